"""Interned graph of scalar expressions: construction, differentiation, elimination, evaluation."""

from .node import DivisionByZero, Graph, Node
from .table import Samples, Table, monotone_table

__all__ = ["DivisionByZero", "Graph", "Node", "Samples", "Table", "monotone_table"]

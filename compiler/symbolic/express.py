"""Nodes of the graph as SymPy expressions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction

import sympy as sp

from ..graph import Graph, Node, Table
from ..graph import operations as ops
from ..graph.evaluate import Numbers, evaluate
from ..graph.smooth_roots import NOTHING


def _number(value: Fraction) -> sp.Expr:
    """Return a number; nothing for what only floats need, where roots vanish."""
    if value == NOTHING:
        return sp.Integer(0)
    return sp.Rational(value.numerator, value.denominator)


def _table(table: Table, x: sp.Expr, order: int) -> sp.Expr:
    return sp.Function("table" + "'" * order)(x)


SYMPY = Numbers(
    _number,
    {
        ops.ADD: lambda a, b: a + b,
        ops.SUB: lambda a, b: a - b,
        ops.MUL: lambda a, b: a * b,
        ops.NEG: lambda a: -a,
        ops.DIV: lambda a, b: a / b,
        ops.SIN: sp.sin,
        ops.COS: sp.cos,
        ops.TAN: sp.tan,
        ops.ASIN: sp.asin,
        ops.ACOS: sp.acos,
        ops.ATAN: sp.atan,
        ops.SINH: sp.sinh,
        ops.COSH: sp.cosh,
        ops.TANH: sp.tanh,
        ops.ASINH: sp.asinh,
        ops.ACOSH: sp.acosh,
        ops.ATANH: sp.atanh,
        ops.EXP: sp.exp,
        ops.LOG: sp.log,
        ops.SQRT: sp.sqrt,
        ops.ABS: sp.Abs,
        ops.SIGN: sp.sign,
        ops.FLOOR: sp.floor,
        ops.ATAN2: sp.atan2,
        ops.MINIMUM: sp.Min,
        ops.MAXIMUM: sp.Max,
        ops.MODULO: sp.Mod,
        ops.POW: sp.Pow,
        ops.LESS: sp.Lt,
        ops.LESS_EQUAL: sp.Le,
        ops.EQUAL: sp.Eq,
        ops.AND: sp.And,
        ops.OR: sp.Or,
        ops.NOT: sp.Not,
        ops.SELECT: lambda c, a, b: sp.Piecewise((a, c), (b, True)),
    },
    _table,
)
"""SymPy's numbers, for ``graph/evaluate.py``."""


def express(graph: Graph, nodes: Sequence[Node], symbols: Mapping[Node, sp.Expr]) -> list[sp.Expr]:
    """Return nodes as expressions in the given symbols; others get symbols of their own names."""
    missing = {n: sp.Symbol(graph.name(n)) for n in graph.support(*nodes) if n not in symbols}
    return [sp.sympify(e) for e in evaluate(graph, nodes, {**missing, **symbols}, SYMPY)]

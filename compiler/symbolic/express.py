"""Nodes of the graph as SymPy expressions."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from typing import Any

import sympy as sp

from ..graph import Graph, Node, Samples, Table
from ..graph.evaluate import Numbers, evaluate
from ..graph.operation import Operation
from ..graph.operations import LOOKUP, OPERATIONS, SELECT
from ..graph.smooth_roots import NOTHING
from ..graph.table import ELEMENT, question


def _number(value: Fraction) -> sp.Expr:
    """Return a number; nothing for what only floats need, where roots vanish."""
    if value == NOTHING:
        return sp.Integer(0)
    return sp.Rational(value.numerator, value.denominator)


def _table(table: Table | Samples, x: sp.Expr, order: int) -> sp.Expr:
    return sp.Function(question(order) if order >= ELEMENT else "table" + "'" * order)(x)


def _function(row: Operation) -> Callable[..., Any]:
    if row.sympy is None:
        return sp.Function(row.name)  # type: ignore[no-any-return]
    made: Callable[..., Any] = getattr(sp, row.sympy or row.name) if isinstance(row.sympy, str) else row.sympy
    return made


SYMPY = Numbers(
    _number,
    {
        **{row.code: _function(row) for row in OPERATIONS if row.arity and row.code not in (SELECT, LOOKUP)},
        SELECT: lambda c, a, b: sp.Piecewise((a, c), (b, True)),
    },
    _table,
)
"""SymPy's numbers, for ``graph/evaluate.py``."""


def express(graph: Graph, nodes: Sequence[Node], symbols: Mapping[Node, sp.Expr]) -> list[sp.Expr]:
    """Return nodes as expressions in the given symbols; others get symbols of their own names."""
    missing = {n: sp.Symbol(graph.name(n)) for n in graph.support(*nodes) if n not in symbols}
    return [sp.sympify(e) for e in evaluate(graph, nodes, {**missing, **symbols}, SYMPY)]

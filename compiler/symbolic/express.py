"""Nodes of the graph as SymPy expressions, in their shorter form."""

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


HIGHEST = 12
"""Numerators and denominators of exponents: factors are sought among polynomials that have a coefficient for each power below."""


def factored(expression: sp.Expr) -> sp.Expr:
    """Return it with its factors taken out if that is shorter; 0.67^(0.55*t) is a power of 549 999 for those who look for them."""
    if not all(_is_low(exponent) for exponent in _exponents(expression)):
        return expression
    return min(expression, sp.factor(expression), key=sp.count_ops)


def _exponents(expression: sp.Expr) -> list[sp.Expr]:
    powers = [power.exp for power in expression.atoms(sp.Pow)]
    return powers + [power.args[0] for power in expression.atoms(sp.exp)]


def _is_low(exponent: sp.Expr) -> bool:
    shares = [term.as_coeff_Mul()[0] for term in sp.Add.make_args(exponent)]
    return all(s.is_Rational and abs(s.p) <= HIGHEST and s.q <= HIGHEST for s in shares)

"""The linear part of a graph: residuals that are affine in some unknowns, as a sparse system.

A node that depends on the unknowns, is used more than once and has more than one term becomes a
*definition*, a further unknown with a row of its own and unit pivot. So the sharing of the graph is kept.
"""

from __future__ import annotations

from collections.abc import Sequence

from msgspec import Struct

from ..differentiate import jacobian
from ..node import Graph, Node
from ..operations import ADD, DIV, MUL, NEG, SELECT, SUB
from ..rewrite import substitute

Coefficients = dict[Node, Node]
"""Variable (unknown or definition) -> coefficient."""


class NotAffine(ValueError):
    """``node`` is not affine in the unknowns."""

    def __init__(self, node: Node) -> None:
        super().__init__("an equation is not affine in the unknowns")
        self.node = node


class LinearRows(Struct, frozen=True):
    """Rows by key: a definition v means v = sum c w + offset; ~i means 0 = sum c w + offset, residual i.

    The variables of a definition are unknowns or definitions with smaller numbers.
    """

    unknowns: tuple[Node, ...]
    rows: dict[int, Coefficients]
    offsets: dict[int, Node]


def linear_system(graph: Graph, residuals: Sequence[Node], unknowns: Sequence[Node]) -> LinearRows:
    """Return the residuals as sparse rows. Raises NotAffine.

    What is not affine may stand in a residual as long as it cancels: nodes are joined by their values, so that one that
    had it when it was made may stand for the same without it.
    """
    code, left, right = graph._code, graph._left, graph._right
    zero, one = graph.zero, graph.one
    order = graph.reach_of(residuals, unknowns)
    uses: dict[Node, int] = dict.fromkeys(unknowns, 0)
    dependent: list[Node] = []
    leaves = set(unknowns)
    for n in order:
        if not (left[n] in uses or right[n] in uses or code[n] == SELECT) or n in leaves:
            continue
        arguments = [a for a in (graph.args(n) if code[n] == SELECT else (left[n], right[n])) if a in uses]
        if arguments:
            for a in set(arguments):
                uses[a] += 1
            uses[n] = 0
            dependent.append(n)
    for n in residuals:
        if n in uses:
            uses[n] += 1

    rows: dict[int, Coefficients] = {}
    offsets: dict[int, Node] = {}
    terms: dict[Node, tuple[Coefficients, Node]] = {n: ({n: one}, zero) for n in unknowns}
    strange: set[Node] = set()

    def affine(n: Node) -> tuple[Coefficients, Node]:
        return terms[n] if n in uses else ({}, n)

    for n in dependent:
        a, b = left[n], right[n]
        match code[n]:
            case c if c in (ADD, SUB):
                found = _combine(graph, affine(a), affine(b), c == SUB)
            case c if c == NEG:
                found = _scale(graph, affine(a), graph.minus_one)
            case c if c == MUL and not (a in uses and b in uses):
                found = _scale(graph, affine(a), b) if a in uses else _scale(graph, affine(b), a)
            case c if c == DIV and b not in uses:
                found = _scale(graph, affine(a), graph.div(one, b))
            case c if c == SELECT and a not in uses:
                found = _choose(graph, a, affine(b), affine(graph.args(n)[2]))
            case _:
                found = ({n: one}, zero)
                strange.add(n)
        if uses[n] > 1 and len(found[0]) > 1 and strange.isdisjoint(found[0]):
            rows[n], offsets[n] = found
            found = ({n: one}, zero)
        terms[n] = found
        for argument in {a, b} if code[n] != SELECT else set(graph.args(n)):
            if argument in uses and argument not in leaves:
                uses[argument] -= 1
                if not uses[argument]:
                    del terms[argument]  # nothing reads it any more: most of them are never together
    for i, n in enumerate(residuals):
        coefficients, offsets[~i] = affine(n)
        if left_over := [v for v, c in coefficients.items() if v in strange and c != zero]:
            raise NotAffine(left_over[0])
        rows[~i] = {v: c for v, c in coefficients.items() if v not in strange}
    return LinearRows(tuple(unknowns), rows, offsets)


def _scale(graph: Graph, x: tuple[Coefficients, Node], factor: Node) -> tuple[Coefficients, Node]:
    mul = graph.mul
    return {v: mul(c, factor) for v, c in x[0].items()}, mul(x[1], factor)


def _combine(
    graph: Graph, x: tuple[Coefficients, Node], y: tuple[Coefficients, Node], subtract: bool
) -> tuple[Coefficients, Node]:
    join = graph.sub if subtract else graph.add
    zero = graph.zero
    total = dict(x[0])
    for v, c in y[0].items():
        coefficient = join(total.get(v, zero), c)
        if coefficient == zero:
            del total[v]
        else:
            total[v] = coefficient
    return total, join(x[1], y[1])


def _choose(
    graph: Graph, condition: Node, x: tuple[Coefficients, Node], y: tuple[Coefficients, Node]
) -> tuple[Coefficients, Node]:
    zero = graph.zero
    chosen = {v: graph.select(condition, x[0].get(v, zero), y[0].get(v, zero)) for v in (*x[0], *y[0])}
    return chosen, graph.select(condition, x[1], y[1])


def mass_matrix(graph: Graph, residuals: Sequence[Node], accelerations: Sequence[Node]) -> list[list[Node]]:
    """Return the rows of d residual / d acceleration; structural zeros are ``graph.zero``."""
    sparse = jacobian(graph, residuals, accelerations)
    return [[row.get(j, graph.zero) for j in range(len(accelerations))] for row in sparse]


def bias(graph: Graph, residuals: Sequence[Node], accelerations: Sequence[Node]) -> list[Node]:
    """Return the residuals with all accelerations zero."""
    return substitute(graph, residuals, dict.fromkeys(accelerations, graph.zero))

"""Relations whose two sides are equal over a whole region, as `max(0, x) > 0` where x is negative.

No sign changes where such a region is entered, so that an event there would be passed over. What bounds the region becomes a part of the
relation, which says the same with it.
"""

from __future__ import annotations

from collections.abc import Iterator

from ...graph import Graph, Node
from ...graph import operations as ops
from ...graph.node import DivisionByZero
from ...graph.rewrite import substitute

_MOST, _LONGEST = 8, 100
"""Bends of a relation that are looked at, each of which takes substitutions, and formulas on the way to them."""
_BENDS = (ops.MAXIMUM, ops.MINIMUM, ops.SELECT)
_THROUGH = frozenset({ops.NEG, ops.ADD, ops.SUB, ops.MUL, ops.DIV, ops.POW, ops.ABS, ops.SQRT})


def less(graph: Graph, a: Node, b: Node) -> Node:
    """Return a < b."""
    result = graph.less(a, b)
    for inside in _regions(graph, a, b):
        result = graph.logical_and(graph.logical_not(inside), result)
    return result


def less_equal(graph: Graph, a: Node, b: Node) -> Node:
    """Return a <= b."""
    result = graph.less_equal(a, b)
    for inside in _regions(graph, a, b):
        result = graph.logical_or(inside, result)
    return result


def _regions(graph: Graph, a: Node, b: Node) -> Iterator[Node]:
    """Yield conditions under which a and b are the same formula: with a piece in the place of what bends."""
    for n in _bends(graph, a, b):
        for piece, inside in _pieces(graph, n):
            try:
                first, second = substitute(graph, [a, b], {n: piece})
                same = first == second or graph.is_zero(graph.sub(second, first))
            except DivisionByZero:
                continue
            if same:
                yield inside


def _pieces(graph: Graph, n: Node, deeper: bool = True) -> Iterator[tuple[Node, Node]]:
    """Yield the formulas that a maximum, a minimum or an `if` may be, and when; also those of one in it."""
    *conditions, p, q = graph.args(n)
    for piece, other in ((p, q), (q, p)):
        if conditions:
            inside = conditions[0] if piece == p else graph.logical_not(conditions[0])
        else:
            low, high = (other, piece) if graph.op(n) == ops.MAXIMUM else (piece, other)
            inside = graph.less_equal(low, high)
        yield piece, inside
        if deeper and graph.op(piece) in _BENDS:
            for inner, within in _pieces(graph, piece, deeper=False):
                yield inner, graph.logical_and(inside, within)


def _bends(graph: Graph, a: Node, b: Node) -> Iterator[Node]:
    """Yield what bends, from which both sides follow by sums, products, powers and sizes."""
    pending, seen, found = [a, b], {a, b}, 0
    while pending and found < _MOST:
        n = pending.pop()
        code = graph.op(n)
        if code in _BENDS:
            found += 1
            yield n
        elif code in _THROUGH and len(seen) < _LONGEST:
            further = [k for k in graph.args(n) if k not in seen]
            seen.update(further)
            pending += further

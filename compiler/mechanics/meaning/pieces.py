"""Where an integrand bends: the pieces of an interval between whose ends it is smooth, as far as its formula shows that, and the
places in them."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

from ...graph import Graph, Node
from ...graph import operations as ops
from ...graph.differentiate import jvp
from ...graph.kinks import kinks_of
from ...graph.rewrite import substitute

MOST_KINKS = 6
"""Kinks at which an integral is split; of more, the others are left to the rule."""
AT_THE_END = Fraction(1, 100_000)
"""Places so close to the upper end are reckoned from it, which keeps their distance exact where that end is 0."""

Integrand = Callable[[Node], Node]


def pieces_of(
    graph: Graph, integrand: Integrand, s: Node, lower: Node, upper: Node
) -> tuple[list[Node], bool]:
    """Return the ends of the pieces: the bounds, and between them, in order, the kinks that the formula shows; and whether
    it may bend elsewhere."""
    found, bent = _kinks(graph, integrand(s), s)
    kinks, bent = found[:MOST_KINKS], bent or len(found) > MOST_KINKS
    if not kinks:
        return [lower, upper], bent
    low, high = graph.minimum(lower, upper), graph.maximum(lower, upper)
    inside = [graph.minimum(graph.maximum(kink, low), high) for kink in kinks]
    for end in range(len(inside) - 1, 0, -1):  # bubbles, as the order is not known before
        for i in range(end):
            a, b = inside[i], inside[i + 1]
            inside[i], inside[i + 1] = graph.minimum(a, b), graph.maximum(a, b)
    turned = graph.less(upper, lower)
    ordered = [graph.select(turned, b, a) for a, b in zip(inside, reversed(inside), strict=True)]
    return [lower, *ordered, upper], bent


def _kinks(graph: Graph, body: Node, s: Node) -> tuple[list[Node], bool]:
    """Return where relations, absolute values and extremes change inside a formula, and the points of tables, as far as
    they are linear in s; and whether there are others."""
    found: dict[Node, None] = {}
    others = False
    for n in graph.reach([body], [s]):
        places: tuple[float, ...] = (0.0,)
        match graph.op(n):
            case ops.LOOKUP:
                argument, places = graph.args(n)[0], kinks_of(graph, n)
            case ops.ABS | ops.SIGN:
                argument = graph.args(n)[0]
            case ops.MINIMUM | ops.MAXIMUM | ops.LESS | ops.LESS_EQUAL:
                argument = graph.sub(*graph.args(n))
            case ops.FLOOR:
                others = True
                continue
            case _:
                continue
        (slope,) = jvp(graph, [argument], {s: graph.one})
        if s in graph.support(slope):
            others = True
        if slope == graph.zero or s in graph.support(slope):
            continue
        (start,) = substitute(graph, [argument], {s: graph.zero})
        flat = graph.equal(slope, graph.zero)
        divisor = graph.select(flat, graph.one, slope)
        for place in places:
            off = graph.sub(start, graph.constant(place)) if place else start
            found[graph.neg(graph.div(off, divisor))] = None
    return list(found), others


def place_in(graph: Graph, a: Node, b: Node, place: Fraction) -> Node:
    """Return a place between a, at 0, and b, at 1."""
    width = graph.sub(b, a)
    if 1 - place < AT_THE_END:
        return graph.sub(b, graph.mul(graph.constant(1 - place), width))
    return graph.add(a, graph.mul(graph.constant(place), width))

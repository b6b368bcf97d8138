"""Limits of frictions that ask which way these slip: they are limits of two sides.

`if M*der(a) > 0 then f else g` of a friction on a is at rest neither f nor g. Where the numbers that a relation compares differ by
h s, with the slip s, it stands for h > 0 of a slip forwards, and for h < 0 of one backwards.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

from ..graph import Graph, Node
from ..graph import operations as ops
from ..graph.differentiate import jacobian
from ..graph.rewrite import substitute
from .meaning.lower import Lowering


def sides_of(
    lowering: Lowering, limit: Node, slip: Node, velocities: Collection[Node]
) -> tuple[Node, Node] | None:
    """Return the limits of slips forwards and backwards; None where the limit does not ask for the direction."""
    graph = lowering.graph
    asked = [n for n in graph.reach([limit]) if graph.op(n) in (ops.LESS, ops.LESS_EQUAL, ops.SIGN)]
    moving = sorted(set(velocities).intersection(graph.support(slip)))
    asked = [n for n in asked if not set(moving).isdisjoint(graph.support(n))]
    if not asked:
        return None  # before a node is made, whose number would reorder formulas
    forward: dict[Node, Node] = {}
    backward: dict[Node, Node] = {}
    for n in asked:
        arguments = graph.args(n)
        tested = arguments[0] if graph.op(n) == ops.SIGN else graph.sub(arguments[1], arguments[0])
        factor = _factor(graph, tested, slip, moving)
        if factor is None:
            continue
        if graph.op(n) == ops.SIGN:
            forward[n] = graph.sign(factor)
            backward[n] = graph.neg(forward[n])
        else:
            forward[n], backward[n] = graph.less(graph.zero, factor), graph.less(factor, graph.zero)
    if not forward:
        return None
    for n in (*forward.values(), *backward.values()):
        if graph.op(n) in (ops.LESS, ops.SIGN):
            lowering.relations[n] = None
    ahead, behind = substitute(graph, [limit], forward)[0], substitute(graph, [limit], backward)[0]
    return ahead, behind


def _factor(graph: Graph, tested: Node, slip: Node, moving: Sequence[Node]) -> Node | None:
    """Return h of tested = h slip; None where it is nothing like that."""
    (shares,) = jacobian(graph, [slip], moving)
    (rates,) = jacobian(graph, [tested], moving)
    for k, share in shares.items():
        if not graph.is_constant(share):
            continue
        factor = graph.div(rates.get(k, graph.zero), share)
        rest = graph.sub(tested, graph.mul(factor, slip))
        return factor if factor != graph.zero and graph.is_zero(rest) else None
    return None

"""Bounds of how fast a gap may change: factors of the speeds of coordinates that hold in every state."""

from __future__ import annotations

from collections.abc import Mapping, Set

from ...graph import Graph, Node
from ...graph.operations import ADD, CONST, COS, MUL, NEG, SIN, SQRT, SUB, SYMBOL

Bounds = dict[int, Node]


def reach(graph: Graph, gap: Node, places: Mapping[Node, int], constant: Set[Node]) -> Bounds | None:
    """Return bounds of |d gap/dq| by the places of coordinates; None where none is known that holds everywhere.

    ``places``: of coordinates whose rate is a velocity; ``constant``: symbols that do not change. A distance
    norm({a, b}) changes no faster than a and b do.
    """
    known: dict[Node, Bounds | None] = {}
    for n in graph.reach([gap]):
        known[n] = _bounds(graph, n, places, constant, known)
    return known[gap]


def _bounds(
    graph: Graph,
    n: Node,
    places: Mapping[Node, int],
    constant: Set[Node],
    known: Mapping[Node, Bounds | None],
) -> Bounds | None:
    code, args = graph.op(n), graph.args(n)
    if code == CONST or n in constant:
        return {}
    if code == SYMBOL:
        return {places[n]: graph.one} if n in places else None
    parts = [known[a] for a in args]
    if all(part == {} for part in parts):
        return {}
    if code in (ADD, SUB, NEG, SIN, COS):
        return _sum(graph, parts)
    if code == MUL:
        factor, of = (args[0], parts[1]) if parts[0] == {} else (args[1], parts[0])
        if of is not None and {} in parts:
            return {k: graph.mul(graph.abs(factor), bound) for k, bound in of.items()}
    return _norm(graph, args[0], known) if code == SQRT else None


def _sum(graph: Graph, parts: list[Bounds | None]) -> Bounds | None:
    total: Bounds = {}
    for part in parts:
        if part is None:
            return None
        for k, bound in part.items():
            total[k] = graph.add(total.get(k, graph.zero), bound)
    return total


def _norm(graph: Graph, of: Node, known: Mapping[Node, Bounds | None]) -> Bounds | None:
    """Return the bounds of a root of a sum of squares: those of the vector."""
    squares: Bounds = {}
    waiting = [of]
    while waiting:
        n = waiting.pop()
        args = graph.args(n)
        if graph.op(n) == ADD:
            waiting += args
            continue
        part = known[args[0]] if graph.op(n) == MUL and args[0] == args[1] else None
        if part is None:
            return None
        for k, bound in part.items():
            squares[k] = graph.add(squares.get(k, graph.zero), graph.mul(bound, bound))
    return {k: graph.sqrt(square) for k, square in squares.items()}

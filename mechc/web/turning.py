"""Angles after whose turn the motion is the same, as the structure of the equations shows it: they are read through sines and cosines."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mechc.compiler.graph.operations import ADD, CONST, COS, MUL, NEG, SIN, SUB, TAN

if TYPE_CHECKING:
    from mechc.compiler.equations.model import Equations
    from mechc.compiler.graph.node import Graph, Node

FUNCTIONS = ("rhs", "constraints", "indicators", "conditions")
"""What decides the motion."""


def turning(equations: Equations) -> list[int]:
    """Return the indices in y of coordinates after whose turn all that decides the motion is the same."""
    graph = equations.graph
    angles = {
        node: slot.index
        for node, slot in equations.layout.items()
        if slot.array == "y" and slot.index < equations.nq
    }
    outputs = [n for f in equations.functions if f.name in FUNCTIONS for n in f.outputs]
    turns: dict[
        Node, dict[int, int]
    ] = {}  # of each formula that the turn of an angle changes, by how many turns
    lost: set[int] = set()
    for n in graph.reach(outputs):
        turns[n] = {angles[n]: 1} if n in angles else _turns(graph, n, turns, lost)
    for n in outputs:
        lost.update(turns[n])
    states = equations.states
    return [k for k in angles.values() if k not in lost and states[k].unit in ("rad", "", "1")]


def _turns(graph: Graph, n: Node, turns: dict[Node, dict[int, int]], lost: set[int]) -> dict[int, int]:
    """Return by how many turns a formula changes with each angle; add to ``lost`` those with which it changes in another way."""
    arguments = graph.args(n)
    found = [turns[a] for a in arguments]
    if not any(found):
        return {}
    match graph.op(n), found:
        case (op, [_]) if op in (SIN, COS, TAN):
            return {}
        case (op, [of]) if op == NEG:
            return {k: -by for k, by in of.items()}
        case (op, [a, b]) if op in (ADD, SUB):
            sign = 1 if op == ADD else -1
            both = {k: a.get(k, 0) + sign * b.get(k, 0) for k in {*a, *b}}
            return {k: by for k, by in both.items() if by}
        case (op, [a, b]) if op == MUL and not (a and b):
            factor = arguments[0] if b else arguments[1]
            if graph.op(factor) == CONST and graph.value(factor) == int(graph.value(factor)):
                return {k: by * int(graph.value(factor)) for k, by in (a or b).items()}
    for of in found:
        lost.update(of)
    return {}

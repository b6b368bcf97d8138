"""Whole parts of moving quantities: constant between events, which are where the quantity is a whole number.

A step that ends at every whole number knows by one bit which of them lie around it: whether the lower one is odd. That
bit is a switch (switches.py); the whole part follows from it and from x, and stays the same for half a unit beyond
either end, so that it does not matter on which side of a whole number rounding leaves x.
"""

from __future__ import annotations

import math
from fractions import Fraction

from ...graph import Graph, Node
from ...graph import operations as ops

EARLY = Fraction(1, 10**14)
"""A whole number counts as reached by this much before, so that one that is met exactly is reached."""


def stair(graph: Graph, n: Node) -> Node | None:
    """Return x where ``n`` jumps with the whole part of x: floor(x), or the rest of a division."""
    match graph.op(n):
        case ops.FLOOR:
            return graph.args(n)[0]
        case ops.MODULO:
            return graph.div(*graph.args(n))
        case _:
            return None


def evenness(graph: Graph, x: Node) -> Node:
    """Return a smooth formula that is not negative where the whole part of x is even, and negative where it is odd."""
    two = graph.constant(2)
    turn = graph.sub(x, graph.mul(two, graph.floor(graph.div(x, two))))  # exact, however large x is
    return graph.sin(graph.mul(graph.constant(Fraction(math.pi)), graph.add(turn, graph.constant(EARLY))))


def frozen(graph: Graph, n: Node, x: Node, odd: Node) -> Node:
    """Return ``n`` with the whole part of x that has the parity ``odd``, 0 or 1."""
    two, shifted = graph.constant(2), graph.sub(x, odd)
    near = graph.floor(graph.div(graph.add(shifted, graph.half), two))
    whole = graph.add(odd, graph.mul(two, near))
    if graph.op(n) == ops.FLOOR:
        return whole
    a, b = graph.args(n)
    return graph.sub(a, graph.mul(b, whole))

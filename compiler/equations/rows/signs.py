"""On which side of zero unknown forces lie, in laws that ask for it.

The limit of a friction may hold the size of a reaction, a maximum or a comparison with one. Between events each such
question has one answer, and the law is affine: abs(N) is N or -N. The answer becomes a switch like that of any
relation (switches.py): a number in z, changed where the force changes its side.
"""

from __future__ import annotations

from collections.abc import Collection

from msgspec import Struct

from ...graph import Graph, Node
from ...graph.kinks import as_choice
from ...graph.rewrite import rebuild


class Side(Struct, frozen=True):
    """``symbol`` is 1 where ``difference``, a formula with unknown forces, is negative."""

    symbol: Node
    difference: Node


def take_sides(graph: Graph, law: Node, unknowns: Collection[Node], sides: dict[Node, Side]) -> Node:
    """Return a law with its questions about ``unknowns`` answered by symbols, which are added to ``sides``."""
    depends = set(unknowns)
    images: dict[Node, Node] = {}

    def below(a: Node, b: Node) -> Node:
        """Return the symbol that is 1 where a < b."""
        difference = graph.sub(a, b)
        if difference not in sides:
            sides[difference] = Side(graph.symbol(f"switch(force {len(sides) + 1})"), difference)
        return sides[difference].symbol

    for n in graph.reach([law]):
        arguments = graph.args(n)
        if n in depends or not depends.intersection(arguments):
            continue
        depends.add(n)
        new = tuple(images.get(a, a) for a in arguments)
        choice = as_choice(graph, n, new, below)
        if choice is not None:
            images[n] = choice
        elif new != arguments:
            images[n] = rebuild(graph, n, graph, new)
    return images.get(law, law)

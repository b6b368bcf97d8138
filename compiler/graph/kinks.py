"""Kinks and jumps as choices: abs, min, max and signs by the comparisons that decide them."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence

from . import operations as ops
from .node import Graph, Node
from .rewrite import rebuild
from .table import CELL, Table

COMPARING = frozenset({ops.LESS, ops.LESS_EQUAL, ops.SIGN})
"""Operations that jump where their arguments pass each other."""

Below = Callable[[Node, Node], Node]
"""(a, b) -> what is 1 where a < b, else 0"""


def as_choice(graph: Graph, n: Node, arguments: tuple[Node, ...], below: Below) -> Node | None:
    """Return the node with its question of which argument is less put to ``below``; None where it has none.

    ``arguments``: what stands instead of its own.
    """
    match graph.op(n):
        case ops.ABS:
            return graph.select(below(arguments[0], graph.zero), graph.neg(arguments[0]), arguments[0])
        case ops.SIGN:
            return graph.select(below(arguments[0], graph.zero), graph.minus_one, graph.one)
        case ops.LESS:
            return below(*arguments)
        case ops.LESS_EQUAL:
            return graph.logical_not(below(arguments[1], arguments[0]))
        case ops.MINIMUM:
            return graph.select(below(*arguments), *arguments)
        case ops.MAXIMUM:
            return graph.select(below(*arguments), arguments[1], arguments[0])
        case _:
            return None


def kinks_of(graph: Graph, n: Node) -> tuple[float, ...]:
    """Return the arguments at which a look-up, or its derivative, bends or jumps; indices of samples are whole numbers anyway."""
    index, order = graph.table_of(n)
    table = graph.tables[index]
    if isinstance(table, Table):
        return table.points
    return table.values if order == CELL else ()


def as_choices(
    graph: Graph, nodes: Sequence[Node], fixed: Collection[Node], whole: Collection[Node] = ()
) -> tuple[Node, ...]:
    """Return nodes with abs, min and max as choices, but for those of the symbols ``fixed`` alone, and for what is inside
    the nodes ``whole``."""
    known = set(fixed)
    images: dict[Node, Node] = {}
    for n in graph.reach(nodes, whole):
        arguments = graph.args(n)
        if not arguments:
            continue
        if known.issuperset(a for a in arguments if not graph.is_constant(a)):
            known.add(n)
            continue
        new = tuple(images.get(a, a) for a in arguments)
        bent = None if graph.op(n) in COMPARING else as_choice(graph, n, new, graph.less)
        if bent is not None:
            images[n] = bent
        elif new != arguments:
            images[n] = rebuild(graph, n, graph, new)
    return tuple(images.get(n, n) for n in nodes)

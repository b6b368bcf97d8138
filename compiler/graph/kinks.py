"""Kinks and jumps as choices: abs, min, max and signs by the comparisons that decide them; a least of several taken apart."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Collection, Sequence

from . import operations as ops
from .evaluate import evaluate
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
    graph: Graph, nodes: Sequence[Node], fixed: Collection[Node], whole: Collection[Node]
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


MOST_PIECES = 64


def bends_of(graph: Graph, code: int, arguments: Sequence[Node]) -> list[Node] | None:
    """Return what is zero where abs, min or max of ``arguments`` may bend: straight lines, where the arguments are made of such and of
    bends; None where these are many."""
    pieces = [_pieces(graph, a) for a in arguments]
    if code == ops.ABS:
        return pieces[0]
    one, other = pieces
    if one is None or other is None or len(one) * len(other) > MOST_PIECES:
        return None
    return [graph.sub(a, b) for a, b in itertools.product(one, other)]


def _pieces(graph: Graph, n: Node) -> list[Node] | None:
    code, args = graph.op(n), graph.args(n)
    if code not in (ops.ABS, ops.MINIMUM, ops.MAXIMUM, ops.NEG, ops.ADD, ops.SUB, ops.MUL, ops.DIV):
        return [n]
    parts = [_pieces(graph, a) for a in args]
    each = [p for p in parts if p is not None]
    if len(each) < len(parts) or math.prod(map(len, each)) > MOST_PIECES:
        return None
    if code in (ops.MINIMUM, ops.MAXIMUM):
        return [*each[0], *each[1]]
    if code == ops.ABS:
        return [*each[0], *map(graph.neg, each[0])]
    if all(len(p) == 1 for p in each):
        return [n]
    return [rebuild(graph, n, graph, one) for one in itertools.product(*each)]


MOST = 16
"""Parts that are looked for; what would have more stays whole."""


def hollow_parts(graph: Graph, n: Node) -> tuple[Node, ...]:
    """Return nodes whose least one is ``n``, through sums, differences and constant factors; ``n`` alone where it is not a
    least."""
    return tuple(dict.fromkeys(_parts(graph, n, 1)))


def _parts(graph: Graph, n: Node, sign: int) -> list[Node]:
    """Return parts of ``n``: it is the least one of them where ``sign`` is 1, the largest one where it is -1."""
    args = graph.args(n)
    split = ops.MINIMUM if sign > 0 else ops.MAXIMUM
    found: list[Node] = [n]
    match graph.op(n):
        case operation if operation == split:
            found = [*_parts(graph, args[0], sign), *_parts(graph, args[1], sign)]
        case ops.SELECT if (pair := _chosen(graph, args, sign)) is not None:
            found = [*_parts(graph, pair[0], sign), *_parts(graph, pair[1], sign)]
        case ops.ABS if sign < 0:
            found = [args[0], graph.neg(args[0])]
        case ops.NEG:
            found = [graph.neg(p) for p in _parts(graph, args[0], -sign)]
        case ops.ADD:
            pairs = itertools.product(*(_parts(graph, a, sign) for a in args))
            found = [graph.add(a, b) for a, b in pairs]
        case ops.SUB:
            pairs = itertools.product(_parts(graph, args[0], sign), _parts(graph, args[1], -sign))
            found = [graph.sub(a, b) for a, b in pairs]
        case ops.MUL if (factor := next((a for a in args if not graph.support(a)), None)) is not None:
            other = args[1] if factor == args[0] else args[0]
            found = [graph.mul(factor, p) for p in _parts(graph, other, sign * _side(graph, factor))]
        case ops.DIV if not graph.support(args[1]):
            found = [graph.div(p, args[1]) for p in _parts(graph, args[0], sign * _side(graph, args[1]))]
        case _:
            pass
    return found if 1 < len(found) <= MOST else [n]


def _side(graph: Graph, number: Node) -> int:
    return 1 if evaluate(graph, [number], {})[0] > 0 else -1


def _chosen(graph: Graph, args: tuple[Node, ...], sign: int) -> tuple[Node, Node] | None:
    """Return both sides of ``if a < b then a else b``, the least one, or of its opposite."""
    condition, one, other = args
    if graph.op(condition) not in (ops.LESS, ops.LESS_EQUAL):
        return None
    a, b = graph.args(condition)
    return (one, other) if ((one, other) == (a, b) if sign > 0 else (one, other) == (b, a)) else None

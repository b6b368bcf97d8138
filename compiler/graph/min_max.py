"""A least of several: min(l, r) and what is written so, taken apart."""

from __future__ import annotations

import itertools

from . import operations as ops
from .evaluate import evaluate
from .node import Graph, Node

MOST = 16
"""Parts that are looked for; what would have more stays whole."""


def hollow_parts(graph: Graph, n: Node) -> tuple[Node, ...]:
    """Return nodes whose least one is ``n``, through sums, differences and constant factors; ``n`` alone where it is no
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

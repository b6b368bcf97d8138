"""Two linear equations for two unknowns, found again in what elimination made of them.

    q = (N + l u f) / (a - m u w)   beside   w q   in the other one
is
    a q = N + u s,   s = l f + m w q,
of which a series needs the products u s and w q alone, instead of u w, u f, w q and q times the denominator.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from typing import NamedTuple

from ..graph import Graph, Node
from ..graph.operations import ADD, MUL, NEG, SUB


class Coupled(NamedTuple):
    """What stands in both equations, by the letters above; ``rest``: the terms of N, with the constants before them."""

    rest: tuple[tuple[Node, Node], ...]
    before_f: Node
    f: Node
    u: Node
    w: Node
    before_product: Node
    product: Node
    s: Node


def coupled(
    graph: Graph, q: Node, constant: Callable[[Node], bool], wanted: Collection[Node]
) -> Coupled | None:
    """Return the equations that a quotient comes from, if it does; ``wanted``: nodes whose series are formed anyhow."""
    numerator, denominator = graph.args(q)
    moving = [(before, n) for before, n in _terms(graph, denominator, constant) if not constant(n)]
    if len(moving) != 1 or graph.op(moving[0][1]) != MUL:
        return None
    before, (a, b) = moving[0][0], graph.args(moving[0][1])
    terms = [*_terms(graph, numerator, constant)]
    for u, w in ((a, b), (b, a)):
        product = graph.mul(w, q)
        for k, (before_f, n) in enumerate(terms):
            if product in wanted and graph.op(n) == MUL and u in graph.args(n):
                first, second = graph.args(n)
                f = second if first == u else first
                back = graph.neg(before)
                s = graph.add(graph.mul(before_f, f), graph.mul(back, product))
                return Coupled((*terms[:k], *terms[k + 1 :]), before_f, f, u, w, back, product, s)
    return None


def _terms(graph: Graph, n: Node, constant: Callable[[Node], bool]) -> Iterator[tuple[Node, Node]]:
    """Yield the terms of a sum: a constant, and what it is times."""
    waiting = [(graph.one, n)]
    while waiting:
        before, n = waiting.pop()
        args = graph.args(n)
        match graph.op(n):
            case _ if constant(n):
                yield before, n
            case code if code in (ADD, SUB):
                second = before if code == ADD else graph.neg(before)
                waiting += [(second, args[1]), (before, args[0])]
            case code if code == NEG:
                waiting.append((graph.neg(before), args[0]))
            case code if code == MUL and constant(args[0]):
                waiting.append((graph.mul(before, args[0]), args[1]))
            case code if code == MUL and constant(args[1]):
                waiting.append((graph.mul(before, args[1]), args[0]))
            case _:
                yield before, n

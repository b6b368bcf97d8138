"""Like terms of a sum: c p (x + y) - c p x is c p y.

Lagrange's operator on kinetic energies such as m x' y' cos(x - y) makes such terms, of which one cancels: taken together they
cost less and round less.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from fractions import Fraction

from ...graph import Graph, Node
from ...graph import operations as ops

Factors = tuple[Node, ...]
"""Ascending; constants apart."""
Term = tuple[Fraction, Factors]


def combined(graph: Graph, total: Node) -> Node:
    """Return a sum with like terms taken together; the node itself where there are none.

    Only products that hold a sum of two are looked into, each once: the work grows with the number of terms.
    """
    terms: dict[int, Term] = dict(
        enumerate(_product(graph, node, sign) for node, sign in _terms(graph, total))
    )
    where = {factors: i for i, (_, factors) in terms.items()}
    count = len(terms)
    for i in range(count):
        while (found := _cancelling(graph, terms, where, i)) is not None:
            del terms[found[0]]
            terms[i] = found[1]
    if len(terms) == count:
        return total
    return graph.sum(
        graph.mul(graph.constant(coefficient), graph.product(factors))
        for coefficient, factors in terms.values()
    )


def _cancelling(
    graph: Graph, terms: Mapping[int, Term], where: Mapping[Factors, int], i: int
) -> tuple[int, Term] | None:
    """Return a term that cancels one half of term i, with the other half."""
    if i not in terms:
        return None
    coefficient, factors = terms[i]
    for (size, half), rest in _halves(graph, factors, coefficient):
        j = where.get(half, i)
        if j != i and j in terms and terms[j] == (-size, half):
            return j, rest
    return None


def _terms(graph: Graph, total: Node) -> Iterator[tuple[Node, int]]:
    """Yield the terms of a sum in their order, with their signs."""
    stack = [(total, 1)]
    while stack:
        node, sign = stack.pop()
        match graph.op(node):
            case ops.ADD:
                a, b = graph.args(node)
                stack += [(b, sign), (a, sign)]
            case ops.SUB:
                a, b = graph.args(node)
                stack += [(b, -sign), (a, sign)]
            case ops.NEG:
                stack.append((graph.args(node)[0], -sign))
            case _:
                yield node, sign


def _product(graph: Graph, node: Node, sign: int) -> Term:
    """Return the coefficient and the factors of a term."""
    coefficient, factors = Fraction(sign), []
    stack = [node]
    while stack:
        n = stack.pop()
        match graph.op(n):
            case ops.MUL:
                stack += graph.args(n)
            case ops.NEG:
                coefficient = -coefficient
                stack += graph.args(n)
            case ops.CONST:
                coefficient *= graph.value(n)
            case _:
                factors.append(n)
    return coefficient, tuple(sorted(factors))


def _halves(graph: Graph, factors: Factors, coefficient: Fraction) -> Iterator[tuple[Term, Term]]:
    """Yield both halves of a product that holds a sum of two: each half, and what is left without it."""
    for k, factor in enumerate(factors):
        if graph.op(factor) not in (ops.ADD, ops.SUB):
            continue
        others = factors[:k] + factors[k + 1 :]
        first, second = graph.args(factor)
        halves = []
        for part, sign in ((first, 1), (second, -1 if graph.op(factor) == ops.SUB else 1)):
            own, inner = _product(graph, part, sign)
            halves.append((coefficient * own, tuple(sorted((*others, *inner)))))
        yield halves[0], halves[1]
        yield halves[1], halves[0]

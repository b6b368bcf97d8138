"""Products in which a square root is smooth where it vanishes, though by itself it has no derivative there.

x^k sqrt(x) is one, and |v| v is another, the resistance of what moves through air: where v is zero its derivative is
|v| 1 + v v^T / |v| = 0, whose last part by the rules of sums and products alone would be 0/0.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Container
from fractions import Fraction

from msgspec import Struct

from .node import Graph, Node
from .operations import ADD, CONST, MUL, NEG, SQRT

NOTHING = Fraction(1, 10**300)
"""Changes no square root in any digit but that of zero, and makes 0/0 zero."""
_MANY = 24
"""Products of more factors are differentiated as they stand: to look at them would take long."""


def half_power(graph: Graph, n: Node, independent: Container[Node]) -> tuple[Node, Node, Node] | None:
    """Return c, x^k and the root of x where a product is x^(k + 1/2), whose derivative is c times that of x^k times the root, which by
    itself has none at zero. Neither may be ``independent`` of x."""
    a, b = graph.args(n)
    whole, root = (a, b) if graph.op(b) == SQRT else (b, a)
    if graph.op(root) != SQRT or root in independent:
        return None
    k = _whole_power(graph, whole, graph.args(root)[0], independent)
    return (graph.constant(1 + Fraction(1, 2 * k)), whole, root) if k else None


def _whole_power(graph: Graph, n: Node, x: Node, independent: Container[Node]) -> int:
    """Return k where a node is x^k, made of products, with k of at least 1, else 0."""
    if n == x:
        return 1
    if graph.op(n) != MUL or n in independent:
        return 0
    a, b = graph.args(n)
    first = _whole_power(graph, a, x, independent)
    second = first and _whole_power(graph, b, x, independent)
    return first + second if second else 0


class RootedProduct(Struct, frozen=True):
    """A product of factors with the root of a sum of squares, zero wherever this root is.

    Its differential is d(factors) * root + factors * slope * d(square).
    """

    factors: tuple[Node, ...]
    root: Node
    square: Node
    slope: Node
    """Derivative of the root with respect to the square; finite where both vanish, as the factors, too, do there."""


def rooted_product(graph: Graph, n: Node, rooted: Container[Node]) -> RootedProduct | None:
    """Return what a product is made of if it has a root as a factor, and others that are zero wherever this root is.

    ``rooted``: the products, down to square roots, that may be looked into.
    """
    factors = _factors(graph, n, rooted)
    roots = [f for f in factors if graph.op(f) == SQRT and f in rooted]
    if len(roots) != 1:
        return None
    (root,) = roots
    others = [f for f in factors if f != root]
    square = graph.args(root)[0]
    there = {x for f in others for x in _all_factors(graph, f)}
    if not any(part <= there for part in _squared(graph, square)):
        return None
    slope = graph.div(graph.half, graph.add(root, graph.constant(NOTHING)))
    return RootedProduct(tuple(others), root, square, slope)


def _factors(graph: Graph, n: Node, inside: Container[Node]) -> list[Node]:
    """List the factors of a product, looking into those nodes alone; of a negative one, with -1. Empty if there are very many."""
    found: list[Node] = []
    pending = [n]
    while pending and len(found) + len(pending) <= _MANY:
        at = pending.pop()
        code = graph.op(at)
        if code == MUL and at in inside:
            pending += reversed(graph.args(at))
        elif code == NEG and at in inside:
            pending += (graph.args(at)[0], graph.minus_one)
        else:
            found.append(at)
    return [] if pending else found


def _squared(graph: Graph, square: Node) -> list[set[Node]]:
    """List, for each part of a sum of squares, the factors of what is squared, one of which is zero where the sum is; none if it is not a
    such sum."""
    found: list[set[Node]] = []
    pending = [square]
    while pending:
        at = pending.pop()
        if graph.op(at) == ADD:
            pending += graph.args(at)
            continue
        powers = Counter(_all_factors(graph, at))
        if any(k % 2 and not (graph.op(f) == CONST and graph.value(f) >= 0) for f, k in powers.items()):
            return []
        found.append({f for f in powers if graph.op(f) != CONST})
    return found


def _all_factors(graph: Graph, n: Node) -> list[Node]:
    """List the factors of a product and of those that it is made of; signs are left out."""
    found: list[Node] = []
    pending = [n]
    while pending:
        at = pending.pop()
        code = graph.op(at)
        if (code == MUL and len(found) + len(pending) < _MANY) or code == NEG:
            pending += graph.args(at)
        else:
            found.append(at)
    return found

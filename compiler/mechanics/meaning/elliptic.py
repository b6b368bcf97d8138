"""Elliptic integrals and functions by arithmetic-geometric means, as formulas: all derivatives follow, for m = 0, too.

M. Abramowitz, I. A. Stegun, Handbook of Mathematical Functions, 17.6 and 16.4; the phases grow and shrink without jumps. All take the
parameter m = k^2, below 1.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from fractions import Fraction

from ...graph import Graph, Node

STEPS = 9
"""Each doubles the digits: from 1 - m = 1e-16 on they give 30."""


def _means(graph: Graph, m: Node) -> list[tuple[Node, Node]]:
    """Return the pairs of means that begin with 1 and sqrt(1 - m)."""
    found = [(graph.one, graph.sqrt(graph.sub(graph.one, m)))]
    for _ in range(STEPS):
        a, b = found[-1]
        found.append((graph.mul(graph.half, graph.add(a, b)), graph.sqrt(graph.mul(a, b))))
    return found


def complete(graph: Graph, m: Node) -> Node:
    """Return K(m)."""
    return graph.div(graph.constant(Fraction(math.pi)), graph.mul(graph.two, _means(graph, m)[-1][0]))


def incomplete(graph: Graph, phi: Node, m: Node) -> Node:
    """Return F(phi, m), for any angle: tan(phi' - phi) = (b/a) tan(phi), without the jumps of a tangent."""
    means = _means(graph, m)
    for a, b in means[:-1]:
        ratio, s, c = graph.div(b, a), graph.sin(phi), graph.cos(phi)
        up = graph.mul(graph.sub(ratio, graph.one), graph.mul(s, c))
        down = graph.add(graph.mul(c, c), graph.mul(ratio, graph.mul(s, s)))
        phi = graph.add(graph.mul(graph.two, phi), graph.atan(graph.div(up, down)))
    return graph.div(phi, graph.mul(graph.constant(2**STEPS), means[-1][0]))


def amplitude(graph: Graph, u: Node, m: Node) -> Node:
    """Return am(u, m): sin(2 phi - phi') = (c/a) sin(phi')."""
    means = _means(graph, m)
    phi = graph.mul(graph.constant(2**STEPS), graph.mul(means[-1][0], u))
    for (a, b), (after, _) in zip(means[-2::-1], means[:0:-1], strict=True):
        ratio = graph.div(graph.mul(graph.half, graph.sub(a, b)), after)
        phi = graph.mul(graph.half, graph.add(phi, graph.asin(graph.mul(ratio, graph.sin(phi)))))
    return phi


def sn(graph: Graph, u: Node, m: Node) -> Node:
    return graph.sin(amplitude(graph, u, m))


def cn(graph: Graph, u: Node, m: Node) -> Node:
    return graph.cos(amplitude(graph, u, m))


def dn(graph: Graph, u: Node, m: Node) -> Node:
    """Return the root of cn^2 + (1 - m) sn^2, a sum of positive numbers."""
    phi = amplitude(graph, u, m)
    s, c = graph.sin(phi), graph.cos(phi)
    return graph.sqrt(graph.add(graph.mul(c, c), graph.mul(graph.sub(graph.one, m), graph.mul(s, s))))


FORMULAS: Mapping[str, Callable[..., Node]] = {
    "ellipk": complete,
    "ellipf": incomplete,
    "sn": sn,
    "cn": cn,
    "dn": dn,
}
"""By their names in the language."""

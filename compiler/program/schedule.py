"""The order of the operations of one function.

Depth first from the outputs, left operands first: a value is computed shortly before its first use, and as
left operands are the older ones, what many others need comes early. Measured on chains of 20 and 100 links
this runs 15 to 30 % faster than the order of construction, and than taking larger subtrees first (which is
best for trees, R. Sethi, J. D. Ullman, J. ACM 17 (1970) 715, but not for graphs that share most of their
nodes). Sine and cosine of one argument stand side by side, where C compilers fuse them.
"""

from __future__ import annotations

from collections.abc import Container, Sequence

from ..graph import Graph, Node
from ..graph.operations import COS, SIN


def schedule(graph: Graph, outputs: Sequence[Node], given: Container[Node] = ()) -> list[Node]:
    """Return all nodes that the outputs need, arguments first; nothing below a ``given`` node."""
    args, op = graph.args, graph.op
    pairs = _pairs(graph, outputs, given)
    done: set[Node] = set()
    order: list[Node] = []
    for output in outputs:
        stack = [output]
        while stack:
            n = stack[-1]
            if n in done:
                stack.pop()
                continue
            operands = () if n in given else args(n)
            waiting = [a for a in operands if a not in done]
            if waiting:
                # the last one is taken first
                waiting.reverse()
                stack += waiting
                continue
            stack.pop()
            done.add(n)
            order.append(n)
            if op(n) in (SIN, COS) and n in pairs and pairs[n] not in done:
                done.add(pairs[n])
                order.append(pairs[n])
    return order


def _pairs(graph: Graph, outputs: Sequence[Node], given: Container[Node]) -> dict[Node, Node]:
    """Return the cosine for each sine of the same argument that is needed too, and the reverse."""
    args, op = graph.args, graph.op
    first: dict[Node, Node] = {}
    pairs: dict[Node, Node] = {}
    for n in _needed(graph, outputs, given):
        if op(n) in (SIN, COS):
            other = first.setdefault(args(n)[0], n)
            if other != n:
                pairs[n], pairs[other] = other, n
    return pairs


def _needed(graph: Graph, outputs: Sequence[Node], given: Container[Node]) -> list[Node]:
    args = graph.args
    seen: set[Node] = set()
    stack = list(outputs)
    while stack:
        n = stack.pop()
        if n not in seen:
            seen.add(n)
            if n not in given:
                stack += args(n)
    return sorted(seen)

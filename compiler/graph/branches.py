"""Which nodes only one branch of a ``select`` needs.

Generated code evaluates them inside that branch, and reverse sweeps let nothing pass into a branch that is
not taken: 0 * NaN is NaN.
"""

from __future__ import annotations

from collections.abc import Iterable

from msgspec import Struct

from .node import Graph, Node
from .operations import SELECT


class Guard(Struct, frozen=True, eq=False):
    """Nodes under it matter only where ``condition`` is (``holds``) or is not true, inside ``outer``."""

    outer: Guard | None
    condition: Node
    holds: bool
    depth: int


def guards(graph: Graph, outputs: Iterable[Node]) -> dict[Node, Guard | None]:
    """Return the innermost guard that covers all uses of each node reached; None: always needed.

    Guards are unique: one object for each (outer, condition, holds).
    """
    outputs = list(outputs)
    found: dict[Node, Guard | None] = dict.fromkeys(outputs)
    known: dict[tuple[Guard | None, Node, bool], Guard] = {}
    for n in reversed(graph.reach(outputs)):
        here = found[n]
        arguments = graph.args(n)
        for i, a in enumerate(arguments):
            guard = here
            if i and graph.op(n) == SELECT:
                key = (here, arguments[0], i == 1)
                entered = known.get(key)
                if entered is None:
                    entered = Guard(here, arguments[0], i == 1, here.depth + 1 if here else 1)
                    known[key] = entered
                guard = entered
            found[a] = _common(found[a], guard) if a in found else guard
    return found


def _common(a: Guard | None, b: Guard | None) -> Guard | None:
    """Return the innermost guard that encloses both."""
    while a is not b:
        if a is None or b is None:
            return None
        if a.depth >= b.depth:
            a, b = a.outer, b
        else:
            b = b.outer
    return a

"""What nodes depend on: found by one descent through the numbers of nodes, as arguments have smaller ones."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence, Set
from functools import cache
from itertools import islice
from typing import Final, NewType, Protocol

from .operations import SELECT

Node = NewType("Node", int)

REMEMBERED: Final = 6
"""Questions whose answers a graph keeps: a byte for each node. What was reached once stays so."""

FEW: Final = 500
"""Nodes up to which what others depend on is looked for without an entry for each node of the graph."""


class Arguments(Protocol):
    """The arguments of each node, -1 where there is none; the third one of those that have three."""

    _code: list[int]
    _left: list[Node]
    _right: list[Node]
    _third: dict[Node, Node]
    _traits: bytearray

    def args(self, n: Node) -> tuple[Node, ...]: ...


class ReachCache:
    """What the last large questions found, by the nodes that were asked for."""

    __slots__ = ("_found",)

    def __init__(self, found: Mapping[frozenset[Node], bytearray] | None = None) -> None:
        self._found = dict(found or {})

    def copy(self) -> ReachCache:
        return ReachCache(self._found)

    def to(self, graph: Arguments, wanted: Collection[Node]) -> bytearray:
        """Return ``marked``, remembered, or found beside what some of the nodes are known to reach."""
        found, asked = self._found, frozenset(wanted)
        marks = found.pop(asked, None)
        if marks is None:
            parts = [known for nodes, known in found.items() if nodes <= asked]
            marks = _more(graph, asked, parts) if parts else marked(graph, asked)
            if len(found) >= REMEMBERED:
                del found[next(iter(found))]
        found[asked] = marks  # after those that were asked for before
        return marks


def _more(graph: Arguments, wanted: Collection[Node], parts: Sequence[bytearray]) -> bytearray:
    """Return ``marked`` where some of what is reached is known."""
    known = 0
    for part in parts:
        known |= int.from_bytes(part, "little")
    marks = bytearray(known.to_bytes(max(wanted, default=-1) + 1, "little"))
    pending = [n for n in wanted if not marks[n]]
    for n in pending:
        marks[n] = 1
    left, right, code, third = graph._left, graph._right, graph._code, graph._third
    while pending:
        n = pending.pop()
        for a in (left[n], right[n], third[n]) if code[n] == SELECT else (left[n], right[n]):
            if a >= 0 and not marks[a]:
                marks[a] = 1
                pending.append(a)
    return marks


def marked(graph: Arguments, wanted: Collection[Node], known: Collection[Node] = frozenset()) -> bytearray:
    """Return a byte for each node, 1 for those wanted and all they depend on but ``known`` ones and what is below them."""
    top = max(wanted, default=-1)
    marks = bytearray(top + 2)  # one more: the arguments that are not there have the number -1
    for n in wanted:
        marks[n] = 1
    left, right, code, third = graph._left, graph._right, graph._code, graph._third
    find: Callable[[int, int, int], Node] = marks.rfind  # type: ignore[assignment]  # a node or -1
    n = find(1, 0, top + 1)
    while n >= 0:
        if not known or n not in known:
            marks[left[n]] = 1
            marks[right[n]] = 1
            if third and code[n] == SELECT:
                marks[third[n]] = 1
        n = find(1, 0, n)
    for k in known:
        if k <= top:
            marks[k] = 0
    del marks[top + 1 :]
    return marks


@cache
def within(asked: frozenset[int]) -> bytes:
    """Return for each combination of traits whether what has them may depend on a node that has one of some others."""
    return bytes(any(not own & ~held for own in asked) for held in range(256))


def marked_within(graph: Arguments, wanted: Collection[Node], may: bytes) -> list[Node]:
    """Return those nodes that ``marked`` marks whose traits are allowed, and those of arguments that are, ascending."""
    traits = graph._traits
    top = max(wanted, default=-1)
    marks = bytearray(top + 1)
    for n in wanted:
        marks[n] = may[traits[n]]
    left, right, code = graph._left, graph._right, graph._code
    find: Callable[[int, int, int], Node] = marks.rfind  # type: ignore[assignment]  # a node or -1
    found: list[Node] = []
    add = found.append
    n = find(1, 0, top + 1)
    while n >= 0:
        add(n)
        a = left[n]
        if a >= 0:
            if may[traits[a]]:
                marks[a] = 1
            b = right[n]
            if b >= 0:
                if may[traits[b]]:
                    marks[b] = 1
                if code[n] == SELECT and may[traits[c := graph._third[n]]]:
                    marks[c] = 1
        n = find(1, 0, n)
    found.reverse()
    return found


def few_reached(
    graph: Arguments, wanted: Collection[Node], known: Collection[Node] = frozenset()
) -> list[Node] | None:
    """Return what ``marked`` marks, ascending; None where these are more than a few."""
    if len(wanted) > FEW:
        return None
    seen = {*known, *wanted}
    left, right, code = graph._left, graph._right, graph._code
    found = [n for n in dict.fromkeys(wanted) if n not in known]
    add = found.append
    for n in islice(found, FEW):  # grows while it is walked through
        a = left[n]
        if a >= 0:
            if a not in seen:
                seen.add(a)
                add(a)
            b = right[n]
            if b >= 0:
                if b not in seen:
                    seen.add(b)
                    add(b)
                if code[n] == SELECT and (c := graph._third[n]) not in seen:
                    seen.add(c)
                    add(c)
    if len(found) > FEW:
        return None
    found.sort()
    return found


def depends_on(graph: Arguments, wanted: Iterable[Node], sought: Set[Node], may: bytes) -> bool:
    """Tell whether a node depends on one of others, or is one; what is found first ends the search. ``may``: their ``within``."""
    traits = graph._traits
    pending = [n for n in wanted if may[traits[n]]]
    seen = set(pending)
    left, right, code = graph._left, graph._right, graph._code
    while pending:
        n = pending.pop()
        if n in sought:
            return True
        for a in graph.args(n) if code[n] == SELECT else (left[n], right[n]):
            if a >= 0 and may[traits[a]] and a not in seen:
                seen.add(a)
                pending.append(a)
    return False

"""Branches: statements that are needed on one side of a choice only. Where the other side is taken, code for numbers leaves them out.

A body stays a sequence of statements, each of which can be computed. ``gathered`` puts those of a branch side by side, and ``branches``
finds where they stand; a printer may put them under a condition, or compute all.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from msgspec import Struct

from ..graph.operations import SELECT
from .model import (
    Body,
    LongBody,
    Lookup,
    Operate,
    ProgramFunction,
    Value,
    codes_of,
    moved,
    operands_of,
)

LEAST = 32
"""Operations of a branch that is worth a condition."""

DEEPEST = 60
"""Branches inside each other; Python reads less than 100 levels."""


class GuardedPart(Struct, frozen=True):
    """The statements from ``begin`` to before ``end`` are needed where ``condition`` is (``holds``) or is not true. What follows reads
    ``results`` of them, on that side only."""

    begin: int
    end: int
    condition: Value
    holds: bool
    results: tuple[Value, ...]


class GuardedParts(Struct, frozen=True):
    """The branches of a body: those that begin at a statement, outer ones first, and how many end before one."""

    begins: Mapping[int, Sequence[GuardedPart]]
    ends: Mapping[int, int]

    @classmethod
    def of(cls, body: Body) -> GuardedParts:
        begins: dict[int, list[GuardedPart]] = {}
        ends: dict[int, int] = {}
        for branch in branches(body):
            begins.setdefault(branch.begin, []).append(branch)
            ends[branch.end] = ends.get(branch.end, 0) + 1
        return cls(begins, ends)

    def edges(self) -> set[int]:
        """Return where branches begin and end."""
        return {*self.begins, *self.ends}

    def conditions(self) -> Iterator[Value]:
        return (branch.condition for found in self.begins.values() for branch in found)

    def results(self) -> set[Value]:
        return {v for found in self.begins.values() for branch in found for v in branch.results}


def gathered(body: Body) -> Body:
    """Return the body with the statements of each branch side by side."""
    if not _may_branch(body):
        return body
    whole: set[_Key] = set()
    while True:
        sides = _Sides(body, whole)
        if not any(sides.members):
            return body
        try:
            order = sides.order()
        except _Crossing as crossing:
            whole.add(crossing.key)
        else:
            return _reordered(body, order)


def branches(body: Body) -> list[GuardedPart]:
    """Return the branches of a body, by where they begin, outer ones first."""
    if not _may_branch(body):
        return []
    sides = _Sides(body, ())
    found = []
    for side, within in enumerate(sides.members):
        _, condition, holds = sides.keys[side]
        if not within or within[-1] - within[0] + 1 != len(within) or within[0] < condition:
            continue
        first, last = within[0], within[-1]
        results = tuple(v for v in within if sides.last[v] > last)
        found.append(GuardedPart(first, last + 1, condition, holds, results))
    return sorted(found, key=lambda branch: (branch.begin, -branch.end))


def mostly_branches(function: ProgramFunction) -> bool:
    """Whether branches are more than half of a function: split into pieces it would compute them all."""
    if len(function.bodies) > 1:
        return False
    covered = end = 0
    for branch in branches(function.bodies[0]):
        if branch.begin >= end:
            covered += branch.end - branch.begin
            end = branch.end
    return 2 * covered > len(function.bodies[0])


def _may_branch(body: Body) -> bool:
    return not isinstance(body, LongBody) and len(body) > LEAST and SELECT in codes_of(body)


_Key = tuple[int, Value, bool]
"""The side that a side is in, -1 for none; the condition, and what it is there."""


class _Crossing(Exception):
    """A branch reads what is made of its own results."""

    def __init__(self, key: _Key) -> None:
        self.key = key


class _Sides:
    """Of each value the innermost side of a choice on which all that reads it stands. Loads and constants stand anywhere.

    ``members``: of each side, in order, the values inside it, deeper ones included; none where it is not worth a branch.
    """

    def __init__(self, body: Body, whole: set[_Key] | tuple[()]) -> None:
        self.body = body
        self.keys: list[_Key] = []
        self.depth: list[int] = []
        known: dict[_Key, int] = {}
        none = -2
        side = [none] * len(body)
        last = self.last = [0] * len(body)
        for v in range(len(body) - 1, -1, -1):
            statement = body[v]
            here = side[v]
            if here == none or (type(statement) is not Operate and type(statement) is not Lookup):
                here = side[v] = -1
            operands = operands_of(statement)
            choice = type(statement) is Operate and statement.code == SELECT
            for k, a in enumerate(operands):
                there = here
                if k and choice:
                    key = there, operands[0], k == 1
                    if key in known:
                        there = known[key]
                    elif key not in whole and (self.depth[there] if there >= 0 else 0) < DEEPEST:
                        known[key] = there = self._made(key)
                before = side[a]
                if before == none:  # what reads it last is met first
                    side[a], last[a] = there, v
                elif before != there:
                    side[a] = self._common(before, there)
        self.side = side
        self._drop_small()

    def _made(self, key: _Key) -> int:
        self.keys.append(key)
        self.depth.append((self.depth[key[0]] if key[0] >= 0 else 0) + 1)
        return len(self.keys) - 1

    def _common(self, a: int, b: int) -> int:
        while a != b:
            if a < 0 or b < 0:
                return -1
            if self.depth[a] >= self.depth[b]:
                a = self.keys[a][0]
            else:
                b = self.keys[b][0]
        return a

    def _drop_small(self) -> None:
        """Give the values of sides that are not worth a branch to the sides around them."""
        inside = [0] * len(self.keys)
        for v, side in enumerate(self.side):
            if side >= 0 and type(self.body[v]) in (Operate, Lookup):
                while side >= 0:
                    inside[side] += 1
                    side = self.keys[side][0]
        self.outer = [-1] * len(self.keys)
        for side, (outer, _, _) in enumerate(self.keys):  # outer ones were made first
            self.outer[side] = outer if outer < 0 or inside[outer] >= LEAST else self.outer[outer]
        self.members: list[list[Value]] = [[] for _ in self.keys]
        for v, side in enumerate(self.side):
            if side < 0:
                continue
            if inside[side] < LEAST:
                side = self.side[v] = self.outer[side]
            while side >= 0:
                self.members[side].append(v)
                side = self.outer[side]

    def order(self) -> list[Value]:
        """Return the statements in an order in which branches stand together, else as they are. Raises _Crossing."""
        self.placed = bytearray(len(self.body))
        self.found: list[Value] = []
        self.open = bytearray(len(self.keys))
        for v in range(len(self.body)):
            if self.side[v] < 0:
                self._place(v, -1)
        return self.found

    def _place(self, value: Value, here: int) -> None:
        """Place a value that does not stand deeper than ``here``, and before it what it needs."""
        pending = [value]
        while pending:
            v = pending[-1]
            if self.placed[v]:
                pending.pop()
                continue
            missing = [a for a in operands_of(self.body[v]) if not self.placed[a]]
            near = [a for a in missing if not self._deeper(self.side[a], self.side[v])]
            if near:
                pending += reversed(near)
                continue
            for a in missing:
                if not self.placed[a]:
                    self._enter(self._next(self.side[a], self.side[v]))
            self.placed[v] = 1
            self.found.append(v)
            pending.pop()

    def _enter(self, side: int) -> None:
        """Place all of a side, and before it what it needs from around it."""
        if self.open[side]:
            raise _Crossing(self.keys[side])
        self.open[side] = 1
        within = self.members[side]
        inside = set(within)
        self._place(self.keys[side][1], side)
        for v in within:
            for a in operands_of(self.body[v]):
                if a not in inside and not self.placed[a]:
                    self._place(a, side)
        for v in within:
            if self.side[v] == side and not self.placed[v]:
                self._place(v, side)

    def _deeper(self, a: int, b: int) -> bool:
        """Whether a side is inside another one."""
        while a >= 0 and a != b:
            a = self.outer[a]
            if a == b:
                return True
        return False

    def _next(self, a: int, b: int) -> int:
        """Return the outermost side around ``a`` that is inside ``b``."""
        while self.outer[a] != b:
            a = self.outer[a]
        return a


def _reordered(body: Body, order: Sequence[Value]) -> Body:
    place = {v: k for k, v in enumerate(order)}
    return tuple(moved(body[v], place) for v in order)

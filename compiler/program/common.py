"""What several long functions compute alike, as bodies that they have in common."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Sequence
from typing import Final

from msgspec.structs import replace

from .chunk import split
from .model import Body, Load, Lookup, Operate, Program, ProgramFunction, Statement, Store, operands_of

Node = int
"""A statement that yields a value, which counts once where several functions have it."""

Line = tuple[Node, Store | None]
"""A node, or a store of its value."""

WORTH: Final = 100
"""Operations that are worth bodies of their own: what others need of them passes through the workspace."""


def in_common(program: Program, size: int, whole: Collection[str] = ()) -> Program:
    """Return the program in which functions begin with the bodies that they have in common, all of them of about ``size`` operations
    (``split``); those that have none, or stay ``whole``, are as they were."""
    long = [
        f for f in program.functions if f.name not in whole and f.operations >= WORTH and len(f.bodies) == 1
    ]
    nodes = _Nodes(long)
    first = len(nodes.places)
    shared = {of: split(ProgramFunction("", "", 0, (body,)), size, first) for of, body in nodes.groups()}
    done = {}
    for k, function in enumerate(long):
        parts = [part for of, part in shared.items() if of >> k & 1]
        if parts:
            parts.append(split(replace(function, bodies=(nodes.rest(k),), made=()), size, first))
            done[function.name] = replace(
                parts[-1],
                bodies=tuple(body for part in parts for body in part.bodies),
                workspace=max(first, *(part.workspace for part in parts)),
            )
    return replace(program, functions=tuple(done.get(f.name, f) for f in program.functions))


class _Nodes:
    """The values of functions of one body each.

    ``of``: which functions compute a node, one bit each; those that the same ones compute are a group. ``common``: whether a node
    is in a group, or a load or literal, which each body repeats. ``places``: in the workspace, of what one group passes to others.
    """

    def __init__(self, functions: Sequence[ProgramFunction]) -> None:
        self.statements: list[Statement] = []
        self.of: list[int] = []
        known: dict[Statement, Node] = {}
        self.lines = [[*self._lines(function, 1 << k, known)] for k, function in enumerate(functions)]
        self.inner = [n for n, s in enumerate(self.statements) if type(s) is Operate or type(s) is Lookup]
        self.common = [of.bit_count() > 1 for of in self.of]
        self._choose()
        self.places = {node: place for place, node in enumerate(sorted({*self._passed()}))}

    def _lines(self, function: ProgramFunction, bit: int, known: dict[Statement, Node]) -> Iterator[Line]:
        (body,) = function.bodies
        at: list[Node] = []
        for statement in body:
            operands = [at[v] for v in operands_of(statement)]
            if type(statement) is Store:
                node = operands[0]
                yield node, statement
            else:
                moved = _reading(statement, operands)
                node = known.setdefault(moved, len(known))
                if node == len(self.statements):
                    self.statements.append(moved)
                    self.of.append(0)
                self.of[node] |= bit
                yield node, None
            at.append(node)

    def _choose(self) -> None:
        """Leave only what belongs to large groups and reads nothing but these."""
        inner, common = {*self.inner}, self.common
        for node in range(len(common)):
            common[node] |= node not in inner
        left = True
        while left:
            counts = Counter(self.of[node] for node in inner if common[node])
            left = False
            for node in self.inner:
                operands = operands_of(self.statements[node])
                if common[node] and (counts[self.of[node]] < WORTH or not all(common[a] for a in operands)):
                    common[node], left = False, True

    def _passed(self) -> Iterator[Node]:
        """Yield what groups compute and others read."""
        inner = {*self.inner}
        for node in self.inner:
            group = self.of[node] if self.common[node] else 0
            for a in operands_of(self.statements[node]):
                if a in inner and self.common[a] and self.of[a] != group:
                    yield a
        for lines in self.lines:
            yield from (node for node, store in lines if store and node in inner and self.common[node])

    def groups(self) -> Iterator[tuple[int, Body]]:
        """Yield what the same functions compute, by these: each group reads such of more functions, which come before it."""
        found: dict[int, list[Line]] = {}
        for node in self.inner:
            if self.common[node]:
                found.setdefault(self.of[node], []).append((node, None))
        for of in sorted(found, key=lambda of: -of.bit_count()):
            yield of, self._body(found[of])

    def rest(self, k: int) -> Body:
        """Return what a function computes besides its groups, with its stores."""
        return self._body((node, store) for node, store in self.lines[k] if store or not self.common[node])

    def _body(self, lines: Iterable[Line]) -> Body:
        body: list[Statement] = []
        here: dict[Node, int] = {}

        def add(statement: Statement) -> int:
            body.append(statement)
            return len(body) - 1

        def value(node: Node) -> int:
            if node not in here:
                place = self.places.get(node)
                here[node] = add(self.statements[node] if place is None else Load("w", place))
            return here[node]

        for node, store in lines:
            if store is not None:
                add(_reading(store, [value(node)]))
                continue
            operands = [value(a) for a in operands_of(self.statements[node])]
            here[node] = add(_reading(self.statements[node], operands))
            if node in self.places:
                add(Store("w", self.places[node], here[node]))
        return tuple(body)


def _reading(statement: Statement, operands: Sequence[int]) -> Statement:
    """Return a statement that reads other values."""
    match statement:
        case Operate(code, _):
            return Operate(code, tuple(operands))
        case Lookup(table, order, _):
            return Lookup(table, order, *operands)
        case Store(array, index, _, guarded):
            return Store(array, index, *operands, guarded)
        case _:
            return statement

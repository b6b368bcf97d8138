"""What several long functions compute alike, as bodies that they have in common."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from typing import Final

from msgspec.structs import replace

from .chunk import split
from .model import Body, Load, Lookup, Operate, Program, ProgramFunction, Statement, Store, operands_of

Node = int
"""A statement that yields a value, which counts once where several functions have it."""

Line = tuple[Node, Store | None]
"""A node, or a store of its value."""

ALL: Final = -1
"""The functions that have a load or literal."""

WORTH: Final = 100
"""Operations that are worth bodies of their own: what others need of them passes through the workspace."""


def in_common(program: Program, size: int, whole: Collection[str] = ()) -> Program:
    """Return the program in which functions begin with the bodies that they have in common, all of them of about ``size`` operations
    (``split``); those that have none, or stay ``whole``, are as they were."""
    long = [f for f in program.functions if f.operations >= WORTH and len(f.bodies) == 1]
    long = sorted((f for f in long if f.name not in whole), key=lambda f: -f.operations)
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
    """The values of functions of one body each, long ones first.

    ``of``: which functions a node is computed for once, one bit each; what the same functions share is a group. ``places``: in the
    workspace, of what groups pass to others. Loads and literals stand in each body that reads them.
    """

    def __init__(self, functions: Sequence[ProgramFunction]) -> None:
        self.statements: list[Statement] = []
        self.of: list[int] = []
        known: dict[Statement, Node] = {}
        self.lines = [[*self._lines(function, 1 << k, known)] for k, function in enumerate(functions)]
        self.inner = [n for n, s in enumerate(self.statements) if type(s) is Operate or type(s) is Lookup]
        for node in {*range(len(known))}.difference(self.inner):
            self.of[node] = ALL
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
        """Take the shortest function from each group that is too small, and from what reads that, until none is."""
        of = self.of
        while True:
            counts = Counter(of[node] for node in self.inner)
            small = {
                group: group ^ 1 << group.bit_length() - 1
                for group, count in counts.items()
                if count < WORTH and group.bit_count() > 1
            }
            if not small:
                return
            for node in self.inner:
                left = small.get(of[node], of[node])
                for a in operands_of(self.statements[node]):
                    left &= of[a]
                of[node] = left

    def _is_shared(self, node: Node, bit: int) -> bool:
        """Whether a function, by its bit, has a node in common with others."""
        of = self.of[node]
        return bool(of & bit) and of.bit_count() > 1

    def _passed(self) -> Iterator[Node]:
        """Yield what groups compute and others read."""
        for k, lines in enumerate(self.lines):
            for node, store in lines:
                read: Sequence[Node] = (node,)
                group = 0
                if store is None:
                    read = operands_of(self.statements[node])
                    group = self.of[node] if self._is_shared(node, 1 << k) else 0
                yield from (
                    a
                    for a in read
                    if self.of[a] != ALL and self._is_shared(a, 1 << k) and self.of[a] != group
                )

    def groups(self) -> Iterator[tuple[int, Body]]:
        """Yield what the same functions compute, by these: each group reads such of more functions, which come before it."""
        found: dict[int, list[Line]] = {}
        for node in self.inner:
            if self.of[node].bit_count() > 1:
                found.setdefault(self.of[node], []).append((node, None))
        for of in sorted(found, key=lambda of: -of.bit_count()):
            yield of, self._body(found[of], self.places)

    def rest(self, k: int) -> Body:
        """Return what a function computes besides its groups, with its stores."""
        return self._body(
            ((node, store) for node, store in self.lines[k] if store or not self._is_shared(node, 1 << k)), {}
        )

    def _body(self, lines: Iterable[Line], kept: Mapping[Node, int]) -> Body:
        """Return a body of what is not computed before, and stores what is to be ``kept`` of it."""
        body: list[Statement] = []
        here: dict[Node, int] = {}

        def add(statement: Statement) -> int:
            body.append(statement)
            return len(body) - 1

        def value(node: Node) -> int:
            if node not in here:
                here[node] = add(
                    self.statements[node] if self.of[node] == ALL else Load("w", self.places[node])
                )
            return here[node]

        for node, store in lines:
            if store is not None:
                add(_reading(store, [value(node)]))
            elif self.of[node] != ALL:
                operands = [value(a) for a in operands_of(self.statements[node])]
                here[node] = add(_reading(self.statements[node], operands))
                if node in kept:
                    add(Store("w", kept[node], here[node]))
        return tuple(body)


def _reading(statement: Statement, operands: Sequence[int]) -> Statement:
    """Return a statement that reads other values."""
    match statement:
        case Operate(code, _):
            return Operate(code, tuple(operands))
        case Lookup(table, order, _):
            return Lookup(table, order, *operands)
        case Store(array, index, _, guarded):
            return Store(array, index, operands[0], guarded)
        case _:
            return statement

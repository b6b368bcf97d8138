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

Line = Node | Store
"""A node, or a store of one."""

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
    """The values of functions of one body each, long ones first; ``statements`` tell what they are, ``read`` from which nodes.

    ``of``: which functions a node is computed for once, one bit each, if more than one; what the same functions share is a group.
    ``places``: in the workspace, of what groups pass to others. Loads and literals stand in each body that reads them.
    """

    def __init__(self, functions: Sequence[ProgramFunction]) -> None:
        self.statements: list[Statement] = []
        self.read: list[tuple[Node, ...]] = []
        self.had: list[int] = []
        """The functions that have a node, one bit each."""
        known: dict[object, Node] = {}
        self.lines = [self._lines(function, 1 << k, known) for k, function in enumerate(functions)]
        self.inner = [node for node, read in enumerate(self.read) if read]
        self.of = self._groups()
        self.places = {node: place for place, node in enumerate(sorted(self._passed()))}

    def _lines(self, function: ProgramFunction, bit: int, known: dict[object, Node]) -> list[Line]:
        (body,) = function.bodies
        lines: list[Line] = []
        at: list[Node] = []
        for statement in body:
            if type(statement) is Store:
                node = at[statement.value]
                lines.append(replace(statement, value=node))
            else:
                read = tuple([at[v] for v in operands_of(statement)])
                if type(statement) is Operate:
                    key: object = statement.code, read
                else:
                    key = _reading(statement, read)
                node = known.setdefault(key, len(known))
                if node == len(self.statements):
                    self.statements.append(statement)
                    self.read.append(read)
                    self.had.append(0)
                self.had[node] |= bit
                lines.append(node)
            at.append(node)
        return lines

    def _groups(self) -> list[int]:
        """Take the shortest function from each group that is too small, and from what reads that, until none is."""
        of = [had if read else ALL for had, read in zip(self.had, self.read, strict=True)]
        shared = self.inner
        while True:
            shared = [node for node in shared if of[node].bit_count() > 1]
            counts = Counter([of[node] for node in shared])
            small = {
                group: group ^ 1 << group.bit_length() - 1 for group, count in counts.items() if count < WORTH
            }
            if not small:
                return [group if group == ALL or group.bit_count() > 1 else 0 for group in of]
            for node in shared:
                left = small.get(of[node], of[node])
                for a in self.read[node]:
                    left &= of[a]
                of[node] = left

    def _passed(self) -> set[Node]:
        """Return what groups compute and others read."""
        of, passed = self.of, set[Node]()
        for node in self.inner:
            group = of[node]
            own = self.had[node] & ~group
            for a in self.read[node]:
                if of[a] > 0 and ((group and of[a] != group) or of[a] & own):
                    passed.add(a)
        for k, lines in enumerate(self.lines):
            passed.update(
                s.value for s in lines if isinstance(s, Store) and of[s.value] > 0 and of[s.value] >> k & 1
            )
        return passed

    def groups(self) -> Iterator[tuple[int, Body]]:
        """Yield what the same functions compute, by these: each group reads such of more functions, which come before it."""
        found: dict[int, list[Line]] = {}
        for node in self.inner:
            if self.of[node]:
                found.setdefault(self.of[node], []).append(node)
        for of in sorted(found, key=lambda of: -of.bit_count()):
            yield of, self._body(found[of], self.places)

    def rest(self, k: int) -> Body:
        """Return what a function computes besides its groups, with its stores."""
        return self._body(
            (line for line in self.lines[k] if isinstance(line, Store) or not self.of[line] >> k & 1), {}
        )

    def _body(self, lines: Iterable[Line], kept: Mapping[Node, int]) -> Body:
        """Return a body of what is not computed before, and stores what is to be ``kept`` of it."""
        body: list[Statement] = []
        here: dict[Node, int] = {}

        def value(node: Node) -> int:
            if node not in here:
                here[node] = len(body)
                body.append(self.statements[node] if self.of[node] == ALL else Load("w", self.places[node]))
            return here[node]

        for line in lines:
            if isinstance(line, Store):
                body.append(_reading(line, [value(line.value)]))
            else:
                moved = _reading(self.statements[line], [value(a) for a in self.read[line]])
                here[line] = len(body)
                body.append(moved)
                if line in kept:
                    body.append(Store("w", kept[line], here[line]))
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

"""A function as a stream of statements in the order of making, whose loads and literals are leaves of their readers."""

from __future__ import annotations

from collections.abc import Sequence

from msgspec import Struct

from ...graph.operations import ADD, MUL
from ..model import Literal, Load, Lookup, Operate, ProgramFunction, Store, operands_of

NEAR = 4
"""Largest distance of an operand that tells statements apart. From 0 to 8 it makes little difference."""

COMMUTATIVE = (ADD, MUL)

Leaf = Load | Literal
Done = Operate | Lookup | Store
"""What a stream holds; the operands of these objects are those of the function, not of the stream."""


class Stream(Struct):
    """``operands`` of statement i: positions before i, or -1 - k for leaf k."""

    done: list[Done]
    operands: list[tuple[int, ...]]
    leaves: list[Leaf]

    def ordered(self, order: Sequence[int]) -> Stream:
        """Return the same statements in another order."""
        place = [0] * len(order)
        for k, i in enumerate(order):
            place[i] = k
        return Stream(
            [self.done[i] for i in order],
            [tuple([place[a] if a >= 0 else a for a in self.operands[i]]) for i in order],
            self.leaves,
        )


def stream(function: ProgramFunction) -> Stream:
    """Return the statements of a function that says in which order they were made."""
    (body,) = function.bodies
    made = Stream([], [], [])
    place: dict[int, int] = {}
    for position in function.made:
        statement = body[position]
        assert type(statement) is Operate or type(statement) is Lookup or type(statement) is Store
        operands = []
        for value in operands_of(statement):
            at = place.get(value)
            if at is None:
                leaf = body[value]
                assert type(leaf) is Load or type(leaf) is Literal, "a value is made before it is read"
                made.leaves.append(leaf)
                at = place[value] = -len(made.leaves)
            operands.append(at)
        if type(statement) is Operate and statement.code in COMMUTATIVE:
            first, second = operands
            if first >= 0 and second < first:  # leaves first, then what is older
                operands = [second, first]
        place[position] = len(made.done)
        made.done.append(statement)
        made.operands.append(tuple(operands))
    return made


def tokens(made: Stream) -> list[int]:
    """Number the shapes of the statements: what they do, and with what kinds of operands."""
    kinds: dict[object, int] = {}
    leaf = [
        -1 - kinds.setdefault(x.array if type(x) is Load else x.number, len(kinds))  # type: ignore[union-attr]
        for x in made.leaves
    ]
    shapes: dict[object, int] = {}
    found = []
    far = NEAR + 1
    for i, (statement, operands) in enumerate(zip(made.done, made.operands, strict=True)):
        shape: list[object] = [statement.code if type(statement) is Operate else _action(statement)]
        for a in operands:
            distance = i - a
            shape.append(leaf[-1 - a] if a < 0 else distance if distance <= NEAR else far)
        found.append(shapes.setdefault(tuple(shape), len(shapes)))
    return found


def _action(statement: Done) -> object:
    if type(statement) is Lookup:
        return statement.table, statement.order
    assert type(statement) is Store
    return statement.array, statement.guarded

"""A function as a stream of statements in the order of making, whose loads and literals are leaves of their readers."""

from __future__ import annotations

from fractions import Fraction
from typing import Final

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from ...graph.operations import ADD, LOOKUP, MUL, OPERATIONS
from ..model import (
    ARRAYS,
    LITERAL,
    LOAD,
    STORE,
    Literal,
    Load,
    LongBody,
    Lookup,
    Operate,
    ProgramFunction,
    Store,
)

Numbers = NDArray[np.int64]

NEAR = 4
"""Largest distance of an operand that tells statements apart. From 0 to 8 it makes little difference."""

COMMUTATIVE = (ADD, MUL)

NONE: Final = int(np.iinfo(np.int64).min)
"""In the place of an operand that a statement does not have."""


class Stream(Struct):
    """``done``: places in the body; ``operands`` of statement i, three columns: positions in the stream before i, or -1 - k
    for a load or literal at place k of the body, or ``NONE``. The operands that the body names are its own."""

    body: LongBody
    done: Numbers
    operands: Numbers

    def statement(self, i: int) -> Operate | Lookup | Store:
        """Return what statement i does; the operands of this object mean nothing here."""
        found = self.body[int(self.done[i])]
        assert type(found) is Operate or type(found) is Lookup or type(found) is Store
        return found

    def leaf(self, operand: int) -> Load | Literal:
        found = self.body[-1 - int(operand)]
        assert type(found) is Load or type(found) is Literal, "a value is made before it is read"
        return found

    def indices_of(self, leaves: Numbers) -> Numbers:
        """Return the indices that loads read."""
        return _column(self.body.second)[-1 - leaves]

    def numbers_of(self, leaves: Numbers) -> list[Fraction]:
        """Return the numbers that literals are."""
        return [self.body.numbers[k] for k in _column(self.body.first)[-1 - leaves]]

    def targets_of(self, stores: Numbers) -> Numbers:
        """Return the indices that stores write."""
        return _column(self.body.second)[self.done[stores]]

    def ordered(self, order: Numbers) -> Stream:
        """Return the same statements in another order."""
        place = np.empty_like(order)
        place[order] = np.arange(len(order))
        operands = self.operands[order]
        made = operands >= 0
        operands[made] = place[operands[made]]
        return Stream(self.body, self.done[order], operands)


def stream(function: ProgramFunction) -> Stream:
    """Return the statements of a function that says in which order they were made."""
    (body,) = function.bodies
    assert isinstance(body, LongBody)
    kinds = _column(body.kinds)
    done = _column(function.made)
    at = -1 - np.arange(len(kinds))
    at[done] = np.arange(len(done))
    code = kinds[done]
    arity = np.array([row.arity for row in OPERATIONS])[np.maximum(code, 0)]
    arity[(code == STORE) | (code == LOOKUP)] = 1
    columns = []
    for k, column in enumerate((body.first, body.second, body.third)):
        values = np.where(arity > k, _column(column)[done], 0)
        columns.append(np.where(arity > k, at[values], NONE))
    first, second, third = columns
    swapped = np.isin(code, COMMUTATIVE) & (first >= 0) & (second < first)  # leaves first, then what is older
    first, second = np.where(swapped, second, first), np.where(swapped, first, second)
    return Stream(body, done, np.stack([first, second, third], axis=1))


def tokens(made: Stream, by_number: bool = True) -> Numbers:
    """Number the shapes of the statements: what they do, and with what kinds of operands; without ``by_number`` all literals
    are of one kind."""
    body = made.body
    kinds, first = _column(body.kinds), _column(body.first)
    # what tells leaves apart: the array, or the number
    numbers: dict[object, int] = {}
    told = body.numbers if by_number else [None] * len(body.numbers)
    known = np.array([numbers.setdefault(number, len(numbers)) for number in told] or [0])
    literal = kinds == LITERAL
    leaf = np.where(kinds == LOAD, first, 0)
    leaf[literal] = len(ARRAYS) + known[first[literal]]
    i = np.arange(len(made.done))
    far = NEAR + 1
    second, third = _column(body.second)[made.done], _column(body.third)[made.done]
    code = kinds[made.done]
    shape = np.where(code == STORE, len(OPERATIONS) + third, code)
    shape = np.where(code == LOOKUP, len(OPERATIONS) + 2 * len(ARRAYS) + 8 * second + third, shape)
    choices = far + 2 + len(ARRAYS) + len(numbers)
    for operands in made.operands.T:
        is_leaf = (operands < 0) & (operands != NONE)
        distance = np.minimum(i - np.where(operands >= 0, operands, 0), far)
        kind = np.where(operands >= 0, distance, 0)
        kind[is_leaf] = far + 1 + leaf[-1 - operands[is_leaf]]
        shape = shape * choices + kind
    return shape


def _column(column: object) -> Numbers:
    return np.array(column, np.int64)

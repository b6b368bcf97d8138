"""Follow loops statement by statement and hold them against the function that they stand for."""

from __future__ import annotations

from collections.abc import Mapping

from ...malformed import Malformed
from ..model import Literal, Load, Lookup, Operate, ProgramFunction, Store, operands_of
from .rolled import (
    Carried,
    Compute,
    Index,
    Item,
    Local,
    Loop,
    LoopNumber,
    LoopRegister,
    Operand,
    Put,
    Read,
    Rolled,
)
from .stream import COMMUTATIVE

Value = int
"""Number of a value: equal for equal operations on equal values."""


def verify(function: ProgramFunction, rolled: Rolled) -> None:
    """Raise Malformed where loops do not store the same formulas of the same numbers as the function, in each place."""
    values: dict[object, Value] = {}
    wanted = _straight(function, values)
    found = _Replay(rolled, values).run()
    for place in wanted.keys() | found.keys():
        if wanted.get(place) != found.get(place):
            array, index = place
            raise Malformed(
                f"program, function {function.name}, as loops", f"stores another value in {array}[{index}]"
            )


def _number(values: dict[object, Value], *key: object) -> Value:
    return values.setdefault(key, len(values))


def _operation(
    values: dict[object, Value], statement: Operate | Lookup, operands: tuple[Value, ...]
) -> Value:
    if type(statement) is Operate:
        if statement.code in COMMUTATIVE:
            operands = tuple(sorted(operands))
        return _number(values, statement.code, *operands)
    assert type(statement) is Lookup
    return _number(values, "lookup", statement.table, statement.order, *operands)


def _loaded(
    values: dict[object, Value], stored: Mapping[tuple[str, int], Value], array: str, index: int
) -> Value:
    """What is read of a parameter that was stored is that, set from outside or not."""
    known = stored.get((array, index)) if array == "p" else None
    return _number(values, array, index) if known is None else _number(values, "stored", index, known)


def _straight(function: ProgramFunction, values: dict[object, Value]) -> dict[tuple[str, int], Value]:
    stored: dict[tuple[str, int], Value] = {}
    (body,) = function.bodies
    known: list[Value] = []
    for statement in body:
        match statement:
            case Load(array, index):
                known.append(_loaded(values, stored, array, index))
            case Literal(number):
                known.append(_number(values, number))
            case Store(array, index, value):
                stored[array, index] = known[value]
                known.append(-1)
            case _:
                operands = tuple([known[a] for a in operands_of(statement)])
                known.append(_operation(values, statement, operands))
    return stored


class _Replay:
    def __init__(self, rolled: Rolled, values: dict[object, Value]) -> None:
        self.rolled = rolled
        self.values = values
        self.memory: dict[int, Value] = {}
        self.local: dict[int, Value] = {}
        self.kept: dict[int, Value] = {}
        self.carried: dict[int, Value] = {}
        self.counters: dict[int, int] = {}
        self.counted: dict[int, int] = {}
        self.stored: dict[tuple[str, int], Value] = {}

    def run(self) -> dict[tuple[str, int], Value]:
        for item in self.rolled.items:
            self.do(item)
        return self.stored

    def at(self, index: Index) -> int:
        place = index.base + sum(stride * self.counters[c] for c, stride in index.strides)
        if index.table >= 0:
            number = self.counted.get(index.numbered, 0) + self.counters[index.numbered]
            place += self.rolled.tables[index.table][number]
        return place

    def value(self, operand: Operand) -> Value:
        match operand:
            case Read("w", index):
                return self.memory[self.at(index)]
            case Read("numbers", index):
                return _number(self.values, self.rolled.numbers[self.at(index)])
            case Read(array, index):
                return _loaded(self.values, self.stored, array, self.at(index))
            case Local(number):
                return self.local[number]
            case LoopRegister(number):
                return self.kept[number]
            case Carried(number):
                return self.carried[number]
            case LoopNumber(value):
                return _number(self.values, value)

    def do(self, item: Item) -> None:
        match item:
            case Compute(number, statement, operands, place, kept):
                found = _operation(self.values, statement, tuple([self.value(o) for o in operands]))
                self.local[number] = found
                if kept:
                    self.kept[number] = found
                if place is not None:
                    self.memory[self.at(place)] = found
            case Put("w", index, operand):
                self.memory[self.at(index)] = self.value(operand)
            case Put(array, index, operand):
                self.stored[array, self.at(index)] = self.value(operand)
            case Loop(counter, trips, body, registers, carried=carried):
                for number, index in registers:
                    self.kept[number] = self.memory[self.at(index)]
                for carry in carried:
                    self.carried[carry.number] = self.memory[self.at(carry.first)]
                n = self.at(trips)
                for self.counters[counter] in range(n):
                    for inner in body:
                        self.do(inner)
                    for carry in carried:
                        self.carried[carry.number] = self.local[carry.source]
                self.counted[counter] = self.counted.get(counter, 0) + n
                for number, index in registers:
                    self.memory[self.at(index)] = self.kept[number]
                for carry in carried:
                    if carry.last is not None:
                        self.memory[self.at(carry.last)] = self.carried[carry.number]

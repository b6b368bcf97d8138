"""Functions as loops (``program/loops``) as loops of WebAssembly, in the order of the statements."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator, Sequence
from typing import assert_never

from ...program.loops.rolled import (
    NUMBERS,
    Carried,
    Carry,
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
from ...program.model import Operate
from . import binary as b
from .straight import Arrays, Fragment, FunctionWriter, number


class Loops:
    """The loops of one function; ``arrays``: where its arrays, and its workspace w, lie."""

    def __init__(self, writer: FunctionWriter, rolled: Rolled, arrays: Arrays) -> None:
        self.writer = writer
        self.arrays = arrays
        self.tables = [_table(writer, table) for table in rolled.tables]
        """Address, and whether its numbers have 16 bits."""
        self.numbers = writer.place.numbers([number(n) for n in rolled.numbers]) if rolled.numbers else 0
        self.counters: dict[int, int] = {}
        """Of the loops around; so are the registers."""
        self.numbered = {
            loop.counter: writer.local(b.I32) for loop in _loops_in(rolled.items) if loop.numbered
        }
        """The local in which the iterations of a loop are counted through the function: locals begin as zero."""
        self.values: dict[int, Fragment] = {}
        self.kept: dict[int, int] = {}
        self.before: dict[int, int] = {}

    def items(self, items: Sequence[Item], carried: Sequence[Carry] = ()) -> None:
        """Append the code of statements, and then of what they carry to the next iteration. Locals are used again after the last
        statement that reads their values."""
        last = {value: k for k, item in enumerate(items) for value in _read_in(item)}
        last |= {carry.source: len(items) for carry in carried}
        ends: list[list[int]] = [[] for _ in range(len(items) + 1)]
        for k, item in enumerate(items):
            if isinstance(item, Compute):
                ends[last.get(item.number, k)].append(item.number)
        for k, item in enumerate(items):
            match item:
                case Compute():
                    self._compute(item)
                case Put():
                    code = self._store(item.array, item.index, self._operand(item.operand).as_kind(False))
                    if item.guarded:
                        place = b.get(self.arrays.where["set"]) + self._index(item.index) + b.I32_ADD
                        code = place + b.load_u8() + b.I32_EQZ + b.IF + code + b.END
                    self.writer.flush(code)
                case Loop():
                    self._loop(item)
                case _:
                    assert_never(item)
            self._forget(ends[k])
        for carry in carried:
            self.writer.flush(self.values[carry.source].as_kind(False) + b.put(self.before[carry.number]))
        self._forget(ends[-1])

    def _forget(self, values: Sequence[int]) -> None:
        for value in values:
            for local in self.values.pop(value).reads:
                self.writer.release(local)

    def _compute(self, item: Compute) -> None:
        operands = [self._operand(o) for o in item.operands]
        if type(item.statement) is Operate:
            value = self.writer.operation(item.statement.code, operands)
        else:
            assert not isinstance(item.statement, Operate)
            value = self.writer.lookup(item.statement.table, item.statement.order, operands[0])
        local = self.writer.local(b.I32 if value.condition else b.F64)
        known = self.values[item.number] = Fragment(b.get(local), value.condition, (local,), True)
        self.writer.flush(value.code + b.put(local))
        if item.kept:
            self.writer.flush(known.as_kind(False) + b.put(self.kept[item.number]))
        if item.place is not None:
            self.writer.flush(self._store("w", item.place, known.as_kind(False)))

    def _loop(self, item: Loop) -> None:
        writer, flush = self.writer, self.writer.flush
        i, trips = writer.local(b.I32), writer.local(b.I32)
        self.counters[item.counter] = i
        carried = [(carry.number, carry.first) for carry in item.carried]
        for registers, rows in ((self.kept, item.kept), (self.before, carried)):
            for register, place in rows:
                registers[register] = writer.local(b.F64)
                flush(self._load("w", place) + b.put(registers[register]))
        flush(self._index(item.trips) + b.tee(trips) + b.i32(0) + b.I32_GT_S + b.IF)
        flush(b.i32(0) + b.put(i) + b.LOOP)
        self.items(item.body, item.carried)
        flush(b.get(i) + b.i32(1) + b.I32_ADD + b.tee(i) + b.get(trips) + b.I32_LT_S)
        flush(b.branch_if(0) + b.END + b.END)
        for register, place in item.kept:
            flush(self._store("w", place, b.get(self.kept[register])))
        for carry in item.carried:
            if carry.last is not None:
                flush(self._store("w", carry.last, b.get(self.before[carry.number])))
        if item.numbered:
            n = self.numbered[item.counter]
            flush(b.get(n) + self._index(item.trips) + b.I32_ADD + b.put(n))
        kept = [self.kept.pop(register) for register, _ in item.kept]
        before = [self.before.pop(register) for register, _ in carried]
        for local in (self.counters.pop(item.counter), trips, *kept, *before):
            writer.release(local)

    def _operand(self, operand: Operand) -> Fragment:
        match operand:
            case Read("t"):
                return self.arrays.load("t", 0)
            case Read(array, index):
                return Fragment(self._load(array, index))
            case Local(known):
                return self.values[known]
            case LoopRegister(register):
                return Fragment(b.get(self.kept[register]), simple=True)
            case Carried(register):
                return Fragment(b.get(self.before[register]), simple=True)
            case LoopNumber(value):
                return Fragment(b.f64(number(value)), simple=True)
            case _:
                assert_never(operand)

    # ---- places

    def _load(self, array: str, index: Index) -> bytes:
        return self._at(array, index, b.load_f64)

    def _store(self, array: str, index: Index, value: bytes) -> bytes:
        return self._at(array, index, lambda offset: value + b.store_f64(offset))

    def _at(self, array: str, index: Index, then: Callable[[int], bytes]) -> bytes:
        """Return the address of a number, and what is done there at an offset from it."""
        base = 8 * index.base
        if array == "g":
            array, base = "u", base + 8 * self.arrays.inputs
        # an offset adds to an address that is not negative, but must not be so itself
        constant = base >= 0 and index.table < 0 and all(stride > 0 for _, stride in index.strides)
        start = b.i32(self.numbers) if array == NUMBERS else b.get(self.arrays.where[array])
        at = start + self._moving(index, 8, 0 if constant else base)
        return at + then(base if constant else 0)

    def _index(self, index: Index) -> bytes:
        return b.i32(index.base) + self._moving(index, 1, 0)

    def _moving(self, index: Index, size: int, base: int) -> bytes:
        """Return code that adds base, strides and entry of the table to what is on the stack, in units of ``size`` bytes."""
        code = b.i32(base) + b.I32_ADD if base else b""
        for counter, stride in index.strides:
            step = stride * size
            code += b.get(self.counters[counter]) + (b.i32(step) + b.I32_MUL if step != 1 else b"")
            code += b.I32_ADD
        if index.table >= 0:
            code += self._entry(index) + (b.i32(size) + b.I32_MUL if size != 1 else b"") + b.I32_ADD
        return code

    def _entry(self, index: Index) -> bytes:
        at, short = self.tables[index.table]
        i = b.get(self.numbered[index.numbered]) + b.get(self.counters[index.numbered]) + b.I32_ADD
        i += b.i32(1 if short else 2) + b.I32_SHL
        return b.i32(at) + i + b.I32_ADD + (b.LOAD_U16 if short else b.LOAD_I32)


def _table(writer: FunctionWriter, table: Sequence[int]) -> tuple[int, bool]:
    short = min(table) >= 0 and max(table) < 1 << 16
    data = struct.pack(f"<{len(table)}{'H' if short else 'i'}", *table)
    return writer.place.put(data, 2 if short else 4), short


def _loops_in(items: Sequence[Item]) -> Iterator[Loop]:
    for item in items:
        if isinstance(item, Loop):
            yield item
            yield from _loops_in(item.body)


def _read_in(item: Item) -> Iterator[int]:
    """Yield the numbers of the values that a statement, or a loop, reads."""
    match item:
        case Compute(_, _, operands):
            yield from (o.number for o in operands if isinstance(o, Local))
        case Put(_, _, operand):
            if isinstance(operand, Local):
                yield operand.number
        case Loop():
            yield from (carry.source for carry in item.carried)
            for inner in item.body:
                yield from _read_in(inner)
        case _:
            assert_never(item)

"""Taylor series of few slots: one loop over the orders, as ``c_series.py`` writes it for C, which says how it goes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from ...program.model import Program, Store
from ...program.series import LANES, NEXT, padded
from ..c_series import Side, results, sides_of
from . import binary as b
from .operations import OF_KERNEL
from .place import Place
from .straight import Arrays, Fragment, Writer

SUMS: Final = f"{OF_KERNEL}series_sums"
"""The function of the kernel that adds up the slots (``series.h``)."""

ORDER, KEPT, PARAMETERS, X, ROWS = range(5)
"""The parameters of mech_expansion."""


class _Coefficients(Arrays):
    """Where the function of one order finds and leaves its numbers."""

    def __init__(self, writer: Writer, ny: int, slots: int, n_slots: int) -> None:
        self.slots = slots
        self.k = writer.local(b.I32)
        self.over = writer.local(b.F64)
        self.x = [writer.local(b.F64) for _ in range(ny)]
        self.rates = [writer.local(b.F64) for _ in range(ny)]
        self.sums = [writer.local(b.F64) for _ in range(n_slots)] if slots == LANES else []
        self.made: dict[int, int] = {}
        """The local of each value that is a side of slots."""

    def load(self, array: str, index: int) -> Fragment:
        match array:
            case "t":
                return Fragment(b.get(self.k) + b.F64_FROM_I32, simple=True)
            case "y":
                return Fragment(b.get(self.x[index]), simple=True)
            case "u" if index == self.slots:
                return Fragment(b.get(self.over), simple=True)
            case "u" if index == self.slots + 1:
                return Fragment(b.get(self.k) + b.i32(1) + b.I32_EQ, condition=True)
            case "u" if self.sums:
                return Fragment(b.get(self.sums[index]), simple=True)
        source = {"u": ROWS, "z": KEPT, "p": PARAMETERS}[array]
        return Fragment(b.get(source) + b.load_f64(8 * index))

    def store(self, statement: Store, value: bytes) -> bytes:
        local = self.made[statement.index] if statement.array == "r" else self.rates[statement.index]
        return value + b.put(local)

    def side(self, side: Side) -> int:
        """Return the local with the coefficient of this order."""
        kind, index = side
        return self.x[index] if kind == "x" else self.made[index]


def expansion(program: Program, place: Place, tables: Mapping[int, tuple[int, int]]) -> bytes:
    """Return the body of the function that takes the place of ``series_next``."""
    plan, function = program.series, program.function(NEXT)
    assert plan is not None and function is not None
    (body,) = function.bodies
    ny, slots = len(program.arrays["y"]), padded(plan.n_slots)
    states = padded(ny)
    stored = {s.index: s.value for s in body if type(s) is Store}
    a, c = sides_of(body, stored, plan.n_slots, ny)
    sides = [*dict.fromkeys((*a, *c))]
    writer = Writer(place, 5, tables)
    at = _Coefficients(writer, ny, slots, plan.n_slots)
    at.made = {value: writer.local(b.F64) for name, value in sides if name == "r"}
    row, flush = writer.local(b.I32), writer.flush
    for i, local in enumerate(at.x):
        flush(b.get(X) + b.load_f64(8 * (states + i)) + b.put(local))
    first: dict[Side, int] = {}
    latest: dict[Side, int] = {}
    if slots == LANES:
        first, latest = ({side: writer.local(b.F64) for side in sides} for _ in range(2))
        for k in range(slots):
            flush(b.get(ROWS) + b.f64(0) + b.store_f64(8 * (slots + k)))
    flush(b.i32(1) + b.put(at.k) + b.LOOP)
    flush(_over(at.k) + b.put(at.over))
    if slots == LANES:
        _sums_with_ends(writer, at, [*zip(a, c, strict=True)], first, latest)
    elif slots:
        flush(b.i32(1) + b.get(at.k) + b.get(ROWS) + b.i32(slots) + b.get(ROWS) + place.call(SUMS))
    writer.write(results(body, stored, ny, {*a, *c}), at)
    flush(b.get(at.k) + b.i32(16 * slots) + b.I32_MUL + b.get(ROWS) + b.I32_ADD + b.put(row))
    for offset, column in ((0, a), (slots, c)):
        for k in range(slots):
            value = b.get(at.side(column[k])) if k < len(column) else b.f64(0)
            flush(b.get(row) + value + b.store_f64(8 * (offset + k)))
    for side, local in latest.items():
        flush(b.get(at.side(side)) + b.put(local))
    if first:
        flush(b.get(at.k) + b.i32(1) + b.I32_EQ + b.IF)
        for side, local in first.items():
            flush(b.get(at.side(side)) + b.put(local))
        flush(b.END)
    flush(b.get(at.k) + b.i32(1) + b.I32_ADD + b.put(at.k))
    flush(_over(at.k) + b.put(at.over))
    flush(b.get(at.k) + b.i32(8 * states) + b.I32_MUL + b.get(X) + b.I32_ADD + b.put(row))
    for i, (x, rate) in enumerate(zip(at.x, at.rates, strict=True)):
        flush(b.get(row) + b.get(rate) + b.get(at.over) + b.F64_MUL + b.tee(x) + b.store_f64(8 * i))
    flush(b.get(at.k) + b.get(ORDER) + b.I32_LT_S + b.branch_if(0) + b.END)
    return writer.body()


def _over(k: int) -> bytes:
    return b.f64(1) + b.get(k) + b.F64_FROM_I32 + b.F64_DIV


def _sums_with_ends(
    writer: Writer,
    at: _Coefficients,
    pairs: Sequence[tuple[Side, Side]],
    first: Mapping[Side, int],
    latest: Mapping[Side, int],
) -> None:
    """Complete the sums of this order, and begin those of the next one."""
    flush, slots = writer.flush, at.slots

    def begun(k: bytes) -> bytes:
        return k + b.i32(1) + b.I32_AND + b.i32(8 * slots) + b.I32_MUL + b.get(ROWS) + b.I32_ADD

    following = b.get(at.k) + b.i32(1) + b.I32_ADD
    flush(b.i32(2) + following + b.get(ROWS) + b.i32(slots) + begun(following) + writer.place.call(SUMS))
    here = writer.local(b.I32)
    flush(begun(b.get(at.k)) + b.put(here))
    for k, (one, other) in enumerate(pairs):
        product = b.get(first[one]) + b.get(latest[other]) + b.F64_MUL
        flush(b.get(here) + b.load_f64(8 * k) + product + b.F64_ADD + b.put(at.sums[k]))
    flush(b.get(at.k) + b.i32(2) + b.I32_GT_S + b.IF)
    for k, (one, other) in enumerate(pairs):
        product = b.get(latest[one]) + b.get(first[other]) + b.F64_MUL
        flush(b.get(at.sums[k]) + product + b.F64_ADD + b.put(at.sums[k]))
    flush(b.END)

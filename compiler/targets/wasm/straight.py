"""Straight-line bodies as code of a stack machine.

A value that is used once stays a fragment of code until it is used; any other goes to a local, and locals are used again after
their last reader.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from functools import lru_cache
from heapq import heappop, heappush
from itertools import groupby
from math import pi

from ...graph.table import ELEMENT, question
from ...program.branches import GuardedParts
from ...program.model import Body, Literal, Load, Lookup, Operate, Store, operands_of
from ..literal import LiteralForm, constant
from . import binary as b
from .operations import OF_KERNEL, ROWS
from .place import MemoryPlace

LONGEST = 400
"""Bytes of a fragment that is carried on to where it is used."""


@lru_cache(maxsize=4096)
def number(exact: Fraction) -> float:
    """Return the double that the C text of a constant evaluates to: ratios and multiples of pi are rounded twice."""
    c = constant(exact)
    if c.form is LiteralForm.RATIO:
        return float(c.text) / float(c.divisor)
    if c.form is LiteralForm.PI:
        value = float({"": "1", "-": "-1"}.get(c.text, c.text)) * pi
        return value / float(c.divisor) if c.divisor else value
    return float(c.text)


class Fragment:
    """Code that leaves one value on the stack: a truth value, or a number. ``reads``: the locals in it that are used again
    after their last reader. ``simple``: it is so short that it stands wherever it is read."""

    __slots__ = ("code", "condition", "reads", "simple")

    def __init__(
        self, code: bytes, condition: bool = False, reads: tuple[int, ...] = (), simple: bool = False
    ) -> None:
        self.code = code
        self.condition = condition
        self.reads = reads
        self.simple = simple

    def as_kind(self, condition: bool) -> bytes:
        """Return the code of the value as a truth value or as a number."""
        if self.condition == condition:
            return self.code
        return self.code + (b.f64(0.0) + b.F64_NE if condition else b.F64_FROM_I32)


class Arrays:
    """The arrays that a body reads and writes, by the locals with their addresses; ``inputs``: how many numbers u has, after
    which g stands."""

    def __init__(self, where: Mapping[str, int], inputs: int) -> None:
        self.where = where
        self.inputs = inputs

    def load(self, array: str, index: int) -> Fragment:
        if array == "t":
            return Fragment(b.get(self.where["t"]), simple=True)
        if array == "g":
            array, index = "u", index + self.inputs
        return Fragment(b.get(self.where[array]) + b.load_f64(8 * index))

    def zeros(self, begin: Store, count: int) -> bytes:
        """Return code that writes so many zeros."""
        at = b.get(self.where[begin.array]) + b.i32(8 * begin.index) + b.I32_ADD
        return at + b.i32(0) + b.i32(8 * count) + b.MEMORY_FILL

    def store(self, statement: Store, value: bytes) -> bytes:
        code = b.get(self.where[statement.array]) + value + b.store_f64(8 * statement.index)
        if statement.guarded:
            test = b.get(self.where["set"]) + b.load_u8(statement.index) + b.I32_EQZ
            code = test + b.IF + code + b.END
        return code


class FunctionWriter:
    """The code of one function, whose locals begin after its ``parameters``; ``tables``: address and length."""

    def __init__(self, place: MemoryPlace, parameters: int, tables: Mapping[int, tuple[int, int]]) -> None:
        self.place = place
        self.tables = tables
        self.code = bytearray()
        self.first = parameters
        self.kinds: list[int] = []
        self.free: dict[int, list[int]] = {b.F64: [], b.I32: []}
        self.left: dict[int, int] = {}
        """How often a local is still read."""

    def local(self, kind: int) -> int:
        """Return the first local that is free: low numbers are short, and packed well."""
        if self.free[kind]:
            return heappop(self.free[kind])
        self.kinds.append(kind)
        return self.first + len(self.kinds) - 1

    def flush(self, code: bytes, reads: Sequence[int] = ()) -> None:
        """Append code that reads these locals."""
        self.code += code
        for local in reads:
            self.left[local] -= 1
            if not self.left[local]:
                self.release(local)

    def release(self, local: int) -> None:
        heappush(self.free[self.kinds[local - self.first]], local)

    def keep(self, value: Fragment, uses: int) -> Fragment:
        """Put a value into a local that is read so often."""
        self.flush(value.code, value.reads)
        local = self.local(b.I32 if value.condition else b.F64)
        self.code += b.put(local)
        self.left[local] = uses
        return Fragment(b.get(local), value.condition, (local,), True)

    def body(self) -> bytes:
        return b.function_body(self.kinds, bytes(self.code))

    # ---- operations

    def operation(self, code: int, operands: Sequence[Fragment]) -> Fragment:
        row = ROWS[code]
        parts = [o.as_kind(wanted) for o, wanted in zip(operands, row.conditions, strict=True)]
        text = b"".join([parts[k] for k in row.order])
        done = self.place.call(row.called) if row.called else row.code
        return Fragment(text + done, row.condition, sum((o.reads for o in operands), ()))

    def lookup(self, table: int, order: int, operand: Fragment) -> Fragment:
        at, n = self.tables[table]
        asked = b.i32(order) if order < ELEMENT else b""
        called = self.place.call(f"{OF_KERNEL}{question(order)}")
        text = b.i32(at) + b.i32(n) + asked + operand.as_kind(False) + called
        return Fragment(text, False, operand.reads)

    # ---- bodies

    def write(self, body: Body, arrays: Arrays) -> None:
        """Append the code of a body."""
        body = tuple(body)
        uses = [0] * len(body)
        stored = {s.array for s in body if type(s) is Store}
        for statement in body:
            for operand in operands_of(statement):
                uses[operand] += 1
        zeros = _zeros(body)
        found = GuardedParts.of(body)
        results = found.results()
        for condition in found.conditions():
            uses[condition] += 1
        values: list[Fragment] = []
        for k, (statement, count) in enumerate(zip(body, uses, strict=True)):
            self.code += b.END * found.ends.get(k, 0)
            for branch in found.begins.get(k, ()):
                asked = values[branch.condition]
                self.flush(asked.as_kind(True) + (b"" if branch.holds else b.I32_EQZ) + b.IF, asked.reads)
            if k not in zeros:
                values.append(self._value(statement, count, values, arrays, stored, k in results))
                continue
            if zeros[k]:
                assert type(statement) is Store
                self.flush(arrays.zeros(statement, zeros[k]))
            values.append(NOTHING)

    def _value(
        self,
        statement: Load | Literal | Operate | Lookup | Store,
        uses: int,
        values: Sequence[Fragment],
        arrays: Arrays,
        stored: set[str],
        moved: bool,
    ) -> Fragment:
        """Return the code of a value; ``moved``: other code stands between it and what reads it."""
        match statement:
            case Operate(code, operands):
                value = self.operation(code, [values[a] for a in operands])
            case Literal(exact):
                return Fragment(b.f64(number(exact)), simple=True)
            case Load(array, index):
                value = arrays.load(array, index)
                moved = array in stored  # it is read before what is stored later
                if value.simple:
                    return value
            case Lookup(table, order, operand):
                value = self.lookup(table, order, values[operand])
            case Store():
                given = values[statement.value]
                self.flush(arrays.store(statement, given.as_kind(False)), given.reads)
                return NOTHING
        if not uses:
            return NOTHING
        return self.keep(value, uses) if uses > 1 or moved or len(value.code) > LONGEST else value


NOTHING = Fragment(b"")
"""In the place of a value that nobody reads."""

MANY = 3
"""More zeros than these are written at once."""


def _zeros(body: Body) -> dict[int, int]:
    """Return the stores of zeros, one after the other, side by side, as in Jacobians: how many the first one of these begins; none of the
    rest."""
    zero = Literal(Fraction(0))
    stores = [
        (k, s) for k, s in enumerate(body) if type(s) is Store and not s.guarded and body[s.value] == zero
    ]
    found: dict[int, int] = {}
    for _, run in groupby(enumerate(stores), lambda x: (x[1][0] - x[0], x[1][1].index - x[0], x[1][1].array)):
        first, *rest = (k for _, (k, _) in run)
        if len(rest) >= MANY:
            found |= {first: 1 + len(rest)} | dict.fromkeys(rest, 0)
    return found

"""WebAssembly: how the table of operations is written.

Numbers are f64, truth values i32, as in the C text double and int.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from msgspec import Struct

from ...graph.operation import Operation
from ...graph.operations import LOOKUP, OPERATIONS
from ..c_forms import CALLED, OWN
from . import binary as b

INSTRUCTIONS: Final[Mapping[str, bytes]] = {
    "f64.add": b.F64_ADD,
    "f64.sub": b.F64_SUB,
    "f64.mul": b.F64_MUL,
    "f64.div": b.F64_DIV,
    "f64.neg": b.F64_NEG,
    "f64.abs": b.F64_ABS,
    "f64.sqrt": b.F64_SQRT,
    "f64.floor": b.F64_FLOOR,
    "f64.lt": b.F64_LT,
    "f64.le": b.F64_LE,
    "f64.eq": b.F64_EQ,
    "i32.and": b.I32_AND,
    "i32.or": b.I32_OR,
    "i32.eqz": b.I32_EQZ,
    "select": b.SELECT,
    "drop": b.DROP,
}

OF_KERNEL: Final = "f_"
"""Begins the names of functions of the kernel that are not functions of the C library."""


class WasmRow(Struct, frozen=True):
    """How an operation leaves its value on the stack, after its operands: an instruction, or a function of the kernel."""

    code: bytes
    called: str
    conditions: tuple[bool, ...]
    """Which operands are truth values."""
    condition: bool
    """The value is a truth value."""
    order: tuple[int, ...]
    """In which order the operands lie on the stack."""


def _row(row: Operation) -> WasmRow:
    called = "" if row.wasm else f"{OF_KERNEL}{CALLED[row.code]}" if row.code in OWN else CALLED[row.code]
    order = (1, 2, 0) if row.wasm == "select" else tuple(range(row.arity))
    code = INSTRUCTIONS[row.wasm] if row.wasm else b""
    return WasmRow(code, called, row.conditions[: row.arity], row.condition, order)


ROWS: Final[Mapping[int, WasmRow]] = {
    row.code: _row(row) for row in OPERATIONS if row.arity and row.code != LOOKUP
}

LIBRARY: Final = tuple(row.called for code, row in ROWS.items() if row.called and code not in OWN)
"""Functions of the C library that the kernels offer."""

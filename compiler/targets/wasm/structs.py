"""The constant structs of a program (``model_data.py``) as bytes with pointers of 32 bits."""

from __future__ import annotations

import ctypes
import struct
from collections.abc import Sequence
from fractions import Fraction
from typing import Any, Final

from mechc.runtime.native.contract import Contract

from ..model_data import ArrayPointer, FunctionPointer, NamedNumber, StructArray, StructPointer, Value
from .place import MemoryPlace
from .straight import number

FORMATS: Final[dict[str, str]] = {"int": "i", "unsigned char": "B", "mech_real": "d"}

Entry = Value | Fraction | float


def placed(value: StructArray | ArrayPointer | StructPointer, place: MemoryPlace) -> int:
    """Put what a pointer points to among the data and return its address; 0 for NULL."""
    if isinstance(value, ArrayPointer):
        entries = [number(v) if isinstance(v, Fraction) else v for v in value.values]
        if not entries and value.never_null:
            entries = [0]
        form = f"<{len(entries)}{FORMATS[value.kind]}"
        return place.put(struct.pack(form, *entries)) if entries else 0
    if isinstance(value, StructArray):
        rows = [_laid_out(value.struct, row, place) for row in value.rows]
        return place.put(b"".join(rows)) if rows else 0
    names = [field[0] for field in value.struct._fields_]
    unknown = value.fields.keys() - set(names)
    assert not unknown, f"{value.struct.c_name} has no fields {sorted(unknown)}"
    return place.put(_laid_out(value.struct, [value.fields.get(name, 0) for name in names], place))


def _laid_out(kind: type[Contract], values: Sequence[Entry], place: MemoryPlace) -> bytes:
    """Return the bytes of a struct: each field at a multiple of its size, the end at one of the largest."""
    out = bytearray()
    largest = 1
    for field, value in zip(kind._fields_, values, strict=True):
        form = _form(field[1])
        size = struct.calcsize(form)
        largest = max(largest, size)
        out += bytes(-len(out) % size) + struct.pack(form, _entry(value, place))
    return bytes(out + bytes(-len(out) % largest))


def _form(kind: Any) -> str:
    """Return the format of a field; what is neither a number nor a byte is a pointer."""
    return {ctypes.c_int: "<i", ctypes.c_double: "<d"}.get(kind, "<I")


def _entry(value: Entry, place: MemoryPlace) -> int | float:
    match value:
        case None:
            return 0
        case NamedNumber(_, n):
            return n
        case FunctionPointer(name):
            return place.pointer(name)
        case Fraction():
            return number(value)
        case ArrayPointer() | StructArray() | StructPointer():
            return placed(value, place)
    return value

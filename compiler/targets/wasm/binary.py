"""The binary format of WebAssembly: numbers, sections, the instructions used here, and a reader of sections.

https://webassembly.github.io/spec/core/binary/
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable, Sequence
from typing import Final

I32: Final = 0x7F
F64: Final = 0x7C
EMPTY: Final = 0x40
"""The type of a block without a value."""

IF: Final = bytes((0x04, EMPTY))
LOOP: Final = bytes((0x03, EMPTY))
END: Final = b"\x0b"
LOAD_I32: Final = b"\x28\x02\0"
LOAD_U16: Final = b"\x2f\x01\0"
DROP: Final = b"\x1a"
SELECT: Final = b"\x1b"
I32_EQZ: Final = b"\x45"
I32_LT_S: Final = b"\x48"
I32_GT_S: Final = b"\x4a"
I32_ADD: Final = b"\x6a"
I32_SUB: Final = b"\x6b"
I32_MUL: Final = b"\x6c"
I32_AND: Final = b"\x71"
I32_OR: Final = b"\x72"
I32_SHL: Final = b"\x74"
F64_EQ: Final = b"\x61"
F64_NE: Final = b"\x62"
F64_LT: Final = b"\x63"
F64_LE: Final = b"\x65"
F64_ABS: Final = b"\x99"
F64_NEG: Final = b"\x9a"
F64_FLOOR: Final = b"\x9c"
F64_SQRT: Final = b"\x9f"
F64_ADD: Final = b"\xa0"
F64_SUB: Final = b"\xa1"
F64_MUL: Final = b"\xa2"
F64_DIV: Final = b"\xa3"
F64_FROM_I32: Final = b"\xb7"
MEMORY_FILL: Final = b"\xfc\x0b\0"

MAGIC: Final = b"\0asm\1\0\0\0"
TYPE, IMPORT, FUNCTION, TABLE, MEMORY, GLOBAL, EXPORT, START, ELEMENT, CODE, DATA, DATA_COUNT = range(1, 13)
"""Kinds of sections."""

PAGE: Final = 65_536
"""Bytes by which memory is counted."""


def unsigned(n: int) -> bytes:
    """Return a number in LEB128."""
    out = bytearray()
    while n >= 0x80:
        out.append(n & 0x7F | 0x80)
        n >>= 7
    out.append(n)
    return bytes(out)


def signed(n: int) -> bytes:
    """Return a number in signed LEB128."""
    out = bytearray()
    while not -64 <= n < 64:
        out.append(n & 0x7F | 0x80)
        n >>= 7
    out.append(n & 0x7F)
    return bytes(out)


# ---- instructions with something after them


def i32(n: int) -> bytes:
    return b"\x41" + signed(n)


def f64(x: float) -> bytes:
    return b"\x44" + struct.pack("<d", x)


def _numbered(code: bytes) -> Callable[[int], bytes]:
    """Return an instruction that takes a number: of a local, a global, a function or a block, or an offset in the memory."""
    return lambda number: code + unsigned(number)


get = _numbered(b"\x20")
put = _numbered(b"\x21")
tee = _numbered(b"\x22")
get_global = _numbered(b"\x23")
put_global = _numbered(b"\x24")
call = _numbered(b"\x10")
branch_if = _numbered(b"\x0d")
load_f64 = _numbered(b"\x2b\x03")
store_f64 = _numbered(b"\x39\x03")


def load_u8(offset: int = 0) -> bytes:
    return b"\x2d\x00" + unsigned(offset)


# ---- parts of modules


def vector(items: Sequence[bytes]) -> bytes:
    return unsigned(len(items)) + b"".join(items)


def section(kind: int, body: bytes) -> bytes:
    return bytes((kind,)) + unsigned(len(body)) + body


def function_type(parameters: Iterable[int]) -> bytes:
    """Return the type of a function without results."""
    return b"\x60" + vector([bytes((kind,)) for kind in parameters]) + b"\0"


def function_body(kinds: Sequence[int], code: bytes) -> bytes:
    """Return a body with locals of these types after its parameters; neighbours of one type share an entry."""
    groups: list[list[int]] = []
    for kind in kinds:
        if groups and groups[-1][1] == kind:
            groups[-1][0] += 1
        else:
            groups.append([1, kind])
    body = vector([unsigned(n) + bytes((kind,)) for n, kind in groups]) + code + END
    return unsigned(len(body)) + body


class BinaryReader:
    """Reads numbers and texts from a place in a module on."""

    def __init__(self, data: bytes, at: int = 0) -> None:
        self.data = data
        self.at = at

    def unsigned(self) -> int:
        n = shift = 0
        while True:
            byte = self.take(1)[0]
            n |= (byte & 0x7F) << shift
            shift += 7
            if byte < 0x80:
                return n

    def signed(self) -> int:
        begin = self.at
        n = self.unsigned()
        bits = 7 * (self.at - begin)
        return n - (1 << bits) if n >> (bits - 1) else n

    def take(self, n: int) -> bytes:
        self.at += n
        return self.data[self.at - n : self.at]

    def text(self) -> str:
        return self.take(self.unsigned()).decode()


def sections(module: bytes) -> dict[int, bytes]:
    """Return the bodies of the sections by kind, without custom ones."""
    assert module[:8] == MAGIC
    found: dict[int, bytes] = {}
    reader = BinaryReader(module, 8)
    while reader.at < len(module):
        kind = reader.take(1)[0]
        body = reader.take(reader.unsigned())
        if kind:
            found[kind] = body
    return found


def appended(section_body: bytes, items: Sequence[bytes]) -> bytes:
    """Return a section that is a vector, with further items at its end."""
    reader = BinaryReader(section_body)
    n = reader.unsigned()
    return unsigned(n + len(items)) + section_body[reader.at :] + b"".join(items)

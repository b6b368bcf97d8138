"""A model added to a kernel: one module without imports."""

from __future__ import annotations

import struct
from functools import cached_property

from ...program import Program
from ..alone import standing_alone
from . import binary as b
from .functions import place_functions
from .place import TYPES, MemoryPlace
from .plan import web_plan
from .structs import placed

SLOT = "web_slot"
"""The variable of the kernel that holds the address of the plan."""


class Kernel:
    """A kernel that was built before (``mechc/web/kernel``), and what linking needs to know of it."""

    def __init__(self, module: bytes) -> None:
        self.parts = b.sections(module)
        self.exports: dict[str, tuple[int, int]] = {}
        """Kind and index."""
        reader = b.BinaryReader(self.parts[b.EXPORT])
        for _ in range(reader.unsigned()):
            name = reader.text()
            self.exports[name] = (reader.take(1)[0], reader.unsigned())

    @cached_property
    def functions(self) -> dict[str, int]:
        return {name: index for name, (kind, index) in self.exports.items() if kind == 0}

    def count(self, section: int) -> int:
        return b.BinaryReader(self.parts[section]).unsigned()

    @cached_property
    def pages(self) -> int:
        """Pages of memory to begin with: what lies after them is the model's, and after that what the kernel asks for."""
        reader = b.BinaryReader(self.parts[b.MEMORY])
        reader.take(2)  # one memory, whether it has an upper limit
        return reader.unsigned()

    @cached_property
    def table(self) -> tuple[bytes, int]:
        """The type of the entries of the table of functions, and how many there are."""
        reader = b.BinaryReader(self.parts[b.TABLE])
        reader.take(1)  # one table
        kind, _ = reader.take(1), reader.take(1)
        return kind, reader.unsigned()

    def constant(self, name: str) -> int:
        """Return the number that an exported global begins with."""
        index = self.exports[name][1]
        reader = b.BinaryReader(self.parts[b.GLOBAL])
        for k in range(reader.unsigned()):
            reader.take(3)  # type, whether it changes, i32.const
            value = reader.signed()
            reader.take(1)
            if k == index:
                return value
        raise KeyError(name)


class Linked:
    """The module, and entries of the table of functions by the names of the model's that are in it."""

    def __init__(self, module: bytes, entries: dict[str, int]) -> None:
        self.module = module
        self.entries = entries


def linked(program: Program, kernel: Kernel, experiment: str | None = None, *, every: bool = False) -> Linked:
    """Return a module with a program; what a page draws is in it if the program was made with a scene. ``every``: functions that
    no struct points to are in the table, too."""
    program = standing_alone(program)
    base = kernel.pages * b.PAGE
    kind, entries = kernel.table
    place = MemoryPlace(
        kernel.functions, kernel.exports["__stack_pointer"][1], kernel.count(b.FUNCTION), base, entries
    )
    place_functions(program, place)
    plan = placed(web_plan(program, experiment), place)
    if every:
        for name in place.by_name:
            place.pointer(name)
    data = bytes(place.data)
    parts = dict(kernel.parts)
    types = kernel.count(b.TYPE)
    parts[b.TYPE] = b.appended(parts[b.TYPE], TYPES)
    kinds = [b.unsigned(types + kind) for kind, _ in place.functions]
    parts[b.FUNCTION] = b.appended(parts[b.FUNCTION], kinds)
    parts[b.TABLE] = b"\x01" + kind + b"\x00" + b.unsigned(entries + len(place.listed))
    parts[b.MEMORY] = b"\x01\x00" + b.unsigned(kernel.pages + -(-len(data) // b.PAGE))
    listed = b.vector([b.unsigned(index) for index in place.listed])
    parts[b.ELEMENT] = b.appended(parts[b.ELEMENT], [b"\x00" + b.i32(entries) + b.END + listed])
    parts[b.CODE] = b.appended(parts[b.CODE], [body for _, body in place.functions])
    slot = struct.pack("<i", plan)
    blocks = [(base, data), (kernel.constant(SLOT), slot)]
    segments = [b"\x00" + b.i32(at) + b.END + b.unsigned(len(block)) + block for at, block in blocks]
    parts[b.DATA] = b.appended(parts[b.DATA], segments)
    if b.DATA_COUNT in parts:
        parts[b.DATA_COUNT] = b.unsigned(kernel.count(b.DATA_COUNT) + len(segments))
    # the count of data stands before the code
    order = sorted(parts, key=lambda part: b.ELEMENT + 0.5 if part == b.DATA_COUNT else part)
    module = b.MAGIC + b"".join(b.section(part, parts[part]) for part in order)
    own = {name: place.table + place.listed[k] for name, k in place.by_name.items() if k in place.listed}
    return Linked(module, own)

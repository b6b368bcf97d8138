"""Where the data and functions of a model lie after those of a kernel: all addresses are numbers known here."""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence

from . import binary as b

PARAMETER, PIECE = 1, 2
"""Added to a kind of function: that of parameters rather than of the contract, one body of several."""

TYPES = (
    b.function_type((b.F64, *(b.I32,) * 5)),  # mech_function
    b.function_type((b.I32, b.I32)),  # parameters
    b.function_type((b.F64, *(b.I32,) * 6)),  # a body of several: with the workspace
    b.function_type((b.I32, b.I32, b.I32)),
)
"""By kind of function."""


class MemoryPlace:
    """``base``: where the data begin. ``table``: the first entry of the table of functions that is free."""

    def __init__(
        self, kernel: Mapping[str, int], stack_pointer: int, first_function: int, base: int, table: int
    ) -> None:
        self.kernel = kernel
        self.stack_pointer = stack_pointer
        self.first_function = first_function
        self.base = base
        self.table = table
        self.data = bytearray()
        self.functions: list[tuple[int, bytes]] = []
        """Kind and body."""
        self.by_name: dict[str, int] = {}
        """The functions of the model, by their index in the module."""
        self.listed: dict[int, int] = {}
        """Entries of the table after its own, by the index of the function."""

    def put(self, data: bytes, align: int = 8) -> int:
        """Add data and return their address."""
        self.data += bytes(-len(self.data) % align)
        at = self.base + len(self.data)
        self.data += data
        return at

    def numbers(self, values: Sequence[float]) -> int:
        return self.put(struct.pack(f"<{len(values)}d", *values))

    def function(self, name: str, kind: int, body: bytes) -> int:
        """Add a function and return its index."""
        index = self.first_function + len(self.functions)
        self.functions.append((kind, body))
        self.by_name[name] = index
        return index

    def pointer(self, name: str) -> int:
        """Return a pointer to a function of the model, or of the kernel."""
        index = self.by_name.get(name)
        if index is None:
            index = self.kernel[name]
        return self.table + self.listed.setdefault(index, len(self.listed))

    def call(self, name: str) -> bytes:
        """Return a call of a function of the kernel."""
        return b.call(self.kernel[name])

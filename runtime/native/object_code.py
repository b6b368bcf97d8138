"""How large compiled code is, without what a linker adds."""

from __future__ import annotations

import struct
from pathlib import Path

_MAGIC = b"\x7fELF\x02\x01"
"""64 bits, little endian."""
_ALLOCATED, _EXECUTABLE, _WRITABLE = 2, 4, 1
_OWN = (".text", ".rodata", ".data.rel.ro", ".data")


def code_bytes(library: Path) -> int:
    """Return the bytes of instructions and constants of a shared library.

    Of formats other than 64-bit ELF, which is all that is read here, the size of the file.
    """
    data = library.read_bytes()
    if not data.startswith(_MAGIC):
        return len(data)
    table, size, count, names = *struct.unpack_from("<Q", data, 40), *struct.unpack_from("<HHH", data, 58)
    headers = [struct.unpack_from("<IIQQQQ", data, table + k * size) for k in range(count)]
    strings = headers[names][4]
    total = 0
    for name, _, _, _, _, length in headers:
        start = strings + name
        title = data[start : data.index(b"\0", start)].decode()
        if any(title == own or title.startswith(f"{own}.") for own in _OWN):
            total += length
    return total

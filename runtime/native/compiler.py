"""A C compiler that was found, and what tells it from others."""

from __future__ import annotations

from msgspec import Struct

NATIVE = "-march=native"


class Compiler(Struct, frozen=True):
    """A C compiler that answers: its command line and what it says of its version."""

    command: tuple[str, ...]
    version: str

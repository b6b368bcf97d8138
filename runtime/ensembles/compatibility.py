"""What decides whether a process elsewhere can make members of an ensemble, and whether it makes the same bits."""

from __future__ import annotations

import functools
import hashlib
import platform
import sys
from pathlib import Path

from msgspec import Struct

from ..native.build import find_compiler
from ..native.compiler import Compiler, processor

PACKAGES = ("mechc", "lang", "compiler", "runtime", "stdlib")
DECIDING = (".py", ".c", ".h", ".mech", ".lark")


class Facts(Struct, frozen=True):
    """``code``: a digest of mechc's own files; ``machine``: system, architecture and C library; ``processor``: a digest of
    what it is and can do."""

    code: str
    python: str
    machine: str
    processor: str
    compiler: Compiler | None

    def refused_by(self, sender: Facts) -> str:
        """Say why work of the sender is not understood here; empty where it is."""
        if self.python != sender.python:
            return f"it runs Python {self.python}, and the sender {sender.python}"
        return "" if self.code == sender.code else "it has another version of mechc"

    def runs_code_of(self, sender: Facts) -> bool:
        """Whether code compiled for the sender runs here."""
        return (self.machine, self.processor) == (sender.machine, sender.processor)

    def same_bits_as(self, sender: Facts) -> bool:
        """Whether both compile a text to the same instructions."""
        return self.runs_code_of(sender) and (self.lacks_compiler or self.compiler == sender.compiler)

    @property
    def lacks_compiler(self) -> bool:
        """Whether it has none of its machine, and takes code that the sender compiled."""
        return self.compiler is None or self.compiler.in_process


def own_facts() -> Facts:
    """Give those of this process. Raises CompilerMissing where ``CC`` names none that answers."""
    return _facts(find_compiler())


@functools.cache
def _facts(compiler: Compiler | None) -> Facts:
    version = f"{sys.version_info.major}.{sys.version_info.minor}"
    machine = " ".join((sys.platform, platform.machine(), *platform.libc_ver()))
    return Facts(
        _own_code(), version, machine.strip(), hashlib.sha256(processor().encode()).hexdigest()[:16], compiler
    )


@functools.cache
def _own_code() -> str:
    home = Path(__file__).resolve().parents[2]
    found = hashlib.sha256()
    for package in PACKAGES:
        folder = home / package
        if not folder.is_dir():  # installed, the others lie in mechc
            continue
        for file in sorted(folder.rglob("*")):
            if file.suffix in DECIDING and file.is_file():
                found.update(file.relative_to(folder).as_posix().encode() + file.read_bytes())
    return found.hexdigest()[:16]

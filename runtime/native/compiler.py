"""A C compiler that was found, what tells it from others, and the key of its code in the cache."""

from __future__ import annotations

import functools
import os
import platform
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from msgspec import Struct

from .checksum import checksum

NATIVE = "-march=native"
NAMES = ("cc", "gcc", "clang")
"""Compilers that are looked for, in this order."""

LIBTCC = ("libtcc",)
"""The command of the one that comes with mechc (``libtcc.py``); ``CC=libtcc`` chooses it."""


class Compiler(Struct, frozen=True):
    """A C compiler that answers: its command line and what it says of its version."""

    command: tuple[str, ...]
    version: str

    @property
    def in_process(self) -> bool:
        """Whether it is the library that comes with mechc."""
        return self.command == LIBTCC


def compiler_by_its_file() -> Compiler | None:
    """Tell the compiler by its file, without asking it: enough to find what it has made. None where no file is found."""
    chosen, path = os.environ.get("CC", ""), os.environ.get("PATH", "")
    for words in [chosen.split()] if chosen else [[name] for name in NAMES]:
        files = [_lying(word, path) for word in words]
        if files and files[0]:  # further ones where one compiler calls another
            states = [(file, os.stat(file).st_size, os.stat(file).st_mtime_ns) for file in files if file]
            return Compiler(tuple(words), repr(states))
    return None


def _lying(command: str, path: str) -> str:
    """Give the file of a command, empty where there is none."""
    folders = [""] if os.path.dirname(command) else path.split(os.pathsep)
    files = (os.path.join(folder, command) for folder in folders)
    return next((file for file in files if os.path.isfile(file) and os.access(file, os.X_OK)), "")


def cache_key(sources: Mapping[str, str], flags: Sequence[str], key: str, compiler: Compiler) -> str:
    """Return what tells an entry of the cache from all others: sources, flags, compiler, machine, and ``key``."""
    digest = checksum()
    parts = [key, *compiler.command, compiler.version, platform.machine(), sys.platform, *flags]
    if NATIVE in flags:
        parts.append(processor())
    for file in sorted(sources):
        parts += [file, sources[file]]
    for part in parts:
        text = part.encode()
        digest.update(b"%d:" % len(text) + text)
    return digest.hexdigest()[:32]


@functools.cache
def processor() -> str:
    """What tells this processor from others, as far as generated instructions go."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return platform.processor()
    wanted = ("model name", "flags", "Features", "CPU implementer", "CPU part", "isa")
    return "\n".join(dict.fromkeys(line for line in lines if line.startswith(wanted)))

"""The key of compiled code in the cache: all that the code depends on."""

from __future__ import annotations

import functools
import platform
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from .checksum import checksum
from .compiler import NATIVE, Compiler


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

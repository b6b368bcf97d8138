"""C programs that models are written as, compiled; files of the kernel are the same in many: each is compiled once."""

from __future__ import annotations

import hashlib
import re
import subprocess
from pathlib import Path

from mechc.runtime.native.build import find_compiler

BITS = ("-O0", "-ffp-contract=off", "-frounding-math")
"""One rounding for each operation, as a reproducible run has."""


def build(folder: Path, objects: Path) -> Path:
    """Compile the program that was written into a folder; ``objects`` holds what was compiled before."""
    compiler = find_compiler()
    assert compiler is not None
    linked = []
    for source in sorted(folder.glob("*.c")):
        digest = hashlib.sha256("\0".join(read(source, {}).values()).encode()).hexdigest()
        linked.append(objects / f"{digest}.o")
        if not linked[-1].exists():
            flags = [
                "-std=c11",
                "-Wall",
                "-Wextra",
                "-Werror",
                *BITS,
                "-c",
                source.name,
                "-o",
                str(linked[-1]),
            ]
            subprocess.run([*compiler.command, *flags], cwd=folder, check=True)
    program = folder / "program"
    subprocess.run([*compiler.command, "-o", program, *linked, "-lm"], check=True)
    return program


def read(file: Path, known: dict[str, str]) -> dict[str, str]:
    """Return what the compiler reads of a file: its text, and that of all it includes, by name."""
    known[file.name] = text = file.read_text(encoding="utf-8")
    for name in re.findall(r'^#include "([^"]+)"', text, re.M):
        if name not in known:
            read(file.with_name(name), known)
    return known

"""Build the kernels of pages by zig's C compiler: ``make kernel``, after a change of what they consist of.

They stand in the repository, so that a page needs no compiler. ``kernels.sums`` says what each was built from: a test compares
that with the sources, and CI builds them again, which gives the same bytes on every machine.
"""

from __future__ import annotations

import hashlib
import importlib.util
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path

from mechc.compiler.graph.operations import OPERATIONS
from mechc.compiler.targets import c_tables
from mechc.compiler.targets.c_forms import CALLED, OWN
from mechc.compiler.targets.wasm.link import SLOT
from mechc.compiler.targets.wasm.operations import LIBRARY, OF_KERNEL
from mechc.runtime.native.kernel import kernel_sources
from mechc.runtime.native.selection import fitted, needed

from .kernels import FOLDER, KERNELS, WebKernel

ZIG = "0.17.1"
"""The version of ziglang that builds the kernels; others give other bytes."""

FLAGS = (
    *("-target", "wasm32-wasi", "-std=c11", "-Os", "-ffunction-sections", "-fdata-sections", "-g0"),
    *("-ffp-contract=off", "-fno-math-errno"),
)
LINK = (
    *("-mexec-model=reactor", "-Wl,--gc-sections", "-Wl,--strip-all", "-Wl,-z,stack-size=1048576"),
    *("-Wl,--export-table", "-Wl,--growable-table", "-Wl,--export=__stack_pointer", f"-Wl,--export={SLOT}"),
    *(f"-Wl,--export={name}" for name in LIBRARY),
    "-lm",
)
SUMS = FOLDER / "kernels.sums"


def sources(kernel: WebKernel) -> Mapping[str, str]:
    """Return the C files of a kernel by name."""
    files = ["web.c", "web_plan.h"]
    if kernel.events:
        files += ["web_crowd.c", "web_shares.c"]
    own = {name: (FOLDER / name).read_text(encoding="utf-8") for name in files}
    own["operations.c"] = _operations()
    own["web_kind.h"] = f"enum {{ WEB_EVENTS = {int(kernel.events)} }};\n"
    chosen = fitted(kernel_sources(), methods=kernel.methods, states=0, switches=kernel.events)
    of_kernel = needed(chosen, own.values())
    of_kernel.pop("clock.c", None)  # the page has its own
    return {**of_kernel, **own}


def _operations() -> str:
    """Return the functions of operations that the C library does not have, offered to models."""
    tables = c_tables.FUNCTIONS
    lines = [
        "#include <math.h>",
        '#include "web_plan.h"',
        "#define NOINLINE __attribute__((noinline))",
        *OWN.values(),
        *tables.values(),
    ]
    kinds = {CALLED[code]: ["double"] * OPERATIONS[code].arity for code in OWN}
    kinds |= {name: ["const double *", "int", "double"] for name in tables}
    kinds["lookup"] = ["const double (*)[3]", "int", "int", "double"]
    for name, given in kinds.items():
        declared = [
            kind.replace("(*)", f"(*x{k})") if "(*)" in kind else f"{kind} x{k}"
            for k, kind in enumerate(given)
        ]
        passed = ", ".join(f"x{k}" for k in range(len(given)))
        lines.append(
            f"double EXPORT({OF_KERNEL}{name})({', '.join(declared)}) {{ return {name}({passed}); }}"
        )
    return "\n".join(lines) + "\n"


def digest(kernel: WebKernel) -> str:
    """Return what tells apart all that a kernel is built from: sources, flags, compiler."""
    files = sources(kernel)
    parts = [ZIG, *FLAGS, *LINK, *(part for name in sorted(files) for part in (name, files[name]))]
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()


def sums_text() -> str:
    """Return what ``kernels.sums`` holds when it is up to date."""
    lines = [
        f"# Written by `make kernel`, with ziglang {ZIG}: kernel, sha256 of what it is built from, of its bytes."
    ]
    for kernel in KERNELS:
        built = hashlib.sha256(kernel.file.read_bytes()).hexdigest() if kernel.file.exists() else "-"
        lines.append(f"{kernel.name} {digest(kernel)} {built}")
    return "\n".join(lines) + "\n"


def build(kernel: WebKernel) -> bytes:
    """Return the bytes of a kernel. Raises CalledProcessError."""
    files = sources(kernel)
    with tempfile.TemporaryDirectory() as folder:
        for name, text in files.items():
            Path(folder, name).write_text(text, encoding="utf-8", newline="\n")
        texts = sorted(name for name in files if name.endswith(".c"))
        command = [sys.executable, "-m", "ziglang", "cc", *FLAGS, *texts, "-o", "kernel.wasm", *LINK]
        subprocess.run(command, cwd=folder, check=True)
        return Path(folder, "kernel.wasm").read_bytes()


def main() -> int:
    """Build the kernels whose sources have changed, all of them with ``--all``."""
    found = version("ziglang") if importlib.util.find_spec("ziglang") else "none"
    if found.split(".post")[0] != ZIG:
        print(
            f"the kernels of pages are built by ziglang {ZIG}, and here is {found}: pip install ziglang=={ZIG}"
        )
        return 1
    known = SUMS.read_text(encoding="utf-8").split() if SUMS.exists() else []
    for kernel in KERNELS:
        if "--all" in sys.argv or not kernel.file.exists() or digest(kernel) not in known:
            kernel.file.write_bytes(build(kernel))
            print(f"built {kernel.file} ({kernel.file.stat().st_size} bytes)")
    SUMS.write_text(sums_text(), encoding="utf-8", newline="\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())

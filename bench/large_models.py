"""Very large models: from the text to the library, each in a process of its own, with the memory that it takes."""

from __future__ import annotations

import resource
import subprocess
import sys

from .forming import STAGES, compile_seconds, formed
from .large import BODIES
from .machine import table, write
from .systems import BARS, System

CASES = (("bars on hinges", BARS, 1000), ("bars on hinges", BARS, 10_000), ("bodies in pairs", BODIES, 200))


def measure(name: str, n: int) -> list[str]:
    """Return a row of the table; imports are not part of the times."""
    system = System(name, next(text for known, text, _ in CASES if known == name))
    formed(system, 5)
    seconds, operations, text, loops = formed(system, n)
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
    compiled = compile_seconds(text, loops)
    cells = [name, str(n), str(operations), *(f"{s:.2f}" for s in seconds), f"{compiled:.2f}"]
    return [*cells, f"{sum(seconds) + compiled:.2f}", f"{memory}"]


def main(quick: bool = False) -> None:
    rows = []
    for name, _, n in CASES:
        if not quick or n <= 1000:
            code = f"from bench.whole import measure; print('|'.join(measure({name!r}, {n})))"
            done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
            rows.append(done.stdout.strip().split("|"))
    words = (
        "Processor seconds of each stage, and of the C compiler for the whole model (accelerations, energies, outputs, starts); "
        "operations of all accelerations; the most memory that the stages took, in MiB. Each row is a process of its own."
    )
    head = ["model", "n", "operations", *STAGES, "C compiler", "sum, s", "memory, MiB"]
    write("whole", "From text to library", [words, table(head, rows)])


if __name__ == "__main__":
    main()

"""Forming: CPU time of each stage and operations per freedom, over the size of the mechanism."""

from __future__ import annotations

import gc
import math
import tempfile
import time
from fractions import Fraction
from itertools import pairwise
from pathlib import Path

from mechc.compiler.equations.assemble import assemble
from mechc.compiler.flat.flatten import flatten
from mechc.compiler.interpreter import compiling
from mechc.compiler.mechanics.build import build
from mechc.compiler.problem import header
from mechc.compiler.program.lower import lower
from mechc.compiler.targets.c import emit_c
from mechc.lang.diagnostics import Reporter
from mechc.lang.parser import parse
from mechc.lang.source import SourceFile
from mechc.runtime.native.build import find_compiler, model_flags

from .machine import table, write
from .systems import SYSTEMS, System

STAGES = ("parse", "flat", "mechanics", "equations", "program", "C text")


def formed(system: System, n: int) -> tuple[list[float], int, str, bool]:
    """Return the CPU seconds of each stage, the operations of all accelerations, and the C text, with loops or not."""
    source = SourceFile(f"{system.name}.mech", system.text)
    reporter = Reporter()
    gc.collect()
    clock = [time.process_time()]

    def tick() -> None:
        clock.append(time.process_time())

    with compiling():  # like the pipeline
        tree = parse(source, reporter)
        tick()
        flat = flatten(tree, reporter, structural={"n": Fraction(n)}, search=())
        tick()
        mechanics = build(flat, reporter)
        tick()
        equations = assemble(mechanics, reporter)
        tick()
        program = lower(equations)
        tick()
        text = emit_c(program)
        tick()
    rhs = next(f for f in equations.functions if f.name == "rhs")
    operations = equations.graph.count_operations(rhs.outputs)
    return [b - a for a, b in pairwise(clock)], operations, text, program.long


def compile_seconds(text: str, loops: bool) -> float:
    """CPU seconds of the C compiler for one model file."""
    import resource
    import subprocess

    compiler = find_compiler()
    assert compiler is not None, "forming is measured with a C compiler"
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "model.c").write_text(text)
        Path(folder, "model.h").write_text(header())
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        command = (
            *compiler.command,
            *model_flags(loops=loops),
            "-shared",
            "model.c",
            "-o",
            "model.so",
            "-lm",
        )
        subprocess.run(command, cwd=folder, check=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def measure(system: System, quick: bool) -> list[list[str]]:
    sizes = [n for n in (10, 20, 30, 50, 100, 200, 400) if n <= system.largest and (n <= 100 or not quick)]
    formed(system, 2)  # imports, parser tables and caches are not part of a size
    rows: list[list[str]] = []
    last: tuple[int, float] | None = None
    for n in sizes:
        seconds, operations, text, loops = min(
            (formed(system, n) for _ in range(3 if n <= 100 else 1)), key=lambda f: sum(f[0])
        )
        total = sum(seconds)
        growth = f"{math.log(total / last[1]) / math.log(n / last[0]):.2f}" if last else ""
        last = (n, total)
        rows.append(
            [
                str(n),
                f"{operations}",
                f"{operations / system.freedom_count(n):.1f}",
                *(f"{s:.3f}" for s in seconds),
                f"{total:.3f}",
                growth,
                f"{compile_seconds(text, loops):.2f}" if n <= 100 else "",
            ]
        )
    return rows


def main(quick: bool = False) -> None:
    head = ["n", "operations", "per freedom", *STAGES, "total, s", "exponent", "C compiler, s"]
    parts = [
        "CPU seconds from the text to the C text (best of three to n = 100), operations of `rhs` (all "
        "accelerations, sines and cosines counted apart), and CPU seconds of the C compiler for the whole model: "
        "accelerations, Jacobian, energies, outputs. The exponent is that of the growth since the row above."
    ]
    for system in SYSTEMS:
        goal = ""
        if math.isfinite(system.bound):
            goal = f" (goal: at most {system.bound:g} operations per freedom at n = {system.bound_size})"
        parts.append(f"## {system.name}{goal}\n\n{table(head, measure(system, quick))}")
    write("forming", "Forming and compiling over size", parts)


if __name__ == "__main__":
    main()

"""Closed loops over their size: forming time, operations and evaluation time, and the exponents of their growth."""

from __future__ import annotations

import math
from fractions import Fraction

from mechc.compiler.pipeline import compile_source
from mechc.compiler.program.lower import hoistable
from mechc.lang.source import SourceFile

from .evaluation import nanoseconds
from .forming import formed
from .loops import LOOPS, Loops
from .machine import table, write
from .systems import System


def operations(text: str, n: int) -> int:
    """Operations of one evaluation of all accelerations; those on parameters alone are made once for a run."""
    equations = compile_source(SourceFile("loops.mech", text), structural={"n": Fraction(n)}).equations
    rhs = next(f for f in equations.functions if f.name == "rhs")
    graph = equations.graph
    once = hoistable(graph, equations.layout, rhs.outputs)
    return graph.count_operations(rhs.outputs) - graph.count_operations(once)


def _exponent(sizes: tuple[int, int], values: tuple[float, float]) -> str:
    return f"{math.log(values[1] / values[0]) / math.log(sizes[1] / sizes[0]):.2f}"


def measure(loops: Loops, quick: bool) -> list[list[str]]:
    system = System(loops.name, loops.text)
    formed(system, loops.sizes[0])  # imports, parser tables and caches are not part of a size
    rows: list[list[str]] = []
    last: tuple[int, float, int, float] | None = None
    for n in loops.sizes[:2] if quick else loops.sizes:
        seconds = min(sum(formed(system, n)[0]) for _ in range(1 if quick else 3))
        count, time = operations(loops.text, n), nanoseconds(loops.text, n)
        growth = ["", "", ""]
        if last is not None:
            pairs = zip(last[1:], (seconds, count, time), strict=True)
            growth = [_exponent((last[0], n), (old, new)) for old, new in pairs]
        last = (n, seconds, count, time)
        cells = [f"{count}", f"{count / n:.0f}", growth[1], f"{seconds:.3f}", growth[0]]
        rows.append([str(n), *cells, f"{time:.0f}", f"{time / n:.0f}", growth[2]])
    return rows


def main(quick: bool = False) -> None:
    parts = [
        "CPU seconds from the text to the C text, with everything: assembly, projections, rank (best of three). "
        "Operations of one evaluation of all accelerations, sines and cosines counted apart, what depends on "
        "parameters alone not counted. Nanoseconds of one evaluation at random states, best of many batches. The "
        "exponents are those of the growth since the row above: 1 is linear. Goals: 118 operations for each bar of a "
        "closed chain, 400 for each cell of a ladder, 630 for each joint of a closed spatial chain, at any size."
    ]
    for loops in LOOPS:
        of = f"per {loops.unit}"
        head = ["n", "operations", of, "exponent", "forming, s", "exponent", "evaluation, ns", of, "exponent"]
        title = f"## {loops.name} (goal: {loops.bound:g} operations {of})"
        parts.append(f"{title}\n\n{table(head, measure(loops, quick))}")
    write("constraints", "Closed loops over their size", parts)


if __name__ == "__main__":
    main()

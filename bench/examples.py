"""Error against run time of every example: a diagram each, and the fastest method for each accuracy."""

from __future__ import annotations

import mechc
from mechc.measurement.benchmark import Benchmark, benchmark
from mechc.measurement.benchmark_report import draw_small
from mechc.runtime.reference.work_precision import time_to_reach

from .machine import REPORT, table, write
from .references import FAILURES, SECONDS, example_references, examples

LEVELS = (1e-3, 1e-6, 1e-9, 1e-12)
METHODS = ("dop853", "radau5", "rk4", "verlet")
TOLERANCES = (1e-3, 1e-5, 1e-7, 1e-9, 1e-11, 1e-13)
LONGEST = 0.5
"""Seconds after which a run is given up, and with it the rest of its ladder."""
FOLDER = "examples"


def fastest(made: Benchmark, error: float) -> str:
    """Say which method reaches an error first, and how long it takes."""
    found = [
        (seconds, method)
        for method, points in made.by_method().items()
        if (seconds := time_to_reach(points, error)) is not None
    ]
    if not found:
        return "-"
    seconds, method = min(found)
    return f"{method} {seconds * 1e3:.2g} ms"


def main(quick: bool = False) -> None:
    (REPORT / FOLDER).mkdir(parents=True, exist_ok=True)
    rows: list[list[str]] = []
    left_out: list[str] = []
    wins: dict[str, list[int]] = {method: [0] * len(LEVELS) for method in METHODS}
    paths = examples(quick, every=16)
    unknown = example_references(paths)
    left_out += [f"- `{name}`: {why}" for name, why in unknown.items()]
    for path in paths:
        if path.stem in unknown:
            continue
        try:
            made = benchmark(
                mechc.load(path).for_experiment(None),
                methods=METHODS,
                tolerances=TOLERANCES,
                seconds=SECONDS,
                longest=LONGEST,
            )
        except FAILURES as error:
            left_out.append(f"- `{path.stem}`: {str(error).splitlines()[0]}")
            continue
        draw_small(made, REPORT / FOLDER / f"{path.stem}.png")
        best = [fastest(made, error) for error in LEVELS]
        for k, text in enumerate(best):
            if text != "-":
                wins[text.split()[0]][k] += 1
        errors = [p.error for p in made.points if p.error is not None]
        smallest = f"{min(errors):.0e}" if errors else "-"
        picture = f"![{path.stem}]({FOLDER}/{path.stem}.png)"
        rows.append([f"`{path.stem}`", f"{made.digits}", *best, smallest, picture])
        print(*rows[-1][:-1], flush=True)
    levels = [f"{e:g}" for e in LEVELS]
    text = (
        f"{len(rows)} examples with their default experiment, by {', '.join(METHODS)} over ladders of tolerances or "
        "steps. The table names the fastest method that reaches an error and its run time; the reference is a run in "
        "higher precision, of which so many digits can be trusted. Errors are the largest ones over 41 output times "
        "and all states, relative to nominal + |value|. A run of more than "
        f"{LONGEST:g} s is given up, and with it the rest of its ladder. `mechc bench MODEL` gives the numbers after a "
        "diagram."
    )
    overview = [[method, *map(str, counts)] for method, counts in wins.items()]
    parts = [
        text,
        "How often each method is the fastest:\n\n" + table(["method", *levels], overview),
        table(["example", "digits", *levels, "smallest error", "error over run time"], rows),
    ]
    if left_out:
        parts.append("Not measured:\n\n" + "\n".join(left_out))
    write("examples", "Error against run time of every example", parts)


if __name__ == "__main__":
    main()

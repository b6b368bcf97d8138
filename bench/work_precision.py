"""Error against run time over the examples: a diagram each, and the ratio to the best scipy method."""

from __future__ import annotations

from pathlib import Path

import mechc
from mechc.benchmark import Benchmark, benchmark
from mechc.benchmark_report import draw
from mechc.runtime.outcome import SimulationError
from mechc.runtime.reference import ReferenceFailed
from mechc.runtime.work_precision import time_to_reach

from .machine import REPORT, table, write
from .systems import BARS

EXAMPLES = Path(__file__).parent.parent / "examples"
MODELS = (
    "double_pendulum",
    "kepler",
    "lagrange_top",
    "four_bar",
    "squeezing_mechanism",
    "pleiades",
    "van_der_pol",
    "elastic_pendulum",
)
CHAIN = 50
LEVELS = (1e-3, 1e-6, 1e-9, 1e-12)
TOLERANCES = tuple(10.0**-k for k in (3, 5, 6, 7, 9, 10, 11, 12, 13))


def best_other(made: Benchmark, error: float) -> float | None:
    """Seconds of the fastest scipy method at an error."""
    times = [
        time_to_reach(points, error)
        for method, points in made.by_method().items()
        if method.startswith("scipy:")
    ]
    return min((t for t in times if t is not None), default=None)


def ours(made: Benchmark, error: float) -> tuple[float, str] | None:
    """Seconds and name of the fastest method of the kernel at an error."""
    found = [
        (seconds, method)
        for method, points in made.by_method().items()
        if not method.startswith("scipy:") and (seconds := time_to_reach(points, error)) is not None
    ]
    return min(found, default=None)


def row(made: Benchmark) -> list[str]:
    cells = [made.model, f"{made.reference.doubt.max():.0e}"]
    for error in LEVELS:
        mine, other = ours(made, error), best_other(made, error)
        if mine is None:
            cells.append("-")
            continue
        ratio = f", {other / mine[0]:.0f} x" if other is not None else ""
        cells.append(f"{mine[1]} {mine[0] * 1e3:.3g} ms{ratio}")
    errors = [p.error for p in made.points if p.error is not None and not p.method.startswith("scipy:")]
    return [*cells, f"{min(errors):.0e}"]


def main(quick: bool = False) -> None:
    rows, notes, pictures = [], [], []
    REPORT.mkdir(exist_ok=True)
    models = [(name, None) for name in MODELS]
    for name, text in [*models, (f"chain of {CHAIN}", BARS)]:
        if text is None:
            model = mechc.load(EXAMPLES / f"{name}.mech")
        else:
            model = mechc.loads(text).with_values({"n": CHAIN})
        stop = 1.0 if text is not None else None
        try:
            made = benchmark(
                model,
                against=("scipy",),
                tolerances=TOLERANCES[::2] if quick else TOLERANCES,
                seconds=5 if quick else 40,
                stop=stop,
            )
        except (ReferenceFailed, SimulationError) as error:
            notes.append(f"`{name}` could not be measured: {error}.")
            continue
        picture = f"work_precision_{name.replace(' ', '_')}.svg"
        draw(made, REPORT / picture)
        pictures.append(f"![{name}]({picture})")
        rows.append([f"`{name}`", *row(made)[1:]])
        print(name, rows[-1], flush=True)
    levels = [f"{e:g}" for e in LEVELS]
    head = ["model", "reference known to", *levels, "smallest error"]
    text = (
        "For each model and error: the fastest method of the kernel, its run time, and how many times longer the "
        "best of scipy's DOP853, LSODA, Radau and BDF takes to the same error on the same compiled functions in the "
        "same process. The error is the largest one over 41 output times and all states, relative to nominal + "
        "|value|, against a run in `__float128`; times between two runs are interpolated in the logarithms. "
        "`mechc bench MODEL --against scipy` gives the tables behind it."
    )
    write("work_precision", "Error against run time", [text, table(head, rows), *notes, *pictures])


if __name__ == "__main__":
    main()

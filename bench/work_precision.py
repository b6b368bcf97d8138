"""Error against run time of eight systems: the kernel against the best of scipy's methods on the same functions, and against
CVODE, LSODA of numbalsoda and heyoka where they are installed."""

from __future__ import annotations

from contextlib import suppress
from functools import partial
from itertools import pairwise
from pathlib import Path

from msgspec import Struct

import mechc
from mechc.measurement.benchmark import Benchmark, benchmark
from mechc.measurement.benchmark_report import draw
from mechc.measurement.peers import LIBRARIES, absent
from mechc.runtime.outcome import SimulationError
from mechc.runtime.reference.high_precision import ReferenceFailed
from mechc.runtime.reference.work_precision import time_to_reach

from .machine import REPORT, table, write
from .references import FAILURES, in_parallel
from .systems import BENT_BARS, STIFF_SPRING

EXAMPLES = Path(__file__).parent.parent / "examples"
CHAIN = 50
LEVELS = (1e-6, 1e-9)
TOLERANCES = tuple(10.0**-k for k in (3, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14))
METHODS = ("dop853", "radau5")
ACCURATE = 1e-11
ENOUGH = 3e-10
"""Error at which the ladder of a scipy method ends: past the last level."""
SECONDS = 20.0
"""CPU seconds that a reference may take."""
LONGEST = 2.0
"""Seconds after which a run is given up, and with it the rest of its ladder."""


class System(Struct, frozen=True):
    """``goal``: how many times longer scipy should take. ``text``: of a model that is not an example."""

    name: str
    goal: float
    text: str = ""
    experiment: str | None = None
    stop: float | None = None
    size: int = 0

    def model(self) -> mechc.Model:
        if not self.text:
            return mechc.load(EXAMPLES / f"{self.name}.mech").for_experiment(self.experiment)
        model = mechc.loads(self.text)
        return model.with_values({"n": self.size}) if self.size else model


SYSTEMS = (
    System("double_pendulum", 50),
    System("kepler", 50),
    System("heavy_symmetric_top", 50),
    System("four_bar", 50),
    System("bouncing_ball", 50, experiment="by_hand"),
    System("stiff_spring", 50, STIFF_SPRING),
    System("squeezing_mechanism", 10),
    System(f"chain_of_{CHAIN}", 3, BENT_BARS, stop=1.0, size=CHAIN),
)


def group(method: str) -> str:
    """Return whose a method is: the kernel's, scipy's, or that of a compiled peer (beside.py)."""
    whose, apart, _ = method.partition(":")
    return {"": "kernel", "scipy": "scipy"}.get(whose if apart else "", "peers")


def best(made: Benchmark, error: float, of: str) -> tuple[float, str] | None:
    """Return seconds and name of the fastest method of a group that reaches an error."""
    found = [
        (seconds, method)
        for method, points in made.by_method().items()
        if group(method) == of and (seconds := time_to_reach(points, error)) is not None
    ]
    return min(found, default=None)


def row(system: System, made: Benchmark) -> list[str]:
    until = f"{made.horizon:.3g}" + (f" of {made.stop:.3g}" if made.horizon < made.stop else "")
    cells = [f"`{system.name}`", until, str(made.digits)]
    for error in LEVELS:
        mine = best(made, error, "kernel")
        cells.append(_told(mine))
        for of in ("scipy", "peers"):
            other = best(made, error, of)
            cells.append(_told(other))
            cells.append(f"**{other[0] / mine[0]:.2g}**" if mine and other else "-")
    errors = [p.error for p in made.points if p.error is not None and group(p.method) == "kernel"]
    return [*cells, f"{system.goal:g}", f"{min(errors):.0e}"]


def _told(found: tuple[float, str] | None) -> str:
    return f"{found[0] * 1e3:.3g} ms, {found[1].removeprefix('scipy:')}" if found else "-"


def falls(made: Benchmark, method: str) -> bool:
    """Tell whether the error of a method falls from each hundredth of the tolerance to the next, down to rounding."""
    errors = [p.error for p in made.by_method().get(method, []) if p.error is not None]
    coarse = errors[::2]
    return all(b < a or a < ACCURATE for a, b in pairwise(coarse))


def given_up(system: System, made: Benchmark) -> list[str]:
    """Say which ladders ended early, and where."""
    ends = [(p.method, p.setting, p.failure) for p in made.points if p.given_up]
    return [f"`{system.name}`, {method} at {setting:g}: {why}." for method, setting, why in ends]


def measured(system: System, quick: bool, *, timed: bool = True) -> Benchmark:
    """Measure one system, or only put its reference into the cache."""
    model = system.model()
    return benchmark(
        model,
        methods=METHODS,
        against=[name for name in LIBRARIES if name not in absent()] if timed else (),
        tolerances=(TOLERANCES[::3] if quick else TOLERANCES) if timed else (),
        seconds=5 if quick else SECONDS,
        experiment=system.experiment,
        stop=system.stop,
        longest=LONGEST,
        enough=ENOUGH,
    )


def reference_of(system: System, quick: bool) -> None:
    with suppress(*FAILURES):  # told where it is measured
        measured(system, quick, timed=False)


def _absent() -> str:
    missing = absent()
    return f"Not installed, and so not measured: {', '.join(missing)}. " if missing else ""


def main(quick: bool = False) -> None:
    rows, notes, pictures = [], [], []
    REPORT.mkdir(exist_ok=True)
    list(in_parallel(partial(reference_of, quick=quick), SYSTEMS))
    for system in SYSTEMS:
        try:
            made = measured(system, quick)
        except (ReferenceFailed, SimulationError) as error:
            notes.append(f"`{system.name}` could not be measured: {error}.")
            continue
        picture = f"work_precision_{system.name}.svg"
        draw(made, REPORT / picture)
        pictures.append(f"![{system.name}]({picture})")
        rows.append(row(system, made))
        if not any(falls(made, method) for method in METHODS):
            notes.append(f"`{system.name}`: the error does not fall with the tolerance all the way.")
        notes += [f"`{system.name}`, {name}: {why}." for name, why in made.skipped] + given_up(system, made)
        print(*rows[-1], flush=True)
    head = ["model", "measured to", "digits of the reference"]
    for level in LEVELS:
        head += [f"kernel at {level:g}", f"best of scipy at {level:g}", "ratio"]
        head += [f"best of the compiled peers at {level:g}", "ratio"]
    text = (
        "For each model and error: the fastest method of the kernel, and the fastest of scipy's DOP853, RK45, LSODA, "
        "Radau and BDF on the same compiled functions in the same process, each called through ctypes into an array "
        "made before. The compiled peers have no Python in their runs: CVODE (as FMPy ships it; Adams with fixed-point "
        "iterations, BDF with the model's Jacobian and dense LU) and numbalsoda's LSODA call the compiled functions, heyoka "
        "compiles its own code from the same formulas; what they need to begin is not counted. "
        f"{_absent()}Constrained models have the index-1 form for scipy, which has no other; the kernel projects as "
        "well. The ball bounces by `when`, for scipy by its own events. The error is the largest one over 41 output "
        "times and all states, relative to nominal + |value|, against a run in higher precision; runs are timed "
        "without output, medians of repeats (CPU time, the kernel's the smaller one of that and the clock's; runs "
        "of more than a second once, with their output); times between two runs are interpolated in the logarithms. A "
        f"run of more than {LONGEST:g} s is given up, and with it the rest of its ladder; ladders of others end at an "
        f"error of {ENOUGH:g}. Goals: ratios of 50, 10 and 3, and errors down to {ACCURATE:g}. `mechc bench MODEL "
        "--against scipy` gives the tables."
    )
    parts = [
        text,
        table([*head, "goal", "smallest error"], rows),
        "\n".join(f"- {note}" for note in notes),
        *pictures,
    ]
    write("work_precision", "Error against run time", parts)


if __name__ == "__main__":
    main()

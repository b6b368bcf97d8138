"""Is the estimated error right? Over all examples, methods and tolerances: the estimate of a run over its true error."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from msgspec import Struct

import mechc
from mechc.measurement.benchmark import benchmark
from mechc.runtime.outcome import Outcome, SimulationError
from mechc.runtime.reference.high_precision import PrecisionReference

from .machine import table, write
from .references import FAILURES, SECONDS, examples, in_parallel

TOLERANCES = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
ADAPTIVE = ("dop853", "radau5")
FIXED = ("rk4", "gauss4", "verlet", "rattle")
STEPS = (300, 3000)
ROUNDING = 1e3 * float(np.finfo(float).eps)
LARGEST = 0.1
"""True errors above say no more than that the run is wrong: a chaotic motion, or a step that is far too long."""


class Case(Struct, frozen=True):
    """One run at a tolerance, or with a number of steps. ``counted``: its true error is above the rounding floor."""

    model: str
    method: str
    setting: float
    estimate: float
    error: float

    @property
    def counted(self) -> bool:
        return ROUNDING < self.error < LARGEST

    @property
    def ratio(self) -> float:
        return self.estimate / self.error


def cases(path: Path) -> list[Case] | str:
    """Run one example by every method that fits it, to its end or its horizon; else say why it cannot be judged."""
    try:
        return _cases(path)
    except FAILURES as error:
        return str(error).splitlines()[0]


def _cases(path: Path) -> list[Case]:
    model = mechc.load(path).for_experiment(None)
    made = benchmark(model, methods=("dop853",), tolerances=(), seconds=SECONDS)
    truth = made.reference
    found: list[Case] = []
    for method in ADAPTIVE:
        found += _runs(model, path.stem, method, TOLERANCES, truth, made.horizon)
    for method in FIXED:
        try:
            found += _runs(model, path.stem, method, STEPS, truth, made.horizon)
        except SimulationError:
            continue  # the method is for other models
    return found


def _runs(
    model: mechc.Model,
    name: str,
    method: str,
    settings: Sequence[float],
    truth: PrecisionReference,
    stop: float,
) -> list[Case]:
    found = []
    duration = float(truth.t[-1] - truth.t[0])
    for setting in settings:
        if method in ADAPTIVE:
            run = model.simulate(method=method, tolerance=setting, stop=stop)
        else:
            run = model.simulate(method=method, step=duration / setting, stop=stop)
        if run.outcome is not Outcome.COMPLETED or run.accuracy.error is None:
            continue
        at_end = np.array([[run[q.name][-1] for q in run.problem.states]])
        last = np.abs((at_end - truth.high[-1:]) - truth.low[-1:]) / (truth.nominal + np.abs(truth.high[-1:]))
        found.append(Case(name, method, setting, run.accuracy.error.at_end, float(np.nanmax(last))))
    return found


def main(quick: bool = False) -> None:
    paths = examples(quick, every=8)
    found: list[Case] = []
    left_out: list[str] = []
    for path, made in zip(paths, in_parallel(cases, paths), strict=True):
        if isinstance(made, str):
            left_out.append(f"{path.stem}: {made}")
        else:
            found += made
        print(path.stem, len(found), flush=True)
    rows = []
    for method, settings in [*((m, TOLERANCES) for m in ADAPTIVE), *((m, STEPS) for m in FIXED)]:
        for setting in settings:
            counted = [c for c in found if c.counted and c.method == method and c.setting == setting]
            if not counted:
                continue
            ratios = [c.ratio for c in counted]
            within = sum(0.1 <= r <= 10 for r in ratios) / len(ratios)
            middle = math.exp(float(np.median(np.log(ratios))))
            worst = min(counted, key=lambda c: c.ratio)
            rows.append(
                [
                    method,
                    f"{setting:g}" if method in ADAPTIVE else f"{setting} steps",
                    f"{len(counted)}",
                    f"{within:.0%}",
                    f"{middle:.2f}",
                    f"{min(ratios):.2g} ({worst.model})",
                    f"{max(ratios):.2g}",
                ]
            )
    counted = [c for c in found if c.counted]
    within = sum(0.1 <= c.ratio <= 10 for c in counted) / max(len(counted), 1)
    low = min((c.ratio for c in counted), default=float("nan"))
    text = (
        f"{len(counted)} runs of {len({c.model for c in counted})} examples whose true error at the end lies between "
        f"1e3 units in the last place and {LARGEST}. The estimate lies within a factor of 10 of it in {within:.1%} of "
        f"the cases; the smallest estimate is {low:.2g} of the true error. Goal: 95 %, and never below a hundredth."
    )
    head = ["method", "tolerance", "runs", "within 10", "median ratio", "smallest", "largest"]
    outliers = [
        [c.model, c.method, f"{c.setting:g}", f"{c.estimate:.1e}", f"{c.error:.1e}"]
        for c in sorted(counted, key=lambda c: c.ratio)
        if not 0.1 <= c.ratio <= 10
    ]
    parts = [text, table(head, rows)]
    if outliers:
        parts.append("Outside:\n\n" + table(["model", "method", "tolerance", "estimate", "error"], outliers))
    if left_out:
        parts.append("Not measured:\n\n" + "\n".join(f"- {reason}" for reason in left_out))
    write("calibration", "The estimated error against the true one", parts)


if __name__ == "__main__":
    main()

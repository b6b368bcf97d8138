"""Is the estimated error right? Over all examples and tolerances: the estimate of a run over its true error."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import mechc
from mechc.benchmark import HORIZON_DOUBT, benchmark
from mechc.lang.diagnostics import CompileError
from mechc.runtime.build import BuildError
from mechc.runtime.outcome import Outcome, SimulationError
from mechc.runtime.reference import ReferenceFailed
from mechc.settings import UsageMistake

from .machine import table, write

EXAMPLES = Path(__file__).parent.parent / "examples"
TOLERANCES = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
METHODS = ("dop853", "radau5")
ROUNDING = 1e3 * float(np.finfo(float).eps)


@dataclass(frozen=True, slots=True)
class Case:
    """One run; ``counted``: its true error is above the rounding floor and below 1 (a chaotic motion is beyond)."""

    model: str
    method: str
    tolerance: float
    estimate: float
    error: float

    @property
    def counted(self) -> bool:
        return ROUNDING < self.error < 0.1

    @property
    def ratio(self) -> float:
        return self.estimate / self.error


def cases(path: Path, method: str, seconds: float) -> list[Case]:
    """Run one example by one method at all tolerances."""
    model = mechc.load(path).for_experiment(None)
    made = benchmark(model, methods=("dop853",), tolerances=(), seconds=seconds)
    truth = made.reference
    if truth.doubt.max() > HORIZON_DOUBT or made.horizon < made.stop:
        raise ReferenceFailed("no reference to the end of the run")
    found = []
    for tolerance in TOLERANCES:
        run = model.simulate(tolerance=tolerance, method=method)
        if run.outcome is not Outcome.COMPLETED or run.accuracy.error is None:
            continue
        at_end = np.array([run[q.name][-1] for q in run.problem.states])
        scaled = np.abs((at_end - truth.high[-1]) - truth.low[-1]) / (truth.nominal + np.abs(truth.high[-1]))
        found.append(Case(path.stem, method, tolerance, run.accuracy.error.at_end, float(scaled.max())))
    return found


def main(quick: bool = False) -> None:
    paths = sorted(EXAMPLES.glob("*.mech"))[:: 8 if quick else 1]
    found: list[Case] = []
    left_out: list[str] = []
    for path in paths:
        for method in METHODS:
            try:
                found += cases(path, method, 2 if quick else 5)
            except (ReferenceFailed, SimulationError, CompileError, BuildError, UsageMistake) as error:
                left_out.append(f"{path.stem} ({method}): {str(error).splitlines()[0]}")
    rows = []
    for method in METHODS:
        for tolerance in TOLERANCES:
            counted = [c for c in found if c.counted and c.method == method and c.tolerance == tolerance]
            if not counted:
                continue
            ratios = [c.ratio for c in counted]
            within = sum(0.1 <= r <= 10 for r in ratios) / len(ratios)
            middle = math.exp(float(np.median(np.log(ratios))))
            worst = min(counted, key=lambda c: c.ratio)
            rows.append(
                [
                    method,
                    f"{tolerance:g}",
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
        f"1e3 units in the last place and 0.1. The estimate lies within a factor of 10 of it in {within:.1%} of the "
        f"cases; the smallest estimate is {low:.2g} of the true error. Goal: 95 %, and never below a hundredth."
    )
    head = ["method", "tolerance", "runs", "within 10", "median ratio", "smallest", "largest"]
    outliers = [
        [c.model, c.method, f"{c.tolerance:g}", f"{c.estimate:.1e}", f"{c.error:.1e}"]
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

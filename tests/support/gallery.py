"""Run the examples and compare them with known answers.

A run of tolerance ``tol`` keeps the error of each step below ``tol*(nominal + |value|)``. What the steps add
up to grows with their number and with the instability of the motion, so each case states its own bound as a
multiple of the tolerance, and why where it is more than the usual few hundred steps.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from msgspec import Struct, field
from numpy.typing import NDArray
from scipy.optimize import brentq

import mechc

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "examples"
DATA = ROOT / "tests" / "physics" / "data"
TOLERANCE = 1e-10
ROUNDING = 1e-13  # of a few hundred steps; smaller errors are not told apart


def stars(n: int) -> dict[str, str]:
    """Return the states of n bodies by the names that published solutions give them."""
    names: dict[str, str] = {}
    for i in range(1, n + 1):
        names |= {f"x{i}": f"r[{i},1]", f"y{i}": f"r[{i},2]"}
        names |= {f"vx{i}": f"der(r[{i},1])", f"vy{i}": f"der(r[{i},2])"}
    return names


Array = NDArray[np.float64]
Formula = Callable[[Array], Any]
"""A quantity as a function of the times of the output."""
Solution = mechc.Solution


@cache
def load(example: str, model: str | None = None) -> mechc.Model:
    """Load an example by the name of its file."""
    return mechc.load(EXAMPLES / f"{example}.mech", model=model)


_runs: dict[str, Solution] = {}


def run(
    example: str,
    experiment: str | None = None,
    *,
    model: str | None = None,
    stop: float | None = None,
    tolerance: float = TOLERANCE,
    set: Mapping[str, Any] | None = None,
) -> Solution:
    """Simulate an example, once for each set of options, and demand that it ends as the model says."""
    key = repr((example, experiment, model, stop, tolerance, sorted((set or {}).items())))
    if key not in _runs:
        solution = load(example, model).simulate(
            stop=stop, tolerance=tolerance, experiment=experiment, set=dict(set or {})
        )
        assert isinstance(solution, mechc.Solution)
        _runs[key] = solution
    solution = _runs[key]
    assert solution.outcome.value in ("completed", "terminated"), solution.message
    return solution


class Case(Struct, frozen=True):
    """A run whose quantities are known functions of time.

    ``bound``: largest error at the end, relative to the largest value of each quantity in the run, in units of
    the tolerance. Between the steps the interpolation, one order lower, may add to it: ten times the bound.
    """

    example: str
    values: Mapping[str, Formula]
    bound: float
    experiment: str | None = None
    model: str | None = None
    stop: float | None = None
    tolerance: float = TOLERANCE
    set: Mapping[str, Any] = field(default_factory=dict)

    def __str__(self) -> str:
        return " ".join(x for x in (self.example, self.model, self.experiment) if x)


def check(case: Case) -> None:
    """Compare the end and all output points with the closed form, and the estimated error with the true one."""
    solution = run(
        case.example,
        case.experiment,
        model=case.model,
        stop=case.stop,
        tolerance=case.tolerance,
        set=case.set,
    )
    estimate = solution.accuracy.error
    assert estimate is not None, solution.accuracy.remark
    errors, at_end = {}, {}
    for name, function in case.values.items():
        expected = np.broadcast_to(np.asarray(function(solution.time), dtype=float), solution.time.shape)
        scale = float(np.max(np.abs(expected))) or 1.0
        difference = np.abs(solution[name] - expected) / scale
        errors[name], at_end[name] = float(difference.max()), float(difference[-1])
        if name in estimate.by_state:
            size = estimate.nominal[name] + np.abs(expected)
            error = float(np.max(np.abs(solution[name] - expected) / size))
            assert error / 100 <= estimate.by_state[name] <= 100 * max(error, ROUNDING), name
    assert max(errors.values()) <= 10 * case.bound * case.tolerance, errors
    assert max(at_end.values()) <= case.bound * case.tolerance, at_end


def check_estimate(solution: Solution, expected: Mapping[str, float]) -> None:
    """Compare the estimated error at the end with the true one, state by state: within a factor of 100."""
    estimate = solution.accuracy.error
    assert estimate is not None, solution.accuracy.remark
    compared = expected.keys() & estimate.by_state_at_end.keys()
    assert compared
    for name in compared:
        size = estimate.nominal[name] + abs(expected[name])
        error = abs(float(solution[name][-1]) - expected[name]) / size
        assert error / 100 <= estimate.by_state_at_end[name], name
    largest = max(
        abs(float(solution[n][-1]) - expected[n]) / (estimate.nominal[n] + abs(expected[n])) for n in compared
    )
    assert max(estimate.by_state_at_end[n] for n in compared) <= 100 * max(largest, ROUNDING)


def references(name: str) -> list[dict[str, Any]]:
    """Return the reference points of a data file, with their numbers as floats.

    ``growth``: how much an error at the start has grown, from the digits in which the two runs agree that made
    the reference.
    """
    points = json.loads((DATA / f"{name}.json").read_text(encoding="utf-8"))["references"]
    digits = [point.get("digits_heyoka256_vs_heyoka230", point.get("digits", 0.0)) for point in points]
    return [
        {
            "growth": 10 ** max(0.0, max(digits) - digit),
            "case": point.get("case", ""),
            "t": time_of(point.get("t", "0")),
            "values": {k: float(v) for k, v in point["values"].items() if k != "note"},
        }
        for point, digit in zip(points, digits, strict=True)
    ]


def time_of(text: str) -> float:
    """Read ``2.5``, ``pi`` or ``3*pi``."""
    number, _, pi = text.partition("*")
    if number == "pi":
        return float(np.pi)
    return float(number) * (float(np.pi) if pi == "pi" else 1.0)


def values(data: str, case: str) -> dict[str, float]:
    """Return the values of the one reference point whose case starts with ``case``."""
    (point,) = [p for p in references(data) if p["case"].startswith(case)]
    return dict(point["values"])


def upward_crossings(solution: Solution, name: str) -> list[float]:
    """Times at which a quantity passes zero upwards: bracketed by the grid, found on the dense output."""
    x, t = solution[name], solution.time
    return [
        float(brentq(lambda s: float(solution(s)[name]), t[i], t[i + 1], xtol=1e-14, rtol=1e-14))
        for i in np.flatnonzero((x[:-1] < 0) & (x[1:] >= 0))
    ]


def downward_crossings(solution: Solution, name: str) -> list[float]:
    """Times at which a quantity passes zero downwards, as ``upward_crossings``."""
    x, t = solution[name], solution.time
    return [
        float(brentq(lambda s: float(solution(s)[name]), t[i], t[i + 1], xtol=1e-14, rtol=1e-14))
        for i in np.flatnonzero((x[:-1] > 0) & (x[1:] <= 0))
    ]


def at(solution: Solution, t: float, names: Sequence[str]) -> Array:
    """Quantities at a time, from the dense output."""
    point = solution(t)
    return np.array([float(point[name]) for name in names])

"""The best values of parameters or of the start: by which a formula of the motion is greatest, or least.

One value is looked for over its range and then by bisection and parabolas (Brent 1973), several by a simplex (Nelder and Mead
1965); both end with Newton's steps on differences of fourth order, whose last one tells how far the place may be off.
"""

from __future__ import annotations

import math
from typing import Annotated, Any

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray
from scipy.optimize import minimize

from ...allowed_values import bounds_of
from ...case import find_setting
from ...integrate.interruption import NotedInterruptions
from ...numerics.roots import minimum
from ...outcome import ENDED, Outcome, SimulationError
from ...problem import Array, Problem
from ...results.solution import Solution
from ...settings import Formula, Free, settable
from ..findings import Curve, Findings, Panel, Value
from ..flow.crossings import turns
from ..flow.pieces import with_horizon
from ..runs.companion import closer
from ..runs.simulate import plan_run, run
from ..study import Study

TOLERANCE = 1e-11
LOOKS = 41
WIDTH = 0.2
"""Of a value: how far the first simplex reaches."""
DIFFERENCE = 2e-3
"""Of the size of a value: for derivatives by differences of fourth order."""
NEWTON = 6
BESIDE = 1e-5
"""Of the size of a value: so near to a bound it is on it."""
WHEN = ("end", "highest", "lowest")
TURN = math.pi / 2
EPSILON = float(np.finfo(float).eps)


class Optimum(Study, frozen=True, kw_only=True):
    """The values of ``vary`` by which ``goal`` is greatest at the end of the motion, or ``least``."""

    vary: Annotated[
        tuple[Free, ...],
        settable('Parameters and initial values to vary: "a, b", or with bounds "a = 0 .. 1".', "free"),
    ] = ()
    goal: Annotated[Formula | None, settable('Formula to maximise: "x".', "formula")] = None
    least: Annotated[bool, settable("Minimise instead of maximise.", "flag")] = False
    when: Annotated[
        str, settable("Which value of the motion counts: end, highest, lowest (default: end).", "text")
    ] = "end"

    def solve(self, problem: Problem) -> Findings:
        """Run the model for many values. Raises SimulationError."""
        if not self.vary or self.goal is None:
            raise SimulationError(
                "an optimum needs quantities to vary, and a goal", help="say --vary angle --goal x"
            )
        if self.when not in WHEN:
            raise SimulationError(f"what counts is {', '.join(WHEN)}, not '{self.when}'")
        with NotedInterruptions() as interrupted:
            search = _Search(problem, with_horizon(problem, self, 100.0, TOLERANCE))
            place = search.rough(interrupted)
            place, off = search.polished(place) if not interrupted() else (place, None)
            place = search.at_bound(place) if off is None and not interrupted() else place
            return _findings(problem, search, place, off, interrupted())


class _Search:
    """The goal as a function of what is varied; ``sign`` makes it one to be least."""

    def __init__(self, problem: Problem, study: Optimum) -> None:
        assert study.goal is not None
        self.problem, self.study, self.goal = problem, study, study.goal
        self.sign = 1.0 if study.least else -1.0
        self.names = [one.name for one in study.vary]
        case = plan_run(problem, study).case
        arrays = {"p": case.p, "y": case.y0, "u": np.empty(0)}
        begin = []
        for one in study.vary:
            setting = find_setting(problem, one.name)
            if setting.array == "u":
                raise SimulationError(f"'{one.name}' is an input: make it a parameter to vary it")
            begin.append(float(arrays[setting.array][setting.index]))
        self.low, self.high = np.array([bounds_of(problem, one) for one in study.vary]).T
        bounded = np.isfinite(self.low) & np.isfinite(self.high)
        inside = (np.array(begin) >= self.low) & (np.array(begin) <= self.high)
        with np.errstate(invalid="ignore"):
            self.begin = np.where(inside, begin, (self.low + self.high) / 2)
            self.size = np.where(bounded, (self.high - self.low) / 2, [
                TURN if one.unit == "rad" and abs(x) < TURN else abs(x) or 1.0
                for one, x in zip(study.vary, begin, strict=True)
            ])  # fmt: skip
        self.count = 0
        self.closer: dict[str, float] = {}
        """Settings of motions beside those of the study, from which errors follow."""
        self.seen: list[tuple[Array, float]] = []
        self.looked: tuple[float, float] | None = None
        """Between which ends a single value without bounds was looked for."""
        self.failed = ""
        """Why one of the motions has no end."""

    def motion(self, x: Array) -> Solution:
        values = {**self.study.values, **dict(zip(self.names, map(float, x), strict=True))}
        options = replace(self.study, values=values, estimate_error=False, progress=None, **self.closer)
        return run(self.problem, options)

    def __call__(self, x: Array) -> float:
        """Give the goal, to be least; infinite where there is no motion to its end."""
        if (x < self.low).any() or (x > self.high).any():
            return math.inf
        self.count += 1
        try:
            found = self.read(self.motion(x))
        except SimulationError:
            return math.inf
        if self.study.progress is not None:
            self.study.progress(1 - 1 / (1 + self.count / 100))
        self.seen.append((x.copy(), found))
        return self.sign * found if math.isfinite(found) else math.inf

    def read(self, solution: Solution) -> float:
        if solution.outcome not in ENDED:
            self.failed = f": {solution.message}"
            return math.nan
        match self.study.when:
            case "highest":
                return float(np.max(turns(solution, self.goal.name)[1]))
            case "lowest":
                return float(np.min(turns(solution, self.goal.name)[1]))
        return float(solution[self.goal.name][-1])

    def rough(self, interrupted: Any) -> Array:
        """Look for the optimum without derivatives."""
        if len(self.names) == 1:
            low, high = float(self.low[0]), float(self.high[0])
            if not math.isfinite(high - low):
                low, high = (
                    max(low, float((self.begin - self.size)[0])),
                    min(high, float((self.begin + self.size)[0])),
                )
                self.looked = low, high
            axis = np.linspace(low, high, LOOKS)
            values = [math.inf if interrupted() else self(np.array([x])) for x in axis]
            k = int(np.argmin(values))
            if not math.isfinite(values[k]):
                raise SimulationError(
                    f"no motion of '{self.problem.name}' between {low:g} and {high:g} has a goal{self.failed}"
                )
            low, high = axis[max(k - 1, 0)], axis[min(k + 1, LOOKS - 1)]
            return np.array([minimum(lambda x: self(np.array([x])), low, high, 1e-6 * self.size[0])[0]])
        inwards = np.where(self.begin + WIDTH * self.size > self.high, -WIDTH, WIDTH)
        low, high = (self.low - self.begin) / self.size, (self.high - self.begin) / self.size
        found = minimize(
            lambda z: self(np.clip(self.begin + self.size * z, self.low, self.high)), np.zeros_like(inwards),
            method="Nelder-Mead", bounds=list(zip(low, high, strict=True)),
            options={"initial_simplex": np.vstack([np.zeros_like(inwards), np.diag(inwards)]),
                     "xatol": 1e-6, "fatol": 1e-13, "maxiter": 400 * len(self.names)},
        )  # fmt: skip
        if not math.isfinite(found.fun):
            raise SimulationError(
                f"no motion of '{self.problem.name}' near its start has a goal{self.failed}"
            )
        place: Array = np.clip(self.begin + self.size * found.x, self.low, self.high)
        return place

    def polished(self, x: Array) -> tuple[Array, Array | None]:
        """Take Newton's steps to where the derivatives vanish; give the place and the last step, None at a bound or
        where the goal is not smooth."""
        best, last = self(x), None
        for _ in range(NEWTON):
            gradient, hessian = self._derivatives(x)
            if not (np.isfinite(gradient).all() and np.isfinite(hessian).all()):
                return x, None
            if np.linalg.eigvalsh(hessian * np.outer(self.size, self.size)).min() <= 0:
                return x, None
            step = -np.linalg.solve(hessian, gradient)
            if (np.abs(step) > 0.05 * self.size).any():
                return x, None
            value = self(x + step)
            if value > best + 1e-9 * abs(best):
                return x, last
            x, best = x + step, min(value, best)
            smaller = last is None or (np.abs(step) < 0.5 * np.abs(last)).any()
            last = np.abs(step)
            if not smaller:
                break
        return x, last

    def at_bound(self, x: Array) -> Array:
        """Give the place with what lies next to a bound on it, where the goal is no worse there."""
        there = np.where(self.beside(x, self.low), self.low, x)
        there = np.where(self.beside(x, self.high), self.high, there)
        return there if self(there) <= self(x) else x

    def beside(self, x: Array, end: Array) -> NDArray[np.bool_]:
        """Say which values lie on a bound, as far as the search tells."""
        return np.asarray(np.abs(x - end) < BESIDE * self.size)

    def moved(self, x: Array) -> Array:
        """Give how far Newton's step leads from the optimum, by the motions of now: nan where it leads nowhere."""
        gradient, hessian = self._derivatives(x)
        try:
            step = np.abs(np.linalg.solve(hessian, gradient))
        except np.linalg.LinAlgError:
            return np.full(len(x), np.nan)
        return np.asarray(np.maximum(step, EPSILON * np.abs(x)))

    def _derivatives(self, x: Array) -> tuple[Array, Array]:
        n, h = len(x), DIFFERENCE * self.size
        here = self(x)
        gradient, hessian = np.empty(n), np.empty((n, n))
        unit = np.diag(h)
        for i in range(n):
            f = {k: self(x + k * unit[i]) for k in (-2, -1, 1, 2)}
            gradient[i] = (f[-2] - 8 * f[-1] + 8 * f[1] - f[2]) / (12 * h[i])
            hessian[i, i] = (-f[-2] + 16 * f[-1] - 30 * here + 16 * f[1] - f[2]) / (12 * h[i] ** 2)
            for j in range(i):
                corners = [
                    self(x + a * unit[i] + b * unit[j]) for a, b in ((1, 1), (1, -1), (-1, 1), (-1, -1))
                ]
                hessian[i, j] = hessian[j, i] = (corners[0] - corners[1] - corners[2] + corners[3]) / (
                    4 * h[i] * h[j]
                )
        return gradient, hessian


def _findings(
    problem: Problem, search: _Search, place: Array, off: Array | None, interrupted: bool
) -> Findings:
    best = search.motion(place)
    value = search.read(best)
    search.closer, factor = closer(plan_run(problem, search.study))
    error = factor * abs(search.read(search.motion(place)) - value)
    if off is not None and not interrupted:
        off = np.maximum(off, factor * search.moved(place))
    word = "least" if search.study.least else "greatest"
    unit = best.unit(search.goal.name)
    remarks = []
    on = search.beside(place, search.low) | search.beside(place, search.high)
    at_bound = [name for name, there in zip(search.names, on, strict=True) if there]
    if at_bound:
        remarks.append(f"{', '.join(at_bound)}: at its bound, where the goal may still grow beyond")
    elif search.looked and any(search.beside(place, np.array([end])).all() for end in search.looked):
        low, high = search.looked
        remarks.append(
            f"{search.names[0]}: at an end of {low:g} .. {high:g}, where it was looked for as it has no bounds: the goal may still "
            "grow beyond"
        )
    elif off is None:
        remarks.append("the goal is not smooth there, or flat: the error of the place is unknown")
    if best.outcome is Outcome.TERMINATED:
        remarks.append(f"the motion with these values ends before its stop: {best.message}")
    rows = sorted(search.seen, key=lambda row: float(row[0][0]))
    points = np.array([row[0][0] for row in rows])
    goals = np.array([row[1] for row in rows])
    first = search.study.vary[0]
    return Findings(
        study="optimum",
        model=problem.name,
        outcome=Outcome.INTERRUPTED if interrupted else Outcome.COMPLETED,
        message=("interrupted: as yet " if interrupted else "")
        + f"{search.goal.text} is {word} with {value:.10g}"
        + (f" {unit}" if unit else ""),
        values=(
            Value(search.goal.text, unit, value, error),
            *(
                Value(one.name, one.unit, float(x), None if off is None else float(off[k]))
                for k, (one, x) in enumerate(zip(search.study.vary, place, strict=True))
            ),
        ),
        errors_from="a tighter run for the goal, the last of Newton's steps for its place",
        remarks=tuple(remarks),
        panels=(
            Panel("tried", first.name, first.unit, search.goal.text, unit, (
                Curve("tried", points, goals, "points"),
                Curve("optimum", place[:1], np.array([value]), "points"))),
        ),
        details={
            "optimum": dict(zip(search.names, place.tolist(), strict=True)),
            "goal": value,
            "runs": search.count,
        },
        runs=(best,),
    )  # fmt: skip

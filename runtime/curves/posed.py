"""A problem of a curve made ready: values of its parameters, its guess, its borders, and where it is steep."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np
from msgspec import Struct

from mechc.suggest import suggest

from ..interface import CurveInterface, Experiment, Setting
from ..outcome import SimulationError
from ..problem import Array, Problem

DEFAULT_TOLERANCE = 1e-10
LOWEST_TOLERANCE = 1e-14
SCAN = 4001
"""Places at which bends are looked for."""


class Posed(Struct, frozen=True, eq=False):
    """``p``: parameters; ``guesses``: constants given for coordinates by index in y; ``experiment``: whose guesses count,
    with the places in y of its settings; ``tolerance``: of values, relative to their size."""

    problem: Problem
    p: Array
    guesses: Mapping[int, float]
    experiment: Experiment | None
    tolerance: float
    ends: Array

    @property
    def curve(self) -> CurveInterface:
        assert self.problem.curve is not None
        return self.problem.curve

    @property
    def functions(self) -> Mapping[str, Callable[..., Array]]:
        return self.problem.functions

    def z(self, unknown: Array) -> Array:
        z = np.zeros(len(self.problem.discretes))
        z[: len(unknown)] = unknown
        return z

    def range(self, unknown: Array) -> tuple[float, float]:
        """Return the ends of the range with values of those that are to be found."""
        found = self.functions["range"](np.zeros(()), self._nothing(), _NONE, self.z(unknown), self.p)
        return float(found[0]), float(found[1])

    def guess(self, s: Array) -> Array:
        """Return the guess of the coordinates at places: (n, places)."""
        n = self.curve.coordinates
        z = self.z(self.ends)
        y = np.zeros((self._height(), len(s)))
        values = self.functions["guess"](s, y, _NONE, z, self.p)[:n]
        if self.experiment is not None:
            found = self.functions[self.experiment.function](s, y, _NONE, z, self.p)
            for k, setting in enumerate(self.experiment.settings, start=len(self.experiment.options)):
                if setting.array == "y" and setting.index < n:
                    values[setting.index] = found[k]
        for index, value in self.guesses.items():
            if index < n:
                values[index] = value
        return values

    def borders(self) -> list[float]:
        """Return where elements must end: kinks, and places at which values are asked for."""
        found = [s for s in self._places() if 0 < s < 1]
        return found + self.bends()

    def _places(self) -> list[float]:
        shares = self.functions["places"](np.zeros(1), self._nothing(1), _NONE, self.z(self.ends), self.p)[
            :, 0
        ]
        rows = [
            r for r in (*self.curve.numbers, *self.curve.further) if r.kind in ("lower", "upper", "inside")
        ]
        for share, row in zip(shares, rows, strict=True):
            if not -1e-12 <= share <= 1 + 1e-12:
                a, b = self.range(self.ends)
                unit = f" {self.problem.time.unit}" if self.problem.time.unit else ""
                raise SimulationError(
                    f"'{row.name}' asks for a place outside of the range",
                    row.origin,
                    help=f"the range goes from {a:.6g} to {b:.6g}{unit}",
                )
        return [float(s) for s in shares]

    def bends(self) -> list[float]:
        """Return where the integrand makes a choice by place."""

        def values(s: Array) -> Array:
            return self.functions["bends"](s, self._nothing(len(s)), _NONE, self.z(self.ends), self.p)

        s = np.linspace(0, 1, SCAN)
        table = values(s)
        found: list[float] = []
        for k, row in enumerate(table):
            found += [float(s[i]) for i in np.flatnonzero(row == 0) if 0 < i < SCAN - 1 and np.any(row != 0)]
            for i in np.flatnonzero(row[:-1] * row[1:] < 0):
                low, high = float(s[i]), float(s[i + 1])
                sign = row[i]
                for _ in range(60):
                    middle = (low + high) / 2
                    if values(np.array([middle]))[k, 0] * sign > 0:
                        low = middle
                    else:
                        high = middle
                found.append((low + high) / 2)
        return found

    def _height(self) -> int:
        return self.curve.coordinates * (self.curve.depth + 1) + len(self.curve.points)

    def _nothing(self, *count: int) -> Array:
        return np.zeros((self._height(), *count))


_NONE = np.zeros(0)


def pose(
    problem: Problem, values: Mapping[str, float], experiment: Experiment | None, tolerance: float | None
) -> Posed:
    """Make a problem of a curve ready. Raises SimulationError."""
    curve = problem.curve
    assert curve is not None
    n = curve.coordinates
    wanted: dict[Setting, float] = {}
    for name, value in values.items():
        wanted[_setting(problem, name)] = float(value)
    p, ends, numbers = _settle(problem, wanted, experiment)
    if (
        bad := next((k for k in range(len(problem.parameters)) if not math.isfinite(p[k])), None)
    ) is not None:
        q = problem.parameters[bad]
        raise SimulationError(
            f"the parameter '{q.name}' has no value", q.origin, help=f"give it one: --set {q.name}=..."
        )
    chosen = tolerance if tolerance is not None else numbers.get("tolerance", DEFAULT_TOLERANCE)
    if not LOWEST_TOLERANCE <= chosen < 1:
        raise SimulationError(f"the tolerance lies between {LOWEST_TOLERANCE:g} and 1, it is {chosen:g}")
    guesses = {s.index: v for s, v in wanted.items() if s.array == "y" and s.index < n}
    for setting, value in wanted.items():
        if setting.array == "z":
            ends[setting.index] = value
    posed = Posed(problem, p, guesses, experiment, chosen, ends)
    a, b = posed.range(ends)
    if not (math.isfinite(a) and math.isfinite(b)) or b <= a:
        unit = f" {problem.time.unit}" if problem.time.unit else ""
        raise SimulationError(
            f"the range of '{problem.time.name}' goes from {a:.6g}{unit} to {b:.6g}{unit}: it must ascend",
            problem.time.origin,
            help="exchange its ends, or give other values"
            if not curve.unknown
            else "give another guess of its end",
        )
    return posed


def _setting(problem: Problem, name: str) -> Setting:
    curve = problem.curve
    assert curve is not None
    for k, q in enumerate(problem.parameters):
        if q.name == name:
            return Setting("p", k)
    for k, q in enumerate(problem.states[: curve.coordinates]):
        if q.name == name:
            return Setting("y", k, True)
    for k, q in enumerate(problem.discretes[: curve.unknown]):
        if q.name == name:
            return Setting("z", k, True)
    known = [q.name for q in (*problem.parameters, *problem.states[: curve.coordinates])]
    raise SimulationError(f"'{problem.name}' has no parameter or coordinate '{name}'" + suggest(name, known))


def _settle(
    problem: Problem, wanted: Mapping[Setting, float], experiment: Experiment | None
) -> tuple[Array, Array, dict[str, float]]:
    """Return parameters with all settings applied, guesses of ends that are to be found, and options of the experiment."""
    curve = problem.curve
    assert curve is not None
    count = len(problem.parameters)
    chosen = {s.index: v for s, v in wanted.items() if s.array == "p"}
    fixed = set(chosen)
    height = curve.coordinates * (curve.depth + 1) + len(curve.points)
    functions: Mapping[str, Callable[..., Array]] = problem.functions
    ends = np.zeros(curve.unknown)
    numbers: dict[str, float] = {}
    for _ in range(count + 2):
        p = np.full(count + problem.nh, np.nan)
        given = np.zeros(count, dtype=np.uint8)
        for index, value in chosen.items():
            p[index], given[index] = value, 1
        if problem.parameters_function is not None:
            problem.parameters_function(p, given)
        z = np.zeros(len(problem.discretes))
        nothing = (np.zeros(()), np.zeros(height), _NONE)
        ends = functions["guess_of_ends"](*nothing, z, p).copy()
        if experiment is None:
            return p, ends, {}
        z[: len(ends)] = ends
        found = functions[experiment.function](*nothing, z, p)
        numbers = {name: float(v) for name, v in zip(experiment.options, found, strict=False)}
        before = dict(chosen)
        for setting, value in zip(experiment.settings, found[len(experiment.options) :], strict=True):
            if setting.array == "p" and setting.index not in fixed:
                chosen[setting.index] = float(value)
            if setting.array == "z":
                ends[setting.index] = float(value)
        if chosen == before:
            return p, ends, numbers
    raise SimulationError("the settings of the experiment do not settle: they depend on each other")

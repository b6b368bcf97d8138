"""Systems of equations for outputs at single places of a motion: residuals of what is tried, steps of Newton's method."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..case import Case, inputs_at
from ..functions import named_function
from ..numerics.rank import singular_values, solve
from ..problem import Array

SETTLED = 1e-9
"""Step, as a share of the unknowns, after which a further one changes nothing but rounding."""
CONTRACTS = 0.25
"""Share of the step before that a step of a sequence has at most which surely goes to the nearest solution."""
STEPS = 12
"""Steps of such a sequence at most."""
VANISHING = 1e-5
"""An unknown smaller than this share of its largest value is measured against that."""
SEARCH = 40
"""Steps of a search from afar, those that are taken back included."""
HOLDS = 1e-9
"""Largest residual, as a share of its terms, of equations that hold."""


class SystemPlace(NamedTuple):
    """Time, state [ny], inputs and discrete variables."""

    t: float
    y: Array
    u: Array
    z: Array


class SystemLook(NamedTuple):
    """At values that are tried: the guess [n], rows [m] and their derivatives [m, n] as shares of the ``sizes`` [m] of the
    terms of rows."""

    guess: Array
    rows: Array
    matrix: Array
    sizes: Array


StatesAt = Callable[[Array], tuple[Array, Array | None]]


class RunSystem:
    """One system of a run. ``largest`` [n]: the largest sizes of the unknowns along it."""

    def __init__(self, case: Case, number: int) -> None:
        problem = case.problem
        plans = problem.sought
        widths = [len(s.outputs) * (1 + s.rows) + 2 * s.rows for s in plans]
        self.case = case
        self.outputs = list(plans[number].outputs)
        self.quantities = [problem.outputs[k] for k in self.outputs]
        self.rows = plans[number].rows
        self.largest = np.ones(len(self.outputs))
        self._function = named_function(problem, case.functions, "sought", sum(widths))
        self._first = sum(widths[:number])
        self._given = np.zeros(sum(len(s.outputs) for s in plans))
        self._place = sum(len(s.outputs) for s in plans[:number])

    @property
    def count(self) -> int:
        return len(self.outputs)

    def place(self, t: float, y: Array, z: Array) -> SystemPlace:
        return SystemPlace(t, np.ascontiguousarray(y), inputs_at(self.case, t), np.ascontiguousarray(z))

    def reported(self, at: SystemPlace) -> Array:
        """Give what the model reports [n]: not-a-number where it found nothing."""
        assert self.case.functions.outputs is not None, "a model with unknown outputs has outputs"
        found: Array = self.case.functions.outputs(at.t, at.y, at.u, at.z, self.case.p)[self.outputs]
        return found

    def look(self, at: SystemPlace, tried: Array) -> SystemLook:
        n, m, k = self.count, self.rows, self._first
        self._given[self._place : self._place + n] = tried
        out = self._function(at.t, at.y, np.concatenate([at.u, self._given]), at.z, self.case.p)
        rows, sizes = out[k + n : k + n + m], out[k + n + m : k + n + 2 * m]
        sizes = np.where(sizes > 0, sizes, 1.0)
        matrix = out[k + n + 2 * m : k + n + 2 * m + m * n].reshape(m, n)
        return SystemLook(out[k : k + n], rows / sizes, matrix / sizes[:, None], sizes)

    def sizes(self, values: Array) -> Array:
        """Give what changes of the unknowns are measured against."""
        return np.maximum(np.abs(values), VANISHING * self.largest)

    def step(self, look: SystemLook) -> Array:
        """Give the step of Newton's method; not-a-number where there is none."""
        with np.errstate(all="ignore"):
            if not (np.isfinite(look.matrix).all() and np.isfinite(look.rows).all()):
                return np.full(self.count, np.nan)
            if self.count == self.rows == 1:
                return np.asarray(-look.rows / look.matrix[0])
            try:
                if self.rows > self.count:
                    return solve(look.matrix, -look.rows)
                return np.asarray(np.linalg.solve(look.matrix, -look.rows))
            except np.linalg.LinAlgError:
                return np.full(self.count, np.nan)

    def flatness(self, look: SystemLook, values: Array) -> float:
        """Give how far a solution moves, as a share of the unknowns, for residuals that are shares of their terms."""
        if not np.isfinite(look.matrix).all():
            return np.inf
        least = singular_values(look.matrix * np.maximum(self.largest, np.abs(values)))[-1]
        return float(1 / least) if least > 0 else np.inf

    def nearest(self, at: SystemPlace, start: Array) -> Array | None:
        """Give the solution that Newton's method goes to from a start without detours; None where it does not."""
        values, before = start, np.inf
        for _ in range(STEPS):
            look = self.look(at, values)
            step = self.step(look)
            if not np.isfinite(step).all():
                return None
            values = values + step
            size = float(np.max(np.abs(step) / self.sizes(values)))
            if size <= SETTLED:
                return values if self._holds(look) else None
            if size > CONTRACTS * before:
                return None
            before = size
        return None

    def found(self, at: SystemPlace, start: Array) -> Array | None:
        """Give the solution that steps lead to which are shortened where they lead away; None where there is none."""
        values, fraction = start, 1.0
        look = self.look(at, values)
        for _ in range(SEARCH):
            step = self.step(look)
            if not np.isfinite(step).all():
                return None
            if float(np.max(np.abs(step) / self.sizes(values + step))) <= SETTLED:
                return values + step if self._holds(look) else None
            tried = self.look(at, values + fraction * step)
            off = tried.rows * tried.sizes / look.sizes
            if float(off @ off) < float(look.rows @ look.rows):
                values, look, fraction = values + fraction * step, tried, min(1.0, 2 * fraction)
            else:
                fraction /= 4
        return None

    def _holds(self, look: SystemLook) -> bool:
        return self.rows == self.count or bool(np.all(np.abs(look.rows) <= HOLDS))

    def alike(self, a: Array, b: Array, share: float) -> bool:
        """Tell whether two solutions differ by less than a share of the largest values of the unknowns."""
        return bool(np.all(np.abs(a - b) <= share * np.maximum(self.largest, np.abs(a))))


def systems_of(case: Case) -> list[RunSystem]:
    """Give the systems of a model for a case."""
    return [RunSystem(case, k) for k in range(len(case.problem.sought))]

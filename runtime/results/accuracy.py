"""How accurate a run is: a companion run at a tighter tolerance, and what the motion keeps constant."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping

from msgspec import Struct, field
from msgspec.structs import replace

from ..arrays.choice import np
from ..outcome import Failure
from ..problem import Array, Problem
from .doubts import Contradiction

COMPANION_RATIO = 100.0
LOWEST_COMPANION = 1e-14
AT_ONCE = 65_536
"""Rows that are looked at together."""

EPSILON = sys.float_info.epsilon


class Drift(Struct, frozen=True):
    """Largest change of a quantity that ought to stay constant. ``relative`` to the largest size of the
    quantity (of all energies, for the energy balance); None where the quantity is zero but for its drift."""

    name: str
    unit: str
    absolute: float
    relative: float | None


class ConstraintDrift(Struct, frozen=True):
    """Distance from the constraints on the ``level`` of positions or velocities: the largest change that a
    projection makes, over nominal + |value|. ``before``: the steps of the method; None where nothing projects them.
    ``after``: the states that are kept; ``rounding``: what the next projection of the same state would change."""

    level: str
    before: float | None
    after: float
    rounding: float = 0.0


class ErrorEstimate(Struct, frozen=True):
    """Of the global error: |difference from the companion run| / (nominal + |value|), by state.

    ``largest`` and ``at_end`` are the largest ones over all states, during the run and at its end.
    ``tolerance`` is that of the companion run (its step, for a fixed-step method).
    """

    largest: float
    at_end: float
    by_state: Mapping[str, float]
    by_state_at_end: Mapping[str, float]
    tolerance: float
    nominal: Mapping[str, float] = field(default_factory=dict)
    """The sizes that the errors are measured against, by state."""


class Accuracy(Struct, frozen=True):
    """``error`` is None if no companion run was made, or if it failed: ``remark`` then says why, and ``failure`` how
    the companion run failed."""

    error: ErrorEstimate | None = None
    energy: Drift | None = None
    conserved: tuple[Drift, ...] = ()
    remark: str = ""
    constraints: tuple[ConstraintDrift, ...] = ()
    failure: Failure | None = None
    contradictions: tuple[Contradiction, ...] = ()
    """The checks that disagree with ``error``."""


def companion_tolerance(tolerance: float) -> tuple[float, float]:
    """Give the companion's tolerance and the factor from difference to error of the main run.

    Tighter by 100 where rounding allows. The error falls like the tolerance, so that a companion tighter by
    less than that still has the share 1 / ratio of the error. At the tightest tolerances the companion is the
    looser run: the difference is then its error, an upper bound.
    """
    tight = max(tolerance / COMPANION_RATIO, LOWEST_COMPANION)
    if tolerance / tight >= 10:
        return tight, 1 / (1 - tight / tolerance)
    return looser_companion(tolerance)


def looser_companion(tolerance: float) -> tuple[float, float]:
    return 10 * tolerance, 1.0


HALVES, APART, FARTHER = 2.0, 2.618, 3.303
"""Into how many parts the steps of a companion divide those of a main run of fixed steps. No small ratio is near the last two
(the square of the golden section, and the bronze one), nor near their ratio."""


def companion_step(step: float, order: int, parts: float) -> tuple[float, float]:
    """The same for a fixed step: a part of it, Richardson's factor."""
    share: float = parts**-order
    return step / parts, 1 / (1 - share)


def compare(
    problem: Problem, y: Array, companion: Array, nominal: Array, factor: float, steps: int, tolerance: float
) -> ErrorEstimate:
    """Estimate errors from two runs on one grid, [n, ny] each; never below the growth of rounding errors."""
    floor = EPSILON * np.sqrt(max(steps, 1))

    def error(rows: slice) -> Array:
        size = nominal + np.abs(companion[rows])
        return np.asarray(np.maximum(factor * np.abs(y[rows] - companion[rows]) / size, floor))

    names = [quantity.name for quantity in problem.states]
    largest = np.max([error(rows).max(axis=0) for rows in _slices(len(y))], axis=0)
    last = error(slice(-1, None))[0]
    return ErrorEstimate(
        largest=float(largest.max()),
        at_end=float(last.max()),
        by_state=dict(zip(names, largest.tolist(), strict=True)),
        by_state_at_end=dict(zip(names, last.tolist(), strict=True)),
        tolerance=tolerance,
        nominal=dict(zip(names, nominal.tolist(), strict=True)),
    )


def worse(one: ErrorEstimate, other: ErrorEstimate) -> ErrorEstimate:
    """Of two estimates for one run, take the larger errors."""

    def larger(a: Mapping[str, float], b: Mapping[str, float]) -> dict[str, float]:
        return {name: max(value, b[name]) for name, value in a.items()}

    return replace(
        one,
        largest=max(one.largest, other.largest),
        at_end=max(one.at_end, other.at_end),
        by_state=larger(one.by_state, other.by_state),
        by_state_at_end=larger(one.by_state_at_end, other.by_state_at_end),
    )


def energy_drift(problem: Problem, outputs: Array) -> Drift | None:
    """Largest change of total + dissipated - supplied energy; ``outputs`` [n, n_outputs]."""
    if not problem.energy_balance:
        return None
    total, dissipated, supplied = problem.energy_balance
    balance = outputs[:, total].copy()
    if dissipated >= 0:
        balance += outputs[:, dissipated]
    if supplied >= 0:
        balance -= outputs[:, supplied]
    energies = [i for i, quantity in enumerate(problem.outputs) if quantity.kind == "energy"]
    energies += [i for i in problem.energy_balance if i >= 0]
    size = max((_largest(outputs[rows][:, energies]) for rows in _slices(len(outputs))), default=0.0)
    return _drift(problem, total, balance, size)


def conserved_drifts(problem: Problem, outputs: Array) -> tuple[Drift, ...]:
    drifts = [
        _drift(problem, index, outputs[:, index], _largest(outputs[:, index])) for index in problem.conserved
    ]
    # What is nothing but its own drift is zero: a share of it says nothing.
    return tuple(
        replace(d, relative=None) if d.relative is not None and d.relative > 0.5 else d for d in drifts
    )


def _drift(problem: Problem, index: int, values: Array, size: float) -> Drift:
    quantity = problem.outputs[index]
    first = float(values[0]) if values.size else math.nan
    if not math.isfinite(first):
        defined = np.isfinite(values)
        first = float(values[np.argmax(defined)]) if defined.any() else math.nan
    absolute = math.nan if math.isnan(first) else _largest(values, first)
    return Drift(quantity.name, quantity.unit, absolute, absolute / size if size > 0 else None)


def _largest(values: Array, about: float = 0.0) -> float:
    """Largest distance [n] from ``about`` among the numbers: at the surface of a contact, within rounding, an energy may be
    undefined."""
    found = 0.0
    for rows in _slices(len(values)):
        apart = np.abs(values[rows] - about)
        found = max(found, float(apart[np.isfinite(apart)].max(initial=0.0)))
    return found


def _slices(count: int) -> list[slice]:
    """Take rows apart, so that what is computed of many points on the way needs no memory of their number."""
    return [slice(begin, begin + AT_ONCE) for begin in range(0, count, AT_ONCE)]

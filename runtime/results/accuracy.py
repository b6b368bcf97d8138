"""How accurate a run is: a companion run at a tighter tolerance, and what the motion keeps constant.

The verdict on a run tells how it ended and how accurate it was; of a short run it is found when somebody asks.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterable, Mapping
from functools import partial

import numpy as np
from msgspec import Struct, field
from msgspec.structs import replace

from ..interface import Quantity
from ..outcome import Failure, Outcome
from ..problem import Array, Problem
from .doubts import Contradiction

COMPANION_RATIO = 100.0
LOWEST_COMPANION = 1e-14
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


def compare(problem: Problem, largest: Array, last: Array, nominal: Array, tolerance: float) -> ErrorEstimate:
    """Estimate errors from what two runs are apart: of each state [ny] the largest, and at their ends."""
    names = [quantity.name for quantity in problem.states]
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


def drifts_of(problem: Problem, parts: Iterable[Array]) -> tuple[Drift | None, tuple[Drift, ...]]:
    """Give the largest change of total + dissipated - supplied energy, where the model has that balance, and of all that is
    conserved; ``parts`` [n, n_outputs] of the outputs in the order of time."""
    kept = [_Kept(problem.outputs[index], partial(_column, index)) for index in problem.conserved]
    energies = [i for i, quantity in enumerate(problem.outputs) if quantity.kind == "energy"]
    energies += [i for i in problem.energy_balance if i >= 0]
    balance = None
    if problem.energy_balance:
        balance = _Kept(problem.outputs[problem.energy_balance[0]], partial(_balance, problem))
    for part in parts:
        for one in kept:
            one.read(part)
            one.size = max(one.size, _largest(one.of(part)))
        if balance is not None:
            balance.read(part)
            balance.size = max(balance.size, _largest(part[:, energies]))
    drifts = [one.drift() for one in kept]
    # What is nothing but its own drift is zero: a share of it says nothing.
    conserved = tuple(
        replace(d, relative=None) if d.relative is not None and d.relative > 0.5 else d for d in drifts
    )
    return None if balance is None else balance.drift(), conserved


def with_balance(
    problem: Problem, error: ErrorEstimate | None, energy: Drift | None, reached: Array
) -> ErrorEstimate | None:
    """Return an estimate in which no account of energy claims to be more exact than the balance that it is part of.

    ``reached`` [ny]: the largest size of each state; an account that nothing flows into is zero.
    """
    if error is None or energy is None or not math.isfinite(energy.absolute):
        return error
    booked = {problem.outputs[i].name for i in problem.energy_balance[1:] if i >= 0}
    states, at_end = dict(error.by_state), dict(error.by_state_at_end)
    for q, size in zip(problem.states, reached.tolist(), strict=True):
        if q.kind != "account" or q.name not in booked or not size:
            continue
        states[q.name] = max(states[q.name], energy.absolute / error.nominal[q.name])
        at_end[q.name] = max(at_end[q.name], energy.absolute / (error.nominal[q.name] + size))
    largest, last = max(error.largest, *states.values()), max(error.at_end, *at_end.values())
    return replace(error, by_state=states, by_state_at_end=at_end, largest=largest, at_end=last)


def _column(index: int, outputs: Array) -> Array:
    return outputs[:, index]


def _balance(problem: Problem, outputs: Array) -> Array:
    total, dissipated, supplied = problem.energy_balance
    balance = outputs[:, total].copy()
    if dissipated >= 0:
        balance += outputs[:, dissipated]
    if supplied >= 0:
        balance -= outputs[:, supplied]
    return balance


class _Kept:
    """Something ``of`` outputs that ought to stay what it is first."""

    def __init__(self, quantity: Quantity, of: Callable[[Array], Array]) -> None:
        self._quantity, self.of = quantity, of
        self._first, self._absolute = math.nan, math.nan
        self.size = 0.0

    def read(self, part: Array) -> None:
        values = self.of(part)
        if math.isnan(self._first):
            defined = np.isfinite(values)
            if not defined.any():
                return
            self._first, self._absolute = float(values[np.argmax(defined)]), 0.0
        self._absolute = max(self._absolute, _largest(values, self._first))

    def drift(self) -> Drift:
        q, absolute = self._quantity, self._absolute
        return Drift(q.name, q.unit, absolute, absolute / self.size if self.size > 0 else None)


def _largest(values: Array, about: float = 0.0) -> float:
    """Largest distance from ``about`` among the numbers: at the surface of a contact, within rounding, an energy may be
    undefined."""
    apart = np.abs(values - about)
    return float(apart[np.isfinite(apart)].max(initial=0.0))


class Verdict(Struct, frozen=True):
    """``message`` says the ``outcome`` in words; ``failure`` is why a run failed; ``remarks`` are what it says itself."""

    outcome: Outcome
    message: str
    failure: Failure | None
    accuracy: Accuracy
    remarks: tuple[str, ...] = ()


class Judged:
    """A verdict, or what finds it from the rows of the run, which nobody else may change until then."""

    def __init__(self, found: Verdict | Callable[[], Verdict]) -> None:
        self._found = found

    @property
    def pending(self) -> bool:
        """Whether nobody has asked yet."""
        return not isinstance(self._found, Verdict)

    def __call__(self) -> Verdict:
        found = self._found
        if not isinstance(found, Verdict):
            found = self._found = found()  # whose rows may go
        return found

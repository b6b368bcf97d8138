"""What a case is, what is expected of it, and what it came to."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from msgspec import Struct, field
from numpy.typing import NDArray

from mechc.measurement.truth import TrueErrors
from mechc.runtime.outcome import Outcome, SimulationError
from mechc.solution import Solution

Array = NDArray[np.float64]
Formula = Callable[[Array], Any]
"""A quantity as a function of the output times."""
Demand = tuple[str, Callable[[Solution], bool]]
"""A condition in words, and its test."""

UNDERSTATED = 100.0
"""A true error that is larger than the estimated one by more than this is a silent failure."""
ROUNDING = 1e3 * float(np.finfo(float).eps)
"""Errors below are not told apart."""


class Finding(Struct, frozen=True):
    """``problems`` say what was not as expected; ``silent``: the answer is wrong and nothing in it says so."""

    error: float | None = None
    problems: tuple[str, ...] = ()
    silent: bool = False


class Known(Struct, frozen=True):
    """The run completes; ``values`` are known at its end, or all along where they are functions of time.

    ``bound``: of the largest error over the largest value of a quantity. Of a state the estimated error is
    compared with the true one. ``ends``: how the run ends.
    """

    text: str
    values: Mapping[str, float | Formula]
    bound: float
    demands: tuple[Demand, ...] = ()
    ends: Outcome = Outcome.COMPLETED
    sizes: Mapping[str, float] = field(default_factory=dict)
    """By what the error of a quantity is divided, where that is not its largest value."""

    def judge(self, s: Solution) -> Finding:
        if s.outcome is not self.ends:
            return Finding(problems=(f"{s.outcome.value}: {s.message}",))
        worst, problems, silent = 0.0, [], False
        for name, value in self.values.items():
            all_along = callable(value)
            got = s[name] if all_along else s[name][-1:]
            expected = np.broadcast_to(
                np.asarray(value(s.time) if callable(value) else value, float), got.shape
            )
            difference = np.abs(got - expected)
            error = float(difference.max()) / (self.sizes.get(name) or float(np.abs(expected).max()) or 1.0)
            worst = max(worst, error) if np.isfinite(error) else float("inf")
            claim = claimed(s, name, at_end=not all_along)
            if claim is not None:
                nominal = s.accuracy.error.nominal[name]  # type: ignore[union-attr]
                true = float((difference / (nominal + np.abs(expected))).max())
                if true > UNDERSTATED * max(claim, ROUNDING):
                    silent = True
                    problems.append(f"the error of {name} is {true:.1e}, {claim:.1e} was estimated")
        if not worst <= self.bound:
            problems.append(f"an error of {worst:.1e}")
            silent = silent or not confessed(s, worst)
        problems += unmet(s, self.demands)
        return Finding(worst, tuple(problems), silent)


class Measured(Struct, frozen=True):
    """The run completes, and a number made of it stays below a bound."""

    text: str
    measure: Callable[[Solution], float]
    bound: float
    demands: tuple[Demand, ...] = ()
    ends: Outcome = Outcome.COMPLETED

    def judge(self, s: Solution) -> Finding:
        if s.outcome is not self.ends:
            return Finding(problems=(f"{s.outcome.value}: {s.message}",))
        error = self.measure(s)
        good = bool(error <= self.bound)
        problems = () if good else (f"an error of {error:.1e}",)
        return Finding(error, (*problems, *unmet(s, self.demands)), not good and not confessed(s, error))


class Refusal(Struct, frozen=True):
    """The run stops between two times with a message that holds ``words``, a state, and what came before.

    ``between`` None: it does not begin at all. ``error``: of a quantity just before, where it is known.
    """

    text: str
    words: tuple[str, ...]
    between: tuple[float, float] | None = None
    until: Mapping[str, Formula] = field(default_factory=dict)
    bound: float = 0.0
    before: float = float("inf")
    """The time up to which ``until`` is compared."""

    def judge(self, s: Solution) -> Finding:
        if s.outcome is not Outcome.FAILED or s.failure is None:
            return Finding(problems=(f"{s.outcome.value}, though it cannot be solved",), silent=True)
        problems = [f"the message does not say '{w}': {s.message}" for w in self.words if w not in s.message]
        if self.between is None:
            problems.append(f"it began: {s.message}")
        elif not self.between[0] <= s.failure.time <= self.between[1]:
            problems.append(f"it stopped at {s.failure.time:.10g}")
        if not s.failure.state or not all(np.isfinite(v) for v in s.failure.state.values()):
            problems.append("the last state is not told")
        if not s.time.size or not all(
            np.isfinite(s[q][s.time < 0.99 * s.failure.time]).all() for q in s.failure.state
        ):
            problems.append("what came before is not kept")
        worst = None
        for name, formula in self.until.items():
            early = s.time < self.before
            expected = np.asarray(formula(s.time[early]), float)
            error = float(np.abs(s[name][early] - expected).max() / np.abs(expected).max())
            worst = max(worst or 0.0, error)
        if worst is not None and not worst <= self.bound:
            problems.append(f"an error of {worst:.1e} before")
        return Finding(worst, tuple(problems))

    def judge_error(self, message: str) -> Finding:
        problems = [f"the message does not say '{w}': {message}" for w in self.words if w not in message]
        if self.between is not None:
            problems.append(f"it did not begin: {message}")
        return Finding(problems=tuple(problems))


class Followed(Struct, frozen=True):
    """The run completes, and stays near a reference in higher precision: error over nominal + |value|.

    ``least``: the share of the time for which that reference must be clear.
    """

    text: str
    bound: float
    demands: tuple[Demand, ...] = ()
    seconds: float = 10.0
    least: float = 1.0

    def judge(self, s: Solution, truth: TrueErrors) -> Finding:
        if s.outcome is not Outcome.COMPLETED:
            return Finding(problems=(f"{s.outcome.value}: {s.message}",))
        problems, silent = [], False
        if truth.horizon < self.least * s.time[-1]:
            problems.append(f"the reference is clear until {truth.horizon:g} only")
        if not truth.largest <= self.bound:
            problems.append(f"an error of {truth.largest:.1e}")
            silent = not confessed(s, truth.largest)
        for name, true in truth.by_state.items():
            claim = claimed(s, name, at_end=False)
            if claim is not None and true > UNDERSTATED * max(claim, ROUNDING):
                problems.append(f"the error of {name} is {true:.1e}, {claim:.1e} was estimated")
                silent = True
        return Finding(truth.largest, (*problems, *unmet(s, self.demands)), silent)


Expectation = Known | Measured | Refusal | Followed


class Case(Struct, frozen=True):
    """``model``: a text, or ``examples/NAME.mech``; ``options`` those of ``Model.simulate``. ``fault``: the
    fault (faults.py) under which the expectation must fail. ``seconds``: of the watchdog. ``full``: left out of the
    quick run."""

    name: str
    extreme: str
    model: str
    expects: Expectation
    fault: str
    options: Mapping[str, Any] = field(default_factory=dict)
    seconds: float = 30.0
    full: bool = False
    variant: str | None = None
    """Which model of the text."""


class Row(Struct, frozen=True):
    """A case that was run; ``kind``: met, not met, silent, crashed, hung."""

    group: int
    name: str
    extreme: str
    expects: str
    kind: str
    method: str = ""
    outcome: str = ""
    error: float | None = None
    claim: float | None = None
    seconds: float = 0.0
    steps: int = 0
    reason: str = ""
    fault: str = ""


def claimed(s: Solution, name: str, at_end: bool) -> float | None:
    """Return the estimated error of a state, None for anything else."""
    estimate = s.accuracy.error
    if estimate is None:
        return None
    return (estimate.by_state_at_end if at_end else estimate.by_state).get(name)


def confessed(s: Solution, error: float) -> bool:
    """Say whether the estimate of any state owns up to an error of this size."""
    estimate = s.accuracy.error
    return estimate is not None and error <= UNDERSTATED * estimate.largest


def unmet(s: Solution, demands: tuple[Demand, ...]) -> list[str]:
    return [f"not so: {words}" for words, holds in demands if not holds(s)]


def by(method: str) -> Demand:
    """The run ends with this method."""
    return f"solved by {method}", lambda s: s.statistics.method == method


def within(steps: int) -> Demand:
    return f"at most {steps} steps", lambda s: s.statistics.steps <= steps


def happens(kind: str, count: int) -> Demand:
    """Exactly so many events of a kind."""
    return f"{count} x {kind}", lambda s: sum(e.kind == kind for e in s.events) == count


def drift(s: Solution) -> float:
    """Return the largest relative change of the energy balance and of the conserved momenta."""
    found = [d for d in (s.accuracy.energy, *s.accuracy.conserved) if d is not None]
    if not found:
        raise SimulationError("the model keeps nothing constant")
    return max(d.absolute if d.relative is None else d.relative for d in found)


def energy_drift(s: Solution) -> float:
    found = s.accuracy.energy
    if found is None:
        raise SimulationError("the model has no energy")
    return found.absolute if found.relative is None else found.relative

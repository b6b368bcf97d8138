"""Is a state known by its own range? Errors are claimed as shares of nominal + |value|, and a nominal value may be far above all
that a state does: a length of nanometres beside one of kilometres that keeps to its claim may be wrong in every digit.

A state whose claimed error is a tenth of all that it reaches, or more, is one of two: it is zero but for rounding and errors, or it is
lost. So the run is made again with the errors of such states measured against what they reach: what is still uncertain
then is nothing; what is found, and is otherwise than the run said, was lost.
"""

from __future__ import annotations

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from ..runtime.outcome import ENDED
from ..runtime.results.solution import Solution
from ..runtime.studies.runs.simulate import Plan, run_from

SHARE = 0.1
"""Of its range: from this error on a state is not known."""
ROUNDING = 4 * float(np.finfo(float).eps)
"""Share of the largest state of its unit below which one is rounding."""
COSTLY, AT_LEAST = 100, 10_000
"""A run that takes more steps than so many times those of the first, and so many more, follows rounding."""
POINTS = 1000
"""At which both runs are compared."""


class Lost(Struct, frozen=True):
    """A state that reaches ``range`` in truth, and by what the run is off there, and claims to be, both in its unit."""

    name: str
    unit: str
    range: float
    off: float
    claimed: float

    def words(self) -> str:
        """Say what was seen."""
        return (
            f"{self.name} stays within {self.range:.1e} {self.unit} and is off by {self.off:.1e} {self.unit} there: it is not "
            f"known by its own range, beside sizes against which an error of {self.claimed:.1e} {self.unit} is small"
        )


def uncertain(solution: Solution) -> dict[str, float]:
    """Return the states whose claimed errors are a good share of all that they reach, with what they reach."""
    estimate = solution.accuracy.error
    assert estimate is not None
    found = {}
    for q in solution.problem.states:
        reached = _reached(solution, q.name)
        claimed = estimate.by_state[q.name] * (estimate.nominal[q.name] + reached)
        if q.kind != "account" and reached > 0 and claimed > SHARE * reached:
            found[q.name] = reached
    return found


def lost(plan: Plan, solution: Solution) -> Lost | None:
    """Return the state of a run that is known least by its own range, by another run of the same ``plan``; None where all are
    known, or nothing."""
    doubted, states = uncertain(solution), plan.case.problem.states
    if not doubted:
        return None
    nominal = np.array([doubted.get(q.name, size) for q, size in zip(states, plan.nominal, strict=True)])
    options = replace(plan.options, max_steps=COSTLY * solution.statistics.steps + AT_LEAST)
    again = run_from(replace(plan, options=options, nominal=nominal), plan.case.y0, plan.case.z)
    estimate, claims = again.accuracy.error, solution.accuracy.error
    if estimate is None or claims is None or again.outcome not in ENDED:
        return None
    times = np.linspace(plan.case.begin, min(float(again.time[-1]), float(solution.time[-1])), POINTS)
    assert again.motion.states_at is not None and solution.motion.states_at is not None
    apart = np.abs(again.motion.states_at(times)[0] - solution.motion.states_at(times)[0]).max(axis=0)
    found = []
    for q, off in zip(states, apart.tolist(), strict=True):
        if q.name not in doubted:
            continue
        reached = _reached(again, q.name)
        alike = max(_reached(again, other.name) for other in states if other.unit == q.unit)
        still = estimate.by_state[q.name] * (estimate.nominal[q.name] + reached)
        if still <= SHARE * reached < off and reached > ROUNDING * alike:
            claimed = claims.by_state[q.name] * (claims.nominal[q.name] + reached)
            found.append(Lost(q.name, q.unit, reached, off, claimed))
    return max(found, key=lambda one: one.off / one.range, default=None)


def _reached(solution: Solution, name: str) -> float:
    return float(np.nan_to_num(np.abs(solution[name])).max(initial=0.0))

"""What is shorter than a step and lies within it: looked for between the stages of a run whose model has formulas that may be
so narrow (exponentials, hyperbolic functions, tables).

The polynomial of a step goes through what its stages saw. Where the derivative that the model gives on it is another one
than its own, by more than the errors of the step, the stages did not see all.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from msgspec.structs import replace

from ...case import Case, Progress
from ...integrate.trajectory import DenseOutput, Trajectory
from ...limits_of_time import LOOKS, PLACES_IN_A_STEP
from ...outcome import time_text
from ...results.consistency import Check
from ...results.evaluate import evaluate_rows
from .companion import Estimated, Plan, estimate, trajectory_of

EXPLICIT = ("dop853", "taylor")
LEAST = 8
"""Places that are looked at in a step, at least."""
TOLERANCES, LEAST_CHANGE = 100.0, 1e-9
"""What has been passed over changes a state by more than so many tolerances, and such a share of its size: below that the error that a
run states is the better answer than a run of many more steps."""
OF_ITS_LENGTH = 4
"""Steps in the shortest thing that was seen."""
ROUNDS = 3
"""How often a run is repeated: after what it has passed over it goes elsewhere."""
COSTLY, MOST_STEPS = 200_000, 1e-5
"""Steps of a repeated run at most: the first one stands if that takes more, and says so. No step is made shorter than the second
share of the run."""
SUSPICIOUS = 1e3
"""Errors of more tolerances may be those of a companion that has passed over something: it takes steps in which there are few of the
places that the run was looked at."""
BESIDE = 0.4
"""Share of the way to the next place over which the polynomial of a step is differentiated: nowhere beyond its ends, where a jump
may be."""


class MissedFeature(NamedTuple):
    """What was looked at: the longest time ``apart`` of two places; the first ``time`` at which something was passed over, and the
    longest ``step`` that shows it, None where nothing was."""

    apart: float
    time: float | None = None
    step: float | None = None


class ScannedRun(NamedTuple):
    """A run in which nothing was passed over, ``remarks`` on that, and the longest time ``apart`` of two places that were looked at,
    None where nobody looked."""

    plan: Plan
    main: Trajectory
    remarks: tuple[str, ...] = ()
    apart: float | None = None


def seen_between(plan: Plan, main: Trajectory, progress: Progress | None) -> ScannedRun:
    """Repeat a run that has passed over something in shorter steps, and say so; say how closely was looked, also for events."""
    seen = _seen_between(plan, main, progress)
    case = plan.case
    if seen.remarks or not case.problem.narrow_events or not case.apart > 0:
        return seen
    told = f"looked for narrow events every {_time(case, case.apart)} or closer: what is met for less may be missed"
    return seen._replace(remarks=(told,))


def _time(case: Case, time: float) -> str:
    return f"{time:.2g} {case.problem.time.unit}".rstrip()


def _seen_between(plan: Plan, main: Trajectory, progress: Progress | None) -> ScannedRun:
    case = plan.case
    if not case.problem.narrow or plan.method.fixed_step or main.failure is not None or main.interrupted:
        return ScannedRun(plan, main)
    met: float | None = None
    shown, best, left = plan, main, ""
    for _ in range(ROUNDS):
        look = look_between(shown, best)
        if look is None:
            return ScannedRun(plan, main)
        if look.step is None or look.time is None:
            break
        finer = replace(shown, case=replace(shown.case, max_step=look.step))
        bounded = replace(finer, options=replace(plan.options, max_steps=COSTLY, stiff_after=None))
        again = trajectory_of(bounded, plan.options.dense, progress)
        if again.failure is not None or again.interrupted:
            left = f"something narrow may have been passed over at {time_text(case.problem, look.time)}"
            break
        if not _differs(plan, best, again):
            break
        met = look.time if met is None else met
        shown, best = finer, again
    if look is None:
        return ScannedRun(plan, main)
    told = f"looked for what is narrow every {_time(case, look.apart)} or closer: what is met for less may be missed"
    told = f"{left}: the run could not be repeated with shorter steps" if left else told
    if met is None:
        return ScannedRun(plan, main, (told,), look.apart)
    at = time_text(case.problem, met)
    step = _time(case, shown.case.max_step)
    repeated = f"something narrow was passed over at {at}: the run was repeated with steps of at most {step}"
    return ScannedRun(shown, best, (repeated, told), look.apart)


def estimated_as_closely(
    seen: ScannedRun, estimated: Estimated, progress: Progress | None, listed: tuple[Check, ...]
) -> Estimated:
    """Make the companion of a run again in steps that show it what the run saw, where it tells of a large error: it may have passed
    over something itself, and what was seen would count as the error."""
    case, error = seen.plan.case, estimated.error
    if seen.apart is None or error is None or error.largest <= SUSPICIOUS * case.tolerance:
        return estimated
    bounded = replace(case, max_step=min(case.max_step, PLACES_IN_A_STEP * seen.apart))
    again = estimate(replace(seen.plan, case=bounded), seen.main, progress, listed)
    return again if again.error is not None and again.error.largest < error.largest else estimated


def look_between(plan: Plan, main: Trajectory) -> MissedFeature | None:
    """Compare derivatives along the polynomials of a run with those of the model; None where there is none to compare."""
    dense, case = main.dense, plan.case
    if not isinstance(dense, DenseOutput) or not dense.begin.size:
        return None
    told = main.statistics
    if told.method not in EXPLICIT or told.stiff_time is not None or told.switch_time is not None:
        return (
            None  # where it is stiff, an error of the state becomes one of the derivative many times as large
        )
    problem = case.problem
    each = np.maximum(np.ceil(dense.length * (LOOKS / dense.length.sum())).astype(int), LEAST)
    apart = np.repeat(dense.length / each, each)
    first = np.repeat(np.cumsum(each) - each, each)  # of the places of each step
    times = np.repeat(dense.begin, each) + (np.arange(first.size) - first + 0.5) * apart
    beside = apart * BESIDE
    states = dense(times)
    slopes = (dense(times + beside) - dense(times - beside)) / (2 * beside[:, None])
    modes = None if main.happened is None else main.happened.discretes(times, problem.ny)
    rates = evaluate_rows(case, "rhs", times, states, modes)
    sizes = _noticed(plan) * (plan.nominal + np.abs(states))
    # short steps err in rates, not in states
    lasting = np.minimum(apart, np.repeat(dense.length, each) * (each.size / LOOKS))
    change = np.abs(rates - slopes) * lasting[:, None] / sizes
    unseen = np.any(change > 1, axis=1)
    largest = float(apart.max())
    if not np.any(unseen):
        return MissedFeature(largest)
    ends = np.flatnonzero(np.diff(np.r_[False, unseen, False].astype(int)))
    spans = times[ends[1::2] - 1] - times[ends[::2]] + apart[ends[::2]]
    least = MOST_STEPS * float(dense.length.sum())
    return MissedFeature(
        largest, float(times[np.argmax(unseen)]), max(least, float(spans.min()) / OF_ITS_LENGTH)
    )


def _differs(plan: Plan, one: Trajectory, other: Trajectory) -> bool:
    """Whether two runs differ by more than their tolerances explain."""
    shared = min(one.t.size, other.t.size)
    if one.t.size != other.t.size:
        return True
    sizes = _noticed(plan) * (plan.nominal + np.abs(one.y[:shared]))
    return bool(np.any(np.abs(one.y[:shared] - other.y[:shared]) > sizes))


def _noticed(plan: Plan) -> float:
    return max(TOLERANCES * plan.case.tolerance, LEAST_CHANGE)

"""The true error of a run: the same model solved again in higher precision."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace
from numpy.typing import NDArray

from ..runtime.outcome import Outcome
from ..runtime.reference.high_precision import PrecisionReference, ReferenceFailed
from ..runtime.studies.runs.simulate import Plan
from .references import EXPLICIT, SERIES, ReferenceCode, solve

if TYPE_CHECKING:
    from ..runtime.problem import Array
    from ..runtime.results.solution import Solution

Rows = NDArray[np.integer[Any]]

CLEAR = 1.0
"""Share of the error of a run up to which the reference may be in doubt: that is the error of the looser one of its
two best runs, which the other one is a hundred times nearer to the truth than."""
ROUNDING = 1e3 * float(np.finfo(float).eps)
"""Errors below are not told apart."""
LADDERS = {
    "taylor": (1e-22, 1e-27),
    "dop853": (1e-13, 1e-16, 1e-19, 1e-22),
    "radau5": (1e-9, 1e-12, 1e-15),
}
"""Tolerances of the reference: looser to begin with than for a benchmark, as it has only to be clearer than the run."""
BESIDE = 1e-6
"""Share of the duration within which a row counts as beside an event."""
POINTS = 9
"""Times at which a run is compared, the last one among them."""


class TrueErrors(Struct, frozen=True):
    """``by_state``: largest |error| / (nominal + |value|) at the compared times up to ``horizon``, beyond which the
    reference itself is in doubt. ``largest`` of all states."""

    largest: float
    by_state: dict[str, float]
    horizon: float
    doubt: float
    precision: str


def true_errors(code: ReferenceCode, plan: Plan, solution: Solution, seconds: float) -> TrueErrors:
    """Compare a run with its reference at some of its output times. What ran by Taylor's method is judged by another one.

    ``seconds``: how long the reference may take. Raises ReferenceFailed, also where it is not clear enough to judge
    the run at any time.
    """
    rows = _rows(plan, solution)
    times: Array = solution.time[rows]
    if not times.size:
        raise ReferenceFailed("the run has no length")
    done = solution.statistics
    stiff = done.method == "radau5" or done.stiff_time is not None
    method = "radau5" if stiff else EXPLICIT if done.method == SERIES else code.explicit
    case, names = plan.case, [quantity.name for quantity in plan.case.problem.states]
    claimed = solution.accuracy.error  # a run may have been repeated with errors measured against other sizes
    nominal = plan.nominal if claimed is None else np.array([claimed.nominal[n] for n in names])
    if (
        done.longest_step
    ):  # a run may have been repeated in shorter steps, to see what lies between longer ones
        case = replace(case, max_step=min(case.max_step, done.longest_step))
    made = solve(code, case, nominal, times, method, seconds, ladders=LADDERS)
    got = np.array([solution[name][rows] for name in names]).T
    scaled = np.abs((got - made.high) - made.low) / (made.nominal + np.abs(made.high))
    count = _clear(made, scaled)
    if not count:
        raise ReferenceFailed(f"the two best references differ by {made.doubt[0]:.0e} at t = {times[0]:g}")
    largest = scaled[:count].max(axis=0)
    return TrueErrors(
        float(largest.max()),
        dict(zip(names, largest.tolist(), strict=True)),
        float(times[count - 1]),
        float(made.doubt[:count].max()),
        made.precision,
    )


def _rows(plan: Plan, solution: Solution) -> Rows:
    """Choose rows at which a run is compared: evenly spread, and not beside events, whose times have errors of their own."""
    if plan.case.problem.hybrid is None:
        return _even(solution.time)
    return even_rows(solution.time, solution)


def even_rows(time: Array, run: Solution) -> Rows:
    """Choose rows of some times, evenly spread, within a run and not beside its events; none at its begin."""
    begin, end = run.motion.columns.case.begin, run.time[-1]
    last = end if run.outcome is not Outcome.TERMINATED else end - BESIDE * (end - run.time[0])
    apart = np.full(time.size, np.inf)
    for event in run.events:
        apart = np.minimum(apart, np.abs(time - event.time))
    free = np.flatnonzero((apart > BESIDE * (end - run.time[0])) & (time > begin) & (time <= last))
    if not free.size:
        return free
    chosen: Rows = free[np.unique(np.linspace(0, free.size - 1, POINTS).round().astype(int))]
    return chosen


def _even(time: Array) -> Rows:
    rows: Rows = np.unique(np.linspace(0, time.size - 1, POINTS).round().astype(int))[1:]
    return rows


def _clear(made: PrecisionReference, scaled: Array) -> int:
    """Count the leading times at which the reference is clearly nearer to the truth than the run."""
    allowed = CLEAR * np.maximum(scaled.max(axis=1), ROUNDING)
    unclear = np.flatnonzero(~(made.doubt <= allowed))
    return int(unclear[0]) if unclear.size else made.t.size

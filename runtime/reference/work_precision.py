"""Error against run time: methods over ladders of tolerances or steps, measured on a reference.

Run time is that of the method alone: compiled, warm, the median of repeats, without companion run. The error is
the largest one over the output times and all states, relative to nominal + |value|.
"""

from __future__ import annotations

import functools
import math
import statistics
import time
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from ..case import Case
from ..integrate.choose_method import Method, choose_method
from ..integrate.kernel_run import run_kernel
from ..integrate.solver import SolverOptions
from ..integrate.trajectory import Trajectory
from ..outcome import SimulationError
from ..problem import Array
from .high_precision import PrecisionReference

TOLERANCES = tuple(10.0**-k for k in range(3, 15))
STEPS_OF_FIXED = tuple(round(20 * 2.0**k) for k in range(2, 11))
"""Numbers of steps in the whole run, for methods of fixed step."""
REPEATS = 9
PATIENCE = 0.3
"""Seconds for which a measurement is repeated."""
LEAST_TURNS, MOST_TURNS = 5, 25
"""How often points whose times are compared are measured in turns."""
ONCE = 1.0
"""Seconds of a run above which it is made once: its time is that with output."""
MOST_STEPS = 1_000_000
"""Steps after which a run counts as failed."""
GIVEN_UP = ("given up", "too many steps")
LONGEST = 2.0
"""Seconds after which a run is given up, and with it the rest of its ladder."""


EXACT = 1e-17
"""What an error of zero counts as, on logarithmic scales."""


class WorkPrecisionPoint(Struct, frozen=True):
    """One run: ``setting`` is the tolerance or the step. ``error`` is None where the run failed: ``failure``."""

    method: str
    setting: float
    error: float | None
    error_at_end: float | None
    seconds: float
    spread: float
    """Range of the middle half of the times over their median."""
    steps: int
    evaluations: int
    failure: str = ""
    given_up: bool = False
    """It took too many seconds or steps; tighter settings were left out."""
    quartiles: tuple[float, float] | None = None
    """Of the times, in seconds."""
    fixed: bool = False
    """``setting`` is a step."""
    claimed: float | None = None
    """The error that a run with this setting estimates itself, the largest over its time, and what it truly is at the measured times;
    None where no such run was made."""
    claimed_of: float | None = None
    rounds: tuple[float, ...] = ()
    """Seconds of each round in which the point was timed in turns with others."""


Peer = Callable[[Case, SolverOptions], Trajectory]
"""A run by others: states at the times of the grid, or, where that is the start alone, whatever costs nothing further. Of the
options it takes method, tolerance, nominal values and seconds. Raises SimulationError if the problem is none for it."""


class Task(Struct, frozen=True, eq=False):
    """What methods are measured on. A run that takes more than ``longest`` seconds is given up."""

    case: Case
    nominal: Array
    reference: PrecisionReference
    longest: float = LONGEST


def measure(
    task: Task,
    method: str,
    tolerances: Sequence[float] = TOLERANCES,
    *,
    enough: float = 0.0,
    peer: Peer | None = None,
) -> list[WorkPrecisionPoint]:
    """Measure one method over a ladder: tolerances, or steps where it takes fixed ones. ``peer`` runs it, where it is none of
    the kernel's.

    The ladder ends where a run is given up, and where an error is at most ``enough``. Raises ``SimulationError`` if the
    method does not fit the model.
    """
    case = replace(task.case, method=method, step=None, grid=task.reference.t)
    task = replace(task, case=case)
    if peer is not None:
        return _ladder(tolerances, lambda setting: _peer(task, method, setting, peer), enough)
    try:
        chosen = choose_method(case)
        settings = list(tolerances)
    except SimulationError:
        chosen = choose_method(replace(case, step=1.0))
        settings = [(case.stop - case.begin) / count for count in STEPS_OF_FIXED]
    return _ladder(settings, lambda setting: _point(task, chosen, setting), enough)


def _ladder(
    settings: Sequence[float],
    point: Callable[[float], WorkPrecisionPoint],
    enough: float,
) -> list[WorkPrecisionPoint]:
    points: list[WorkPrecisionPoint] = []
    for setting in settings:
        made = point(setting)
        points.append(made)
        if made.given_up or (made.error is not None and made.error <= enough):
            break
    return points


def _point(task: Task, method: Method, setting: float) -> WorkPrecisionPoint:
    run = _by_kernel(task, method.name, setting, fixed=method.fixed_step)
    alone = replace(task.case, grid=task.case.grid[:1])
    made = _repeated(method.name, setting, task.reference, lambda: run(alone), lambda: run(task.case))
    return replace(made, fixed=method.fixed_step)


def _by_kernel(task: Task, method: str, setting: float, *, fixed: bool) -> Callable[[Case], Trajectory]:
    options = SolverOptions(
        method,
        task.case.tolerance if fixed else setting,
        task.nominal,
        setting if fixed else None,
        max_steps=MOST_STEPS,
        seconds=task.longest,
    )
    return lambda case: run_kernel(case, options)


def timed_in_turns(
    task: Task, points: Sequence[WorkPrecisionPoint], peers: Mapping[str, Peer]
) -> list[WorkPrecisionPoint]:
    """Measure the times of points again, in turns: what the machine does beside meets all of them alike."""
    runs: list[Callable[[], Trajectory]] = []
    for p in points:
        case = replace(task.case, method=p.method, step=None, grid=task.reference.t[:1])
        if p.method in peers:
            options = SolverOptions(p.method, p.setting, task.nominal)
            runs.append(functools.partial(peers[p.method], case, options))
        else:
            runs.append(functools.partial(_by_kernel(task, p.method, p.setting, fixed=p.fixed), case))
    taken: list[list[float]] = [[] for _ in points]
    begun = time.thread_time()
    while len(taken[0]) < LEAST_TURNS or (
        len(taken[0]) < MOST_TURNS and time.thread_time() - begun < PATIENCE * len(points)
    ):
        for run, seconds in zip(runs, taken, strict=True):
            seconds.append(_timed(run)[1])
    return [_with_times(p, seconds) for p, seconds in zip(points, taken, strict=True)]


def _timed(run: Callable[[], Trajectory]) -> tuple[Trajectory, float]:
    """Run, and tell its seconds: by the clock, which a busy machine prolongs, or by the processor's, with what is around the run;
    both are too long, one less."""
    begun = time.thread_time()
    done = run()
    return done, min(done.statistics.run_time, time.thread_time() - begun)


def _with_times(p: WorkPrecisionPoint, seconds: Sequence[float]) -> WorkPrecisionPoint:
    taken = statistics.median(seconds)
    low, high = np.percentile(seconds, (25, 75)).tolist()
    spread = (high - low) / taken if taken > 0 else 0.0
    return replace(p, seconds=taken, quartiles=(low, high), spread=spread, rounds=tuple(seconds))


def _peer(task: Task, method: str, setting: float, runs: Peer) -> WorkPrecisionPoint:
    reference = task.reference

    def run(case: Case, seconds: float = math.inf) -> Trajectory:
        return runs(case, SolverOptions(method, setting, task.nominal, seconds=seconds))

    alone = replace(task.case, grid=task.case.grid[:1])
    # Looking at the clock costs time: only the run that is not timed does it.
    return _repeated(method, setting, reference, lambda: run(alone), lambda: run(task.case, task.longest))


def _repeated(
    name: str,
    setting: float,
    reference: PrecisionReference,
    timed: Callable[[], Trajectory],
    run: Callable[[], Trajectory],
) -> WorkPrecisionPoint:
    """Measure the error of a run, and repeat it without its grid for the median of its times."""
    done, once = _timed(run)
    alone = done
    seconds = [once] if done.failure is not None or done.interrupted or once > ONCE else []
    while not seconds or (len(seconds) < REPEATS and sum(seconds) < PATIENCE and alone is not done):
        alone, taken = _timed(timed)
        seconds.append(taken)
    taken = statistics.median(seconds)
    low, high = np.percentile(seconds, (25, 75)).tolist()
    spread = (high - low) / taken if taken > 0 else 0.0
    made = alone.statistics
    if done.interrupted:
        raise KeyboardInterrupt
    if done.failure is not None:
        message, given_up = done.failure.message, done.failure.kind in GIVEN_UP
        return WorkPrecisionPoint(
            name, setting, None, None, taken, spread, made.steps, made.evaluations, message, given_up
        )
    errors = reference.error(done.y)
    if not np.isfinite(errors).all():
        message = "the result is not finite"
        return WorkPrecisionPoint(
            name, setting, None, None, taken, spread, made.steps, made.evaluations, message
        )
    return WorkPrecisionPoint(
        name,
        setting,
        float(errors.max()),
        float(errors[-1]),
        taken,
        spread,
        made.steps,
        made.evaluations,
        quartiles=(low, high),
    )


def fastest(points: Sequence[WorkPrecisionPoint], error: float) -> WorkPrecisionPoint | None:
    """The fastest run whose error is at most ``error``; None if there is none."""
    reached = [p for p in points if p.error is not None and p.error <= error]
    return min(reached, key=lambda p: p.seconds, default=None)


def around(points: Sequence[WorkPrecisionPoint], error: float) -> list[WorkPrecisionPoint]:
    """Return the points from which ``time_to_reach`` follows: none where no run is as accurate."""
    known = [(max(p.error, EXACT), p.seconds, p) for p in points if p.error is not None]
    better = [k for k in known if k[0] <= error]
    if not better:
        return []
    low = min(better, key=lambda k: (k[1], -k[0]))
    cheaper = [k for k in known if k[0] > error and k[1] < low[1]]
    return [low[2], *([max(cheaper, key=lambda k: k[1])[2]] if cheaper else [])]


def time_to_reach(points: Sequence[WorkPrecisionPoint], error: float) -> float | None:
    """Seconds of one method at which its error is ``error``: between two runs, on the line through their
    logarithms; None where no run is as accurate. An error of zero counts as one below rounding."""
    near = around(points, error)
    return time_between(near, error, [p.seconds for p in near])


def time_between(
    points: Sequence[WorkPrecisionPoint], error: float, seconds: Sequence[float]
) -> float | None:
    """Return the same of the points that ``around`` gives, with such times of them."""
    if len(points) < 2:
        return next(iter(seconds), None)
    low, high = (max(p.error or 0.0, EXACT) for p in points)
    share = np.log(error / low) / np.log(high / low)
    return float(np.exp(np.log(seconds[0]) + share * np.log(seconds[1] / seconds[0])))

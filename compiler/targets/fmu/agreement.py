"""How far two integrators of one model may differ: a bound from each of them at two tolerances.

The native run has a companion at a tolerance a hundred times tighter; their difference is its error, and ``SAFETY``
covers what such an estimate may miss. The run of another integrator has a companion at a tolerance a hundred times
looser; their difference is the error of the companion, an upper bound. The sum bounds the difference of the two runs.
It is relative to the size of each state (nominal value and largest value), does not decrease in time, and is at least
``SAFETY`` times the tolerances. Where motion is chaotic the bound grows, and the runs are compared until it reaches ``AGREED``. But then a
native run at the loose tolerance has to diverge, too. If it stays within ``STEADY``, the motion is not chaotic, and
two runs of the other integrator that disagree are an error.

The times of events have errors of their own: between the events of two runs their states differ by the whole jump, and near the
end of a sequence of shrinking bounces two runs differ in the number of bounces. So runs with events are compared as curves in time and
state: a state is compared with the state before or after an event at another time, and the difference of the times is divided by the
``pace``, the shortest time in which a state changes by its size. On smooth pieces this is at least half of the difference at one time.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from msgspec import Struct

from mechc.runtime.problem import Array

SAFETY = 10.0
AGREED = 1e-2
"""Bound beyond which runs are no longer compared: they go ways of their own."""
STEADY = 1e-5
"""Change of the native run by the loose tolerance below which its motion magnifies no errors: a thousandth of ``AGREED``."""


class FmuMotion(Struct, frozen=True):
    """A run: states [n, ny] at times that are ``step`` apart, and both sides [k, 2, ny] of its events at ``instants``.

    ``rates``: the largest derivative of each state that was seen; None where nobody asks for it.
    """

    times: Array
    step: float
    states: Array
    instants: Array
    sides: Array
    rates: Array | None = None


class Agreement(Struct, frozen=True):
    """``difference`` and ``bound`` at the time at which they come nearest; ``until``: end of the comparison."""

    difference: float
    bound: float
    time: float
    until: float
    parted: bool = False
    """The comparison ended because the bound had become too large."""

    @property
    def passed(self) -> bool:
        return self.difference <= self.bound

    def __str__(self) -> str:
        return f"{self.difference:.1e} at time {self.time:g}, the bound there is {self.bound:.1e}"


def distance(a: Array, b: Array, size: Array) -> Array:
    """Return the largest difference of two runs at each time, over the sizes of the states."""
    n = min(len(a), len(b))
    found: Array = np.max(np.abs(a[:n] - b[:n]) / size, axis=1, initial=0.0)
    return found


def apart(a: Array, b: FmuMotion, size: Array, pace: float) -> Array:
    """Return how far the states ``a`` at the times of ``b`` are from the curve of ``b``, as far as both go.

    Zero as ``pace`` compares at the same times only.
    """
    found = distance(a, b.states, size)
    if not (pace > 0 and len(b.instants)):
        return found
    for k, time in enumerate(b.times[: len(found)]):
        # farther in time than what is found at the same time is no nearer
        reach = pace * found[k] if np.isfinite(found[k]) else np.inf
        first, last = np.searchsorted(b.instants, (time - reach, time + reach))
        if last > first and np.isfinite(a[k]).all():
            late = np.abs(b.instants[first:last] - time) / pace
            off = np.max(np.abs(b.sides[first:last] - a[k]) / size, axis=2, initial=0.0)
            found[k] = np.fmin(found[k], np.min(np.maximum(late[:, None], off)))
    return found


def motion_of(times: Array, step: float, states: Array, events: Sequence[tuple[float, Array]]) -> FmuMotion:
    """Return a run from what was noted of each event: its time and both sides [2, ny]."""
    sides = np.array([sides for _, sides in events]).reshape(len(events), 2, states.shape[1])
    return FmuMotion(times, step, states, np.array([time for time, _ in events]), sides)


def pace_of(motion: FmuMotion, size: Array) -> float:
    """Return the shortest time in which a state that moves at its largest rate changes by its size; 0: none is known."""
    if motion.rates is None:
        return 0.0
    fastest = float(np.max(motion.rates / size, initial=0.0))
    return 1 / fastest if 0 < fastest < np.inf else 0.0


def agreement(times: Array, difference: Array, error: Array, tolerance: float) -> Agreement:
    """Judge differences at times by the estimated errors of both runs at these times.

    ``error``: with ``SAFETY`` where it is an estimate, without where it is a bound.
    """
    n = min(len(times), len(difference), len(error))
    bound = np.maximum.accumulate(error[:n]) + SAFETY * tolerance
    within = bound <= AGREED
    last = n if within.all() else int(np.argmin(within))
    if not last:
        return Agreement(0.0, float(bound[0]), float(times[0]), float(times[0]), parted=True)
    ratio = np.where(np.isfinite(difference[:last]), difference[:last] / bound[:last], np.inf)
    k = int(np.argmax(ratio))
    until = float(times[last - 1])
    return Agreement(float(difference[k]), float(bound[k]), float(times[k]), until, parted=last < n)

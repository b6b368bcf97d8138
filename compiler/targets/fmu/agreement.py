"""How far two integrators of one model may be apart: by what each of them differs from itself at another tolerance.

The native run has a companion at a tolerance a hundred times tighter; their difference is its error, and ``SAFETY``
covers what such an estimate may miss. The run of another integrator has a companion at a tolerance a hundred times
looser; their difference is the error of the companion, an upper bound. The sum bounds the difference of the two runs.
It is over the size of each state (nominal value and largest value), the largest so far in time, and never below
``SAFETY`` times the tolerances. Where motion is chaotic the bound grows, and it is compared up to ``AGREED``: but then a
native run at the loose tolerance has to go elsewhere, too. Where that stays within ``STEADY`` the motion is not chaotic, and
two runs of the integrator that disagree are an error.
"""

from __future__ import annotations

import numpy as np
from msgspec import Struct

from mechc.runtime.problem import Array

SAFETY = 10.0
AGREED = 1e-2
"""Bound beyond which runs are no longer compared: they go ways of their own."""
STEADY = 1e-5
"""Change of the native run by the loose tolerance below which its motion magnifies no errors: a thousandth of ``AGREED``."""


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

"""How small changes of the start have grown along a motion, and until when its figures are to be believed."""

from __future__ import annotations

import math
import sys
from typing import Any

import numpy as np
from msgspec import Struct

from ..outcome import SimulationError
from ..problem import Array

EPSILON = sys.float_info.epsilon
FOLDS = 3.0
"""Powers of e by which changes must have grown in the later part of a motion to be called exponential."""
FEWEST = 8
"""Times that are needed to tell."""


class Condition(Struct, frozen=True, eq=False):
    """``growth`` [n] at ``time`` [n]: by how much the least favourable small change of the start has grown, in nominal sizes (the
    norm of the derivative of the flow). ``e_fold``: the time in which changes grow e-fold, None where they do not grow
    exponentially. ``tolerance``: that of the run."""

    time: Array
    growth: Array
    tolerance: float
    e_fold: float | None = None

    @property
    def horizon(self) -> float | None:
        """When an error as large as the tolerance has grown to the size of the state: later figures are not those of the model.
        Beyond the motion it is extrapolated; None where changes do not grow so far."""
        return self.until(1 / self.tolerance)

    @property
    def longest(self) -> float | None:
        """The same for the rounding of numbers in double precision, which no tolerance is below."""
        return self.until(1 / EPSILON)

    def until(self, growth: float) -> float | None:
        """Give when changes have grown so much."""
        reached = np.flatnonzero(self.growth >= growth)
        if reached.size:
            k = slice(max(int(reached[0]) - 1, 0), int(reached[0]) + 1)
            return float(np.interp(math.log(growth), np.log(self.growth[k]), self.time[k]))
        if self.e_fold is None:
            return None
        return float(self.time[-1] + self.e_fold * math.log(growth / self.growth[-1]))

    def summary(self) -> dict[str, Any]:
        """Give what JSON holds, in SI."""
        return {
            "growth": float(self.growth[-1]),
            "e_fold": self.e_fold,
            "horizon": self.horizon,
            "longest_horizon": self.longest,
        }


def condition_of(time: Array, growth: Array, tolerance: float) -> Condition:
    """Tell exponential growth from that by a power of the time, which regular motions have."""
    finite = np.isfinite(growth) & (growth > 0)
    if not finite.all():  # beyond the largest number
        end = int(np.argmin(finite))
        time, growth = time[:end], growth[:end]
    return Condition(time, growth, tolerance, _e_fold(time, growth))


def _e_fold(time: Array, growth: Array) -> float | None:
    span = time - time[0]
    later = span >= span[-1] / 4
    if later.sum() < FEWEST or span[-1] <= 0:
        return None
    t, folds = span[later], np.log(growth[later])
    if folds[-1] - folds[0] < FOLDS:
        return None
    left = {}
    for name, x in (("exponential", t), ("power", np.log(t))):
        slope, constant = np.polyfit(x, folds, 1)
        left[name] = (float(np.square(folds - slope * x - constant).sum()), float(slope))
    if left["power"][0] <= left["exponential"][0] or left["exponential"][1] <= 0:
        return None
    return 1 / left["exponential"][1]


def no_condition() -> SimulationError:
    return SimulationError(
        "nobody asked how errors grow along this run",
        help="ask for it: --condition to the command, or condition=True in Python",
    )

"""The nearest point that fulfils equations: damped Gauss-Newton along the directions that may move.

Minimise |D (x - guess)|^2 + |e|^2 subject to c(x) = 0, with weights D and wishes e. Each step solves the linear
problem by a singular value decomposition, so that equations that repeat others do no harm. Steps longer than half a
characteristic size are shortened, and steps that raise the merit function |...|^2/2 + mu |c| are halved. Close to the
end the part along the equations is stretched by what the step before has left of it (A. Aitken 1937): steps do not see
the curvature of the equations, by which the nearest point may be much nearer or farther. What no equation moves takes no
part, so that it keeps every bit.

J. Nocedal, S. Wright, Numerical Optimization, 2nd ed., Springer 2006, sections 10.3 and 15.4.

kernel/start/nearest.c does the same by orthogonal factors. What follows the marker stands in modules of the Python target.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..problem import Array

# ---- copied from here

STEPS = 200
LONGEST = 0.5
CLOSE = 1e-7
NEAR_BY = 0.05
RESTORATION = 50
ROUNDING = 1e-16
RANK = 1e-10
"""Singular values below this share of the largest one count as zero."""
CONVERGED = 1e-15
LEFT = 1e-11
"""Of a step along the equations: what is no way any more."""
FULFILLED = 1e-11
"""Largest residual, as a share of a characteristic size, that counts as none."""


class Local(NamedTuple):
    """Everything at one point: ``hard`` and ``soft`` residuals, their Jacobians, deviations from the guess [n]; the ``least``
    scale of each hard row."""

    hard: Array
    hard_jacobian: Array
    soft: Array
    soft_jacobian: Array
    deviation: Array
    least: Array


class Nearest(NamedTuple):
    """``x``: the point reached; ``local``: everything there; ``scale`` of each hard row; ``fulfilled``: whether all
    of them vanish; ``steps`` taken; ``settled``: whether no step that would come nearer was left."""

    x: Array
    local: Local
    scale: Array
    fulfilled: bool
    steps: int
    settled: bool

    @property
    def violations(self) -> Array:
        """Residuals of the hard rows as lengths in characteristic sizes."""
        return np.abs(self.local.hard) / self.scale


def nearest(
    at: Callable[[Array], Local],
    move: Callable[[Array, Array], Array],
    start: Array,
    free: NDArray[np.intp],
    weights: Array,
    *,
    linear: bool = False,
) -> Nearest:
    """Find the point nearest to the guess. ``free``: indices of the directions that may move [m]; ``weights`` [n].

    ``move(x, d)`` goes from x along d [n]. ``linear``: the equations are, and residuals have the size that they have at
    the start, if that is more than 1: rates may be of any size.
    """
    x, here, taken, settled = start, at(start), 0, False
    scale = np.zeros(here.hard.size)
    unit, share, factor = 1.0, 1.0, 1.0
    loose, d = free, np.zeros(weights.size)
    while taken < STEPS:
        taken += 1
        free = moved(here, loose)
        w = weights[free]
        before = np.zeros(free.size) if linear else w * d[free]
        jacobian = here.hard_jacobian / weights
        scale = np.maximum(scale, np.maximum(here.least, np.abs(jacobian).max(axis=1, initial=0.0)))
        rows = np.where(scale > 0, scale, 1.0)
        if linear:
            unit = max(unit, _worst(here, rows))
        step, mu, share, left = _step(here, rows, free, w, before, (share, factor))
        size = float(np.abs(step).max(initial=0.0))
        if not np.isfinite(size) or size <= CONVERGED * unit:
            settled = left <= LEFT
            break
        factor = 1.0 if linear else min(1.0, LONGEST / size)
        step *= factor
        merit = _merit(here, rows, w, free, mu)
        for _ in range(12):
            d = np.zeros(weights.size)
            d[free] = step / w
            there = at(move(x, d))
            value = _merit(there, rows, w, free, mu)
            # close to rounding the merit function says nothing any more
            if value < merit or (np.isfinite(value) and np.abs(step).max() < CLOSE * unit):
                break
            step, factor = step / 2, factor / 2
        else:
            break
        x, here = move(x, d), there
        if np.abs(step).max() < 1e-12 * unit and value >= merit:
            settled = left <= LEFT
            break
    rows = np.where(scale > 0, scale, 1.0)
    x, here, further = restored(at, move, x, here, rows, loose, weights)
    fulfilled = bool(_worst(here, rows) <= FULFILLED * unit)
    return Nearest(x, here, rows, fulfilled, taken + further, settled)


def restored(
    at: Callable[[Array], Local],
    move: Callable[[Array, Array], Array],
    x: Array,
    here: Local,
    rows: Array,
    loose: NDArray[np.intp],
    weights: Array,
) -> tuple[Array, Local, int]:
    """Go on by the shortest steps onto the equations alone, halved where they lead away, as far as rounding allows: the
    search for the nearest point may come to rest beside them. Return the point, everything there, and the steps."""
    for taken in range(RESTORATION):
        worst = _worst(here, rows)
        if not worst > ROUNDING:
            return x, here, taken
        free = moved(here, loose)
        w = weights[free]
        step = _onto(here, rows, free, w)
        size = float(np.abs(step).max(initial=0.0))
        if not np.isfinite(size):
            return x, here, taken
        far = worst > FULFILLED
        step *= min(1.0, LONGEST / max(size, LONGEST))
        for _ in range(13 if far else 1):
            d = np.zeros(weights.size)
            d[free] = step / w
            there = at(move(x, d))
            if _worst(there, rows) < (worst if far else worst / 2):
                break
            step = step / 2
        else:
            return x, here, taken
        x, here = move(x, d), there
    return x, here, RESTORATION


def moved(here: Local, loose: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return what is away from its guess, and what equations connect with that or with an equation that is off."""
    touched = np.vstack([here.hard_jacobian, here.soft_jacobian])[:, loose] != 0
    rows = np.concatenate([here.hard, here.soft]) != 0
    reached = here.deviation[loose] != 0
    while True:
        rows = rows | (touched & reached).any(axis=1)
        further = reached | (touched & rows[:, None]).any(axis=0)
        if (further == reached).all():
            break
        reached = further
    moved: NDArray[np.intp] = loose[reached]
    return moved


def _along_share(step: Array, before: Array, share: float, factor: float) -> float:
    """Return the share of a step along the equations that ends it, as far as the step ``before`` tells, of which a
    ``factor`` was taken."""
    squares, size = float(before @ before), float(np.abs(step).max(initial=0.0))
    if not squares > 0 or not size < NEAR_BY:
        return 1.0
    left = squares - share * factor * float(before @ step)
    best = share * factor * squares / left if left > 0 else 1.0
    return min(max(best, share / 4), 1.0, 2 * share)


def _worst(here: Local, rows: Array) -> float:
    return float((np.abs(here.hard) / rows).max(initial=0.0))


def _step(
    here: Local, rows: Array, free: NDArray[np.intp], w: Array, before: Array, shares: tuple[float, float]
) -> tuple[Array, float, float, float]:
    """The step in scaled directions, the weight of the equations in the merit function, the share of the part along
    them that it holds, and the size of all of that part; ``before``: the last step, with its ``shares`` of that part and
    of the whole."""
    c = here.hard / rows
    matrix = here.hard_jacobian[:, free] / w / rows[:, None]
    if not (np.isfinite(c).all() and np.isfinite(matrix).all()):
        return np.full(free.size, np.nan), 0.0, 1.0, np.inf
    left, values, right = np.linalg.svd(matrix, full_matrices=True)
    rank = rank_of(values)
    particular = -right[:rank].T @ ((left[:, :rank].T @ c) / values[:rank])
    wishes = np.vstack([np.eye(free.size), here.soft_jacobian[:, free] / w])
    wanted = np.concatenate([w * here.deviation[free], here.soft])
    null = right[rank:].T
    along = np.zeros(null.shape[1])
    if along.size:
        along = np.linalg.lstsq(wishes @ null, -(wanted + wishes @ particular), rcond=None)[0]
    whole = null @ along
    share = _along_share(whole, before, *shares)
    step = particular + share * whole
    pull = wishes.T @ (wanted + wishes @ step)
    multipliers = left[:, :rank] @ ((right[:rank] @ pull) / values[:rank]) if rank else np.zeros(0)
    mu = 1.0 + 2.0 * float(np.linalg.norm(multipliers))
    return step, mu, share, float(np.abs(whole).max(initial=0.0))


def rank_of(values: Array) -> int:
    return int((values > RANK * max(values.max(initial=0.0), 1e-300)).sum())


def _onto(here: Local, rows: Array, free: NDArray[np.intp], w: Array) -> Array:
    """The shortest step in scaled directions that fulfils the linearised equations."""
    c = here.hard / rows
    matrix = here.hard_jacobian[:, free] / w / rows[:, None]
    if not (np.isfinite(c).all() and np.isfinite(matrix).all()):
        return np.full(free.size, np.nan)
    left, values, right = np.linalg.svd(matrix, full_matrices=False)
    rank = rank_of(values)
    step: Array = -right[:rank].T @ ((left[:, :rank].T @ c) / values[:rank])
    return step


def _merit(here: Local, rows: Array, w: Array, free: NDArray[np.intp], mu: float) -> float:
    deviation = w * here.deviation[free]
    return float((deviation @ deviation + here.soft @ here.soft) / 2 + mu * np.linalg.norm(here.hard / rows))

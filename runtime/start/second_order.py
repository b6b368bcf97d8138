"""The nearest point that fulfils equations, from another one that does: Newton's method along them.

Where equations bend so much that steps which see their slopes alone go to and fro, the search of ``gauss_newton`` ends
somewhere on them. From there |D (x - guess)|^2 + |e|^2 is minimised within them: the second derivatives of the Lagrange
function along the equations are differences of first ones; a share of the identity is added until they are positive,
and each step is brought back onto the equations before it is judged.

Where slopes say nothing, as those of a kinetic energy at rest, the search ends beside equations that bend towards zero. It
leaves such a point along the direction in which the sum of their squares falls most.

J. Nocedal, S. Wright, Numerical Optimization, 2nd ed., Springer 2006, sections 3.4 and 12.3.

kernel/start/second_order.c does the same. What follows the marker stands in modules of the Python target.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..problem import Array
from .gauss_newton import CLOSE, FULFILLED, LONGEST, Local, Nearest, moved, rank_of, restored

# ---- copied from here

REFINEMENTS = 60
NUDGE = 1e-6
"""Of a characteristic size: where first derivatives are compared for second ones."""
FLATTEST = 1e-3
"""Least second derivative that a step believes; along a line it is 1."""
SHIFTS = 200
"""How often what is added doubles, until a curvature is beyond all sizes."""
ARRIVED = 1e-14
POWERS = 300
"""Products with a matrix that turn a direction into that of its least eigenvalue."""
SPREAD = 0.6180339887498949
"""A direction that is hardly orthogonal to any other: its entries are 1/(1 + k times this)."""
BENT = 1e-6
"""Of the largest curvature: a smaller one leads nowhere."""


def refined(
    at: Callable[[Array], Local],
    move: Callable[[Array, Array], Array],
    found: Nearest,
    loose: NDArray[np.intp],
    weights: Array,
) -> Nearest:
    """Go on from a point on the equations to the nearest one; ``settled``, where it is. ``loose``: indices of the directions that may move."""
    x, here, scale, steps = found.x, found.local, found.scale, found.steps
    last, settled = np.inf, False
    for _ in range(REFINEMENTS):
        steps += 1
        free = moved(here, loose)
        step = _newton_step(at, move, x, here, scale, free, weights)
        size = float(np.abs(step).max(initial=0.0))
        if not np.isfinite(size) or size <= ARRIVED:
            settled = size <= ARRIVED
            break
        settled = size < CLOSE
        step *= min(1.0, LONGEST / size)
        for _ in range(30):
            d = np.zeros(weights.size)
            d[free] = step / weights[free]
            there, local, _ = restored(at, move, move(x, d), at(move(x, d)), scale, loose, weights)
            on_them = bool((np.abs(local.hard) / scale).max(initial=0.0) <= FULFILLED)
            size = float(np.abs(step).max())
            if on_them and (_half_squares(local, weights) < _half_squares(here, weights) or size < CLOSE):
                break
            step = step / 2
        else:
            settled = False
            break
        if size < CLOSE and not size < last / 2:  # of rounding
            break
        x, here, last = there, local, size
    return found._replace(x=x, local=here, steps=steps, settled=settled)


def _half_squares(here: Local, weights: Array) -> float:
    deviation = weights * here.deviation
    return float(deviation @ deviation + here.soft @ here.soft) / 2


def _slope(here: Local, free: NDArray[np.intp], weights: Array) -> Array:
    """The gradient of what is minimised, in scaled directions."""
    w = weights[free]
    slope: Array = w * here.deviation[free] + here.soft @ (here.soft_jacobian[:, free] / w)
    return slope


def _newton_step(
    at: Callable[[Array], Local],
    move: Callable[[Array, Array], Array],
    x: Array,
    here: Local,
    scale: Array,
    free: NDArray[np.intp],
    weights: Array,
) -> Array:
    """The step along the equations, in scaled directions, that leads to where the gradient vanishes, or downwards."""

    def gradients(local: Local) -> Array:
        rows: Array = local.hard_jacobian[:, free] / weights[free] / scale[:, None]
        return rows

    matrix = gradients(here)
    if not np.isfinite(matrix).all():
        return np.full(free.size, np.nan)
    left, values, right = np.linalg.svd(matrix, full_matrices=True)
    rank = rank_of(values)
    along = right[rank:]
    slope = _slope(here, free, weights)
    multipliers = left[:, :rank] @ ((right[:rank] @ slope) / values[:rank])
    pull = slope - multipliers @ matrix
    curvature = np.zeros((len(along), len(along)))
    for k, direction in enumerate(along):
        d = np.zeros(weights.size)
        d[free] = NUDGE * direction / weights[free]
        there = at(move(x, d))
        change = _slope(there, free, weights) - multipliers @ gradients(there) - pull
        curvature[:, k] = along @ change / NUDGE
    if not np.isfinite(curvature).all():
        return np.full(free.size, np.nan)
    step: Array = -(_downhill((curvature + curvature.T) / 2, along @ pull) @ along)
    return step


def _downhill(curvature: Array, slope: Array) -> Array:
    """Solve curvature x = slope, with as much of the identity added as makes it positive."""
    shift = FLATTEST - min(FLATTEST, float(np.diag(curvature).min(initial=FLATTEST)))
    for _ in range(SHIFTS):
        shifted = curvature + shift * np.eye(len(slope))
        try:
            least = float(np.diag(np.linalg.cholesky(shifted)).min(initial=1.0))
        except np.linalg.LinAlgError:
            least = 0.0
        if least**2 > FLATTEST / 1000:
            return np.asarray(np.linalg.solve(shifted, slope), np.float64)
        shift = max(2 * shift, FLATTEST)
    return np.full(len(slope), np.nan)


def beyond(
    at: Callable[[Array], Local],
    move: Callable[[Array, Array], Array],
    found: Nearest,
    loose: NDArray[np.intp],
    weights: Array,
) -> Array | None:
    """Return a point beside one at which no slope brings equations nearer to zero, but their curvature does; None if there is
    none. ``loose``: indices of the directions that may move."""
    w = weights[loose]

    def gradients(local: Local) -> Array:
        rows: Array = local.hard_jacobian[:, loose] / w / found.scale[:, None]
        return rows

    matrix = gradients(found.local)
    if not loose.size or not np.isfinite(matrix).all():
        return None
    left, values, right = np.linalg.svd(matrix, full_matrices=True)
    rank = rank_of(values)
    off = left[:, rank:] @ (left[:, rank:].T @ (found.local.hard / found.scale))
    along = right[rank:].T @ right[rank:]
    bent = np.zeros((loose.size, loose.size))
    for k in range(loose.size):
        d = np.zeros(weights.size)
        d[loose[k]] = NUDGE / w[k]
        bent[:, k] = off @ (gradients(at(move(found.x, d))) - matrix) / NUDGE
    bent = along @ ((bent + bent.T) / 2) @ along
    size = float(np.sqrt((bent**2).sum()))
    if not (np.isfinite(size) and size > 0):
        return None
    way = along @ (1 / (1 + SPREAD * np.arange(loose.size)))
    for _ in range(POWERS):
        length = float(np.sqrt(way @ way))
        if not length > 0:
            return None
        way = along @ (size * (way / length) - bent @ (way / length))
    way = way / np.sqrt(way @ way)
    fall = -float(way @ bent @ way)
    if not fall > BENT * size:
        return None
    d = np.zeros(weights.size)
    d[loose] = np.sqrt(2 * float(off @ off) / fall) * way / w
    return move(found.x, d)

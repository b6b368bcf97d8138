"""Bounds on a slope beside which the integrand is concave: the slope leaps to the bound, and away from it, at corners.

Multipliers of any sign press there, so that they do not tell where the bound holds. The Hamiltonian does: it holds where no
other slope makes F(w) - w p lower, with the momentum p of the curve (Weierstrass' condition). Whole elements hold it or do not;
those beside a corner are halved, so that its place is found.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..problem import Array
from .discrete import DiscreteCurve
from .unknowns import Unknowns, local

SLOPES = np.geomspace(1e-2, 1e2, 33)
"""How far other slopes lie from the bound, in sizes of the curve over the range."""
REFINED = 12
"""Steps of Newton's method to the best of them."""
ON = 1e-6
"""Of its size: a bound that is nearer than that holds."""


def leaps(discrete: DiscreteCurve, start: Unknowns) -> bool:
    """Tell whether one bound is on the slope of the one coordinate, and the integrand is concave beside it."""
    curve, layout = discrete.curve, discrete.layout
    if (curve.coordinates, curve.order, curve.unknown, len(layout.rates)) != (1, 1, 0, 1) or curve.gauge:
        return False
    if not curve.points[layout.rates[0]].bound:
        return False
    at = _Slopes(discrete, start)
    return bool(np.any(at.second(at.bound) < 0))


def begun(discrete: DiscreteCurve, start: Unknowns) -> Unknowns:
    """Let the bound hold where a curve is on it; for a guess that is nowhere on it, where its mean momentum says so. Return from where to
    go on."""
    at = _Slopes(discrete, start)
    size = np.max(np.abs(at.bound - at.slope)) + np.max(discrete.sizes(start))
    held = np.all(np.abs(at.bound - at.slope) <= ON * size, axis=1)
    if held.any():
        discrete.active_rates[:] = held[:, None, None]
        return start
    excess, best = at.others(np.full_like(at.slope, float(np.mean(at.momentum))))
    held = np.any(excess >= 0, axis=1)
    discrete.active_rates[:] = held[:, None, None]
    return at.sloped(start, ~held & at.concave, best)


def settled(discrete: DiscreteCurve, unknowns: Unknowns) -> Unknowns | None:
    """Move corners by one element where the Hamiltonian says so; return from where to go on, None if they were all there before.

    Elements that are let go begin with the best slope: beside the bound there is a stationary one that is the worst.
    """
    at = _Slopes(discrete, unknowns)
    now = discrete.active_rates[:, 0, 0].copy()
    excess, best = at.others(at.momentum)
    better = np.sum(discrete.rate_nodes.weights * excess, axis=1) >= 0
    astray = ~now & at.concave
    after = np.where(_beside(now) | astray, better, now)
    discrete.seen.add(now.tobytes())
    if after.tobytes() in discrete.seen or after.all() or not after.any():  # smaller elements first
        return None
    discrete.active_rates[:] = after[:, None, None]
    return at.sloped(unknowns, (now | astray) & ~after, best)


def corners(discrete: DiscreteCurve) -> NDArray[np.bool_]:
    """Return the elements on both sides of corners."""
    return _beside(discrete.active_rates[:, 0, 0])


def _beside(held: NDArray[np.bool_]) -> NDArray[np.bool_]:
    other = held[1:] != held[:-1]
    beside: NDArray[np.bool_] = np.concatenate([other, [False]]) | np.concatenate([[False], other])
    return beside


class _Slopes:
    """The nodes of all elements with the slope, the slope at the bound and the momentum there, all over s."""

    def __init__(self, discrete: DiscreteCurve, unknowns: Unknowns) -> None:
        curve, layout = discrete.curve, discrete.layout
        self.discrete = discrete
        self.s = discrete.rate_nodes.s
        self.y = discrete.rows(unknowns, discrete.rate_nodes)
        self.z = discrete._z(unknowns)
        start = layout.unknown + layout.numbers
        integrals = sum(row.kind == "integral" for row in curve.numbers)
        self.lam = unknowns.whole[start : start + integrals]
        self.slope = self.y[1]
        (row,) = layout.rates
        gap = discrete.call("points", self.s, self.y, self.z)[row]
        gradients = discrete.call("point_gradients", self.s, self.y, self.z)
        pattern = zip(curve.point_gradient, gradients, strict=True)
        by_slope = sum((g for (k, c), g in pattern if (k, c) == (row, 1)), np.zeros_like(gap))
        self.bound = self.slope - gap / by_slope
        self.side = np.sign(by_slope)
        pressed = local(unknowns)[:, layout.rate_place[:, 0]] * discrete.active_rates[:, :, 0]
        self.momentum = self.first(self.slope) + pressed * by_slope
        self.size = float(np.max(discrete.sizes(unknowns)))

    @property
    def concave(self) -> NDArray[np.bool_]:
        """The elements in which the integrand is concave at a slope of the curve."""
        found: NDArray[np.bool_] = np.any(self.second(self.slope) < 0, axis=1)
        return found

    def sloped(self, unknowns: Unknowns, which: NDArray[np.bool_], slope: Array) -> Unknowns:
        """Return a curve with other slopes in some elements, moved after them."""
        rise = np.diff(unknowns.border[:, 0])
        rise[which] = np.sum(self.discrete.rate_nodes.weights * slope, axis=1)[which]
        made = Unknowns(unknowns.border.copy(), unknowns.inside.copy(), unknowns.whole)
        made.border[1:, 0] = made.border[0, 0] + np.cumsum(rise)
        made.inside[which, : self.discrete.layout.own] = 0.0
        return made

    def others(self, momentum: Array) -> tuple[Array, Array]:
        """Return by how much the best other slope is worse than that of the bound, at each node, and that slope."""
        lowest = np.full_like(self.slope, np.inf)
        best = self.bound
        for far in SLOPES * self.size:
            w = self.bound + self.side * far
            value = self.value(w) - momentum * w
            best = np.where(value < lowest, w, best)
            lowest = np.fmin(lowest, value)
        for _ in range(REFINED):
            bent = self.second(best)
            step = np.where(bent > 0, -(self.first(best) - momentum) / np.where(bent > 0, bent, 1.0), 0.0)
            gap = np.abs(best - self.bound) / 2
            best = best + np.clip(step, -gap, gap)
        other = np.fmin(lowest, self.value(best) - momentum * best)
        return other - (self.value(self.bound) - momentum * self.bound), best

    def value(self, w: Array) -> Array:
        found: Array = np.tensordot(self.lam, self._call("integrands", w), axes=1)
        return found

    def first(self, w: Array) -> Array:
        values = self._call("integrand_gradients", w)
        total: Array = np.zeros_like(self.slope)
        for (k, c), g in zip(self.discrete.curve.gradient, values, strict=True):
            total += self.lam[k] * g if c == 1 else 0.0
        return total

    def second(self, w: Array) -> Array:
        values = self._call("curvature", w)
        total: Array = np.zeros_like(self.slope)
        for (a, b), g in zip(self.discrete.curve.curvature, values, strict=True):
            total += g if (a, b) == (1, 1) else 0.0
        return total

    def _call(self, name: str, w: Array) -> Array:
        y = self.y.copy()
        y[1] = w
        return self.discrete.call(name, self.s, y, self.z)

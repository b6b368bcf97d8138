"""Where forces that jump through zero hold a model at rest: on the surface of a relation, both sides lead onto it (Filippov).

On the surface g = 0 forces are shares of those of both sides, (1 - s) f- + s f+ = 0 with 0 < s < 1: as many equations as there are
displacements and s. Newton's method with differences begins from guesses within the bounds.
"""

from __future__ import annotations

import numpy as np
from msgspec import Struct
from msgspec.structs import replace
from numpy.typing import NDArray

from ..numerics.rank import rank
from ..problem import Array
from .equilibrium import at_rest, moving
from .operating_point import Site, indicators_of, plan_of, switched
from .search import Box, spread_evenly

STEPS, GUESSES = 30, 16
CLOSE = 1e-9
"""Last step, in shares of the sizes of the unknowns."""
APART = 1e-6
"""Rests closer than this, in the same shares, are one."""
REGULAR = 1e-8
"""Share of the largest singular value: below it are errors of the differences."""
DIFFERENCE = 6e-6
"""Cube root of the rounding: the step of central differences."""


class RestAtJump(Struct, frozen=True, eq=False):
    """A state that a jump of forces holds at ``surface``; ``share`` of the side on which its relation is true. ``errors`` [n]: the
    last step of Newton's method, of each displacement."""

    y: Array
    surface: str
    share: float
    errors: Array


def rests_at_jumps(site: Site, box: Box) -> tuple[RestAtJump, ...]:
    """Find isolated rests, those of each surface together. Of none with constraints or rotations: their equations are others."""
    plan, problem = plan_of(site), site.problem
    if plan is None or problem.hybrid is None or problem.rotations or problem.constraints:
        return ()
    found: list[RestAtJump] = []
    unknowns = np.asarray(moving(site.chart), dtype=np.intp)
    for k, text in enumerate(problem.hybrid.switches[: plan.n_switches]):
        here: list[RestAtJump] = []
        for guess in _guesses(site, box, unknowns):
            one = _Surface(site, unknowns, k, text).rest(guess)
            if one is not None and not any(_same(site, one, other) for other in here):
                here.append(one)
        found += here
    return tuple(found)


def on_surfaces(site: Site) -> frozenset[str]:
    """Return the names of the displacements that move a relation, at the start."""
    plan, chart, y = plan_of(site), site.chart, at_rest(site, site.y)
    if plan is None:
        return frozenset()
    here = indicators_of(site, plan, y)[: plan.n_switches]
    found = []
    for j in map(int, moving(chart)):
        d = np.zeros(chart.size)
        d[j] = DIFFERENCE * (1.0 + abs(y[chart.place(j)]))
        if (indicators_of(site, plan, chart.moved(y, d))[: plan.n_switches] != here).any():
            found.append(chart.names[j])
    return frozenset(found)


def _guesses(site: Site, box: Box, unknowns: NDArray[np.intp]) -> list[Array]:
    start = at_rest(site, site.y)
    shares = spread_evenly(GUESSES, max(len(box.moved), 1))[:, : len(box.moved)]
    places = [site.chart.place(int(j)) for j in box.moved]
    found = [start]
    for share in shares if places else ():
        y = start.copy()
        y[places] = box.low + share * (box.high - box.low)
        found.append(y)
    return found


def _same(site: Site, one: RestAtJump, other: RestAtJump) -> bool:
    size = 1.0 + np.abs(one.y)
    return bool((np.abs(one.y - other.y) <= APART * size).all())


class _Surface:
    """One relation, and the forces on both of its sides."""

    def __init__(self, site: Site, unknowns: NDArray[np.intp], k: int, text: str) -> None:
        plan = plan_of(site)
        assert plan is not None
        self.site, self.unknowns, self.k, self.text, self.plan = site, unknowns, k, text, plan
        self.place = plan.switches[k]

    def _sides(self, y: Array) -> tuple[Array, Array]:
        """Return what drives velocities and states where the relation is false, and where it is true; all others as they stand."""
        site, nd = switched(self.site, y), self.site.chart.nd
        rates: list[Array] = []
        for value in (0.0, 1.0):
            z = site.z.copy()
            z[self.place] = value
            rates.append(replace(site, z=z).rates(y)[nd:])
        return rates[0], rates[1]

    def _equations(self, start: Array, x: Array) -> Array:
        y = self._at(start, x)
        low, high = self._sides(y)
        value = indicators_of(self.site, self.plan, y)[self.k]
        return np.array([*((1 - x[-1]) * low + x[-1] * high), value])

    def _at(self, start: Array, x: Array) -> Array:
        d = np.zeros(self.site.chart.size)
        d[self.unknowns] = x[:-1]
        return self.site.chart.moved(start, d)

    def rest(self, start: Array) -> RestAtJump | None:
        """Return the rest to which Newton's method leads from a guess; None where it leads to none that both sides hold."""
        x = np.append(np.zeros(len(self.unknowns)), 0.5)
        sizes = np.append(1.0 + np.abs(start[[self.site.chart.place(int(j)) for j in self.unknowns]]), 1.0)
        step = sizes
        for _ in range(STEPS):
            value = self._equations(start, x)
            slopes = np.column_stack([self._slope(start, x, j, sizes) for j in range(x.size)])
            if not (np.isfinite(value).all() and np.isfinite(slopes).all()):
                return None
            scale = np.abs(slopes).max(axis=1, initial=0.0)
            if not (scale > 0).all() or rank(slopes / scale[:, None], REGULAR) < x.size:
                return None  # the surface does not move with these, or the rest is not isolated
            step = np.linalg.solve(slopes / scale[:, None], -value / scale)
            x = x + step
            if (np.abs(step) <= CLOSE * sizes).all():
                break
        y, share = self._at(start, x), float(x[-1])
        if not ((np.abs(step) <= CLOSE * sizes).all() and 0 < share < 1 and self._held(y)):
            return None
        errors = np.zeros(self.site.chart.size)
        errors[self.unknowns] = np.abs(step[:-1]) + np.finfo(float).eps * np.abs(x[:-1])
        return RestAtJump(y, self.text, share, errors)

    def _slope(self, start: Array, x: Array, j: int, sizes: Array) -> Array:
        d = np.zeros(x.size)
        d[j] = DIFFERENCE * sizes[j]
        found: Array = (self._equations(start, x + d) - self._equations(start, x - d)) / (2 * d[j])
        return found

    def _held(self, y: Array) -> bool:
        """Whether both sides lead onto the surface: forces there turn its indicator back."""
        chart = self.site.chart
        low, high = self._sides(y)
        turn = 0.0
        for k, (a, b) in enumerate(zip(low, high, strict=True)):
            place = int(self.unknowns[k])
            d = np.zeros(chart.size)
            d[place] = DIFFERENCE * (1.0 + abs(y[chart.place(place)]))
            there, here = (
                indicators_of(self.site, self.plan, chart.moved(y, s * d))[self.k] for s in (1, -1)
            )
            turn += (there - here) / (2 * d[place]) * (b - a)
        return turn > 0  # the relation is true where its indicator is negative: there the forces push it up

"""All equilibria within bounds: Newton's method from many guesses, deflated so that none is found twice.

P. E. Farrell, A. Birkisson, S. W. Funke, Deflation techniques for finding distinct solutions of nonlinear partial
differential equations, SIAM J. Sci. Comput. 37 (2015), A2026.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from ..outcome import SimulationError
from ..problem import Array
from .equilibrium import (
    LONGEST,
    Equilibrium,
    at_rest,
    moving,
    newton,
    polished,
    rest,
    sizes_of,
    spread,
)
from .site import Site, depended_on, switched

SAME = 1e-6
"""Equilibria closer than this, in the sizes of the coordinates, are one."""
STEPS = 40
SEED = 7


class Box(Struct, frozen=True, eq=False):
    """Where equilibria are looked for: displacements ``moved`` that matter, their bounds ``low`` and ``high`` as values of
    the coordinates, which of them are ``periodic`` angles, and which have bounds that the model
    ``stated``; ``idle`` ones change nothing and stay as they are."""

    moved: NDArray[np.intp]
    low: Array
    high: Array
    periodic: NDArray[np.bool_]
    stated: NDArray[np.bool_]
    idle: tuple[str, ...]


def box_of(site: Site) -> Box:
    """Return the bounds of the search: ``min`` and ``max`` of the model, a turn of angles, else what lengths suggest."""
    chart, problem = site.chart, site.problem
    y = at_rest(site, site.y)
    every = moving(chart)
    used = depended_on(site)
    moved = np.array([j for j in every if int(j) in used], dtype=np.intp)
    idle = tuple(chart.names[int(j)] for j in every if int(j) not in used)
    lengths = [
        abs(float(v)) for q, v in zip(problem.parameters, site.p, strict=False) if q.measure == "m" and v
    ]
    length = float(np.exp(np.mean(np.log(lengths)))) if lengths else 1.0
    low, high = np.zeros(len(moved)), np.zeros(len(moved))
    periodic, stated = np.zeros(len(moved), dtype=bool), np.zeros(len(moved), dtype=bool)
    for k, j in enumerate(moved):
        if j < chart.nd and chart.places[j] in problem.rotations:
            low[k], high[k] = -np.pi, np.pi  # turns from the start
            continue
        place = chart.place(int(j))
        quantity = problem.states[place]
        periodic[k] = quantity.unit == "rad" and _is_periodic(site, y, place)
        if quantity.unit == "rad":
            reach = np.pi if periodic[k] else 3 * np.pi
        else:
            reach = max(
                3 * (quantity.nominal or (length if quantity.measure == "m" else 1.0)),
                3 * abs(float(y[place])),
            )
        if quantity.unit == "" and quantity.nominal is None:
            reach = max(reach, 4.0)
        low[k] = -reach if quantity.minimum is None else quantity.minimum
        high[k] = reach if quantity.maximum is None else quantity.maximum
        stated[k] = quantity.minimum is not None or quantity.maximum is not None
        periodic[k] = periodic[k] and quantity.minimum is None and quantity.maximum is None
    return Box(moved, low, high, periodic, stated, idle)


def _is_periodic(site: Site, y: Array, place: int) -> bool:
    """Whether a turn by 2 pi changes no rate and no constraint, at a few states."""
    numbers = np.random.default_rng(SEED)
    for _ in range(3):
        here = site.chart.moved(y, 0.4 * numbers.standard_normal(site.chart.size))
        there = here.copy()
        there[place] += 2 * np.pi
        one, two = (np.concatenate([site.rates(x), *site.constraints(x)]) for x in (here, there))
        if not (np.abs(one - two) <= 1e-9 * (1.0 + np.abs(one))).all():
            return False
    return True


def spread_evenly(count: int, size: int) -> Array:
    """Return points [count][size] spread evenly over the unit cube: multiples of powers of the root of x^(size+1) = x + 1
    (M. Roberts, 2018), by which a part of them is spread evenly too."""
    root = 2.0
    for _ in range(60):
        root = (1.0 + root) ** (1.0 / (size + 1))
    steps = root ** -np.arange(1.0, size + 1)
    points: Array = (0.5 + np.arange(1, count + 1)[:, None] * steps) % 1.0
    return points


class Search:
    """The equilibria found so far at one place, and the search for others."""

    def __init__(self, site: Site, box: Box, found: Sequence[Equilibrium] = ()) -> None:
        self.site = site
        self.box = box
        self.found: list[Equilibrium] = list(found)

    def run(self, guesses: int) -> list[Equilibrium]:
        """Look from the start, then from guesses spread over the bounds; return everything found, in order."""
        box, start = self.box, at_rest(self.site, self.site.y)
        self._again(start)
        if len(box.moved):
            for point in spread_evenly(guesses, len(box.moved)):
                self._again(self._placed(start, box.low + point * (box.high - box.low)))
        return sorted(
            self.found, key=lambda e: tuple(round(float(v), 9) for v in e.y[: self.site.problem.nq])
        )

    def _again(self, guess: Array) -> None:
        """Search from one guess as long as that gives something new."""
        for _ in range(20):
            one = self._search(guess)
            if one is None or not self.add(one):
                return

    def add(self, one: Equilibrium) -> bool:
        """Keep an equilibrium that lies within bounds and is new; tell whether it did."""
        one = self._wrapped(one)
        values = self._values(one.y)
        slack = 1e-9 * np.maximum(1.0, self.box.high - self.box.low)
        bounded = ~self._turns()
        if ((values < self.box.low - slack) | (values > self.box.high + slack))[
            bounded & ~self.box.periodic
        ].any():
            return False
        if any(
            self.distance(one, other)
            < SAME + 10 * max(float(e.errors.max(initial=0.0)) for e in (one, other))
            for other in self.found
        ):
            return False
        self.found.append(one)
        return True

    def distance(self, one: Equilibrium, other: Equilibrium) -> float:
        """Return how far two equilibria are apart, but for directions in which nothing pushes on either."""
        d = self._between(one.y, other.y)
        for free in (one.free, other.free):
            directions = free[self.box.moved]
            if directions.size:
                basis = np.linalg.qr(directions)[0]
                d = d - basis @ (basis.T @ d)
        return float(np.linalg.norm(d))

    def _between(self, start: Array, y: Array) -> Array:
        d = self.site.chart.between(start, y)[self.box.moved]
        return np.where(self.box.periodic, (d + np.pi) % (2 * np.pi) - np.pi, d)

    def _turns(self) -> NDArray[np.bool_]:
        chart = self.site.chart
        return np.array(
            [j < chart.nd and chart.places[j] in chart.problem.rotations for j in self.box.moved], dtype=bool
        )

    def _places(self) -> NDArray[np.intp]:
        chart = self.site.chart
        return np.array([chart.place(int(j)) for j in self.box.moved], dtype=np.intp)

    def _values(self, y: Array) -> Array:
        return y[self._places()]

    def _placed(self, start: Array, values: Array) -> Array:
        """Return a guess with values of the coordinates, turns of rotations from the start."""
        turns = self._turns()
        d = np.where(turns, values, values - self._values(start))
        return self.site.chart.moved(start, spread(self.site.chart, self.box.moved, d))

    def _wrapped(self, one: Equilibrium) -> Equilibrium:
        """Return an equilibrium with its periodic angles above -180 and up to 180 degrees."""
        y = one.y.copy()
        for place, periodic in zip(self._places(), self.box.periodic, strict=True):
            if periodic:
                y[place] -= 2 * np.pi * np.ceil((y[place] - np.pi * (1 + 1e-12)) / (2 * np.pi))
        return Equilibrium(y, one.errors, one.residual, one.condition, one.free)

    def _search(self, guess: Array) -> Equilibrium | None:
        """Return an equilibrium by Newton's method with the factor 1 + sum 1/distance^2 before the equations."""
        site, y, moved = switched(self.site, guess), guess, self.box.moved
        for _ in range(STEPS):
            try:
                here = rest(site, y, moved)
            except SimulationError:
                return None
            step = newton(here).step
            sizes = sizes_of(site, y, moved)
            if not np.isfinite(step).all():
                return None
            step = step * self._deflation(y, step)
            size = float(np.abs(step / sizes).max(initial=0.0))
            if size < 1e-7:
                break
            y = site.chart.moved(y, spread(site.chart, moved, step * min(1.0, LONGEST / size)))
        else:
            return None
        one = polished(site, y, moved=moved)
        if one is None or not np.array_equal(switched(site, one.y).z, site.z):
            return None
        return one

    def _deflation(self, y: Array, step: Array) -> float:
        """Return what a Newton step is multiplied by so that it leads away from what is known."""
        total, slope = 1.0, 0.0
        for other in self.found:
            d = self._between(other.y, y)
            free = other.free[self.box.moved]
            if free.size:
                basis = np.linalg.qr(free)[0]
                d = d - basis @ (basis.T @ d)
            squared = max(float(d @ d), 1e-24)
            total += 1.0 / squared
            slope += -2.0 * float(d @ step) / squared**2
        ratio = 1.0 - slope / total
        return float(np.clip(1.0 / ratio if ratio else 1.0, -1e3, 1e3))

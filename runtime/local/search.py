"""All equilibria within bounds: Newton's method from many guesses, deflated so that none is found twice.

P. E. Farrell, A. Birkisson, S. W. Funke, Deflation techniques for finding distinct solutions of nonlinear partial
differential equations, SIAM J. Sci. Comput. 37 (2015), A2026.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from msgspec import Struct
from msgspec.structs import replace
from numpy.typing import NDArray

from ..numerics.newton import newton
from ..outcome import SimulationError
from ..problem import Array
from .equilibrium import (
    LONGEST,
    Equilibrium,
    at_rest,
    moving,
    newton_step,
    polished,
    rest,
    sizes_of,
    spread,
)
from .operating_point import Site, depended_on, switched

SAME = 1e-6
"""Equilibria closer than this, in the sizes of the coordinates, are one."""
STEPS = 40
FAR = 8.0
"""Widths of the bounds, beyond which nothing is looked for."""
SEED = 7
QUIET, MOST_ROUNDS = 3, 24
"""Rounds that must find nothing, one over each region, and most rounds."""
BESIDE, GOLDEN = 0.05, (5**0.5 - 1) / 2
"""Of the bounds, how far places beside what is known lie; a number whose multiples are spread evenly."""
LOOKS, MOST_LOOKS = 4, 1024
"""Places of a round for each guess, and most places times coordinates."""
MOST_FOUND = 1024
"""Equilibria, after which nothing more is looked for."""
SLIDES, ARRIVED = 24, 1e-3
"""Most steps along a set of equilibria from one towards another, and how near the last of them comes."""
MOST_SETS = 6
"""Sets of equilibria that are told apart."""
SAMPLES, BUMPS = 12, 3
"""Places at which forces are compared with their rounding, and displacements from each of them."""
BUMP = 1e-9
"""The length of these, in the sizes of the coordinates: forces are straight over it but for rounding."""
NOISE = 1e3
"""Times that rounding, below which forces everywhere are nothing but that."""


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


def balanced(site: Site, box: Box) -> Site:
    """Return the site without the forces that are rounding all over the box, as the weight of a rotor with three blades is."""
    start, moved, nd = at_rest(site, site.y), box.moved, site.chart.nd
    if not len(moved):
        return site
    numbers = np.random.default_rng(SEED)
    largest = noise = np.zeros(site.chart.size - nd)
    places = Search(site, box)
    for point in spread_evenly(SAMPLES, len(moved)):
        y = places.placed(start, box.low + point * (box.high - box.low))
        sizes = sizes_of(site, y, moved)
        try:
            here = rest(site, y, moved)
        except SimulationError:  # a derivative is undefined there
            return site
        largest = np.maximum(largest, np.abs(here.forces) + np.abs(here.slopes) @ sizes)
        for _ in range(BUMPS):
            d = BUMP * sizes * numbers.uniform(-1, 1, len(moved))
            beside = site.rates(site.chart.moved(y, spread(site.chart, moved, d)))[nd:]
            noise = np.maximum(noise, np.abs(beside - here.forces - here.slopes @ d))
    quiet = np.flatnonzero((largest > 0) & (largest <= NOISE * noise))
    return replace(site, balanced=tuple((nd + quiet).tolist()))


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
    """The equilibria found so far at one place, and the search for others. ``outside``: values of some that lie beyond bounds
    that the model does not state."""

    def __init__(self, site: Site, box: Box, found: Sequence[Equilibrium] = ()) -> None:
        self.site = site
        self.box = box
        self.found: list[Equilibrium] = list(found)
        self.outside: list[str] = []

    def run(self, guesses: int) -> list[Equilibrium]:
        """Look from the start and from guesses spread over the bounds, then in rounds until ``QUIET`` of them find nothing;
        return everything found, in order."""
        box, start = self.box, at_rest(self.site, self.site.y)
        self.again(start)
        if len(box.moved):
            for point in spread_evenly(guesses, len(box.moved)):
                self.again(self.placed(start, box.low + point * (box.high - box.low)))
            quiet, number = 0, 0
            while quiet < QUIET and number < MOST_ROUNDS:
                before = len(self.found)
                for guess in self._promising(guesses, number):
                    self.again(guess)
                quiet, number = (0 if len(self.found) > before else quiet + 1), number + 1
        return self.sorted()

    def sorted(self) -> list[Equilibrium]:
        return sorted(
            self.found, key=lambda e: tuple(round(float(v), 9) for v in e.y[: self.site.problem.nq])
        )

    def _promising(self, guesses: int, number: int) -> list[Array]:
        """Return new places from which one step of Newton's method is short and leads to nothing that is known: of many places
        over the bounds in one round, between what has been found in the next, and round all of it in the third."""
        box, start = self.box, at_rest(self.site, self.site.y)
        size = len(box.moved)
        count = max(1, min(LOOKS * guesses, MOST_LOOKS // size))
        low, width = box.low, box.high - box.low
        points = spread_evenly((number + 1) * count, size)[number * count :]
        places = low + points * width
        if number % 3 and self.found:
            known = np.array([self.values(one.y) for one in self.found])
            if number % 3 == 1:  # between two of them, and a little beside
                ends = np.random.default_rng(SEED + number).integers(len(known), size=(2, count))
                share = np.modf(np.arange(1, count + 1) * GOLDEN)[0][:, None]
                between = known[ends[0]] * (1 - share) + known[ends[1]] * share
                places = between + (points - 0.5) * BESIDE * width
            else:
                room = np.ptp(known, axis=0) / 2 + BESIDE * width
                places = known.min(axis=0) - room + points * (np.ptp(known, axis=0) + 2 * room)
            places = np.where(self.turns(), low + points * width, np.clip(places, box.low, box.high))
        ranked: list[tuple[float, int, Array]] = []
        for place in places:
            y = self.placed(start, place)
            try:
                step = newton_step(rest(switched(self.site, y), y, box.moved)).step
            except SimulationError:
                continue
            length = float(np.linalg.norm(step))
            if np.isfinite(length) and not self._leads_to_known(y, step, length):
                ranked.append((float(np.abs(step / width).max()), len(ranked), y))
        return [y for _, _, y in sorted(ranked)[: max(1, guesses // 8)]]

    def _leads_to_known(self, y: Array, step: Array, length: float) -> bool:
        for other in self.found:
            away = self._between(y, other.y) - step
            if float(np.linalg.norm(away)) < max(length / 2, SAME):
                return True
        return False

    def again(self, guess: Array) -> None:
        """Search from one guess as long as that gives something new."""
        for _ in range(20 if len(self.found) < MOST_FOUND else 0):
            one = self._search(guess)
            if one is None or not self.add(one):
                return

    def add(self, one: Equilibrium) -> bool:
        """Keep an equilibrium that lies within bounds and is new; tell whether it did."""
        one = self._wrapped(one)
        values = self.values(one.y)
        slack = 1e-9 * np.maximum(1.0, self.box.high - self.box.low)
        beyond = (values < self.box.low - slack) | (values > self.box.high + slack)
        beyond &= ~self.turns() & ~self.box.periodic
        if beyond.any():
            if not (beyond & self.box.stated).any():
                chart = self.site.chart
                self.outside.append(
                    ", ".join(
                        f"{chart.names[int(j)]} = {v:.6g}"
                        for j, v in zip(self.box.moved, values, strict=True)
                    )
                )
            return False
        if any(
            self.distance(one, other)
            < SAME + 10 * max(float(e.errors.max(initial=0.0)) for e in (one, other))
            for other in self.found
        ) or (one.free.size and self._belongs(one)):
            return False
        self.found.append(one)
        return True

    def _belongs(self, one: Equilibrium) -> bool:
        """Whether an equilibrium that is not isolated lies on a curve or surface of equilibria of which one is known."""
        sets = [other for other in self.found if other.free.size]
        return len(sets) >= MOST_SETS or any(self._joined(one, other) for other in sets)

    def _joined(self, one: Equilibrium, other: Equilibrium) -> bool:
        """Whether steps along equilibria lead from one to the other."""
        moved, chart, here = self.box.moved, self.site.chart, one
        for _ in range(SLIDES):
            d = self._between(here.y, other.y)
            if float(np.linalg.norm(d)) < ARRIVED:
                return True
            if not here.free.size:
                return False
            basis = np.linalg.qr(here.free[moved])[0]
            along = basis @ (basis.T @ d)
            length = float(np.linalg.norm(along))
            if length < ARRIVED * float(np.linalg.norm(d)):  # straight across, as through a circle
                along, length = basis[:, 0], 1.0
            step = spread(chart, moved, along * min(1.0, LONGEST / length))
            beside = polished(self.site, chart.moved(here.y, step), moved=moved)
            if beside is None:
                return False
            here = beside
        return False

    def goes_on(self, one: Equilibrium) -> bool:
        """Whether there are other equilibria right beside one, so that it is not isolated."""
        chart = self.site.chart
        for k in range(one.free.shape[1]):
            step = (
                10
                * ARRIVED
                * one.free[:, k]
                / max(float(np.linalg.norm(one.free[self.box.moved, k])), 1e-300)
            )
            beside = polished(self.site, chart.moved(one.y, step), moved=self.box.moved)
            if beside is not None and float(np.linalg.norm(self._between(one.y, beside.y))) > ARRIVED:
                return True
        return False

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

    def turns(self) -> NDArray[np.bool_]:
        chart = self.site.chart
        return np.array(
            [j < chart.nd and chart.places[j] in chart.problem.rotations for j in self.box.moved], dtype=bool
        )

    def _places(self) -> NDArray[np.intp]:
        chart = self.site.chart
        return np.array([chart.place(int(j)) for j in self.box.moved], dtype=np.intp)

    def values(self, y: Array) -> Array:
        return y[self._places()]

    def rows(self) -> list[int]:
        """Return which of the rates after the positions are those of the displacements that move."""
        place = [int(j) for j in moving(self.site.chart)]
        kept = {int(j) for j in self.box.moved}
        return [k for k, j in enumerate(place) if j in kept]

    def placed(self, start: Array, values: Array) -> Array:
        """Return a guess with values of the coordinates, turns of rotations from the start."""
        turns = self.turns()
        d = np.where(turns, values, values - self.values(start))
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
        site, moved = switched(self.site, guess), self.box.moved

        def step(y: Array) -> tuple[Array, float] | None:
            try:
                found = newton_step(rest(site, y, moved)).step
            except SimulationError:
                return None
            if self._far(y) or not np.isfinite(found).all():
                return None
            found = found * self._deflation(y, found)
            return found, float(np.abs(found / sizes_of(site, y, moved)).max(initial=0.0))

        def after(y: Array, found: Array, share: float) -> Array:
            return site.chart.moved(y, spread(site.chart, moved, share * found))

        found = newton(guess, step, after, most=STEPS, close=1e-7, longest=LONGEST)
        if not found.converged:
            return None
        y = found.at
        one = polished(site, y, moved=moved)
        if one is None or not np.array_equal(switched(site, one.y).z, site.z):
            return None
        return one

    def _far(self, y: Array) -> bool:
        """Whether a state has left the bounds, or the wider region of those that the model does not state."""
        box, values = self.box, self.values(y)
        room = np.where(box.stated, 1.0, FAR) * (box.high - box.low)
        beyond = (values < box.low - room) | (values > box.high + room)
        return bool((beyond & ~self.turns() & ~box.periodic).any())

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

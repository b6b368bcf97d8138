"""Branches of equilibria over a parameter, by pseudo-arclength, with the points where their number or stability changes.

H. B. Keller, in: Applications of Bifurcation Theory (P. Rabinowitz, ed.), Academic Press 1977, 359.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from ..numerics.continuation import GROWTH, Reached, follow, located
from ..numerics.newton import added, newton
from ..numerics.rank import NEWTON, POSITIONS, decomposed, solve
from ..outcome import SimulationError
from ..problem import Array
from .equilibrium import moving, rest, spread
from .equilibrium_feasibility import penetrated
from .independent_coordinates import independent
from .operating_point import Site
from .search import Box
from .stability import Stability, stability
from .zeros import Complex

MOST = 1500
"""Points of a branch."""
CLOSED = "it comes back to where it began"
CORRECTIONS = 12
FAR = 0.5
"""A step of Newton's method that leads to another branch."""
PAIRED, MEETING = 1e-6, 1e-12
"""Relative differences of eigenvalues and their opposites, and of a discriminant, that count as rounding."""
BESIDE = 1e-2
"""How far from a fork its other branch is looked for."""


class EquilibriumPoint(Struct, frozen=True, eq=False):
    """A state on a branch: ``x`` displacements from the start and the parameter, 0 to 1 over its range; ``tangent``."""

    x: Array
    tangent: Array
    stable: Stability
    crossing: float
    """The real eigenvalue of the stiffness nearest to zero, with its sign: it changes it at folds and forks."""
    growing: float
    """The largest growth of an oscillation; not-a-number where nothing oscillates."""
    apart: float
    """Of a motion that goes back the same way in time, how far its squared eigenvalues are apart: negative where some are
    complex; not-a-number for others."""


class Bifurcation(Struct, frozen=True, eq=False):
    """``kind``: fold, fork, hopf, or hamiltonian hopf, where two pairs of imaginary eigenvalues of opposite Krein signature meet
    and leave the axis. ``exact``: located as a root, not between two points of the branch."""

    kind: str
    x: Array
    exact: bool


class EquilibriumBranch(Struct, frozen=True, eq=False):
    points: tuple[EquilibriumPoint, ...]
    specials: tuple[Bifurcation, ...]


class Tracer:
    """Follows branches. ``at``: the model with a value of the parameter, as a share of its range."""

    def __init__(self, site: Site, box: Box, at: Callable[[float], Site], scales: Array) -> None:
        self.site = site
        self.box = box
        self.at = at
        self.scales = scales
        self.start = site.y
        chart = site.chart
        turns = [j < chart.nd and chart.places[j] in chart.problem.rotations for j in box.moved]
        places = [chart.place(int(j)) for j in box.moved]
        self.origin = np.where(turns, 0.0, site.y[places]) if len(box.moved) else np.zeros(0)

    # ------------------------------------------------------------ one point

    def state(self, x: Array) -> Array:
        d = spread(self.site.chart, self.box.moved, x[:-1] * self.scales)
        return self.site.chart.moved(self.start, d)

    def coordinates(self, y: Array, share: float) -> Array:
        d = self.site.chart.between(self.start, y)[self.box.moved]
        return np.append(d / self.scales, share)

    def _system(self, x: Array) -> tuple[Array, Array]:
        """Return what has to vanish and its derivatives by x; those by the parameter are differences."""
        y, h = self.state(x), 1e-6
        here = rest(self.at(float(x[-1])), y, self.box.moved)
        values = np.concatenate([here.forces, here.phi])
        slopes = np.vstack([here.slopes, here.phi_slopes]) * self.scales
        sides = []
        for share in (x[-1] + h, x[-1] - h):
            site = self.at(float(share))
            sides.append(np.concatenate([site.rates(y)[site.chart.nd :], site.constraints(y)[0]]))
        column = (sides[0] - sides[1]) / (2 * h)
        matrix = np.column_stack([slopes, column])
        sizes = np.linalg.norm(matrix, axis=1)
        sizes[sizes == 0] = 1.0
        return values / sizes, matrix / sizes[:, None]

    def corrected(self, origin: Array, normal: Array) -> Array | None:
        """Return the point of the branch in the plane through x, None where Newton's method finds none near."""

        def step(x: Array) -> tuple[Array, float] | None:
            try:
                values, matrix = self._system(x)
            except SimulationError:
                return None
            whole = np.vstack([matrix, normal])
            left = np.append(values, normal @ (x - origin))
            if not (np.isfinite(whole).all() and np.isfinite(left).all()):
                return None
            found = solve(whole, -left, NEWTON)
            size = float(np.linalg.norm(found))
            return (found, size) if size <= FAR else None

        solved = newton(origin, step, added, most=CORRECTIONS, close=1e-15, resting=1e-10)
        if solved.why in ("undefined", "singular"):
            return None
        values, _ = self._system(solved.at)
        return solved.at if np.abs(values).max(initial=0.0) < 1e-9 else None

    def tangent(self, x: Array, before: Array | None) -> tuple[Array, int]:
        """Return the direction of the branch, along the one before, and how many directions there are."""
        _, matrix = self._system(x)
        found = decomposed(matrix)
        null, right = found.null_space(POSITIONS).T, found.right
        if before is not None and len(null) > 1:
            along = null.T @ (null @ before)
            length = float(np.linalg.norm(along))
            direction = along / length if length > 1e-3 else right[-1]
        else:
            direction = right[-1]
        if before is not None and direction @ before < 0:
            direction = -direction
        return direction, len(null)

    def point(self, x: Array, tangent: Array) -> EquilibriumPoint:
        site, y = self.at(float(x[-1])), self.state(x)
        found = stability(site, y)
        crossing, growing = self._tests(site, y, found)
        apart = np.nan if found.conservative else _apart(found.eigenvalues)
        return EquilibriumPoint(x, tangent, found, crossing, growing if np.isnan(apart) else np.nan, apart)

    def _tests(self, site: Site, y: Array, found: Stability) -> tuple[float, float]:
        derivatives = site.derivatives(y)
        free = independent(site.chart, derivatives)
        nd, nv = site.chart.nd, site.problem.nv
        place = moving(site.chart)
        kept = [int(j) for j in free.chosen if int(j) in self.box.moved]
        forces = [int(j) for j in free.chosen if nd <= j < nd + nv and place[j - nd] in kept]
        forces += [j for j in kept if j >= nd + nv]
        order = free.chosen.tolist()
        a = (derivatives.rates @ free.tangent)[free.chosen]
        matrix = a[np.ix_([order.index(j) for j in forces], [order.index(j) for j in kept])]
        crossing = np.nan
        if matrix.size and matrix.shape[0] == matrix.shape[1]:
            size = float(np.linalg.norm(matrix))
            sign = float(np.sign(np.linalg.det(matrix / size))) if size else 0.0
            crossing = sign * float(np.abs(np.linalg.eigvals(matrix)).min())
        oscillating = found.eigenvalues[
            np.abs(found.eigenvalues.imag) > 1e-6 * np.abs(found.eigenvalues).max(initial=1e-300)
        ]
        growing = float(oscillating.real.max()) if oscillating.size else np.nan
        if found.conservative:
            growing = np.nan
        return crossing, growing

    # ------------------------------------------------------------ a branch

    def trace(self, seed: Array) -> EquilibriumBranch:
        """Return the branch through a point, in both directions as far as the range of the parameter and the bounds."""
        direction, _ = self.tangent(seed, None)
        forward, closed = self._follow(seed, direction)
        backward = [] if closed else self._follow(seed, -direction)[0]
        turned = [replace(p, tangent=-p.tangent) for p in reversed(backward[1:])]
        points = (*turned, *forward)
        specials: list[Bifurcation] = []
        whole = list(points[:1])
        for a, b in itertools.pairwise(points):
            found = self._between(a, b)
            whole += [self.point(s.x, b.tangent) for s in found if s.exact]
            whole.append(b)
            specials += found
        return EquilibriumBranch(tuple(whole), tuple(specials))

    def _follow(self, seed: Array, direction: Array) -> tuple[list[EquilibriumPoint], bool]:
        """Return points from a seed on in a direction, and whether they come back to it."""

        def advance(points: Sequence[EquilibriumPoint], step: float) -> Reached[EquilibriumPoint] | None:
            last = points[-1]
            x = self.corrected(last.x + step * last.tangent, last.tangent)
            if x is None or np.linalg.norm(x - last.x) > 2 * step:
                return None
            tangent = self.tangent(x, last.tangent)[0]
            bend = float(tangent @ last.tangent)
            if bend < 0.97:
                return None
            if not 0.0 <= x[-1] <= 1.0:
                end = float(np.clip(x[-1], 0.0, 1.0))
                edge = self.at_share(last.x + (x - last.x) * (end - last.x[-1]) / (x[-1] - last.x[-1]), end)
                return Reached([self.point(edge, tangent)] if edge is not None else [], end="the range ends")
            point = [self.point(x, tangent)]
            if self._out(x):
                return Reached(point, end="the bounds end")
            if len(points) >= 10 and np.linalg.norm(x - seed) < step and tangent @ direction > 0.5:
                return Reached(point, end=CLOSED)
            return Reached(point, GROWTH if bend > 0.995 else 1.0)

        points, why = follow([self.point(seed, direction)], advance, most=MOST)
        return points, why == CLOSED

    def at_share(self, x: Array, share: float) -> Array | None:
        """Return the point near x with this value of the parameter, None where Newton's method finds none."""
        normal = np.zeros(len(x))
        normal[-1] = 1.0
        x = x.copy()
        x[-1] = share
        return self.corrected(x, normal)

    def _out(self, x: Array) -> bool:
        """Whether a branch has left the bounds: those that the model states, else thrice as wide ones."""
        y = self.state(x)
        d = self.site.chart.between(self.start, y)[self.box.moved]
        values = d + self.origin
        margin = np.where(self.box.stated, 0.0, self.box.high - self.box.low)
        beyond = (values < self.box.low - margin) | (values > self.box.high + margin)
        return bool(beyond.any())

    # ------------------------------------------------------------ special points

    def _between(self, a: EquilibriumPoint, b: EquilibriumPoint) -> list[Bifurcation]:
        found: list[Bifurcation] = []
        turns = a.tangent[-1] * b.tangent[-1] < 0
        if turns:
            found.append(self._located("fold", a, b, lambda p: float(p.tangent[-1])))
        if a.crossing * b.crossing < 0 and not turns:
            found.append(self._located("fork", a, b, lambda p: p.crossing))
        if a.growing * b.growing < 0 and max(abs(a.growing), abs(b.growing)) > 1e-9:
            found.append(self._located("hopf", a, b, lambda p: p.growing))
        if a.apart * b.apart < 0 and min(abs(a.apart), abs(b.apart)) > MEETING:
            met = self._located("hamiltonian hopf", a, b, lambda p: p.apart)
            squares = _squares(stability(self.at(float(met.x[-1])), self.state(met.x)).eigenvalues)
            if squares is not None and _nearest(squares).real < 0:  # not two that grow, on the real axis
                found.append(met)
        return found

    def _located(
        self, kind: str, a: EquilibriumPoint, b: EquilibriumPoint, test: Callable[[EquilibriumPoint], float]
    ) -> Bifurcation:
        """Return where a quantity changes its sign between two points, on the branch."""
        chord = b.x - a.x
        length = float(np.linalg.norm(chord))
        normal = chord / length

        def at(s: float) -> EquilibriumPoint | None:
            x = self.corrected(a.x + s * normal, normal)
            return None if x is None else self.point(x, self.tangent(x, normal)[0])

        found = located(at, test, 0.0, length, 1e-15)
        if found is not None:
            return Bifurcation(kind, found.x, True)
        share = abs(test(a)) / (abs(test(a)) + abs(test(b)))
        return Bifurcation(kind, a.x + share * chord, False)

    def beside(self, special: Bifurcation) -> list[Array]:
        """Return points of the other branch through a fork."""
        _, matrix = self._system(special.x)
        null = decomposed(matrix).right[-2:]
        found = []
        for angle in np.linspace(0, np.pi, 12, endpoint=False):
            direction = np.cos(angle) * null[0] + np.sin(angle) * null[1]
            for sign in (1, -1):
                x = self.corrected(special.x + sign * BESIDE * direction, direction)
                if x is not None and np.linalg.norm(x - special.x) < 2 * BESIDE:
                    found.append(x)
        return found


def _squares(values: Complex) -> Complex | None:
    """Return the squares of eigenvalues that come in pairs of opposite sign; None where some do not."""
    size = float(np.abs(values).max(initial=0.0))
    opposite = np.abs(values[:, None] + values).min(axis=1, initial=np.inf)
    upper = values[(values.imag > 0) | ((values.imag == 0) & (values.real > 0))]
    if not len(values) or opposite.max() > PAIRED * size or 2 * len(upper) != len(values):
        return None
    return np.asarray(upper**2, dtype=complex)


def _apart(values: Complex) -> float:
    """Return the product of the squared distances of the squared eigenvalues, each relative to their size: the discriminant."""
    squares = _squares(values)
    if squares is None:
        return np.nan
    i, j = np.triu_indices(len(squares), 1)
    sizes = np.maximum(np.abs(squares[i]) + np.abs(squares[j]), 1e-300)
    return float(np.prod(((squares[i] - squares[j]) / sizes) ** 2).real)


def _nearest(squares: Complex) -> complex:
    """Return the middle of the two squared eigenvalues that are closest to each other."""
    i, j = np.triu_indices(len(squares), 1)
    k = int(np.argmin(np.abs(squares[i] - squares[j]) / (np.abs(squares[i]) + np.abs(squares[j]))))
    return complex(squares[i[k]] + squares[j[k]]) / 2


def near(branches: Sequence[EquilibriumBranch], x: Array, tracer: Tracer, within: float) -> bool:
    """Whether a point lies on one of the branches: closer to a chord of it than the chord bends."""
    return any(_distance(branch, x, tracer) < within for branch in branches)


def _distance(branch: EquilibriumBranch, x: Array, tracer: Tracer) -> float:
    points = np.array([p.x for p in branch.points])
    turn = 2 * np.pi / tracer.scales
    d = x - points
    d[:, :-1] = np.where(tracer.box.periodic, (d[:, :-1] + turn / 2) % turn - turn / 2, d[:, :-1])
    if len(points) == 1:
        return float(np.linalg.norm(d[0]))
    chords = np.diff(points, axis=0)
    lengths = np.maximum((chords**2).sum(axis=1), 1e-30)
    share = np.clip((d[:-1] * chords).sum(axis=1) / lengths, 0.0, 1.0)
    away = np.linalg.norm(d[:-1] - share[:, None] * chords, axis=1)
    return float(away.min())


def cut(
    branches: Sequence[EquilibriumBranch], specials: Sequence[Bifurcation], tracer: Tracer
) -> tuple[list[EquilibriumBranch], list[Bifurcation], int]:
    """Return the parts of branches and the special points that lie short of every contact, and how many points do not."""

    def beyond(x: Array) -> bool:
        return bool(penetrated(tracer.at(float(x[-1])), tracer.state(x)))

    kept: list[EquilibriumBranch] = []
    left = 0
    for branch in branches:
        inside = [special for special in branch.specials if not beyond(special.x)]
        for out, run in itertools.groupby(branch.points, lambda point: beyond(point.x)):
            points = tuple(run)
            if out:
                left += len(points)
            else:
                kept.append(EquilibriumBranch(points, tuple(inside)))
    return kept, [special for special in specials if not beyond(special.x)], left

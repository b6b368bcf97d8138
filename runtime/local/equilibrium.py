"""Where a model rests: states without velocities in which nothing changes.

From a state one gets to the equilibrium that strong damping would lead to, by steps of pseudo-time that grow as rest
comes near (C. T. Kelley, D. E. Keyes, SIAM J. Numer. Anal. 35 (1998), 508), and then by Newton's method.
"""

from __future__ import annotations

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from ..numerics import rank
from ..numerics.newton import newton
from ..outcome import SimulationError
from ..problem import Array
from .active_constraints import GAP, held_constraints, holding, row_values
from .chart import Chart
from .independent_coordinates import independent, null_space
from .operating_point import Derivatives, Site

EPSILON = float(np.finfo(float).eps)
RELAXING, NEWTON = 2000, 30
"""Most steps of both stages."""
LONGEST = 0.3
"""Of a step, in radians or in the size of the coordinates."""
NEAR = 1e-8
"""A state whose Newton step is shorter than this counts as the equilibrium beside it."""
UNRESOLVED = 1e-7
"""Of the forces that a displacement of the size of the coordinates makes: what remains counts as none."""
SMALL = 1e-3
"""Of the largest row: where there are more equations than unknowns, smaller ones are not made as large as the others."""
BESIDE = 8.0
"""Newton steps to both sides of a state, within which no force of an equilibrium gets half as steep: towards a place where
forces are infinite steps become as short."""
REGULAR = 1e9
"""Equations whose condition is below have no such directions."""


class Equilibrium(Struct, frozen=True, eq=False):
    """``errors`` [n]: bounds by residual and condition, of each displacement; not-a-number along ``free`` directions
    [n][k], which change nothing. ``condition`` of the equations."""

    y: Array
    errors: Array
    residual: float
    condition: float
    free: Array


class RestState(Struct, frozen=True, eq=False):
    """Everything at one state without velocities: ``forces`` [m] (accelerations and rates of states), their derivatives by
    the ``moving`` displacements, residuals of the position constraints and theirs. ``open``: those of the forces that what holds
    leaves; the others are rounding."""

    forces: Array
    slopes: Array
    phi: Array
    phi_slopes: Array
    found: Derivatives
    open: NDArray[np.intp] | slice

    @property
    def equations(self) -> tuple[Array, Array, int]:
        """Return the rows of derivatives, what is left of forces and constraints, and the number of forces."""
        forces = self.forces[self.open]
        rows = np.vstack([self.slopes[self.open], self.phi_slopes])
        return rows, np.concatenate([forces, self.phi]), len(forces)


def moving(chart: Chart) -> NDArray[np.intp]:
    """Return the displacements that may differ between equilibria: positions that have a velocity, and states."""
    problem = chart.problem
    found: list[int] = []
    for k, i in enumerate(problem.partner):
        first = chart.places.index(i)
        same = i in problem.rotations and k and found and chart.places[found[-1]] == i
        found.append(found[-1] + 1 if same else first)
    return np.array([*found, *range(chart.nd + problem.nv, chart.size)], dtype=np.intp)


def at_rest(site: Site, y: Array) -> Array:
    """Return a state with velocities of zero."""
    problem = site.problem
    still = y.copy()
    still[problem.nq : problem.nq + problem.nv] = 0.0
    return still


def rest(site: Site, y: Array, moved: NDArray[np.intp]) -> RestState:
    """Return everything at one state without velocities, with what holds there among the constraints. Raises SimulationError
    where a derivative is undefined."""
    found, held = held_constraints(site, site.derivatives(y))
    nd, phi = site.chart.nd, site.constraints(y)[0]
    return RestState(
        site.rates(y)[nd:],
        found.rates[nd:][:, moved],
        np.concatenate([phi, row_values(site, y)[held, GAP]]) if held else phi,
        found.position[:, moved],
        found,
        _open(site, found) if holding(site) else slice(None),
    )


def _open(site: Site, found: Derivatives) -> NDArray[np.intp]:
    """Return the forces along independent displacements."""
    chosen, nd = independent(site.chart, found).chosen, site.chart.nd
    return chosen[chosen >= nd] - nd


def check_autonomous(site: Site, found: Derivatives, y: Array) -> None:
    """Raise SimulationError where rest is impossible or a matter of time: what is prescribed moves on."""
    chart = site.chart
    name = site.problem.name
    if found.moves_by_itself:
        raise SimulationError(
            f"'{name}' depends on time, so that it has no equilibria",
            help="look at its periodic motions, or hold what moves: replace time by a parameter",
        )
    drift = site.constraints(at_rest(site, y))[1]
    if np.abs(drift).max(initial=0.0) > 0:
        raise SimulationError(f"a constraint of '{name}' moves by itself, so that nothing rests")
    driven = np.setdiff1d(np.arange(chart.nd), moving(chart))
    rates = np.abs(site.rates(at_rest(site, y))[driven])
    if rates.max(initial=0.0) > 0:
        raise SimulationError(
            f"'{chart.names[int(driven[int(rates.argmax())])]}' is driven, so that '{name}' has no equilibria",
            help="its steady motions are what the study steady finds",
        )


class NewtonStep(Struct, frozen=True, eq=False):
    """The shortest ``step`` [m] to where forces and constraints vanish; ``inverse`` of their derivatives, with the
    directions [m][k] that are ``free`` left out; the ``condition``."""

    step: Array
    inverse: Array
    condition: float
    free: Array


def newton_step(here: RestState) -> NewtonStep:
    """Return the Newton step at a state; the shortest one where directions are free."""
    rows, left, n = here.equations
    wanted = -left
    sizes = np.linalg.norm(rows, axis=1)
    if (
        rows.shape[0] != rows.shape[1]
    ):  # what is known already must not be outweighed by rounding of small rows
        for group in (sizes[:n], sizes[n:]):
            group[:] = np.maximum(group, SMALL * float(group.max(initial=0.0)))
    sizes[sizes == 0] = 1.0
    scaled = rows / sizes[:, None]
    if rows.shape[0] == rows.shape[1]:  # nearly always, and ten times faster
        try:
            inverse = np.linalg.inv(scaled)
        except np.linalg.LinAlgError:
            inverse = None
        if inverse is not None and np.isfinite(inverse).all():
            condition = float(np.linalg.norm(scaled, 1) * np.linalg.norm(inverse, 1)) if len(rows) else 1.0
            if condition < REGULAR:
                inverse = inverse / sizes
                return NewtonStep(inverse @ wanted, inverse, condition, np.zeros((len(rows), 0)))
    if not np.isfinite(scaled).all():
        nothing = np.full(rows.shape[1], np.nan)
        return NewtonStep(nothing, np.zeros(rows.shape[::-1]), np.inf, np.zeros((rows.shape[1], 0)))
    found = rank.decomposed(scaled)
    kept = found.rank(rank.NEWTON)
    inverse = found.inverse(rank.NEWTON) / sizes
    condition = float(found.values[0] / found.values[kept - 1]) if kept else 1.0
    return NewtonStep(inverse @ wanted, inverse, condition, found.null_space(rank.NEWTON))


def polished(site: Site, y: Array, moved: NDArray[np.intp] | None = None) -> Equilibrium | None:
    """Return the equilibrium to which Newton's method leads by some displacements, None where it does not lead to one."""
    chosen = moving(site.chart) if moved is None else moved

    def step(y: Array) -> tuple[tuple[RestState, NewtonStep], float] | None:
        try:
            here = rest(site, y, chosen)
        except SimulationError:
            return None
        solved = newton_step(here)
        return (here, solved), float(np.abs(solved.step / sizes_of(site, y, chosen)).max(initial=0.0))

    def after(y: Array, found: tuple[RestState, NewtonStep], share: float) -> Array:
        return site.chart.moved(y, spread(site.chart, chosen, share * found[1].step))

    found = newton(at_rest(site, y), step, after, most=NEWTON, close=EPSILON, resting=NEAR, longest=LONGEST)
    return certified(site, found.at, chosen, *found.step) if found.converged and found.step else None


def certified(
    site: Site, y: Array, moved: NDArray[np.intp], here: RestState, solved: NewtonStep
) -> Equilibrium | None:
    """Return an equilibrium with bounds of its errors; None where what is left of the forces is no rounding."""
    rows, left, count = here.equations
    sizes = sizes_of(site, y, moved)
    scale = np.abs(rows) @ sizes
    rounding = np.repeat(
        [64 * EPSILON * float(part.max(initial=0.0)) for part in (scale[:count], scale[count:])],
        [count, len(here.phi)],
    )
    if (np.abs(rows @ solved.step + left) > UNRESOLVED * scale + rounding + 1e-300).any():
        return None  # the least squares have a minimum here, the forces no zero
    if _singular(site, y, moved, here, solved.step):
        return None
    errors = np.abs(solved.inverse) @ (np.abs(left) + EPSILON * scale) + EPSILON * sizes
    everything = np.zeros(site.chart.size)
    everything[moved] = errors
    still = np.zeros((site.chart.size, solved.free.shape[1]))
    still[moved] = solved.free
    return Equilibrium(y, everything, float(np.abs(left).max(initial=0.0)), solved.condition, still)


def _singular(site: Site, y: Array, moved: NDArray[np.intp], here: RestState, step: Array) -> bool:
    """Whether forces become infinite so near to a state that Newton's steps are short for that alone.

    Of independent coordinates: what is computed of the others may lose digits near places that are regular.
    """
    free = independent(site.chart, here.found)
    steep = np.linalg.norm((here.found.rates @ free.tangent)[free.chosen], axis=1)
    falls = steep > SMALL * float(steep.max(initial=0.0))
    for sign in (1.0, -1.0):
        beside = site.chart.moved(y, spread(site.chart, moved, sign * BESIDE * step))
        try:
            there = rest(site, beside, moved)
        except SimulationError:  # a derivative is undefined there
            return False
        falls &= np.linalg.norm((there.found.rates @ free.tangent)[free.chosen], axis=1) < steep / 2
    return bool(falls.any())


def resting(site: Site, y: Array) -> Equilibrium | None:
    """Return the equilibrium that a state is, but for rounding; None where something moves."""
    problem = site.problem
    if np.abs(y[problem.nq : problem.nq + problem.nv]).max(initial=0.0) > 0:
        return None
    moved = moving(site.chart)
    here = rest(site, y, moved)
    solved = newton_step(here)
    size = float(np.abs(solved.step / sizes_of(site, y, moved)).max(initial=0.0))
    if not size <= NEAR or here.found.moves_by_itself:
        return None
    return certified(site, y, moved, here, solved) if size <= 4 * EPSILON else polished(site, y)


def reached(site: Site, y: Array) -> Equilibrium:
    """Return the equilibrium that strong damping leads to from a state. Raises SimulationError where none is found."""
    moved = moving(site.chart)
    y = at_rest(site, y)
    check_autonomous(site, site.derivatives(y), y)
    found = resting(site, y)
    if found is not None:
        return found
    relaxed = _relaxed(site, y, moved)
    found = polished(site, relaxed) or polished(site, y)
    if found is None:
        raise SimulationError(
            f"no equilibrium was found from this state of '{site.problem.name}'",
            help='begin nearer to one: at = "name = value, ..."; mechc study equilibria searches everywhere',
        )
    return found


def _relaxed(site: Site, y: Array, moved: NDArray[np.intp]) -> Array:
    """Follow the motion that forces alone would give without inertia, in growing steps of implicit Euler."""
    chart, nd, nv = site.chart, site.chart.nd, site.problem.nv
    tau = last = None
    for _ in range(RELAXING):
        here = rest(site, y, moved)
        allowed = (
            null_space(here.found.rate[:, nd : nd + nv], len(here.found.rate)) if nv else np.zeros((0, 0))
        )
        m, k = allowed.shape[1], len(moved) - nv
        basis = np.zeros((len(moved), m + k))
        basis[:nv, :m] = allowed
        basis[nv:, m:] = np.eye(k)
        pull = basis.T @ here.forces
        slopes = basis.T @ here.slopes @ basis
        size = float(np.linalg.norm(pull))
        stiff = float(np.linalg.norm(slopes, 2)) if slopes.size else 0.0
        if size <= 1e-13 * max(stiff, 1e-300):
            break
        if tau is None or last is None:
            tau = 1.0 / max(stiff, 1e-300)
        else:
            tau *= min(4.0, max(0.25, last / size))
        last = size
        away = float(np.linalg.eigvals(slopes).real.max(initial=0.0)) if np.isfinite(slopes).all() else 0.0
        if away > 0:  # downhill from a top: longer steps would be Newton's, which lead back to it
            tau = min(tau, 0.5 / away)
        shortest = rank.solve(np.eye(m + k) / tau - slopes, pull)
        if not np.isfinite(shortest).all():
            break
        step = basis @ shortest
        if len(here.phi):
            step -= rank.solve(here.phi_slopes, here.phi, rank.NEWTON)
        length = float(np.abs(step / sizes_of(site, y, moved)).max(initial=0.0))
        if not np.isfinite(length):
            break
        if length > LONGEST:
            step, tau = step * (LONGEST / length), tau / 2
        y = chart.moved(y, spread(chart, moved, step))
        if length < 1e-9:
            break
    return y


def sizes_of(site: Site, y: Array, moved: NDArray[np.intp]) -> Array:
    """Return the size of each displacement: a radian, or for others the largest of 1 and what it is."""
    chart = site.chart
    now = np.ones(chart.size)
    for j, i in enumerate(chart.places):
        if i not in site.problem.rotations:
            now[j] = max(1.0, abs(y[i]))
    now[chart.nd :] = np.maximum(1.0, np.abs(y[list(chart.behind)]))
    return now[moved]


def spread(chart: Chart, moved: NDArray[np.intp], step: Array) -> Array:
    d = np.zeros(chart.size)
    d[moved] = step
    return d

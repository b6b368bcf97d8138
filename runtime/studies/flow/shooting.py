"""Periodic motions by multiple shooting: Newton's method on pieces of the motion that must join, and close.

The corrections are those of least norm, so that directions in which nothing is decided (along the motion, from one orbit of a
family to the next, by a symmetry) are not gone.
"""

from __future__ import annotations

import math

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from ...case import Case, inputs_at
from ...numerics import rank
from ...numerics.newton import newton
from ...outcome import SimulationError
from ...problem import Array, Problem
from ...tangent.coordinates import basis
from .linearised import Linearised, LinearMap, of_pieces
from .pieces import column_at, periodic

MOST_ITERATIONS = 25
GROWTH = 1e3
"""Of small changes over one piece of the motion."""
MOST_PIECES = 64
CLOSED = 1e-8
"""Residual, in nominal sizes, below which an orbit counts as closed, if rounding allows no better."""
ISOLATED = 1e-8
"""Of the largest derivative: directions with smaller ones are not decided, where an orbit is alone. They are small near a fork."""
MOST_ROUNDS = 64
"""Of an orbit within the period that was found; more of them are found one factor after the other."""
PROJECTIONS = 6
DIFFERENCE = 1e-3
"""Of nominal values: for derivatives of an energy, by the rule of fourth order."""


class ShootingOrbit(Struct, frozen=True, eq=False):
    """A periodic motion: its ``start`` [ny] and ``period``, its linear map, how far it is from closing (in nominal
    sizes), the last correction of the period, and Newton's ``iterations``. ``whole``: the start with the discrete variables of
    the model after it."""

    whole: Array
    start: Array
    period: float
    map: LinearMap
    residual: float
    correction: float
    iterations: int
    pieces: int


def close(
    linear: Linearised, start: Array, period: float, *, free: bool, energy: OrbitEnergy | None = None
) -> ShootingOrbit:
    """Find the periodic motion near a start; ``free``: the period is unknown. ``energy``: which the orbit is to have.

    What the motion keeps in discrete variables and reads again has to come back as well; what it sets once is set at its start. Raises
    SimulationError where none is found.
    """
    found = _closed(linear, start, period, free, energy)
    settled = linear.settled(linear.tangents.case.begin, found.whole, found.period, found.map)
    return found if settled is found.whole else _closed(linear, settled, found.period, free, energy)


def _closed(
    linear: Linearised, start: Array, period: float, free: bool, energy: OrbitEnergy | None
) -> ShootingOrbit:
    shooter = Shooter(linear, free, energy)
    start = linear.joined(*linear.split(start))
    first = linear.map(linear.tangents.case.begin, start, period, checked=False).remembered()
    growth = float(np.linalg.norm(first.matrix, 2))
    count = 1
    if not growth < GROWTH**2:
        count = min(MOST_PIECES, max(2, math.ceil(math.log(min(growth, 1e300)) / math.log(GROWTH))))
    linear.memory = first.memory
    return shooter.solve(start, period, count)


def least(linear: Linearised, found: ShootingOrbit, energy: OrbitEnergy | None = None) -> ShootingOrbit:
    """Give a periodic motion with its least period, where that is a part of the one it was found with.

    Raises SimulationError where the motion fails.
    """
    tangents = linear.tangents
    begin, own = tangents.case.begin, linear.kept
    parts = np.arange(MOST_ROUNDS, 1, -1)
    y, z = linear.split(found.whole)
    w, dz = linear.changes(y, np.eye(linear.size))
    flow = tangents.flow(begin, y, w, begin + found.period / parts, z=z, dz=dz, scheduled=False)
    if flow.short:
        raise SimulationError(f"the motion ends before its period is over: {flow.short}")
    assert flow.z is not None
    shooter = Shooter(linear, True, energy)
    places = [linear.joined(*row) for row in zip(flow.states, flow.z, strict=True)]
    closed = [bool(np.abs(shooter.gap(found.whole, there)[own]).max() < CLOSED) for there in places]
    if all(closed) or not any(closed):  # a state of rest has no least period
        return found
    period = found.period / float(parts[closed.index(True)])
    return least(linear, close(linear, found.whole, period, free=True, energy=energy), energy)


class OrbitEnergy(Struct, frozen=True):
    """A condition on an orbit of a family: the output ``name`` has a value there."""

    name: str
    value: float


class _Pieces(Struct, frozen=True, eq=False):
    """Where the pieces begin (states with discrete variables), the ``residual`` [m n] by which they miss joining, their linear maps, the states where they end, all discrete variables there, and
    the ``size`` of what is wrong, in nominal sizes."""

    nodes: list[Array]
    period: float
    residual: Array
    blocks: list[Array]
    ends: list[Array]
    modes: list[Array]
    size: float


class Shooter:
    def __init__(self, linear: Linearised, free: bool, energy: OrbitEnergy | None) -> None:
        self.linear, self.free, self.energy = linear, free, energy
        self.case: Case = linear.tangents.case
        self.problem: Problem = self.case.problem
        self.turning = [k for k in range(self.problem.nq) if periodic(self.case, k)]

    def solve(self, start: Array, period: float, count: int) -> ShootingOrbit:
        case, linear = self.case, self.linear
        nodes, maps = [start], list[LinearMap]()
        for k in range(count if linear.reals and count > 1 else count - 1):
            begin = case.begin + k * period / count
            maps.append(linear.map(begin, nodes[k], period / count, checked=False))
            if k < count - 1:
                nodes.append(linear.joined(maps[k].end, maps[k].z))
        if linear.reals and count > 1:
            linear.memory = of_pieces(maps)

        def step(at: _Pieces) -> tuple[tuple[list[Array], float], float]:
            return self._correction(at), at.size

        def moved(at: _Pieces, change: tuple[list[Array], float], share: float) -> _Pieces | None:
            longer = at.period + share * change[1]
            if longer <= 0.2 * at.period:
                return None
            places = [self._moved(node, share * d) for node, d in zip(at.nodes, change[0], strict=True)]
            try:
                return self._pieces(places, longer)
            except SimulationError:
                return None

        solved = newton(
            self._pieces(nodes, period),
            step,
            moved,
            most=MOST_ITERATIONS,
            resting=CLOSED,
            accepted=lambda at, _, after, __: after.size < max(at.size, CLOSED),
        )
        nodes, period, size = solved.at.nodes, solved.at.period, solved.at.size
        correction = abs(solved.step[1]) if solved.step else math.inf
        if not size < CLOSED:
            raise SimulationError(
                f"no periodic motion of '{self.problem.name}' was found near its start: the last one misses itself by "
                f"{size:.1e} of its size",
                help='begin nearer to it, --set NAME="...", or say --period with a first guess; a damped motion '
                "that nothing drives has none",
            )
        closing = self.linear.map(case.begin, nodes[0], period)
        if count > 1:  # the product of the pieces: what has grown and fallen within them is not lost
            closing = self._product(nodes, period, closing)
        y, whole = nodes[0][: self.problem.ny], nodes[0]
        return ShootingOrbit(whole, y, period, closing.remembered(), size, correction, solved.steps, count)

    def _product(self, nodes: list[Array], period: float, whole: LinearMap) -> LinearMap:
        maps = [
            self.linear.map(
                self.case.begin + k * period / len(nodes), node, period / len(nodes), closed=False
            )
            for k, node in enumerate(nodes)
        ]
        matrix, error = np.eye(len(whole.matrix)), np.zeros_like(whole.matrix)
        for one in maps:
            error = np.abs(one.matrix) @ error + one.error @ np.abs(matrix)
            matrix = one.matrix @ matrix
        if self.problem.constraints:  # arrives in the directions of another basis of the same space
            return whole
        return replace(whole, matrix=matrix, error=error)

    def _pieces(self, nodes: list[Array], period: float) -> _Pieces:
        """Give how far the pieces are from joining, their linear maps and the states where they end."""
        linear, count = self.linear, len(nodes)
        residual, blocks, ends, modes = [], [], [], []
        nodes = list(nodes)
        for k in range(count):
            begin = self.case.begin + k * period / count
            end, matrix, z = linear.over(linear.tangents, begin, nodes[k], period / count)
            if k + 1 < count:  # what is not an unknown goes on as it is
                nodes[k + 1] = self._continued(nodes[k + 1], end)
            following = nodes[(k + 1) % count]
            residual.append(self.gap(following, end, turns=k == count - 1)[linear.kept])
            blocks.append(matrix)
            ends.append(end)
            modes.append(z)
        gaps = np.concatenate(residual)
        return _Pieces(nodes, period, gaps, blocks, ends, modes, self._size(gaps, nodes[0]))

    def _continued(self, node: Array, end: Array) -> Array:
        """Give a node with the discrete variables of the end before it, but for those that are unknowns."""
        linear, reals = self.linear, list(self.linear.reals)
        z = linear.split(end)[1].copy()
        own = [reals[j] for j in linear.memory]
        y, before = linear.split(node)
        z[own] = before[own]
        return linear.joined(y, z)

    def gap(self, wanted: Array, there: Array, *, turns: bool = True) -> Array:
        """Give how far a start is from a wanted one [2 nv + nx + m], in nominal sizes; up to whole turns of angles."""
        (y, z), (other, reached) = self.linear.split(wanted), self.linear.split(there)
        gap = other - y
        for i in self.turning if turns else ():
            gap[i] -= 2 * math.pi * round(gap[i] / (2 * math.pi))
        reals = list(self.linear.reals)
        return self.linear.told(y, gap[:, None], (reached[reals] - z[reals])[:, None])[:, 0]

    def _size(self, residual: Array, node: Array) -> float:
        """Give the largest gap, or how far the energy is from the one that is wanted, in nominal sizes."""
        size = float(np.abs(residual).max())
        if self.energy is None:
            return size
        kept = self.linear.kept
        return max(size, abs(self.energy_row(node, self.linear.allowed(node)[kept], self.energy)[1]))

    def _correction(self, at: _Pieces) -> tuple[list[Array], float]:
        """Give the least change of the nodes, each [2 nv + nx + m] in nominal sizes, and of the period that closes the gaps."""
        nodes, period = at.nodes, at.period
        linear, count = self.linear, len(nodes)
        kept = linear.kept
        n = len(kept)
        spaces = [linear.allowed(node)[kept] for node in nodes]
        widths = [space.shape[1] for space in spaces]
        places = np.r_[0, np.cumsum(widths)]
        matrix = np.zeros((n * count, places[-1] + int(self.free)))
        for k in range(count):
            rows, following = slice(n * k, n * (k + 1)), (k + 1) % count
            matrix[rows, places[k] : places[k + 1]] += at.blocks[k][np.ix_(kept, kept)] @ spaces[k]
            matrix[rows, places[following] : places[following + 1]] -= spaces[following]
            if self.free:
                rate = self.rate(self.case.begin + (k + 1) * period / count, at.ends[k], at.modes[k])
                matrix[rows, -1] = rate[kept] * period / count
        wanted = -at.residual
        if self.energy is not None:
            slope, missing = self.energy_row(nodes[0], spaces[0], self.energy)
            row = np.zeros((1, matrix.shape[1]))
            row[0, : widths[0]] = slope
            matrix, wanted = np.vstack([matrix, row]), np.append(wanted, missing)
        solution = rank.solve(matrix, wanted, ISOLATED if self.energy is None else rank.MOTIONS)
        steps = []
        for k in range(count):
            whole = np.zeros(linear.size)
            whole[kept] = spaces[k] @ solution[places[k] : places[k + 1]]
            steps.append(whole)
        return steps, float(solution[-1]) * period if self.free else 0.0

    def energy_row(self, start: Array, space: Array, energy: OrbitEnergy) -> tuple[Array, float]:
        """Give the derivatives [r] of the energy in the directions of a node, and what it lacks, both over their size."""
        column, linear = column_at(self.case, energy.name), self.linear
        whole = np.zeros((linear.size, space.shape[1]))
        whole[linear.kept] = space
        y, _ = linear.split(start)
        changes, _ = linear.changes(y, whole)
        rows = np.vstack([y + s * DIFFERENCE * changes.T for s in (1, -1, 2, -2)])
        found = column(np.full(len(rows), self.case.begin), rows).reshape(4, -1)
        slope = (8 * (found[0] - found[1]) - (found[2] - found[3])) / (12 * DIFFERENCE)
        here = float(column(np.array([self.case.begin]), y[None, :])[0])
        size = float(np.linalg.norm(slope)) or 1.0
        return slope / size, (energy.value - here) / size

    def rate(self, t: float, start: Array, z: Array) -> Array:
        """Give the rates of a start in nominal sizes [2 nv + nx + m], at all discrete variables [nz], which rest: what slips is
        driven by its friction."""
        case, (y, _) = self.case, self.linear.split(start)
        rate = case.functions.rhs(t, y, inputs_at(case, t), z, case.p)
        return self.linear.told(y, rate[:, None], np.zeros((len(self.linear.reals), 1)))[:, 0]

    def _moved(self, start: Array, change: Array) -> Array:
        """Give the start that is changed by so much, on the constraints."""
        linear, (y, z) = self.linear, self.linear.split(start)
        far, z = change * linear.scale, z.copy()
        z[list(linear.reals)] += far[linear.states :]
        return linear.joined(self._onto(y + basis(self.problem, y) @ far[: linear.states], z), z)

    def _onto(self, y: Array, z: Array) -> Array:
        """Give a state put onto the constraints."""
        problem, functions, case = self.problem, self.case.functions, self.case
        nq, nv = problem.nq, problem.nv
        for i in problem.rotations:
            y[i : i + 4] /= np.linalg.norm(y[i : i + 4])
        if functions.project_position is None or functions.displace is None:
            return y
        u = inputs_at(case, case.begin)
        for _ in range(PROJECTIONS):
            along = y.copy()
            along[nq : nq + nv] = functions.project_position(case.begin, y, u, z, case.p)[:nv]
            y[:nq] += functions.displace(case.begin, along, u, z, case.p)
        if functions.project_velocity is not None:
            y[nq : nq + nv] += functions.project_velocity(case.begin, y, u, z, case.p)[:nv]
        return y

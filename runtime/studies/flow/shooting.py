"""Periodic motions by multiple shooting: Newton's method on pieces of the motion that must join, and close.

The corrections are those of least norm, so that directions in which nothing is decided (along the motion, from one orbit of a
family to the next, by a symmetry) are not gone.
"""

from __future__ import annotations

import math

import numpy as np
from msgspec import Struct

from ...case import Case, inputs_at
from ...numerics import rank
from ...numerics.newton import newton
from ...outcome import SimulationError
from ...problem import Array, Problem
from ...tangent.coordinates import basis, minimal
from .linearised import Linearised, LinearMap
from .pieces import column_at, periodic

MOST_ITERATIONS = 25
GROWTH = 1e3
"""Of small changes over one piece of the motion."""
MOST_PIECES = 64
CLOSED = 1e-8
"""Residual, in nominal sizes, below which an orbit counts as closed, if rounding allows no better."""
MOST_ROUNDS = 64
"""Of an orbit within the period that was found; more of them are found one factor after the other."""
PROJECTIONS = 6
DIFFERENCE = 1e-3
"""Of nominal values: for derivatives of an energy, by the rule of fourth order."""


class Orbit(Struct, frozen=True, eq=False):
    """A periodic motion: its ``start`` [ny] and ``period``, its linear map, how far it is from closing (in nominal
    sizes), the last correction of the period, and Newton's ``iterations``."""

    start: Array
    period: float
    map: LinearMap
    residual: float
    correction: float
    iterations: int
    pieces: int


def close(linear: Linearised, y: Array, period: float, *, free: bool, energy: Energy | None = None) -> Orbit:
    """Find the periodic motion near a state; ``free``: the period is unknown. ``energy``: which the orbit is to have.

    Raises SimulationError where none is found.
    """
    shooter = Shooter(linear, free, energy)
    first = linear.map(linear.tangents.case.begin, y, period, checked=False)
    growth = float(np.linalg.norm(first.matrix, 2))
    count = 1
    if not growth < GROWTH**2:
        count = min(MOST_PIECES, max(2, math.ceil(math.log(min(growth, 1e300)) / math.log(GROWTH))))
    return shooter.solve(y, period, count)


def least(linear: Linearised, found: Orbit, energy: Energy | None = None) -> Orbit:
    """Give a periodic motion with its least period, where that is a part of the one it was found with.

    Raises SimulationError where the motion fails.
    """
    tangents, problem = linear.tangents, linear.problem
    begin, own = tangents.case.begin, linear.kept
    parts = np.arange(MOST_ROUNDS, 1, -1)
    w = basis(problem, found.start) * linear.scale
    flow = tangents.flow(begin, found.start, w, begin + found.period / parts)
    if flow.short:
        raise SimulationError(f"the motion ends before its period is over: {flow.short}")
    shooter = Shooter(linear, True, energy)
    closed = [bool(np.abs(shooter.gap(found.start, there)[own]).max() < CLOSED) for there in flow.states]
    if all(closed) or not any(closed):  # a state of rest has no least period
        return found
    period = found.period / float(parts[closed.index(True)])
    return least(linear, close(linear, found.start, period, free=True, energy=energy), energy)


class Energy(Struct, frozen=True):
    """A condition on an orbit of a family: the output ``name`` has a value there."""

    name: str
    value: float


class _Pieces(Struct, frozen=True, eq=False):
    """Where the pieces begin, the ``residual`` [m n] by which they miss joining, their linear maps, the states where they end, and
    the ``size`` of what is wrong, in nominal sizes."""

    nodes: list[Array]
    period: float
    residual: Array
    blocks: list[Array]
    ends: list[Array]
    size: float


class Shooter:
    def __init__(self, linear: Linearised, free: bool, energy: Energy | None) -> None:
        self.linear, self.free, self.energy = linear, free, energy
        self.case: Case = linear.tangents.case
        self.problem: Problem = self.case.problem
        self.turning = [k for k in range(self.problem.nq) if periodic(self.case, k)]

    def solve(self, y: Array, period: float, count: int) -> Orbit:
        case = self.case
        nodes = [y]
        for k in range(count - 1):
            begin = case.begin + k * period / count
            nodes.append(self.linear.map(begin, nodes[-1], period / count, checked=False).end)

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
        return Orbit(nodes[0], period, closing, size, correction, solved.steps, count)

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
        return LinearMap(matrix, error, whole.directions, whole.end)

    def _pieces(self, nodes: list[Array], period: float) -> _Pieces:
        """Give how far the pieces are from joining, their linear maps and the states where they end."""
        linear, count = self.linear, len(nodes)
        residual, blocks, ends = [], [], []
        for k, node in enumerate(nodes):
            begin = self.case.begin + k * period / count
            end, matrix = linear._over(linear.tangents, begin, node, period / count)
            following = nodes[(k + 1) % count]
            residual.append(self.gap(following, end, turns=k == count - 1)[linear.kept])
            blocks.append(matrix)
            ends.append(end)
        gaps = np.concatenate(residual)
        return _Pieces(nodes, period, gaps, blocks, ends, self._size(gaps, nodes[0]))

    def gap(self, wanted: Array, there: Array, *, turns: bool = True) -> Array:
        """Give how far a state is from a wanted one [2 nv + nx], in nominal sizes; up to whole ``sincos_batch`` of angles."""
        gap = there - wanted
        for i in self.turning if turns else ():
            gap[i] -= 2 * math.pi * round(gap[i] / (2 * math.pi))
        found: Array = minimal(self.problem, wanted, gap[:, None])[:, 0] / self.linear.scale
        return found

    def _size(self, residual: Array, node: Array) -> float:
        """Give the largest gap, or how far the energy is from the one that is wanted, in nominal sizes."""
        size = float(np.abs(residual).max())
        if self.energy is None:
            return size
        kept = self.linear.kept
        return max(size, abs(self.energy_row(node, self.linear.allowed(node)[kept], self.energy)[1]))

    def _correction(self, at: _Pieces) -> tuple[list[Array], float]:
        """Give the least change of the nodes [m, 2 nv + nx] in nominal sizes and of the period that closes the gaps."""
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
                rate = self._rate(self.case.begin + (k + 1) * period / count, at.ends[k])
                matrix[rows, -1] = (rate / linear.scale)[kept] * period / count
        wanted = -at.residual
        if self.energy is not None:
            slope, missing = self.energy_row(nodes[0], spaces[0], self.energy)
            row = np.zeros((1, matrix.shape[1]))
            row[0, : widths[0]] = slope
            matrix, wanted = np.vstack([matrix, row]), np.append(wanted, missing)
        solution = rank.solve(matrix, wanted, rank.MOTIONS)
        steps = []
        for k in range(count):
            whole = np.zeros(linear.size)
            whole[kept] = spaces[k] @ solution[places[k] : places[k + 1]]
            steps.append(whole)
        return steps, float(solution[-1]) * period if self.free else 0.0

    def energy_row(self, y: Array, space: Array, energy: Energy) -> tuple[Array, float]:
        """Give the derivatives [r] of the energy in the directions of a node, and what it lacks, both over their size."""
        column, linear = column_at(self.case, energy.name), self.linear
        whole = np.zeros((linear.size, space.shape[1]))
        whole[linear.kept] = space
        changes = basis(self.problem, y) @ (whole * linear.scale[:, None])
        rows = np.vstack([y + s * DIFFERENCE * changes.T for s in (1, -1, 2, -2)])
        found = column(np.full(len(rows), self.case.begin), rows).reshape(4, -1)
        slope = (8 * (found[0] - found[1]) - (found[2] - found[3])) / (12 * DIFFERENCE)
        here = float(column(np.array([self.case.begin]), y[None, :])[0])
        size = float(np.linalg.norm(slope)) or 1.0
        return slope / size, (energy.value - here) / size

    def _rate(self, t: float, y: Array) -> Array:
        case = self.case
        rate = case.functions.rhs(t, y, inputs_at(case, t), case.z, case.p)
        found: Array = minimal(self.problem, y, rate[:, None])[:, 0]
        return found

    def _moved(self, y: Array, change: Array) -> Array:
        """Give the state that is changed by so much, on the constraints."""
        problem, functions, case = self.problem, self.case.functions, self.case
        nq, nv = problem.nq, problem.nv
        y = y + basis(problem, y) @ (change * self.linear.scale)
        for i in problem.rotations:
            y[i : i + 4] /= np.linalg.norm(y[i : i + 4])
        if functions.project_position is None or functions.displace is None:
            return y
        u = inputs_at(case, case.begin)
        for _ in range(PROJECTIONS):
            along = y.copy()
            along[nq : nq + nv] = functions.project_position(case.begin, y, u, case.z, case.p)[:nv]
            y[:nq] += functions.displace(case.begin, along, u, case.z, case.p)
        if functions.project_velocity is not None:
            y[nq : nq + nv] += functions.project_velocity(case.begin, y, u, case.z, case.p)[:nv]
        return y

"""The curve of positions that constraints leave: one parameter along it, and the motion over that.

The parameter is a coordinate that goes one way along all of the curve, where there is one, else the length along it.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
from msgspec import Struct
from scipy.integrate import DOP853
from scipy.interpolate import BSpline, make_interp_spline

from ...local.equilibrium import moving
from ...local.operating_point import Site
from ...local.search import Box, box_of
from ...numerics.newton import added, newton
from ...numerics.rank import EPSILON, NEWTON, POSITIONS, null_space, solve
from ...numerics.roots import root
from ...outcome import SimulationError
from ...problem import Array

ARC = "arc"
"""What the length along the curve is called, from the start on."""
TOLERANCE = 1e-12
NODES = 1500
"""Positions that are solved for to rounding; between them are polynomials of seventh degree."""
DEGREE = 7
BEYOND = 0.06
"""Of the range, by which positions are known beyond it."""
SAME = 1e-7
"""Of the size of the positions: how near a closed curve comes to where it began."""
ONE_WAY = 0.05
"""Of the length, which a coordinate that goes one way grows by everywhere at least."""
LONGEST = 12.0
"""Times the size of the bounds, in each direction."""
FINE = 0.005
"""Longest step, in sizes of the bounds."""
CORRECTIONS = 8
MOST = 12_000
"""Looks at the constraints along one side of the curve."""
LOST = "the positions of '{}' cannot be followed along its constraints: they depend on each other, or bend too sharply"
INSTEAD = "describe it by a coordinate that is free, or look at a section of its motion: mechc study section"


class Branching(Exception):
    """The constraints leave several directions, or none."""


class Traced(Struct, frozen=True, eq=False):
    """A curve of positions: displacements [n, m] from the start over lengths [n]; ``closed``, and whether it ends at a
    position at which it ``branches`` on one of its sides."""

    lengths: Array
    places: Array
    closed: bool
    branches: bool


class Tied:
    """The motion of a model with one freedom: ``name`` and ``unit`` of the parameter, ``low`` and ``high`` of it, and
    ``sincos``, after which all is the same, or 0."""

    def __init__(self, site: Site, wanted: Collection[str] = ()) -> None:
        """Trace the positions from the start of a site. Raises SimulationError where it has several freedoms, or none."""
        problem, chart = site.problem, site.chart
        self.site, self.moved = site, moving(chart)
        if chart.size != chart.nd + problem.nv or len(self.moved) != problem.nv:
            raise SimulationError(
                f"'{problem.name}' has states beside its constraints: a portrait shows one coordinate and its rate",
                help="'section' shows where a motion in more states goes through a surface",
            )
        left = self._free(site.y).shape[1]
        if left != 1:
            raise SimulationError(
                f"the constraints of '{problem.name}' leave {left or 'no'} freedom{'s' if left > 1 else ''}: a portrait shows "
                "one coordinate and its rate",
                help="'section' shows where a motion in more of them goes through a surface" if left else "",
            )
        self._bounds(box_of(site))
        self._along = np.ones(problem.nv)
        self._along = self.tangent(site.y)
        if not np.isfinite(self._along).all():
            raise SimulationError(LOST.format(problem.name), help=INSTEAD)
        traced = self._trace()
        self.branches = traced.branches
        self._choose(traced, wanted)
        self._tabulate(traced)

    def _free(self, y: Array) -> Array:
        """Return the velocities that constraints allow, in columns, in sizes of the coordinates."""
        nd, nv = self.site.chart.nd, self.site.problem.nv
        rows = self.site.derivatives(y).rate[:, nd : nd + nv]
        sizes = np.linalg.norm(rows, axis=1, keepdims=True)
        return null_space(rows / np.where(sizes > 0, sizes, 1.0), POSITIONS)

    def _bounds(self, box: Box) -> None:
        """Set bounds and sizes of the displacements that move, and the unit of the length along them."""
        chart, y = self.site.chart, self.site.y
        units = [chart.units[int(j)] for j in self.moved]
        reach = np.array([3 * np.pi if unit == "rad" else 0.0 for unit in units])
        for k, j in enumerate(self.moved):
            place = chart.places[int(j)]
            if not reach[k]:
                reach[k] = max(3 * abs(float(y[place])), self.site.problem.states[place].nominal or 1.0)
        self.low, self.high = -reach, reach.copy()
        self.periodic = np.zeros(len(reach), dtype=bool)
        self.stated = np.zeros(len(reach), dtype=bool)
        order = {int(j): k for k, j in enumerate(self.moved)}
        for n, j in enumerate(box.moved):
            k = order[int(j)]
            self.low[k], self.high[k] = box.low[n], box.high[n]
            self.periodic[k], self.stated[k] = box.periodic[n], box.stated[n]
        for k, j in enumerate(self.moved):  # bounds of displacements from the start
            place = chart.places[int(j)]
            if place not in self.site.problem.rotations:
                self.low[k] -= y[place]
                self.high[k] -= y[place]
        alike = len(set(units)) == 1
        widths = np.where(self.periodic, 2 * np.pi, self.high - self.low)
        self.unit = units[0] if alike else ""
        self.sizes = np.ones(len(units)) if alike else widths / 2
        self.range = float(np.linalg.norm(widths / self.sizes))
        idle = [k for j, k in order.items() if j not in set(box.moved.tolist())]
        for free in (self.periodic, idle):
            self.low[free], self.high[free] = -np.inf, np.inf
        self.room = BEYOND * widths

    def tangent(self, y: Array) -> Array:
        """Return the velocity [nv] of length one along the curve, in the direction of the last one."""
        free = self._free(y)
        if free.shape[1] != 1:
            raise Branching
        direction = free[:, 0] / float(np.linalg.norm(free[:, 0] / self.sizes))
        ahead = float((direction / self.sizes) @ (self._along / self.sizes)) >= 0
        return np.asarray(direction if ahead else -direction)

    def _placed(self, d: Array) -> Array:
        """Return the state displaced from the start, at rest."""
        chart = self.site.chart
        every = np.zeros(chart.size)
        every[self.moved] = d
        y = chart.moved(self.site.y, every)
        y[self.site.problem.nq :][: self.site.problem.nv] = 0.0
        return y

    def _corrected(self, d: Array, held: int | None) -> Array:
        """Put displacements onto the constraints, by the shortest way or with one of them held."""

        def step(d: Array) -> tuple[Array, float] | None:
            y = self._placed(d)
            left = self.site.constraints(y)[0]
            rows = self.site.derivatives(y).position[:, self.moved] * self.sizes
            if held is not None:
                rows[:, held] = 0.0
            found = solve(rows, -left, NEWTON)
            return self.sizes * found, float(np.abs(found).max())

        return newton(d, step, added, most=CORRECTIONS, close=EPSILON).at

    def _orientation(self, y: Array, along: Array) -> float:
        """Return a sign that changes where positions branch: of the determinant of constraints and direction; 0 where
        constraints depend on each other."""
        nd, nv = self.site.chart.nd, self.site.problem.nv
        rows = self.site.derivatives(y).rate[:, nd : nd + nv] * self.sizes
        return (
            float(np.sign(np.linalg.det(np.vstack([rows, along / self.sizes]))))
            if len(rows) == nv - 1
            else 0.0
        )

    def _trace(self) -> Traced:
        ahead, closed, stuck = self._side(1.0)
        if closed:
            return Traced(ahead[:, 0], ahead[:, 1:], True, False)
        back, _, behind = self._side(-1.0)
        both = np.vstack([back[:0:-1] * np.r_[-1.0, np.ones(len(self.moved))], ahead])
        return Traced(both[:, 0], both[:, 1:], False, stuck or behind)

    def _side(self, sign: float) -> tuple[Array, bool, bool]:
        """Follow the curve to one side: rows of length and displacements; whether it closes, and whether it branches."""
        begun = sign * self._along
        self._along, before = begun, self._along
        last, side = begun, self._orientation(self.site.y, begun)

        def slope(_: float, d: Array) -> Array:
            self._along = last
            return self.tangent(self._placed(d))

        d = np.zeros(len(self.moved))
        rows = [np.r_[0.0, d]]
        closed = branches = False
        try:
            solver = DOP853(
                slope, 0.0, d, LONGEST * self.range, rtol=TOLERANCE, atol=TOLERANCE * self.range * self.sizes,
                max_step=FINE * self.range,
            )  # fmt: skip
            while solver.status == "running":
                solver.step()
                dense = solver.dense_output()
                self._along = last
                now = self.tangent(self._placed(solver.y))
                corner = float((now / self.sizes) @ (last / self.sizes)) < 0.5
                if corner or self._orientation(self._placed(solver.y), now) * side < 0:
                    branches = True
                    break
                last = now
                if (end := self._closing(dense, solver, begun)) is not None:
                    rows.append(np.r_[end, dense(end)])
                    closed = True
                    break
                rows.append(np.r_[solver.t, solver.y])
                if ((solver.y < self.low - self.room) | (solver.y > self.high + self.room)).any():
                    break
                if solver.nfev > MOST:
                    raise SimulationError(LOST.format(self.site.problem.name), help=INSTEAD)
        except Branching:
            branches = True
        self._along = before
        return np.array(rows), closed, branches

    def _closing(self, dense: object, solver: DOP853, begun: Array) -> float | None:
        """Return the length at which the last step came back to the start, but for whole turns; None where it did not."""

        def ahead(s: float) -> float:
            return float((self._wrapped(dense(s)) / self.sizes) @ (begun / self.sizes))  # type: ignore[operator]

        first, last = float(solver.t_old), float(solver.t)
        if first == 0.0 or not ahead(first) < 0 <= ahead(last):
            return None
        end = root(ahead, first, last)
        away = self._wrapped(dense(end)) / self.sizes  # type: ignore[operator]
        return end if float(np.linalg.norm(away)) < SAME * self.range else None

    def _wrapped(self, d: Array) -> Array:
        return np.where(self.periodic, d - 2 * np.pi * np.round(d / (2 * np.pi)), d)

    def _choose(self, traced: Traced, wanted: Collection[str]) -> None:
        """Choose the parameter: a coordinate that goes one way, else the length."""
        problem, chart = self.site.problem, self.site.chart
        slopes = np.diff(traced.places, axis=0) / np.diff(traced.lengths)[:, None] / self.sizes
        least = np.where(np.abs(np.sign(slopes).sum(axis=0)) == len(slopes), np.abs(slopes).min(axis=0), 0.0)
        least[[chart.places[int(j)] in problem.rotations for j in self.moved]] = 0.0
        names = [chart.names[int(j)] for j in self.moved]
        asked = [k for k, name in enumerate(names) if name in wanted]
        if asked and least[asked[0]] <= 0:
            raise SimulationError(
                f"over '{names[asked[0]]}' '{problem.name}' can stand in several positions, whose paths would cross in the "
                "picture",
                help=f"leave it away: its axes are then {self._best(least, names)[1]} and its rate",
            )
        self.held, self.name = (asked[0], names[asked[0]]) if asked else self._best(least, names)
        if self.held is not None:
            self.unit = chart.units[int(self.moved[self.held])]

    @staticmethod
    def _best(least: Array, names: list[str]) -> tuple[int | None, str]:
        good = np.flatnonzero(least > ONE_WAY)
        return (int(good[0]), names[int(good[0])]) if len(good) else (None, ARC)

    def _tabulate(self, traced: Traced) -> None:
        """Solve for positions and directions at many values of the parameter, and interpolate them."""
        s, d = traced.lengths, traced.places
        lap = d[-1] - d[0] if traced.closed else np.zeros(d.shape[1])
        x = s if self.held is None else d[:, self.held] + self._origin()
        if x[-1] < x[0]:
            s, d, x, lap = s[::-1], d[::-1], x[::-1], -lap
        self.turn = float(x[-1] - x[0]) if traced.closed else 0.0
        self.lap, first = lap, float(x[0])
        room = BEYOND * (x[-1] - x[0])
        self.first, self.last = (x[0], x[-1]) if not traced.closed else (x[0] - room, x[-1] + room)
        if traced.closed:  # one lap, and a little of the next at both of its ends
            x = np.r_[x[:-1] - self.turn, x[:-1], x + self.turn]
            d = np.vstack([d[:-1] - lap, d[:-1], d + lap])
        rough = make_interp_spline(x, d, k=DEGREE if len(x) > DEGREE else 1)
        nodes = np.linspace(self.first, self.last, NODES)
        places, ways = np.empty((NODES, d.shape[1])), np.empty((NODES, d.shape[1]))
        self._along = rough(nodes[0], 1)
        for k, node in enumerate(nodes):
            guess = rough(node)
            if self.held is not None:
                guess[self.held] = node - self._origin()
            places[k] = self._corrected(guess, self.held)
            try:
                self._along = self.tangent(self._placed(places[k]))
            except Branching:
                raise SimulationError(LOST.format(self.site.problem.name), help=INSTEAD) from None
            ways[k] = self._along / (1.0 if self.held is None else self._along[self.held])
        self._places: BSpline = make_interp_spline(nodes, places, k=DEGREE)
        self._ways: BSpline = make_interp_spline(nodes, ways, k=DEGREE)
        self._middle = first + self.turn / 2

    def _origin(self) -> float:
        """Return the value at the start of the coordinate that is the parameter."""
        return (
            0.0
            if self.held is None
            else float(self.site.y[self.site.chart.places[int(self.moved[self.held])]])
        )

    @property
    def names(self) -> tuple[str, str]:
        return self.name, f"der({self.name})"

    def units(self, time: str) -> tuple[str, str]:
        if self.held is not None:
            nq = self.site.problem.nq
            return self.unit, self.site.problem.states[nq + self.held].unit
        return self.unit, f"{self.unit or '1'}/{time}" if time else self.unit

    def range_of(self) -> tuple[float, float, bool]:
        """Return the range of the parameter, and whether the model states it."""
        if self.turn:
            whole = 2 * np.pi
            low = -np.pi if self.held is not None and abs(self.turn - whole) < 1e-9 else -self.turn / 2
            return low, low + self.turn, False
        stated = bool(self.stated[self.held]) if self.held is not None else False
        room = BEYOND * (self.last - self.first) / (1 + 2 * BEYOND)
        return float(self.first + room), float(self.last - room), stated

    def begun(self) -> Array:
        """Return the parameter and its rate at the start."""
        velocity = self.site.y[self.site.problem.nq :][: self.site.problem.nv]
        x = self._origin()
        return np.array([x, self._rate(self._ways(self._inside(x)[0]), velocity)])

    def _rate(self, way: Array, velocity: Array) -> float:
        if self.held is not None:
            return float(velocity[self.held])
        return float((way / self.sizes) @ (velocity / self.sizes))

    def _inside(self, x: float) -> tuple[float, float]:
        """Return the parameter within one turn, and the number of turns beyond it."""
        laps = float(np.floor((x - self._middle) / self.turn + 0.5)) if self.turn else 0.0
        return x - laps * self.turn, laps

    def state(self, point: Array) -> Array:
        """Return the state at a parameter and its rate; not-a-number beyond the positions that are known."""
        x, laps = self._inside(float(point[0]))
        nq, nv = self.site.problem.nq, self.site.problem.nv
        if not self.first <= x <= self.last:
            return np.full(self.site.problem.ny, np.nan)
        y = self._placed(self._places(x) + laps * self.lap)
        y[nq : nq + nv] = self._ways(x) * point[1]
        return y

    def rates(self, point: Array) -> Array:
        """Return the rates of the parameter and of its rate."""
        y, site = self.state(point), self.site
        if np.isnan(y[0]):
            return np.full(2, np.nan)
        nq, nv = site.problem.nq, site.problem.nv
        dy = site.case.functions.rhs(site.t, y, site.u, site.z, site.p)
        return np.array(
            [point[1], self._rate(self._ways(self._inside(float(point[0]))[0]), dy[nq : nq + nv])]
        )

"""Motion in a plane: one coordinate and its rate, or two states, with the field of rates, its zeros and its paths.

Where constraints leave one freedom, it is a parameter of the curve of positions.
Where the other coordinates are cyclic, their momenta stay as they start, and their rates follow from the one that is left
(Routh 1877).
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
from msgspec import Struct
from scipy.integrate import solve_ivp

from ...local.equilibrium import check_autonomous
from ...local.operating_point import Site
from ...local.search import Search, box_of
from ...local.zeros import Complex
from ...numerics.roots import root
from ...outcome import SimulationError
from ...problem import Array
from ..formulas.effective import Effective
from .one_dof_reduction import Tied

TOLERANCE = 1e-10
"""Of paths."""
DIFFERENCE = 1e-3
"""Of the size of the picture, for derivatives of fourth order by differences."""
LOOKS = 4001
"""Places at which the forces of a reduced coordinate are looked at."""
FLAT = 1e-9
"""Part of the largest eigenvalue below which a real part is none."""
REACHED = 2e-3
"""Of the size of the picture: a path that comes as near to a point of rest has arrived."""
CLOSED = 1e-6
"""Of the size of the picture: how near it has to come."""
BETWEEN = 4
"""Points of each step of a path."""
STEPS = 400
"""At least, of a path that is followed to its last time."""


class Rest(Struct, frozen=True, eq=False):
    """A point at which nothing moves: its ``eigenvalues`` with their ``vectors`` in columns, and its kind."""

    place: Array
    kind: str
    eigenvalues: Complex
    vectors: Complex


class Path(Struct, frozen=True, eq=False):
    """A path [n, 2] over times [n]; ``end``: the number of the point of rest that it arrives at, None where it leaves the
    picture (``left``) or was followed no longer; ``closed`` where it came back."""

    t: Array
    points: Array
    end: int | None
    left: bool
    closed: bool = False


class Plane:
    """The rates of two states over the plane; ``energy`` is told where the model has one."""

    def __init__(self, site: Site, nominal: Array, wanted: Collection[str] = ()) -> None:
        """Find the two states, one of them by a name that is ``wanted`` where constraints leave a choice.

        Raises SimulationError where the model moves in more of them, saying why.
        """
        problem, chart = site.problem, site.chart
        if problem.hybrid is not None:
            raise SimulationError(
                f"'{problem.name}' switches: paths through one point are several, and no portrait shows them",
                help="runs and sections show its motion: mechc run --plot, mechc study section",
            )
        check_autonomous(site, site.derivatives(site.y), site.y)
        self.site, self.case = site, site.case
        self.reduced: Effective | None = None
        self.tied: Tied | None = None
        if problem.constraints or problem.rotations:
            self.tied = Tied(site, wanted)
            self.index = problem.nq
        elif problem.nq == problem.nv == 1 and chart.size == 2:
            self.index = 0
        elif problem.nq == problem.nv == 0 and chart.size == 2:
            self.index = -1
        elif chart.size == 2 * problem.nq:
            self.reduced = _reduced(site, nominal)
            self.index = self.reduced.index
        else:
            raise SimulationError(
                f"'{problem.name}' moves in {chart.size} states: a portrait shows one coordinate and its rate, or two states",
                help="'section' shows where a motion in more of them goes through a surface",
            )
        nq, k = problem.nq, self.index
        self.columns: tuple[int, ...] = (k, nq + k) if k >= 0 else (0, 1)
        self.names: tuple[str, ...]
        self.units: tuple[str, ...]
        if self.tied is not None:
            self.columns = ()
            self.names, self.units = self.tied.names, self.tied.units(problem.time.unit)
            self.start = self.tied.begun()
        else:
            self.names = tuple(problem.states[c].name for c in self.columns)
            self.units = tuple(problem.states[c].unit for c in self.columns)
            self.start = site.y[list(self.columns)].copy()
        self.stated = False
        energies = [n for n, q in enumerate(problem.phase) if q.kind == "energy"] if k >= 0 else []
        self._place = energies[0] if energies else None
        self.energy_unit = problem.phase[self._place].unit if self._place is not None else ""

    def state(self, point: Array) -> Array:
        """Return the whole state at a point; cyclic coordinates go on with their momenta."""
        if self.tied is not None:
            return self.tied.state(point)
        y = self.site.y.copy()
        y[list(self.columns)] = point
        if self.reduced is not None:
            _, _, steady, along = self.reduced.reduced(point[:1])
            nq = self.site.problem.nq
            for place, rate in zip(self.reduced.cyclic, steady[0] + along[0] * point[1], strict=True):
                y[nq + place] = rate
        return y

    def rates(self, point: Array) -> Array:
        """Return the rates of both at a point, not-a-number where they are undefined."""
        site = self.site
        if self.tied is not None:
            return self.tied.rates(point)
        try:
            y = self.state(point)
        except np.linalg.LinAlgError:  # at a pole of the cyclic coordinates
            return np.full(2, np.nan)
        dy = self.case.functions.rhs(site.t, y, site.u, site.z, site.p)
        return np.array([dy[c] for c in self.columns])

    def energy(self, point: Array) -> float:
        """Return the energy function at a point, not-a-number where the model has none."""
        site, functions = self.site, self.case.functions
        if self._place is None or functions.phase is None:
            return float("nan")
        return float(functions.phase(site.t, self.state(point), site.u, site.z, site.p)[self._place])

    def conserves(self, sizes: Array) -> bool:
        """Say whether the energy is constant along the paths: looked at at random points."""
        random = np.random.default_rng(3)
        low, high, _ = self.bounds() if self.tied is not None else (0.0, 0.0, 0.0)
        for _ in range(8):
            point = self.start + 0.5 * sizes * random.uniform(-1, 1, 2)
            if self.tied is not None:
                point[0] = random.uniform(low, high)
            slope = self.rates(point)
            step = 1e-3 / max(float(np.abs(slope / sizes).max()), 1e-300)
            h = [self.energy(point + s * step * slope) for s in (-2, -1, 1, 2)]
            size = abs(self.energy(point + 0.1 * sizes) - h[0]) + abs(h[0])
            if not np.isfinite(h).all():
                return self._place is not None and any(map(np.isfinite, h))
            if abs(h[0] - 8 * h[1] + 8 * h[2] - h[3]) / 12 > 1e-7 * size:
                return False
        return True

    def reverses(self, sizes: Array) -> bool:
        """Say whether the motion goes back the same way with the opposite rate: then closed paths round a point are many."""
        random = np.random.default_rng(5)
        low, high, _ = self.bounds() if self.tied is not None else (0.0, 0.0, 0.0)
        for _ in range(8):
            x = self.start + 0.5 * sizes * random.uniform(-1, 1, 2)
            if self.tied is not None:
                x[0] = random.uniform(low, high)
            one, other = self.rates(x), self.rates(np.array([x[0], -x[1]]))
            if self.index < 0 or not abs(one[1] - other[1]) <= 1e-12 * (abs(one[1]) + sizes[1]):
                return False
        return True

    def bounds(self) -> tuple[float, float, float]:
        """Return the range of the first state, and the turn after which all is the same, 0 where there is none."""
        if self.tied is not None:
            low, high, self.stated = self.tied.range_of()
            return low, high, self.tied.turn
        box, column = box_of(self.site), self.columns[0]
        for k, j in enumerate(box.moved):
            chart = self.site.chart
            place = chart.place(int(j))
            if place == column:
                self.stated = bool(box.stated[k])
                return float(box.low[k]), float(box.high[k]), 2 * np.pi * bool(box.periodic[k])
        reach = max(3 * abs(float(self.start[0])), 1.0)
        return -reach, reach, 0.0

    def rests(self, low: float, high: float) -> list[Rest]:
        """Return all points of rest that are found within bounds of the first state."""
        if self.reduced is None and self.tied is None:
            places = [one.y[list(self.columns)] for one in Search(self.site, box_of(self.site)).run(64)]
        else:
            places = [np.array([x, 0.0]) for x in self._roots(low, high)]
        return [self._rest(place, high - low) for place in places]

    def _roots(self, low: float, high: float) -> list[float]:
        def force(x: float) -> float:
            return float(self.rates(np.array([x, 0.0]))[1])

        axis = np.linspace(low, high, LOOKS)
        with np.errstate(all="ignore"):
            values = np.array([force(x) for x in axis])
        good = (
            np.isfinite(values[:-1]) & np.isfinite(values[1:]) & (np.sign(values[:-1]) != np.sign(values[1:]))
        )
        found: list[float] = []
        for k in np.flatnonzero(good):
            try:
                x = root(force, axis[k], axis[k + 1])
            except ValueError:  # a pole between them
                continue
            new = not found or x - found[-1] > 1e-9 * (high - low)
            if new and abs(force(x)) <= max(
                abs(values[k]), abs(values[k + 1])
            ):  # a pole changes its sign too
                found.append(x)
        return found

    def _rest(self, place: Array, width: float) -> Rest:
        if self.reduced is None and self.tied is None:
            matrix = self.site.derivatives(self.state(place)).rates
        else:
            step = DIFFERENCE * width
            slopes = []
            for d in np.eye(2):
                f = [self.rates(place + s * step * d) for s in (-2, -1, 1, 2)]
                slopes.append((f[0] - 8 * f[1] + 8 * f[2] - f[3]) / (12 * step))
            matrix = np.array(slopes).T
        values, vectors = np.linalg.eig(matrix)
        place = np.where(np.abs(place) < 1e-14 * width, 0.0, place)
        kind = kind_of(values)
        values = 1j * values.imag if kind == "centre" else values.astype(complex)
        return Rest(place, kind, values, vectors.astype(complex))

    def path(
        self,
        begin: Array,
        time: float,
        window: Array,
        rests: list[Rest],
        *,
        back: bool = False,
        closes: bool = False,
        turn: float | None = None,
    ) -> Path:
        """Follow a path from a point until it leaves the ``window`` [2, 2], arrives at a point of rest, or the time is over;
        where ``closes``, until it comes back to where it began, or the first state has gone by a ``sincos``."""  # fmt: skip
        sizes = window[:, 1] - window[:, 0]
        sign = -1.0 if back else 1.0
        places = np.array([one.place for one in rests]).reshape(-1, 2)
        waiting = np.array(
            [float(np.abs((begin - p) / sizes).max()) < 5 * REACHED for p in places], dtype=bool
        )
        normal = self.rates(begin) / sizes
        normal /= max(float(np.linalg.norm(normal)), 1e-300)

        def outside(t: float, x: Array) -> float:
            return float(min(((x - window[:, 0]) / sizes).min(), ((window[:, 1] - x) / sizes).min()) + 0.02)

        def near(t: float, x: Array) -> float:
            apart = np.abs((x - places) / sizes).max(axis=1) - REACHED
            waiting[apart > 5 * REACHED] = False
            return float(np.where(waiting, 1.0, apart).min(initial=1.0))

        def again(t: float, x: Array) -> float:
            return float(normal @ ((x - begin) / sizes)) if t > 0 else 1.0

        def turned(t: float, x: Array) -> float:
            return 1.0 if turn is None else turn - abs(float(x[0] - begin[0]))

        events = [outside, near, turned, again] if closes else [outside, near]
        for event in events:
            event.terminal = True  # type: ignore[attr-defined]
        again.direction = 1.0  # type: ignore[attr-defined]
        with np.errstate(all="ignore"):
            found = solve_ivp(
                lambda t, x: sign * self.rates(x), (0.0, time), begin, method="DOP853", rtol=TOLERANCE,
                atol=TOLERANCE * sizes, events=events, max_step=time / STEPS, dense_output=True,
            )  # fmt: skip
        points, happened = found.y.T, [len(times) > 0 for times in found.t_events]
        end = int(np.argmin(np.abs((points[-1] - places) / sizes).max(axis=1))) if happened[1] else None
        closed = happened[2:3] == [True] or (
            happened[3:] == [True] and float(np.abs((points[-1] - begin) / sizes).max()) < CLOSED
        )
        t = np.unique((found.t[:-1, None] + np.diff(found.t)[:, None] * np.arange(BETWEEN) / BETWEEN).ravel())
        t = np.r_[t, found.t[-1]]
        return Path(t, found.sol(t).T, end, happened[0], closed)


def _reduced(site: Site, nominal: Array) -> Effective:
    """Return the one coordinate that is left of several. Raises SimulationError where there is none."""
    problem = site.problem
    try:
        return Effective(site.case, nominal)
    except SimulationError as error:
        raise SimulationError(
            f"a portrait shows one coordinate and its rate, and those of '{problem.name}' cannot be reduced to one: {error}",
            help="'section' shows where a motion in several coordinates goes through a surface",
        ) from None


def kind_of(values: Array) -> str:
    """Name a point of rest by its two eigenvalues."""
    size = float(np.abs(values).max())
    real = values.real
    if size == 0 or (np.abs(values) < 1e-6 * size).any():
        return "degenerate"
    if np.abs(values.imag).max() > FLAT * size:
        if np.abs(real).max() <= FLAT * size:
            return "centre"
        return "stable focus" if real.max() < 0 else "unstable focus"
    if real[0] * real[1] < 0:
        return "saddle"
    return "stable node" if real.max() < 0 else "unstable node"

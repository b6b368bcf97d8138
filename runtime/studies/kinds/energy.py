"""Where a motion of a given energy can go: the region in which the energy at rest is not above it (Hill's region)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Annotated

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from ...case import Case, inputs_at
from ...local.active_constraints import GAP, row_values
from ...local.chart import chart_of
from ...local.equilibrium_feasibility import contacts
from ...local.operating_point import Site, moving_inputs, switched
from ...numerics.roots import root
from ...outcome import Outcome, SimulationError
from ...problem import Array, Problem
from ...results.files import json_number
from ...settings import Range, settable
from ..findings import Curve, Findings, Landscape, Panel, Table, Value
from ..formulas.sampling import Sampler
from ..study import OF_A_MOTION, Study
from .symmetries import case_of

GRID = 241
"""Points of each axis of the region."""
HEIGHTS = 2.0
"""Of the depth below the level, above and below it, that a picture over one coordinate shows."""

LOOKS, UNMOVED = 8, 1e-12
"""Places at which it is looked whether the energy depends on what is not shown, and the share of it that is rounding."""
CURVES = 8
"""Zero-velocity curves beside that of the energy asked for."""


class Energy(Study, frozen=True, kw_only=True):
    """The region of one or two coordinates in which the energy at rest is at most ``energy`` (without it, that of the start),
    its border, and the zero-velocity curves of neighbouring energies."""

    unused = OF_A_MOTION
    needs = frozenset({"phase"})
    energy: Annotated[float | None, settable("The energy (default: that of the start).", "energy")] = None
    over: Annotated[tuple[Range, ...], settable("Bounds of the coordinates of the picture.", "ranges")] = ()

    def solve(self, problem: Problem) -> Findings:
        """Find the region. Raises SimulationError for constraints, rotations, and without coordinates to look at."""
        case = case_of(problem, self)
        if problem.constraints or problem.rotations or problem.nq != problem.nv:
            raise SimulationError(
                f"the coordinates of '{problem.name}' are not free",
                help="the region is drawn over one or two independent coordinates",
            )
        rest = _Rest(case)
        at_start = rest.energy(case.y0)
        level = at_start if self.energy is None else self.energy
        axes = _axes(case, self.over)
        unit = rest.unit
        if len(axes) == 1:
            axis = axes[0] if self.over else _widened(problem, rest, axes[0], level)
            return self._line(problem, rest, axis, level, unit)
        return self._plane(problem, rest, axes, level, unit)

    def _line(self, problem: Problem, rest: _Rest, axis: Range, level: float, unit: str) -> Findings:
        k = rest.names.index(axis.name)
        places = np.linspace(axis.low, axis.high, 8 * GRID)
        values = rest.line(k, places)
        turning, open_at = [], rest.gaps(k, places)
        for a, b, f, g in zip(places, places[1:], values - level, values[1:] - level, strict=False):
            if f == 0 or (np.isfinite(f * g) and f * g < 0):
                turning.append(
                    a if f == 0 else root(lambda x: float(rest.line(k, np.array([x]))[0]) - level, a, b)
                )
        walls = [
            root(lambda x: float(rest.gaps(k, np.array([x]))[0]), a, b)
            for a, b, f, g in zip(places, places[1:], open_at, open_at[1:], strict=False)
            if (f < 0) != (g < 0)
        ]
        turning = [x for x in turning if rest.gaps(k, np.array([x]))[0] >= 0]

        edges = [float(places[0]), *sorted([*turning, *walls]), float(places[-1])]
        intervals = [(a, b) for a, b in pairwise(edges) if b > a and rest.inside(k, 0.5 * (a + b), level)]
        open_ends = [x for pair in intervals for x in pair if x in (edges[0], edges[-1])]
        return Findings(
            study="energy",
            model=problem.name,
            outcome=Outcome.COMPLETED,
            message=f"{len(intervals)} interval{'' if len(intervals) == 1 else 's'} with energy below {level:.6g} {unit}".rstrip(),
            values=(Value("energy", unit, level, 0.0),),
            errors_from=f"borders are located to rounding; parts below {places[1] - places[0]:.2g} {axis.unit}".rstrip()
            + " wide are passed over",
            remarks=(
                *_open(axis, len(intervals), open_ends),
                *rest.remarks({k: axis}),
            ),
            tables=(
                Table(
                    "where it can be",
                    (("from", axis.unit), ("to", axis.unit)),
                    tuple((a, b) for a, b in intervals),
                ),
            ),
            panels=(
                Panel(
                    "energy at rest",
                    axis.name,
                    axis.unit,
                    "energy",
                    unit,
                    (
                        Curve("energy at rest", places, _near(values, level)),
                        Curve("energy", places[[0, -1]], np.array([level, level]), style="dashed"),
                    ),
                ),
            ),
            details={
                "energy": json_number(level),
                "turning_points": turning,
                "region": [[a, b] for a, b in intervals],
                "bounded": not open_ends,
                "area": None,
            },
        )

    def _plane(
        self, problem: Problem, rest: _Rest, axes: Sequence[Range], level: float, unit: str
    ) -> Findings:
        i, j = (rest.names.index(axis.name) for axis in axes)
        x, y = (np.linspace(axis.low, axis.high, GRID) for axis in axes)
        values = np.array([rest.line(i, x, {j: float(b)}) for b in y])
        values[np.array([rest.gaps(i, x, {j: float(b)}) for b in y]) < 0] = np.nan  # beyond a contact
        inside = values <= level
        cell = (x[1] - x[0]) * (y[1] - y[0])
        area, coarse = float(inside.sum() * cell), float(inside[::2, ::2].sum() * 4 * cell)
        parts = _parts(inside)
        touches = bool(inside[0].any() or inside[-1].any() or inside[:, 0].any() or inside[:, -1].any())
        finite = values[np.isfinite(values)]
        low, high = map(float, np.quantile(finite, [0.02, 0.8]) if len(finite) else (0.0, 0.0))
        others = tuple(map(float, np.linspace(low, high, CURVES))) if high > low else ()
        remarks = ["the region reaches the edge of the picture"] if touches else ["the region is bounded"]
        remarks += rest.remarks({i: axes[0], j: axes[1]})
        return Findings(
            study="energy",
            model=problem.name,
            outcome=Outcome.COMPLETED,
            message=f"{parts} part{'' if parts == 1 else 's'} with energy below {level:.6g} {unit}".rstrip(),
            values=(
                Value("energy", unit, level, 0.0),
                Value("area", _product(axes[0].unit, axes[1].unit), area, abs(area - coarse)),
            ),
            errors_from="area: every second point of the grid",
            remarks=tuple(remarks),
            panels=(
                Panel(
                    "zero-velocity curves",
                    axes[0].name,
                    axes[0].unit,
                    axes[1].name,
                    axes[1].unit,
                    (),
                    equal=axes[0].unit == axes[1].unit,
                    tall=True,
                    landscape=Landscape(x, y, values, level, others, unit),
                ),
            ),
            details={
                "energy": json_number(level),
                "parts": parts,
                "bounded": not touches,
                "border": [[float(a), float(b)] for a, b in zip(*border(x, y, values, level), strict=True)],
            },
        )


def _product(a: str, b: str) -> str:
    """Return the unit of an area over two coordinates."""
    return f"{a}^2" if a == b and a.isalpha() else f"{a} {b}".strip()


def _near(values: Array, level: float) -> Array:
    """Return the values that a picture about the level can hold: the wall of a potential may be 1e30 high, its centre as deep."""
    inside = values[values <= level]
    depth = level - float(np.quantile(inside, 0.02)) if inside.size else 0.0
    far = np.abs(values - level) > HEIGHTS * (depth or abs(level) or 1.0)
    return np.where(far, np.nan, values)


class _Rest:
    """The energy function at rest, over the coordinates."""

    def __init__(self, case: Case) -> None:
        self.case = case
        problem = case.problem
        self.names = [state.name for state in problem.states[: problem.nq]]
        self.place = next(k for k, q in enumerate(problem.phase) if q.kind == "energy")
        self.unit = problem.phase[self.place].unit
        self.u = inputs_at(case, case.begin)
        site = Site(case, chart_of(problem), case.begin, self.u, case.z, case.y0, case.p)
        self.site = switched(site, case.y0)

    def energy(self, y: Array) -> float:
        case = self.case
        assert case.functions.phase is not None, "the part phase"
        z = switched(self.site, y).z
        return float(case.functions.phase(case.begin, y, self.u, z, case.p)[self.place])

    def held(self, shown: Mapping[int, Range]) -> list[str]:
        """Name the other coordinates and the states by which the energy at rest changes somewhere in the picture."""
        problem, width, random = self.case.problem, Sampler(self.case).width, np.random.default_rng(0)
        base = np.tile(self.case.y0, (LOOKS, 1))
        base[:, problem.nq : problem.nq + problem.nv] = 0.0
        for k, axis in shown.items():
            base[:, k] = random.uniform(axis.low, axis.high, LOOKS)
        before = np.array([self.energy(y) for y in base])
        names = []
        for k in problem.own:
            if k in shown or problem.nq <= k < problem.nq + problem.nv:
                continue
            moved = base.copy()
            moved[:, k] += width[k] * random.uniform(0.1, 1.0, LOOKS)
            after = np.array([self.energy(y) for y in moved])
            if (np.abs(after - before) > UNMOVED * (np.abs(after) + np.abs(before))).any():
                names.append(problem.states[k].name)
        return names

    def remarks(self, shown: Mapping[int, Range]) -> tuple[str, ...]:
        """Say what keeps the region over these coordinates from being where the motion can go."""
        problem = self.case.problem
        found = list(moving_inputs(self.site))
        held = self.held(shown)
        if held:
            which, move = ("it is", "moves") if len(held) == 1 else ("they are", "move")
            found.append(
                f"the energy depends on {', '.join(held)}, too: the region is that for where {which} at the start, and "
                f"changes as {'it' if len(held) == 1 else 'they'} {move}"
            )
        rows = problem.hybrid.rows if problem.hybrid is not None else ()
        walls = [rows[k].name for k in contacts(self.site)]
        if walls:
            found.append(f"the region ends at the contacts: {', '.join(walls)}")
        others = [row.name for k, row in enumerate(rows) if row.kind == "contact" and row.name not in walls]
        if others:
            found.append(f"contacts that do not act at the start are not regarded: {', '.join(others)}")
        _, dissipated, supplied = problem.energy_balance or (-1, -1, -1)
        if dissipated >= 0:
            why = " by friction" if any(row.kind == "friction" for row in rows) else ""
            shrinks = "" if held else ": the motion stays in a region that shrinks within this one"
            found.append(f"energy is dissipated{why}{shrinks}")
        if supplied >= 0:
            found.append("energy is supplied: the motion may leave this region")
        return tuple(found)

    def gaps(self, k: int, places: Array, others: dict[int, float] | None = None) -> Array:
        """Return the smallest gap of all contacts along a coordinate, infinite where there are none."""
        found, acting = np.full(len(places), np.inf), list(contacts(self.site))
        for n, y in enumerate(self._states(k, places, others)) if acting else ():
            found[n] = row_values(switched(self.site, y), y)[acting, GAP].min()
        return found

    def line(self, k: int, places: Array, others: dict[int, float] | None = None) -> Array:
        """Return the energy at rest along a coordinate, the others as at the start or as given."""
        return np.array([self.energy(y) for y in self._states(k, places, others)])

    def inside(self, k: int, place: float, level: float) -> bool:
        """Tell whether a place can be reached: no contact is passed, and the energy at rest is at most the level."""
        at = np.array([place])
        return bool(self.line(k, at)[0] <= level and self.gaps(k, at)[0] >= 0)

    def _states(self, k: int, places: Array, others: dict[int, float] | None) -> Iterator[Array]:
        problem = self.case.problem
        y = self.case.y0.copy()
        y[problem.nq : problem.nq + problem.nv] = 0.0
        for j, value in (others or {}).items():
            y[j] = value
        for place in places:
            y[k] = place
            yield y


def _axes(case: Case, over: Sequence[Range]) -> list[Range]:
    """Return the one or two coordinates that are looked at, with bounds."""
    problem = case.problem
    names = [state.name for state in problem.states[: problem.nq]]
    strange = [r.name for r in over if r.name not in names]
    if strange:
        raise SimulationError(
            f"'{strange[0]}' is not a coordinate", help=f"the coordinates are {', '.join(names)}"
        )
    if len(over) > 2:
        raise SimulationError("a region is looked at over one coordinate or two", help="name two with --over")
    if over:
        return list(over)
    width = Sampler(case).width
    found = []
    for k in range(min(2, problem.nq)):
        state = problem.states[k]
        reach = np.pi if state.unit == "rad" else 3 * float(width[k])
        low = (
            state.minimum
            if state.minimum is not None
            else (-reach if state.unit == "rad" else float(case.y0[k]) - reach)
        )
        high = (
            state.maximum
            if state.maximum is not None
            else (reach if state.unit == "rad" else float(case.y0[k]) + reach)
        )
        found.append(Range(state.name, state.unit, low, high))
    return found


def _open(axis: Range, parts: int, ends: Sequence[float]) -> tuple[str, ...]:
    """Say of ends of intervals that are those of the bounds that the region goes on there."""
    if len(ends) == 2 and axis.unit == "rad" and np.isclose(axis.high - axis.low, 2 * np.pi):
        whole = f"{axis.name} turns over: every angle is within reach"
        return (whole if parts == 1 else f"the parts at both ends of the turn of {axis.name} are one",)
    return tuple(
        f"{axis.name} = {x:.6g} {axis.unit}".rstrip() + " is where looking ended, and no border" for x in ends
    )


WIDENED = 12
"""How often the bounds of a length are moved outwards, each time to twice the distance."""


def _widened(problem: Problem, rest: _Rest, axis: Range, level: float) -> Range:
    """Return bounds that hold the region, if any near do; stated bounds and turns of angles stay."""
    k = rest.names.index(axis.name)
    state = problem.states[k]
    if state.unit == "rad":
        return axis
    width = axis.high - axis.low

    def moved(end: float, outwards: float, stated: float | None) -> float:
        for doubling in range(WIDENED if stated is None else 0):
            place = end + outwards * width * float(2**doubling - 1)
            if not rest.inside(k, place, level):
                return place
        return end

    low, high = moved(axis.low, -1.0, state.minimum), moved(axis.high, 1.0, state.maximum)
    return replace(axis, low=low, high=high)


def border(x: Array, y: Array, values: Array, level: float) -> tuple[Array, Array]:
    """Return the points where the lines of a grid [len(y), len(x)] cross a level, by linear interpolation."""
    found: list[tuple[float, float]] = []
    f = values - level
    for i in range(len(y)):
        for j in map(int, np.flatnonzero(np.isfinite(f[i, :-1] * f[i, 1:]) & (f[i, :-1] * f[i, 1:] < 0))):
            s = f[i, j] / (f[i, j] - f[i, j + 1])
            found.append((float(x[j] + s * (x[j + 1] - x[j])), float(y[i])))
    for j in range(len(x)):
        for i in map(int, np.flatnonzero(np.isfinite(f[:-1, j] * f[1:, j]) & (f[:-1, j] * f[1:, j] < 0))):
            s = f[i, j] / (f[i, j] - f[i + 1, j])
            found.append((float(x[j]), float(y[i] + s * (y[i + 1] - y[i]))))
    both = np.array(found).reshape(-1, 2)
    return both[:, 0], both[:, 1]


def _parts(inside: NDArray[np.bool_]) -> int:
    """Return how many connected parts a region of a grid has."""
    from scipy.ndimage import label

    return int(label(inside)[1])

"""Phase portraits: points of rest, separatrices and paths of a motion in a plane."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from ...local.operating_point import PART, moving_inputs, site_of
from ...local.vibration import SECOND_ORDER
from ...outcome import Outcome, SimulationError
from ...problem import Array, Problem
from ...results.files import json_number
from ...settings import Place, Range, settable
from ..findings import Cell, Curve, Findings, Panel, Table
from ..flow.one_dof_reduction import ARC, Tied
from ..flow.plane import Path, Plane, Rest
from ..study import OF_A_MOTION, Study

OFFSET = 1e-5
"""Of the size of the picture: how far from a saddle its separatrices begin; they are off by its square."""
MARGIN = 0.08
"""Of a turn, by which the picture of an angle goes beyond it."""
OFF = 0.0618
"""Of a turn, by which the range of an angle is shifted where points of rest are looked for."""
ABOVE = 1.35
"""Times the largest rate on the separatrices, up to which the picture goes."""
PATHS = 12
SEVERAL = {
    "stable focus": "stable foci", "unstable focus": "unstable foci", "centre or focus": "centres or foci",
    "degenerate": "degenerate points",
}  # fmt: skip
WAIT = 80.0
"""Times one over the smallest size of an eigenvalue, for which a path is followed."""


class Separatrix(Struct, frozen=True, eq=False):
    """A separatrix of the point of rest ``number``: ``stable`` ones lead to it; ``drift`` of its energy."""

    number: int
    stable: bool
    path: Path
    drift: float


class Portrait(Study, frozen=True, kw_only=True):
    """Points of rest with their kinds, the separatrices of saddles, and ``paths`` between them: of one coordinate and its rate,
    of one that is left by constraints or where the others are cyclic, or of two states."""

    unused = OF_A_MOTION
    needs: ClassVar[frozenset[str]] = frozenset({PART, SECOND_ORDER, "projection", "phase"})
    of_own_states = True

    over: Annotated[
        tuple[Range, ...], settable("Bounds of the picture: of the coordinate, and of its rate.", "ranges")
    ] = ()
    paths: Annotated[
        int, settable(f"Number of paths to draw besides separatrices (default: {PATHS}).", "count")
    ] = PATHS

    def solve(self, problem: Problem) -> Findings:
        """Draw it. Raises SimulationError where the model does not move in a plane."""
        site = site_of(problem, self, Place())
        drawn = _Drawn(Plane(site, np.maximum(np.abs(site.y), 1.0), [r.name for r in self.over]), self.over)
        lines = drawn.separatrices()
        return _findings(problem, drawn, lines, drawn.others(lines, self.paths), moving_inputs(site))


class _Drawn:
    """A portrait: its ``window`` [2, 2] and its points of rest, those of an angle with their copies a turn away."""

    def __init__(self, plane: Plane, over: tuple[Range, ...]) -> None:
        self.plane = plane
        strange = [r.name for r in over if r.name not in plane.names]
        if strange:
            raise SimulationError(
                f"'{strange[0]}' is not in the picture", help=f"its axes are {' and '.join(plane.names)}"
            )
        given = {r.name: (r.low, r.high) for r in over}
        low, high, self.turns = plane.bounds()
        margin = MARGIN * (high - low) if self.turns else 0.0
        x = given.get(plane.names[0], (low - margin, high + margin))
        # an angle is looked at over one turn, whose ends are no likely places of rest
        found = plane.rests(*((low + OFF * self.turns, high + OFF * self.turns) if self.turns else x))
        inner = [float(one.place[0]) for one in found if one.kind not in ("saddle", "degenerate")]
        if self.turns and plane.names[0] == ARC and inner and plane.names[0] not in given:
            x = inner[0] - self.turns / 2 - margin, inner[0] + self.turns / 2 + margin
        if self.turns:
            turned = [
                (one, one.place + np.array([k * self.turns, 0.0])) for one in found for k in (-2, -1, 0, 1)
            ]
            found = [Rest(place, one.kind, one.eigenvalues, one.vectors) for one, place in turned]
        self.rests = sorted(
            (one for one in found if x[0] <= one.place[0] <= x[1]), key=lambda one: tuple(one.place)
        )
        self.fast = max([float(np.abs(one.eigenvalues).max()) for one in self.rests], default=0.0)
        small = [float(np.abs(v)) for one in self.rests for v in one.eigenvalues if abs(v) > 1e-6 * self.fast]
        self.time = WAIT / min(small) if small else WAIT * (x[1] - x[0]) / max(
            float(np.abs(plane.rates(plane.start)).max()), abs(float(plane.start[1])), 1e-300
        )  # fmt: skip
        self.window = np.array([x, given.get(plane.names[1], self._rates(x))])
        self.given = plane.names[1] in given
        self.fitted = not (plane.names[0] in given or self.turns or plane.stated)
        sizes = self.window[:, 1] - self.window[:, 0]
        self.conserves = plane.conserves(sizes)
        self.closes = self.conserves or plane.reverses(sizes)
        if not self.closes:
            self.rests = [
                replace(one, kind="centre or focus") if one.kind == "centre" else one for one in self.rests
            ]

    def _rates(self, x: tuple[float, float]) -> tuple[float, float]:
        """Return bounds of the second state: what the eigenvalues make of the width of the picture."""
        plane = self.plane
        if plane.index < 0:  # two states of their own
            reach = max(
                [3 * abs(float(one.place[1])) for one in self.rests]
                + [3 * abs(float(plane.start[1])), x[1] - x[0]]
            )
            return -reach, reach
        reach = max(self.fast * (x[1] - x[0]), 3 * abs(float(plane.start[1])))
        reach = reach or 3 * abs(float(plane.rates(plane.start)[1])) or 1.0
        return -reach, reach

    def separatrices(self) -> list[Separatrix]:
        """Follow the paths that lead to saddles and from them; fit the picture to them."""
        sizes = self.window[:, 1] - self.window[:, 0]
        found = []
        for number, one in enumerate(self.rests):
            if one.kind != "saddle":
                continue
            for value, vector in zip(one.eigenvalues.real, one.vectors.real.T, strict=True):
                step = OFFSET * vector / float(np.abs(vector / sizes).max())
                for side in (1.0, -1.0):
                    begin = one.place + side * step
                    if not self.window[0, 0] <= begin[0] <= self.window[0, 1]:
                        continue
                    path = self.plane.path(begin, self.time, self.window, self.rests, back=bool(value < 0))
                    found.append(Separatrix(number, bool(value < 0), path, self._drift(one.place, path)))
        self._fit(found)
        return found

    def _fit(self, lines: list[Separatrix]) -> None:
        """Fit the picture to what stays in it: points of rest, separatrices between them, and the path from the start."""
        plane, found = self.plane, [one.place for one in self.rests]
        if self.plane.index < 0:
            return
        if self._moves(plane.start):
            path = plane.path(plane.start, self.time, self.window, self.rests, closes=self.closes)
            found += [] if path.left else list(path.points)
        points = np.array(
            found + [p for line in lines if self.turns or not line.path.left for p in line.path.points]
        )
        if not len(points):
            return
        reach = ABOVE * float(np.abs(points[:, 1]).max())
        if not self.given and 0 < reach < self.window[1, 1]:
            self.window[1] = -reach, reach
        low, high = float(points[:, 0].min()), float(points[:, 0].max())
        if self.fitted and high > low:
            room = (ABOVE - 1) * (high - low)
            self.window[0] = max(low - room, self.window[0, 0]), min(high + room, self.window[0, 1])

    def _drift(self, place: Array, path: Path) -> float:
        return (
            abs(self.plane.energy(path.points[-1]) - self.plane.energy(place))
            if self.conserves
            else float("nan")
        )

    def others(self, lines: list[Separatrix], count: int) -> list[Path]:
        """Follow paths from places spread over the picture."""
        turn = self.turns or None
        found, window = [], self.window.copy()
        if self.turns:  # what goes round may be faster for a while than is drawn
            window[1] *= 3
        for begin in self._seeds(count, lines):
            found.append(self.plane.path(begin, self.time, window, self.rests, closes=self.closes, turn=turn))
            if not (self.closes and found[-1].closed):  # what came before
                path = self.plane.path(begin, self.time, self.window, self.rests, back=True)
                joined = np.vstack([path.points[:0:-1], found[-1].points])
                found[-1] = Path(
                    np.arange(len(joined), dtype=float), joined, found[-1].end, found[-1].left or path.left
                )
        return found

    def _seeds(self, count: int, lines: list[Separatrix]) -> list[Array]:
        """Return beginnings: the start, then outwards from points of rest that are not saddles, then above and below."""
        x, v = self.window
        seeds = (
            [self.plane.start]
            if x[0] <= self.plane.start[0] <= x[1] and self._moves(self.plane.start)
            else []
        )
        inner = [
            one.place
            for one in self.rests
            if one.kind not in ("saddle", "degenerate") and x[0] < one.place[0] < x[1]
        ]
        walls = sorted({*x.tolist(), *(float(one.place[0]) for one in self.rests)})
        each = max(1, (2 * count // 3) // max(len(inner), 1))
        for place in inner:
            left = max((w for w in walls if w < place[0] - 1e-9), default=x[0])
            right = min((w for w in walls if w > place[0] + 1e-9), default=x[1])
            heights = [self.plane.energy(np.array([w, place[1]])) for w in (left, right)]
            way = (left if heights[0] < heights[1] else right) - place[0]
            for k in range(each):
                seeds.append(place + np.array([way * (k + 0.7) / (each + 0.2), 0.0]))
        rest = max(count - len(seeds), 2)
        middle = float(np.mean([p[0] for p in inner])) if inner else float(np.mean(x))
        within = max((float(np.abs(line.path.points[:, 1]).max()) for line in lines), default=0.0) / v[1]
        pairs = -(-rest // 2)
        for k in range(2 * pairs):
            share = 0.75 - 0.5 * (k // 2) / pairs
            begin = np.array([(x[1], x[0])[k % 2] if self.turns else middle, v[k % 2] * share])
            if self.turns and self.conserves and within < 1:  # beyond the separatrices, fastest in the middle
                share = within + (1 - within) * (k // 2 + 0.6) / pairs
                begin = self._at_edge(begin[0], np.array([middle, v[k % 2] * share]))
            seeds.append(begin)
        return [seed for seed in seeds if np.isfinite(self.plane.rates(seed)).all()]

    def _at_edge(self, x: float, point: Array) -> Array:
        """Return the place at ``x`` on the level of the energy through a point, with the rate in the same direction."""
        level = self.plane.energy(point)
        rates = np.linspace(0.0, 1.0, 201) * point[1]
        heights = np.array([self.plane.energy(np.array([x, rate])) for rate in rates])
        return np.array([x, float(np.interp(level, heights, rates)) if point[1] else 0.0])

    def _moves(self, point: Array) -> bool:
        sizes = self.window[:, 1] - self.window[:, 0]
        return bool((np.abs(self.plane.rates(point) / sizes) > 1e-12 * self.fast).any())


def _findings(
    problem: Problem, drawn: _Drawn, lines: list[Separatrix], paths: list[Path], remarks: tuple[str, ...]
) -> Findings:
    plane, unit = drawn.plane, drawn.plane.energy_unit
    time = problem.time.unit
    told = list(remarks)
    if plane.reduced is not None:
        others = ", ".join(problem.states[k].name for k in plane.reduced.cyclic)
        told.append(f"the momenta of the cyclic coordinates stay as they start: {others}")
    if plane.tied is not None:
        told += _of_tied(plane.tied)
    if not drawn.conserves:
        told.append("its energy is not constant: paths are not levels of it")
    if drawn.turns:
        angle = abs(drawn.turns - 2 * np.pi) < 1e-9 and plane.units[0] == "rad"
        told.append(
            f"{plane.names[0]} is an angle: what is a turn apart is the same"
            if angle
            else f"the positions form a closed curve: what is {drawn.turns:.7g} {plane.units[0]}".rstrip()
            + " apart is the same"
        )
    energy = (("energy", unit),) if drawn.conserves else ()
    points: list[tuple[Cell, ...]] = []
    records = []
    for one in drawn.rests:
        h = plane.energy(one.place)
        points.append((
            *map(float, one.place), one.kind, *((h,) if drawn.conserves else ()),
            *(complex(v) for v in one.eigenvalues),
        ))  # fmt: skip
        records.append({
            "values": dict(zip(plane.names, map(float, one.place), strict=True)),
            "kind": one.kind,
            **({"positions": _positions(drawn, one.place)} if plane.tied is not None else {}),
            "energy": json_number(h) if drawn.conserves else None,
            "eigenvalues": [[float(v.real), float(v.imag)] for v in one.eigenvalues],
        })  # fmt: skip
    listed: list[tuple[Cell, ...]] = []
    separatrices: list[dict[str, Any]] = []
    for line in lines:
        name = _called(drawn, line.number)
        end = (
            "out of the picture"
            if line.path.left
            else "does not end"
            if line.path.end is None
            else _called(drawn, line.path.end)
        )
        h = plane.energy(drawn.rests[line.number].place)
        ways = (end, name) if line.stable else (name, end)
        listed.append((*ways, *((h, line.drift) if drawn.conserves else ())))
        separatrices.append({
            "of": line.number, "stable": line.stable, "other_end": line.path.end, "leaves": line.path.left,
            "energy": json_number(h) if drawn.conserves else None,
            "drift": json_number(line.drift), "points": line.path.points.tolist(),
        })  # fmt: skip
    levels = [
        {
            "energy": json_number(plane.energy(path.points[0])) if drawn.conserves else None,
            "closed": path.closed,
            "kind": _kind(path, drawn),
            "period": float(path.t[-1]) if path.closed else None,
            "start": path.points[0].tolist(),
        }
        for path in paths
    ]
    rate = f"1/{time}" if time else ""
    head = (
        *zip(plane.names, plane.units, strict=True),
        ("", ""),
        *energy,
        ("eigenvalue", rate),
        ("eigenvalue", rate),
    )
    errors = (("error", unit),) if drawn.conserves else ()
    tables = [Table("points of rest", head, tuple(points))] if points else []
    if listed:
        tables.append(Table("separatrices", (("from", ""), ("to", ""), *energy, *errors), tuple(listed)))
    if drawn.closes:
        rows = tuple(
            (*map(float, one["start"]), one["kind"], *([one["energy"]] if drawn.conserves else []), one["period"] if one["closed"] else "")
            for one in levels
        )  # fmt: skip
        names = zip(plane.names, plane.units, strict=True)
        tables.append(Table("paths", (*names, ("", ""), *energy, ("period", time)), rows))
    counts = []
    for kind in dict.fromkeys(one.kind for one in drawn.rests):
        number = sum(one.kind == kind for one in drawn.rests)
        counts.append(f"{number} {kind if number == 1 else SEVERAL.get(kind, kind + 's')}")
    return Findings(
        study="portrait",
        model=problem.name,
        outcome=Outcome.COMPLETED,
        message=(", ".join(counts) or "no point of rest") + " in the picture",
        errors_from="drift of the energy along separatrices" if drawn.conserves else "paths within 1e-10 of each step",
        remarks=tuple(told),
        tables=tuple(tables),
        panels=(_panel(drawn, lines, paths),),
        details={
            "equilibria": records, "separatrices": separatrices, "levels": levels, "conserves_energy": drawn.conserves,
            "window": drawn.window.tolist(),
        },
    )  # fmt: skip


def _of_tied(tied: Tied) -> list[str]:
    told = [
        "positions are those that lead to the start without leaving the constraints: other assemblies are not looked at"
    ]
    if tied.held is None:
        told.append(f"{ARC} is the length along them from the start: no coordinate tells them apart")
    if tied.branches:
        told.append("the picture ends where positions branch: the constraints depend on each other there")
    return told


def _positions(drawn: _Drawn, point: Array) -> dict[str, float]:
    """Return the coordinates at a point of the picture, where constraints tie them."""
    problem = drawn.plane.site.problem
    if drawn.plane.tied is None:
        return {}
    y = drawn.plane.state(point)
    return {q.name: float(v) for q, v in zip(problem.states[: problem.nq], y, strict=False)}


def _called(drawn: _Drawn, number: int) -> str:
    one = drawn.rests[number]
    return f"{one.kind} at {drawn.plane.names[0]} = {one.place[0]:.6g}"


def _kind(path: Path, drawn: _Drawn) -> str:
    if path.closed:
        round_ = drawn.turns and abs(path.points[-1, 0] - path.points[0, 0]) > drawn.turns / 2
        return "rotation" if round_ else "libration"
    return "leaves the picture" if path.left else "arrives" if path.end is not None else "does not end"


def _panel(drawn: _Drawn, lines: list[Separatrix], paths: list[Path]) -> Panel:
    plane = drawn.plane
    curves = []
    for path in paths:
        turns = (-1, 0, 1) if _kind(path, drawn) == "rotation" else (0,)
        for k in turns:
            x, y = _inside(drawn, path.points + np.array([drawn.turns * k, 0.0]))
            if np.isfinite(x).any():
                curves.append(Curve("", x, y, colour=0))
    named = False
    for line in lines:
        curves.append(Curve("" if named else "separatrix", *_inside(drawn, line.path.points), colour=1))
        named = True
    for k, kind in enumerate(dict.fromkeys(one.kind for one in drawn.rests)):
        places = np.array([one.place for one in drawn.rests if one.kind == kind])
        curves.append(Curve(kind, places[:, 0], places[:, 1], "points", 2 + k))
    name, rate = plane.names
    return Panel("phase portrait", name, plane.units[0], rate, plane.units[1], tuple(curves), tall=True)


def _inside(drawn: _Drawn, points: Array) -> tuple[Array, Array]:
    """Return a path within the picture: outside it is not drawn."""
    (low, high), (least, most) = drawn.window
    x, y = points[:, 0].copy(), points[:, 1].copy()
    outside = (x < low) | (x > high) | (y < least) | (y > most)
    x[outside] = np.nan
    return x, y

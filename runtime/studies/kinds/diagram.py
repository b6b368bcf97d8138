"""Bifurcation diagrams: what a motion settles to, over a parameter, as points once in every period, on a surface, at extrema or at
impacts."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Annotated, Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from ...integrate.interruption import NotedInterruptions
from ...outcome import SimulationError
from ...problem import Array, Problem
from ...results.solution import Solution
from ...settings import Formula, FormulaSurface, Range, settable
from ..findings import Curve, Findings, Panel, Table
from ..flow.carried_sweep import CarriedSweep, interval_of, refuse_states
from ..flow.crossings import crossings, extrema, fine_times
from ..flow.pieces import periodic
from ..runs.simulate import Plan, plan_run
from ..study import Study

VALUES = 200
COUNT = 100
LONGEST = 16
"""Points after which a motion may repeat itself: longer periods are not told from motions that never do."""
REPEATS = 1e-4
"""Of the nominal value of each state, by which the points of a periodic motion may differ."""
EXTREMA = {"maxima": 1.0, "minima": -1.0}
PASSAGES = (*EXTREMA, "impacts")
DIRECTIONS = ("up", "down", "both")
ORDERS = {"up": ("up",), "down": ("down",), "both": ("up", "down"), "start": ("start",)}
ERRORS = "differences between the points of motions that repeat themselves"


class Diagram(Study, frozen=True, kw_only=True):
    """The points ``of`` a quantity in the second half of each hold, over the values of ``over``. A point is taken once in ``every``
    interval, on the surface ``where``, or ``at`` maxima, minima or impacts."""

    of_past = True
    unused = frozenset({"start", "stop", "estimate_error"})
    needs = frozenset({"jacobian"})  # what is held for long may be stiff

    over: Annotated[
        tuple[Range, ...],
        settable(f'The parameter or input: "w = 1 .. 3, 400"; {VALUES} values without a count.', "ranges"),
    ] = ()
    of: Annotated[
        Formula | None, settable("The quantity that is drawn; the first coordinate without it.", "formula")
    ] = None
    every: Annotated[float | Formula | None, settable('A point once in this time: "2*pi/w".', "interval")] = (
        None  # type: ignore[assignment]
    )
    where: Annotated[
        FormulaSurface | None, settable('A point at each crossing: "der(x) = 0".', "surface")
    ] = None
    direction: Annotated[
        str | None, settable("Which way through the surface: up, down, both; up without it.", "text")
    ] = None
    at: Annotated[str | None, settable("Points at maxima, minima or impacts; maxima without it.", "text")] = (
        None
    )
    hold: Annotated[
        float | Formula | None,
        settable(
            f"How long each value is held; without it {2 * COUNT} intervals of 'every', else as long as a run.",
            "interval",
        ),
    ] = None
    order: Annotated[
        str,
        settable(
            "Where motions begin: up or down (with the end of the one before), both, or start (each with that of the model).",
            "text",
        ),
    ] = "up"

    def solve(self, problem: Problem) -> Findings:
        """Follow the motion at each value. Raises SimulationError."""
        self._check()
        over = self.over[0]
        if self.order != "start":
            refuse_states(problem, over)
        if not problem.states:
            raise SimulationError("the model has no states: nothing moves")
        seen = self.of or Formula(problem.states[0].name, problem.states[0].name)
        values = np.linspace(over.low, over.high, over.count or VALUES)
        passages = self.at or "maxima"
        rows: list[DiagramRow] = []

        def held(plan: Plan, y: Array) -> float:
            if self.hold is not None:
                return interval_of(plan, y, self.hold, "the time for which a value is held")
            if self.every is not None:
                return 2 * COUNT * interval_of(plan, y, self.every, "the time between the points")
            return span

        with NotedInterruptions() as interrupted:
            sweep = CarriedSweep(problem, self, over, held, interrupted)
            span = _length_of_a_run(problem, self)
            ways = ORDERS[self.order]
            for k, way in enumerate(ways):
                part = (k / len(ways), (k + 1) / len(ways))
                ordered = values[::-1] if way == "down" else values
                for value, plan, solution in sweep.motions(ordered, part, afresh=way == "start"):
                    t = self._times(plan, solution, seen, passages)
                    rows.append(_row(problem, plan, solution, seen, way, value, t))
                if not sweep.goes_on:
                    break
        return _findings(problem, self, sweep, seen, rows)

    def _check(self) -> None:
        if len(self.over) != 1:
            raise SimulationError(
                "a diagram needs one parameter over which it is drawn", help='say --over "w = 1 .. 3, 400"'
            )
        given = [name for name in ("every", "where", "at") if getattr(self, name) is not None]
        if len(given) > 1:
            raise SimulationError(
                f"'{given[0]}' and '{given[1]}' both choose the points of the diagram: give one of them"
            )
        if self.direction is not None and self.where is None:
            raise SimulationError(
                "only a surface is crossed in a direction", help='say a surface: --where "x = 0"'
            )
        for name, known in (("direction", DIRECTIONS), ("at", PASSAGES), ("order", tuple(ORDERS))):
            said = getattr(self, name)
            if said is not None and said not in known:
                raise SimulationError(f"'{name}' is one of {', '.join(known)}, not '{said}'")

    def _times(self, plan: Plan, solution: Solution, seen: Formula, passages: str) -> Array:
        """Return the times of the points, in the second half of a motion."""
        begin, end = plan.case.begin, float(solution.time[-1])
        half = (begin + end) / 2
        if self.every is not None:
            interval = interval_of(plan, plan.case.y0, self.every, "the time between the points")
            last = math.floor((end - begin) / interval * (1 + 1e-12))
            count: Array = np.arange(math.ceil((half - begin) / interval), last + 1, dtype=float)
            return np.minimum(begin + interval * count, end)
        if passages == "impacts" and self.where is None:
            hits = {event.time for event in solution.events if event.kind == "impact"}
            return np.array(sorted(t for t in hits if t >= half))
        t = fine_times(solution, half, end)
        if self.where is not None:
            name, level = self.where.name, self.where.level
            off = solution(t)[name] - level
            return crossings(t, off, lambda at: solution(at)[name] - level, self.direction or "up")
        if _rests(plan, solution, t):
            return t[-1:]
        return extrema(solution, seen.name, t, EXTREMA[passages])


class DiagramRow(Struct, frozen=True, eq=False):
    """The points of one value: ``times`` [n] and values ``seen`` [n]; after how many of them the motion repeats itself, 0 where it
    does not, and by how much it then is off."""

    way: str
    value: float
    times: Array
    seen: Array
    period: int
    unsettled: float


def _length_of_a_run(problem: Problem, study: Diagram) -> float:
    """Return how long the experiment runs, which decides where nothing else does."""
    if study.hold is not None or study.every is not None:
        return math.nan
    case = plan_run(problem, replace(study, every=None)).case
    return case.stop - case.begin


def _own(problem: Problem) -> list[int]:
    """Return the states by which points are compared."""
    return [k for k, q in enumerate(problem.states) if q.kind not in ("account", "internal")]


def _rests(plan: Plan, solution: Solution, t: Array) -> bool:
    """Whether a motion has come to rest: then it has no extrema but for rounding, and stands at one point."""
    columns, states = solution(t), plan.case.problem.states
    return all(np.ptp(columns[states[k].name]) <= REPEATS * plan.nominal[k] for k in _own(plan.case.problem))


def _row(
    problem: Problem, plan: Plan, solution: Solution, seen: Formula, way: str, value: float, t: Array
) -> DiagramRow:
    if not t.size:
        return DiagramRow(way, value, t, t, 0, math.nan)
    columns = solution(t)
    states = _own(problem)
    turning = [
        k for k in states if np.ptp(columns[problem.states[k].name]) > math.pi and periodic(plan.case, k)
    ]
    y = np.column_stack([columns[problem.states[k].name] / plan.nominal[k] for k in states])
    turn = np.array([2 * math.pi / plan.nominal[k] if k in turning else math.inf for k in states])
    x = columns[seen.name]
    if any(problem.states[k].name == seen.name for k in turning):
        x = (x + math.pi) % (2 * math.pi) - math.pi
    period, off = _repeats(y, turn)
    return DiagramRow(way, value, t, x, period, off)


def _repeats(y: Array, turn: Array) -> tuple[int, float]:
    """Return after how many points a motion repeats itself, and by how much it is off then; 0 where it does not."""
    if len(y) == 1:
        return 1, 0.0
    for period in range(1, min(LONGEST, len(y) // 2) + 1):
        apart = np.abs(y[period:] - y[:-period])
        with np.errstate(invalid="ignore"):
            apart = np.where(np.isfinite(turn), np.abs((apart + turn / 2) % turn - turn / 2), apart)
        off = float((apart / (1 + np.abs(y[:-period]))).max())
        if off < REPEATS:
            return period, off
    return 0, math.nan


def _findings(
    problem: Problem, study: Diagram, sweep: CarriedSweep, seen: Formula, rows: Sequence[DiagramRow]
) -> Findings:
    over = sweep.over
    unit = next(q.unit for q in (*problem.states, *problem.outputs) if q.name == seen.name)
    arrays = {
        over.name: np.repeat([row.value for row in rows], [row.times.size for row in rows]),
        "time": np.concatenate([np.empty(0), *(row.times for row in rows)]),
        seen.text: np.concatenate([np.empty(0), *(row.seen for row in rows)]),
    }
    way_of = np.repeat([row.way for row in rows], [row.times.size for row in rows])
    if len(ORDERS[study.order]) > 1:
        arrays["way"] = way_of
    count = len(arrays["time"])
    ways = ORDERS[study.order]
    curves = tuple(
        curve
        for k, way in enumerate(ways)
        for curve in _dots([row for row in rows if row.way == way], way if len(ways) > 1 else "", k)
    )
    changes = _changes(rows)
    head = (("way", ""), ("from", over.unit), ("to", over.unit), ("period before", ""), ("after", ""))
    table = Table(f"changes of the period, counted in points, over {over.name}", head, tuple(changes))
    empty = sum(not row.times.size for row in rows)
    remarks = []
    if empty:
        remarks.append(
            f"at {empty} of {len(rows)} values the motion has no such points in the second half of its hold"
        )
    open_ends = sum(row.period == 0 and row.times.size > 0 for row in rows)
    if open_ends:
        remarks.append(
            f"at {open_ends} of {len(rows)} values the motion does not repeat itself within {LONGEST} points: it is chaotic, "
            "quasi-periodic, or has not settled"
        )
    largest = max((row.unsettled for row in rows if row.period), default=None)
    points = [
        {
            "parameter": {over.name: row.value},
            "way": row.way,
            "period": row.period or None,
            "times": row.times.tolist(),
            "points": row.seen.tolist(),
        }
        for row in rows
    ]
    details: dict[str, Any] = {
        "of": seen.text,
        "diagram": points,
        "changes": [dict(zip(("way", "from", "to", "before", "after"), row, strict=True)) for row in changes],
        "accuracy": {
            "errors": {"repeats": largest},
            "errors_from": f"{ERRORS}, relative to nominal + |value|",
        },
    }
    message = sweep.message or f"{count} points at {len(rows)} values of {over.name}"
    return Findings(
        study="diagram",
        model=problem.name,
        outcome=sweep.outcome,
        message=message,
        values=(),
        errors_from=ERRORS,
        remarks=tuple(remarks),
        tables=(table,) if changes else (),
        panels=(Panel(_title(study), over.name, over.unit, seen.text, unit, curves, tall=True),),
        details=details,
        arrays=arrays,
        runs=(sweep.last,) if sweep.last is not None else (),
    )


def _dots(rows: Sequence[DiagramRow], name: str, colour: int) -> list[Curve]:
    """Draw what repeats itself as one visible dot for each of its points, all else as a cloud."""
    found = []
    for style, chosen, label in (
        ("dots", [(r.value, r.seen) for r in rows if not r.period], ""),
        ("spots", [(r.value, r.seen[-r.period :]) for r in rows if r.period], name),
    ):
        x = np.concatenate([np.empty(0), *(np.full(seen.size, value) for value, seen in chosen)])
        found.append(
            Curve(label, x, np.concatenate([np.empty(0), *(seen for _, seen in chosen)]), style, colour)
        )
    return found


def _changes(rows: Sequence[DiagramRow]) -> list[tuple[str, float, float, str, str]]:
    """Return between which neighbouring values of one way the period changes."""

    def word(row: DiagramRow) -> str:
        return str(row.period) if row.period else "none" if row.times.size else "no points"

    return [
        (a.way, a.value, b.value, word(a), word(b))
        for a, b in itertools.pairwise(rows)
        if a.way == b.way and word(a) != word(b)
    ]


def _title(study: Diagram) -> str:
    if study.every is not None:
        return f"once in every {study.every.text if isinstance(study.every, Formula) else f'{study.every:g}'}"
    if study.where is not None:
        return f"where {study.where.text}"
    return study.at or "maxima"

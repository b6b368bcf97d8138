"""Bifurcation diagrams: what a motion settles to, over a parameter, as points once in every period, on a surface, at extrema or at
impacts."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from typing import Annotated, Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from ...case import find_setting
from ...integrate.interruption import NotedInterruptions
from ...outcome import SimulationError
from ...problem import Array, Problem
from ...results.solution import Solution
from ...settings import Formula, FormulaSurface, Range, settable
from ..findings import Curve, Findings, Panel, Table
from ..flow.branch import FollowedBranch, follow_branch
from ..flow.carried_sweep import CarriedSweep, interval_of, refuse_states
from ..flow.crossings import crossings, extrema, fine_times
from ..flow.following import FollowedPlace, special_words
from ..flow.pieces import periodic
from ..runs.simulate import Plan, plan_run
from ..study import Study
from .ensemble import EnsembleOf, Varying

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
        Formula | None, settable("Quantity to draw (default: the first coordinate).", "formula")
    ] = None
    every: Annotated[float | Formula | None, settable('A point once in this time: "2*pi/w".', "interval")] = (
        None  # type: ignore[assignment]
    )
    where: Annotated[
        FormulaSurface | None, settable('A point at each crossing: "der(x) = 0".', "surface")
    ] = None
    direction: Annotated[
        str | None, settable("Direction of crossing: up, down, both (default: up).", "text")
    ] = None
    at: Annotated[str | None, settable("Points at maxima, minima or impacts (default: maxima).", "text")] = (
        None
    )
    hold: Annotated[
        float | Formula | None,
        settable(
            f"How long each value is kept fixed (default: {2 * COUNT} intervals of 'every', otherwise the length of a run).",
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

    starts: Annotated[
        tuple[Varying, ...],
        settable(
            'Begin from each of these starts, to see coexisting attractors: "x = -1 .. 1, 5; der(x) = {0, 1}".',
            "varying",
        ),
    ] = ()

    branch: Annotated[
        bool,
        settable("Follow the first periodic motion along the parameter, stable or not, as a line.", "flag"),
    ] = False

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
        settled: Solution | None = None
        branch: FollowedBranch | str | None = None

        def held(plan: Plan, y: Array) -> float:
            if self.hold is not None:
                return interval_of(plan, y, self.hold, "the time for which a value is held")
            if self.every is not None:
                return 2 * COUNT * interval_of(plan, y, self.every, "the time between the points")
            return span

        with NotedInterruptions() as interrupted:
            sweep = CarriedSweep(problem, self, over, held, interrupted)
            span = _length_of_a_run(problem, self)
            starts, unvaried = _starts_of(problem, self), sweep.options.values
            rounds = [(start, way) for start in starts for way in ORDERS[self.order]]
            for k, (start, way) in enumerate(rounds):
                part = (k / len(rounds), (k + 1) / len(rounds))
                sweep.options = replace(sweep.options, values={**unvaried, **start})
                if way == ORDERS[self.order][0]:
                    sweep.afresh()
                ordered = values[::-1] if way == "down" else values
                for value, plan, solution in sweep.motions(ordered, part, afresh=way == "start"):
                    t = self._times(plan, solution, seen, passages)
                    rows.append(replace(_row(problem, plan, solution, seen, way, value, t), start=start))
                    if settled is None and rows[-1].period:
                        first, settled = len(rows) - 1, solution
                if not sweep.goes_on:
                    break
            if self.branch and sweep.goes_on:
                branch = "there is no periodic motion from which to follow a branch"
                if settled is not None:
                    ordered = values[::-1] if rows[first].way == "down" else values
                    branch = self._followed(
                        problem, sweep, ordered[first % len(values) :], rows[first], settled, interrupted
                    )
        drawn = (
            None
            if isinstance(branch, str) or branch is None
            else self._lines(problem, seen, passages, branch)
        )
        return _findings(problem, self, sweep, seen, rows, branch, drawn)

    def _followed(
        self,
        problem: Problem,
        sweep: CarriedSweep,
        values: Array,
        row: DiagramRow,
        settled: Solution,
        interrupted: Callable[[], bool],
    ) -> FollowedBranch | str:
        """Follow the orbit of a row along further values; tell why where there is none."""

        def interval(plan: Plan) -> float:
            if self.every is None:
                return period
            between = interval_of(plan, plan.case.y0, self.every, "the time between the points")
            return row.period * between

        if row.times.size > row.period:
            period = float(row.times[-1] - row.times[-1 - row.period])
        elif self.every is not None and isinstance(self.every, float | int):
            period = row.period * float(self.every)
        else:
            return "the first periodic motion has too few points to follow it: hold each value longer"
        try:
            return follow_branch(
                problem, sweep.options, sweep.over.name, values, settled, period, interval, interrupted
            )
        except SimulationError as failure:
            return f"no branch was followed: {failure.message}"

    def _lines(
        self, problem: Problem, seen: Formula, passages: str, branch: FollowedBranch
    ) -> list[DiagramRow]:
        """Return the points of one round of each orbit of a branch."""
        return [
            _row(problem, plan, solution, seen, "", place.value, self._times(plan, solution, seen, passages))
            for place, (plan, solution) in zip(branch.places, branch.rounds, strict=True)
        ]

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
            count: Array = np.arange(last // 2 + 1, last + 1, dtype=float)  # after the half, not on it
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


def _starts_of(problem: Problem, study: Diagram) -> list[dict[str, float]]:
    """Return the starts from which motions begin. Raises SimulationError for what is not a part of the state."""
    if not study.starts:
        return [{}]
    members = EnsembleOf(vary=study.starts, values=study.values).members(problem)
    for name in members.names:
        if find_setting(problem, name).array != "y":
            raise SimulationError(f"'{name}' is not an initial value: starts differ in these alone")
    return [dict(zip(members.names, row.tolist(), strict=True)) for row in members.values(0, members.count)]


class DiagramRow(Struct, frozen=True, eq=False):
    """The points of one value: ``times`` [n] and values ``seen`` [n]; after how many of them the motion repeats itself, 0 where it
    does not, and by how much it then is off."""

    way: str
    value: float
    times: Array
    seen: Array
    period: int
    unsettled: float
    start: dict[str, float] = {}


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
    problem: Problem,
    study: Diagram,
    sweep: CarriedSweep,
    seen: Formula,
    rows: Sequence[DiagramRow],
    branch: FollowedBranch | str | None,
    followed: Sequence[DiagramRow] | None,
) -> Findings:
    over = sweep.over
    unit = next(q.unit for q in (*problem.states, *problem.outputs) if q.name == seen.name)
    arrays = {
        over.name: np.repeat([row.value for row in rows], [row.times.size for row in rows]),
        "time": np.concatenate([np.empty(0), *(row.times for row in rows)]),
        seen.text: np.concatenate([np.empty(0), *(row.seen for row in rows)]),
    }
    for name in rows[0].start if rows else ():
        arrays[f"start of {name}"] = np.repeat(
            [row.start[name] for row in rows], [row.times.size for row in rows]
        )
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
            **({"start": row.start} if row.start else {}),
            "period": row.period or None,
            "times": row.times.tolist(),
            "points": row.seen.tolist(),
        }
        for row in rows
    ]
    if isinstance(branch, str):
        remarks.append(branch)
    elif branch is not None and followed is not None:
        curves = (*curves, *_branch_curves(branch, followed, len(ways)))
        remarks += [special_words(one, over.name) for one in branch.specials]
        remarks += [branch.message] if branch.message else []
    details: dict[str, Any] = {
        "of": seen.text,
        "diagram": points,
        "changes": [dict(zip(("way", "from", "to", "before", "after"), row, strict=True)) for row in changes],
        "accuracy": {
            "errors": {"repeats": largest},
            "errors_from": f"{ERRORS}, relative to nominal + |value|",
        },
    }
    if isinstance(branch, FollowedBranch) and followed is not None:
        details["branch"] = [
            {
                "parameter": {over.name: place.value},
                "period": place.orbit.period,
                "points": row.seen.tolist(),
                "multipliers": [[float(v.real), float(v.imag)] for v in place.multipliers],
                "stable": _stable(place),
            }
            for place, row in zip(branch.places, followed, strict=True)
        ]
        details["special"] = [
            {"kind": one.kind, "value": one.value, "between": list(one.between)} for one in branch.specials
        ]
    begun = {tuple(row.start.items()) for row in rows}
    from_starts = f" from {len(begun)} starts" if study.starts else ""
    told = len({row.value for row in rows}) if study.starts else len(rows)
    message = sweep.message or f"{count} points at {told} values of {over.name}{from_starts}"
    return Findings(
        study="diagram",
        model=problem.name,
        outcome=sweep.outcome,
        message=message,
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


def _stable(place: FollowedPlace) -> bool:
    return bool(np.abs(place.multipliers).max(initial=0.0) < 1)


def _branch_curves(branch: FollowedBranch, rows: Sequence[DiagramRow], colour: int) -> list[Curve]:
    """Draw a branch as a line for each point of a period, dashed where it is unstable; it ends where the number of points changes."""
    found, named = [], set[str]()
    kinds = [(_stable(place), row.seen.size) for place, row in zip(branch.places, rows, strict=True)]
    start = 0
    for end in range(1, len(rows) + 1):
        if end < len(rows) and kinds[end] == kinds[start] and not branch.places[end].first:
            continue
        stable, size = kinds[start]
        joined = end < len(rows) and kinds[end][1] == size and not branch.places[end].first
        part = rows[start : end + joined]
        for k in range(size):
            name = "stable" if stable else "unstable"
            label = "" if name in named else name
            named.add(name)
            found.append(
                Curve(
                    label,
                    np.array([row.value for row in part]),
                    np.array([row.seen[k] for row in part]),
                    "line" if stable else "dashed",
                    colour,
                )
            )
        start = end
    return found


def _changes(rows: Sequence[DiagramRow]) -> list[tuple[str, float, float, str, str]]:
    """Return between which neighbouring values of one way the period changes."""

    def word(row: DiagramRow) -> str:
        return str(row.period) if row.period else "none" if row.times.size else "no points"

    found = (
        (a.way, a.value, b.value, word(a), word(b))
        for a, b in itertools.pairwise(rows)
        if a.way == b.way and a.start == b.start and word(a) != word(b)
    )
    return list(dict.fromkeys(found))  # once, where several starts lead to it


def _title(study: Diagram) -> str:
    if study.every is not None:
        return f"once in every {study.every.text if isinstance(study.every, Formula) else f'{study.every:g}'}"
    if study.where is not None:
        return f"where {study.where.text}"
    return study.at or "maxima"

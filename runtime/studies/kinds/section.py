"""Poincaré sections: where a motion goes through a surface, or where it stands at multiples of a time.

Crossings are found on the polynomials of the steps, by a change of sign between three points of each step and the
method of Chandrupatla (Advances in Engineering Software 28, 1997), many at once.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from functools import partial
from typing import Annotated, Any

import numpy as np
from msgspec.structs import replace

from ...integrate.interruption import NotedInterruptions
from ...outcome import ENDED, Outcome, SimulationError, time_text, worst
from ...problem import Array, Problem
from ...results.evaluate import evaluate_rows
from ...results.solution import Solution
from ...settings import Formula, FormulaSurface, settable
from ..findings import Findings, Table, Value
from ..flow.crossings import crossings
from ..flow.pieces import Ending, Piece, column_at, pieces, with_horizon
from ..runs.companion import closer
from ..runs.simulate import Plan, plan_run, run
from ..study import Study, swept_axes
from .section_points import NUMBER, Strand, arrays_of, picture

DIRECTIONS = ("up", "down", "both")
COUNT = 1000
TOLERANCE = 1e-10
"""Of a section for which no tolerance is said."""
COMPARED = 200
"""Points that a motion at a tighter tolerance is followed for."""
APART = 1e-3
"""Of the nominal value of a state: points that differ by more belong to motions that have parted."""
PATIENCE = 100
"""Spans between crossings, or of the run, without a crossing, after which none is waited for."""
HORIZON = 100.0
"""Of motions that do not say when to stop, where their size is to be known."""
ERRORS = "the same motions at a tighter tolerance, or with half the step, for the first points"
NEAR = 1e-6
"""Of a unit of time: over which the rate of a surface is taken, for a correction by a few times the resolution of time."""


class Section(Study, frozen=True, kw_only=True):
    """The points where the motion goes through the surface ``where``, or stands at multiples of ``every``. One start
    gives ``count`` points; an experiment that sweeps values gives as many for each of them."""

    sweeps = True
    needs = frozenset({"jacobian"})  # long motions may be stiff

    where: Annotated[
        FormulaSurface | None,
        settable('The surface: "q1 = 0" (default: where the first coordinate is 0).', "surface"),
    ] = None
    direction: Annotated[
        str | None, settable("Direction of crossing: up, down, both (default: up).", "text")
    ] = None
    every: Annotated[
        float | Formula | None,
        settable('Instead of a surface, a time between points: "2*pi/w".', "interval"),
    ] = None  # type: ignore[assignment]
    count: Annotated[int, settable(f"Number of points from each start (default: {COUNT}).", "count")] = COUNT
    of: Annotated[tuple[str, ...], settable("The two quantities of the picture.", "names")] = ()

    def solve(self, problem: Problem) -> Findings:
        """Follow the motion from each start. Raises SimulationError."""
        if self.where is None and self.every is None and problem.nq:
            name = problem.states[0].name
            return replace(self, where=FormulaSurface(name, 0.0, f"{name} = 0")).solve(problem)
        if (self.where is None) == (self.every is None):
            raise SimulationError(
                "a section is taken where something happens, or every so often: one of both",
                help='say --where "x = 0", or --every "2 s"',
            )
        if self.every is not None and self.direction is not None:
            raise SimulationError(
                "points at multiples of a time cross no surface, so they have no direction",
                help='leave it away, or say a surface: --where "x = 0"',
            )
        if self.direction is not None and self.direction not in DIRECTIONS:
            raise SimulationError(f"the direction is up, down or both, not '{self.direction}'")
        axes = swept_axes(problem, self)
        starts = [dict(zip(axes, row, strict=True)) for row in itertools.product(*axes.values())]
        strands: list[Strand] = []
        with NotedInterruptions() as interrupted:
            for k, values in enumerate(starts):
                strands.append(_Follower(problem, self, values, interrupted, (k, len(starts))).strand())
                if strands[-1].outcome is Outcome.INTERRUPTED:
                    break
        return _findings(problem, self, strands)


class _Follower:
    """Follows the motion from one start."""

    def __init__(
        self,
        problem: Problem,
        study: Section,
        values: dict[str, float],
        interrupted: Callable[[], bool],
        part: tuple[int, int],
    ) -> None:
        # the motion goes on for as long as points are wanted: the stop of an experiment does not bound their start
        late = study.start is not None and study.start > 0
        if study.start is not None and study.stop is not None and study.stop < study.start:
            raise SimulationError(f"the stop time {study.stop:g} lies before the start {study.start:g}")
        alone = replace(
            study, values={**study.values, **values}, every=None, start=0.0 if late else study.start
        )
        options = with_horizon(problem, alone, HORIZON, TOLERANCE)
        self.study, self.values, self.interrupted, self.part = study, values, interrupted, part
        self.plan = plan_run(problem, options)
        self.case = self.plan.case
        self.first = float(study.start if late and study.start is not None else self.case.grid[0])
        self.given_stop = study.stop
        self.interval = math.nan
        if study.every is not None:
            self.interval = self._interval(study.every)
        self.runs: tuple[Solution, ...] = ()

    def _interval(self, every: float | Formula) -> float:
        case = self.case
        if isinstance(every, Formula):
            found = column_at(case, every.name)(np.array([case.begin]), case.y0[None, :])
            every = float(found[0])
        if not (math.isfinite(every) and every > 0):
            raise SimulationError(f"the time between the points is positive, it is {every:g}")
        return every

    def strand(self) -> Strand:
        count, case = self.study.count, self.case
        t, y, ending = self._points(count, self.plan)
        outcome, message = Outcome.COMPLETED, f"{len(t)} points until {time_text(case.problem, self.reached)}"
        if ending.failure is not None:
            outcome, message = Outcome.FAILED, ending.failure.message
        elif ending.interrupted:
            outcome, message = Outcome.INTERRUPTED, f"interrupted after {len(t)} points"
        elif ending.terminated and len(t) < count:
            outcome, message = Outcome.TERMINATED, f"{len(t)} of {count} points: {ending.terminated}"
        elif len(t) < count and self.given_stop is None:
            message = f"{len(t)} of {count} points: none came until {time_text(case.problem, self.reached)}"
        compared, agreeing, errors = 0, 0, np.full(case.y0.size, np.nan)
        if outcome in ENDED and len(t):
            compared = min(len(t), COMPARED)
            settings, factor = closer(self.plan)
            beside = plan_run(case.problem, replace(self.plan.options, **settings))
            _, other, _ = self._points(compared, beside)
            compared = min(compared, len(other))
            apart = factor * np.abs(y[:compared] - other[:compared])
            parted = (apart > APART * self.plan.nominal).any(axis=1)
            agreeing = int(np.argmax(parted)) if parted.any() else compared
            errors = apart[:agreeing].max(axis=0, initial=0.0)
        return Strand(
            self.values, t, y, self._outputs(t, y), outcome, message, compared, agreeing, errors, self._drifts(t, y), self.plan, self.runs
        )  # fmt: skip

    def _outputs(self, t: Array, y: Array) -> Array:
        """Give the outputs at points, of a motion with events by the run that holds what switches there."""
        names = [q.name for q in self.case.problem.outputs]
        if not names or not len(t):
            return np.empty((len(t), len(names)))
        if not self.runs:
            return evaluate_rows(self.case, "outputs", t, y)
        columns = self.runs[-1](t)
        return np.column_stack([columns[name] for name in names])

    def _drifts(self, t: Array, y: Array) -> dict[str, float]:
        """Give how far each conserved quantity is from where it began, at the points."""
        problem = self.case.problem
        kept = {problem.outputs[k].name: k for k in problem.conserved}
        if problem.energy_balance and problem.energy_balance[1:] == (-1, -1):
            kept[problem.outputs[problem.energy_balance[0]].name] = problem.energy_balance[0]
        if not kept or not len(t) or problem.hybrid is not None:
            return {}
        rows = evaluate_rows(self.case, "outputs", np.r_[self.case.begin, t], np.vstack([self.case.y0, y]))
        off = np.abs(rows - rows[0]).max(axis=0)
        return {name: float(off[k]) for name, k in kept.items()}

    def _points(self, count: int, plan: Plan) -> tuple[Array, Array, Ending]:
        ending = Ending()
        times: list[Array] = []
        states: list[Array] = []
        found, waited = 0, self.first
        span = self.case.stop - self.case.begin
        stop = self.first + count * self.interval * (1 + 1e-9)
        if self.given_stop is not None:
            stop = self.given_stop
        elif math.isnan(self.interval):
            stop = math.inf
        source = self._smooth if self.case.problem.hybrid is None else self._whole
        self.reached = self.case.begin
        for piece in source(max(stop, self.first), ending, plan):
            t, y = self._in(piece)
            late = t >= self.first
            t, y = t[late][: count - found], y[late][: count - found]
            times.append(t)
            states.append(y)
            found += len(t)
            self.reached = float(t[-1]) if found >= count else float(piece.t[-1])
            if len(t):
                waited = float(t[-1])
                span = max(span, float(t[-1] - self.case.begin) / found)
            if plan is self.plan and self.study.progress is not None:
                k, n = self.part
                self.study.progress((k + min(1.0, found / count)) / n)
            if found >= count or (math.isinf(stop) and self.reached - waited > PATIENCE * span):
                break
        empty = np.empty((0, self.case.y0.size))
        return np.concatenate([np.empty(0), *times]), np.vstack([empty, *states]), ending

    def _smooth(self, stop: float, ending: Ending, plan: Plan) -> Iterator[Piece]:
        through = self.study.where is not None
        return pieces(plan, stop, ending, self.interrupted, looked_at=through)

    def _whole(self, stop: float, ending: Ending, plan: Plan) -> Iterator[Piece]:
        """Yield runs of twice the length each, for models that switch and for the methods outside of the kernel."""
        problem, end, done = self.case.problem, self.case.stop, self.case.begin
        ny = problem.ny
        while done < stop and not self.interrupted():
            end = min(end, stop)
            options = replace(
                plan.options, stop=end, start=self.case.begin, estimate_error=False, progress=None
            )
            solution = run(problem, options)
            if plan is self.plan:
                self.runs = (solution,)
            if solution.interpolation != "dense output":
                raise SimulationError(
                    f"the motion is too long to be kept until {time_text(problem, end)}: take fewer points"
                )
            motion = solution.motion
            new = motion.time >= done
            inner = motion.time[new]
            steps = max(4 * solution.statistics.steps, inner.size)
            more = np.linspace(done, float(motion.time[-1]), steps)
            t = np.concatenate([inner, more])
            y = np.vstack([motion.columns.rows(new), motion.at(more)])
            order = np.argsort(t, kind="stable")
            yield Piece(t[order], y[order][:, :ny], partial(_states, motion.at, ny))
            if solution.outcome not in ENDED or solution.outcome is Outcome.TERMINATED:
                ending.failure = solution.failure
                ending.interrupted = solution.outcome is Outcome.INTERRUPTED
                ending.terminated = solution.message if solution.outcome is Outcome.TERMINATED else ""
                return
            done, end = end, 2 * end
        ending.interrupted = self.interrupted()

    def _in(self, piece: Piece) -> tuple[Array, Array]:
        """Give the points of one piece."""
        where = self.study.where
        if where is None:
            begin = self.case.begin
            k = np.arange(
                math.ceil((piece.t[0] - begin) / self.interval), (piece.t[-1] - begin) / self.interval + 1e-9
            )
            t = begin + k * self.interval
            t = t[(t > piece.t[0]) | (t == begin)]
            return t, piece.at(t)
        column = column_at(self.case, where.name)
        values = column(piece.t, piece.y) - where.level

        def value(t: Array) -> Array:
            return column(t, piece.at(t)) - where.level

        t = crossings(piece.t, values, value, self.study.direction or "up")
        t = t[t > self.case.begin]
        return t, self._onto(t, piece.at(t), column)

    def _onto(self, t: Array, y: Array, column: Callable[[Array, Array], Array]) -> Array:
        """Move states onto the surface along the motion, by less than the times t can tell apart after long."""
        if self.case.problem.hybrid is not None or not len(t):
            return y
        assert self.study.where is not None
        slope = evaluate_rows(self.case, "rhs", t, y)
        off = column(t, y) - self.study.where.level
        moved = column(t, y + NEAR * slope) - self.study.where.level - off
        with np.errstate(all="ignore"):
            back = np.where(moved != 0, -off * NEAR / moved, 0.0)
        resolution = 8 * np.finfo(float).eps * np.abs(t)
        safe = np.abs(back) <= resolution
        return np.where(safe[:, None], y + back[:, None] * slope, y)


def _states(at: Callable[[Array], Array], ny: int, t: Array) -> Array:
    return at(t)[:, :ny]


def _findings(problem: Problem, study: Section, strands: list[Strand]) -> Findings:
    kept = [k for k, quantity in enumerate(problem.states) if quantity.kind != "account"]
    arrays = arrays_of(problem, strands, study.of)
    columns = {name: column.tolist() for name, column in arrays.items() if name != NUMBER}
    points = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
    count = sum(len(strand.t) for strand in strands)
    errors = np.max([strand.errors for strand in strands], axis=0)
    remarks = []
    for strand in strands:
        of = "".join(f", {name} = {value:g}" for name, value in strand.values.items())
        if strand.outcome is not Outcome.COMPLETED and len(strands) > 1:
            remarks.append(f"{strand.message}{of}")
        if strand.agreeing < strand.compared:
            remarks.append(
                f"the first {strand.agreeing} points agree with those at a tighter tolerance; then the motions diverge, as "
                f"chaotic ones do, and each point stands for one of a motion nearby{of}"
            )
        for name, drift in strand.drifts.items():
            remarks.append(f"{name}, which is conserved, changes by {drift:.1e} at most{of}")
    if study.where is not None:
        remarks.append("times of crossings are exact to rounding on the polynomials of the steps")
    details: dict[str, Any] = {"points": points, "count": count}
    told = {problem.states[k].name: float(errors[k]) if np.isfinite(errors[k]) else None for k in kept}
    details["accuracy"] = {
        "errors": told,
        "errors_from": ERRORS,
        "compared": [strand.compared for strand in strands],
        "agreeing": [strand.agreeing for strand in strands],
        "drifts": [strand.drifts for strand in strands],
    }
    worst_one = worst(strand.outcome for strand in strands)
    message = next(s.message for s in strands if s.outcome is worst_one)
    return Findings(
        study="section",
        model=problem.name,
        outcome=worst_one,
        message=message if len(strands) == 1 else f"{count} points of {len(strands)} starts",
        values=(Value("points", "", float(count), 0.0),),
        errors_from=ERRORS,
        tables=(_errors(problem, told),) if count else (),
        remarks=tuple(remarks),
        panels=(picture(problem, study.of, study.where, strands, arrays),),
        details=details,
        arrays=arrays,
        runs=tuple(run for strand in strands for run in strand.runs),
    )


def _errors(problem: Problem, told: dict[str, float | None]) -> Table:
    units = {quantity.name: quantity.unit for quantity in problem.states}
    rows = tuple((name, units[name], off) for name, off in told.items())
    return Table("largest differences from the tighter motions, as long as they agree", HEAD, rows)


HEAD = (("quantity", ""), ("unit", ""), ("error", ""))

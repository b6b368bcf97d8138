"""A run by the C kernel, in slices between which progress is told and Ctrl-C is heard."""

from __future__ import annotations

import ctypes
import math
import time
from collections.abc import Callable
from functools import partial

import numpy as np
from msgspec.structs import replace

from ..case import Case
from ..delays import delays_of
from ..functions import Functions
from ..methods import SOLVING_CONTACTS
from ..native import kernel as native
from ..native.status import Status
from ..outcome import Failure, given_up, too_many_steps
from ..problem import Array, Problem
from ..rows import AT_ONCE, IN_MEMORY, Follower, Passing, passed, slices
from .events import DelayHistory, EventRecord, merged
from .interruption import NotedInterruptions
from .solver import Solver, SolverOptions, method_name
from .trajectory import ContactSteps, DenseOutput, Reader, Statistics, Trajectory


class EventLog:
    """The events and instants of a run: the kernel gets more room whenever it has used what it has."""

    def __init__(self, solver: Solver, problem: Problem) -> None:
        self._solver = solver
        self._problem = problem

    def renew(self) -> None:
        self._solver.grow_events()

    def finish(self, begin: float, t: Array, grid_z: Array) -> EventRecord:
        """Give what happened since ``begin``, with the discrete variables ``grid_z`` [n, nz] at the times ``t`` [n].

        At the start they are as before the first later instant: the first of these times may be after that.
        """
        noted, instants = self._solver.happened()
        ny, size = self._solver.ny, self._solver.ny + self._solver.nz
        start_z = grid_z[0] if t.size else self._solver.discretes()
        later = np.flatnonzero(instants[:, 0] > begin)
        if later.size and not (t.size and t[0] < instants[later[0], 0]):
            start_z = instants[later[0], 1 + ny : 1 + size]
        return EventRecord(self._problem, noted, instants, start_z, grid_z)


SLICE_SECONDS = 0.05
FIRST_SLICE = 256
DENSE_LIMIT = 128_000_000
"""Bytes above which the polynomials of a run are no longer kept."""
FIRST_RECORD = 512
UNTROUBLED = (Status.RUNNING, Status.RECORD_FULL, Status.EVENTS_FULL, Status.REACHED)
"""What a run that was interrupted may have come to: also its end, for what would follow it is not begun then."""


def run_kernel(case: Case, options: SolverOptions, reader: Reader | None = None) -> Trajectory:
    """Run ``case`` to its end, to a failure, or to Ctrl-C; all three keep what was computed.

    A ``reader`` reads the rows while they are written, and only the last one is kept.
    """
    problem = case.problem
    with _solver(case, options, reader) as solver, NotedInterruptions(options.interrupted) as interrupted:
        record = _Record(solver, min(options.dense_kept, DENSE_LIMIT)) if options.dense else None
        log = EventLog(solver, problem) if problem.hybrid is not None else None
        heard = _listen(solver, reader)
        told = None if options.follower is None else _Told(solver, case, options.follower)
        status = _advance(solver, case, options, record, log, told, interrupted)
        report = solver.progress()
        t, rows, z = _written(solver, status, report, reader, heard, options)
        happened, ended = None, ""
        if log is not None:
            assert z is not None
            happened = log.finish(case.begin, t, z)
            if status == Status.TERMINATED and problem.hybrid is not None:
                ended = problem.hybrid.branches[report.failed_index].message or ""
        dense = _dense(record, case, options, report, interrupted())
        if happened is not None and (delays := delays_of(case.functions, case.p)) is not None:
            ny = rows.shape[1]
            happened.past = DelayHistory(
                case, delays, dense, partial(happened.held, ny=ny), (t, happened.grid_z)
            )
        return Trajectory(
            t=t,
            y=rows,
            dense=dense,
            statistics=_statistics(solver.kernel, case.functions, report),
            failure=_failure(problem, status, report, solver, options),
            interrupted=status in UNTROUBLED and interrupted(),
            happened=happened,
            terminated=ended if status == Status.TERMINATED else None,
            solver=solver,
        )


def _solver(case: Case, options: SolverOptions, reader: Reader | None) -> Solver:
    """Make a solver of a case: by one that was made for it, where there is one."""
    storage = Passing() if reader else options.follower.storage if options.follower else IN_MEMORY
    tolerance, step, dense = options.tolerance, options.step or 0.0, options.dense
    if options.like is not None and not dense:
        return options.like.again(tolerance, options.atol, step, case.max_step, options.halves, storage)
    model = case.functions.struct
    kernel = native.kernel_for(model, options.reproducible, options.method)
    records = FIRST_RECORD if dense else 0
    return Solver(
        kernel,
        case,
        options.method,
        tolerance,
        options.atol,
        step,
        storage,
        dense=dense,
        records=records,
        halves=options.halves,
    )


def _written(
    solver: Solver,
    status: Status,
    report: native.ReportStruct,
    reader: Reader | None,
    heard: Callable[[int], None] | None,
    options: SolverOptions,
) -> tuple[Array, Array, Array | None]:
    """Give times, states and discrete variables of all rows with the point where a run stopped; the last row, where the
    others were read already."""
    count = report.n_grid
    t, y, z = solver.rows
    early = status != Status.REACHED and not (count and t[count - 1] >= report.t)
    if reader is None or heard is None:
        times = t[:count]
        if early:
            count = solver.add_last(count)
            times = (options.follower.storage if options.follower else IN_MEMORY).empty(count)
            for rows in slices(count - 1, t, times):
                times[rows] = t[rows]
            times[-1] = report.t
        return times, y[:count], None if z is None else z[:count]
    if early:
        heard(count)
        last = np.array([report.t]), solver.report()[1][None], None if z is None else solver.discretes()[None]
        reader.read(count, *last)
        return last
    row = slice(max(count - 1, 0), count)
    last = t[row], y[row].copy(), None if z is None else z[row].copy()
    heard(count)
    return last


def _listen(solver: Solver, reader: Reader | None) -> Callable[[int], None] | None:
    """Let a reader read rows as they are written; what is given reads the rest. Rows in files leave the memory."""
    t, y, z = solver.rows
    if reader is None:
        if y.shape[0] > AT_ONCE:
            solver.listen(lambda count: passed(t, y, z))
        return None
    done = 0

    def read(count: int) -> None:
        nonlocal done
        rows = slice(done, count)
        reader.read(done, t[rows], y[rows], None if z is None else z[rows])
        if many:
            passed(y, z)
        done = count

    many = y.shape[0] > AT_ONCE
    if many:
        solver.listen(read)
    return read


def _advance(
    solver: Solver,
    case: Case,
    options: SolverOptions,
    record: _Record | None,
    log: EventLog | None,
    told: _Told | None,
    interrupted: Callable[[], bool],
) -> Status:
    """Go on in slices until there is an end, and give the status there. What is full is emptied on the way."""
    status, size, report = (
        Status.RUNNING,
        options.first_slice or FIRST_SLICE,
        native.ReportStruct(stiff_time=math.nan),
    )
    while not interrupted():
        left = _steps_left(options, report)
        if left <= 0 or report.seconds > options.seconds:
            break
        begun = time.perf_counter()
        status = solver.advance(case.stop, int(min(size, left)))
        taken = time.perf_counter() - begun
        if status == Status.RECORD_FULL and record is not None:
            record.renew()
        elif status == Status.EVENTS_FULL and log is not None:
            log.renew()
        elif status != Status.RUNNING:
            break
        else:
            size = max(1, min(4 * size, int(size * SLICE_SECONDS / max(taken, 1e-6))))
        if told is not None:
            told.go_on()
        if options.progress is not None:
            options.progress((solver.progress().t - case.begin) / (case.stop - case.begin))
        report = solver.progress()
    return status


def slice_of(run: Statistics) -> int:
    """Return how many steps take a slice's time, as a run tells."""
    return max(1, int(run.steps * SLICE_SECONDS / max(run.run_time, 1e-6)))


def _steps_left(options: SolverOptions, report: native.ReportStruct) -> float:
    """Return how many steps may follow before it is looked again."""
    left = math.inf if options.max_steps is None else options.max_steps - report.steps
    look = options.stiff_after
    if look is None or report.steps > look or (report.steps == look and math.isnan(report.stiff_time)):
        return left
    return min(left, look - report.steps)


class _Told:
    """Tells a follower of the rows of a run that nothing changes any more."""

    def __init__(self, solver: Solver, case: Case, follower: Follower) -> None:
        self._solver, self._follower = solver, follower
        self._done = self._instants = 0
        follower.begin(case, solver.rows[1])

    def go_on(self) -> None:
        """Tell of the rows before the present time: what happens at it may not be at its end."""
        report = self._solver.progress()
        t, y, z = self._solver.rows
        end = int(np.searchsorted(t[: report.n_grid], report.t))
        while self._done < end:
            rows = slice(self._done, min(self._done + AT_ONCE, end))
            if z is None:
                self._follower.follow(t[rows], y[rows], None)
            else:
                instants = self._solver.instants
                until = t[rows.stop] if rows.stop < end else report.t
                last = int(np.searchsorted(instants[:, 0], until))
                shown = int(np.searchsorted(instants[:, 0], t[0]))
                new = instants[max(self._instants, shown) : last]
                self._follower.follow(*merged(t[rows], y[rows], z[rows], new[:, 0], new[:, 1:])[:3])
                self._instants = last
            self._done = rows.stop
            passed(t, y, z)


class _Record:
    """The polynomials of all steps, kept as long as they stay within ``limit`` bytes."""

    def __init__(self, solver: Solver, limit: float) -> None:
        self._solver = solver
        self._limit = limit
        self._filled: list[Array] = []
        self._size = 0

    def renew(self) -> None:
        """Put the full buffer aside and give the kernel a larger one; none beyond the limit."""
        filled = self._solver.recorded(self._solver.progress().n_record)
        self._filled.append(filled)
        self._size += filled.nbytes
        if self._size > self._limit:
            self._filled.clear()
        self._solver.start_record(2 * len(filled) if self._size <= self._limit else 0)

    def steps_fit(self, steps: int) -> bool:
        """Whether the polynomials of so many steps stay within ``DENSE_LIMIT``."""
        return 8 * (2 + self._solver.n_dense * self._solver.ny) * steps <= DENSE_LIMIT

    def polynomials(self, last: int) -> DenseOutput | None:
        """Give those of all steps, of which the ``last`` are in the present buffer; the run goes on no further."""
        if self._size > self._limit:
            return None
        rows = self._solver.last_record(last)
        if self._filled:
            rows = np.concatenate([*self._filled, rows])
        return DenseOutput(rows, self._solver.ny) if rows.size else None


class PolynomialsAgain:
    """The polynomials of a run that was too long to keep them for nobody: it is run again when they are asked for."""

    def __init__(self, case: Case, options: SolverOptions) -> None:
        self._case = case
        self._options = replace(options, dense_kept=math.inf, progress=None, follower=None, interrupted=None)
        self._found: Callable[[Array], Array] | None = None

    def __call__(self, t: Array) -> Array:
        """Give y [n, ny] at the times t [n]."""
        if self._found is None:
            again = run_kernel(self._case, self._options)
            if again.interrupted:
                raise KeyboardInterrupt
            self._found = again.dense
        assert self._found is not None, "a run goes the same way again"
        return self._found(t)


def _dense(
    record: _Record | None,
    case: Case,
    options: SolverOptions,
    report: native.ReportStruct,
    cut_off: bool,
) -> Callable[[Array], Array] | None:
    """Give the polynomials, or what computes them again where that gives the same."""
    found = None if record is None else record.polynomials(report.n_record)
    if record is None or found is not None or not (report.steps and record.steps_fit(report.steps)):
        return found
    return None if cut_off or options.seconds < math.inf else PolynomialsAgain(case, options)


def _statistics(kernel: ctypes.CDLL, functions: Functions, report: native.ReportStruct) -> Statistics:
    model = functions.struct
    steps, stiff, switched = report.steps, report.stiff_time, report.switch_time
    return Statistics(
        method_name(kernel, report.method),
        steps,
        report.rejected,
        report.evaluations,
        report.seconds,
        report.dt_min if steps else None,
        report.dt_max if steps else None,
        stiff if stiff == stiff else None,
        report.jacobians,
        report.factorisations,
        report.iterations,
        report.switches,
        switched if switched == switched else None,
        report.drift_position if model.n_position else None,
        report.drift_velocity if model.n_velocity else None,
        report.laid,
        report.laid_energy or None,
        report.several,
        report.poisson,
        ContactSteps(report.residual, report.overlap, report.unsolved, report.indeterminate)
        if method_name(kernel, report.method) in SOLVING_CONTACTS
        else None,
    )


def _failure(
    problem: Problem, status: Status, report: native.ReportStruct, solver: Solver, options: SolverOptions
) -> Failure | None:
    if status == Status.REACHED:
        return None
    from .kernel_failure import kernel_failure

    y = solver.report()[1]
    if status == Status.RUNNING and _steps_left(options, report) <= 0:
        return too_many_steps(problem, report.steps, report.t, y)
    if status == Status.RUNNING and report.seconds > options.seconds:
        return given_up(problem, report.seconds, report.evaluations, report.t, y)
    return kernel_failure(problem, status, report, y)

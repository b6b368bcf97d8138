"""Checks of a finished FMU: validation by fmpy, simulation by fmpy, and comparison with the run of this compiler."""

from __future__ import annotations

import tempfile
from pathlib import Path

import fmpy
import numpy as np
from fmpy.fmi1 import FMICallException
from msgspec import Struct
from msgspec.structs import replace

from mechc.lang.diagnostics import CompileError, Reporter
from mechc.runtime.case import Case, inputs_at
from mechc.runtime.integrate.solver import Solver
from mechc.runtime.native import kernel as native
from mechc.runtime.native.status import Status
from mechc.runtime.problem import Array
from mechc.runtime.results.accuracy import companion_tolerance

from . import driver
from .agreement import SAFETY, STEADY, Agreement, FmuMotion, agreement, apart, motion_of, pace_of
from .export import Made
from .rules import check_file
from .variables import Start

APART = 100.0
"""Ratio of the tolerances of a run and of its companion."""
CVODE = 1e-8
"""Tolerance of CVode; its companion, 100 times looser, bounds its error."""
POINTS = 47
"""A prime: events at round times, where states jump, lie between two points."""


class Checked(Struct, frozen=True):
    """What a check has found out: how a run by CVode agrees, and the states of the native run that stops at ``times``.

    ``error``: estimated error of the native run at these times, with its safety. None where it was not run.
    """

    me: Agreement | None
    times: Array
    states: Array
    error: Array
    size: Array


def check_package(made: Made) -> Checked | None:
    """Raise CompileError if an FMU is not valid or does not move as the native run does.

    Co-Simulation must give the bits of the native solver that stops at the same times; Model Exchange stays within
    the bound that both integrators give (agreement.py). An FMU without a binary for this machine is validated only,
    and gives None, as does one whose experiment has no duration.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "model.fmu"
        path.write_bytes(made.package.data)
        problems = check_file(path)
        if problems:
            raise failed("it is not valid: " + "; ".join(p.text for p in problems))
        if fmpy.platform not in fmpy.supported_platforms(str(path)):
            return None
        if made.start.case.stop <= made.start.case.begin:
            return None
        return _check_motion(path, made)


def _check_motion(path: Path, made: Made) -> Checked:
    start = made.start
    end = _end(start, made.method)
    reference = native_motion(start, made.method, POINTS, end)
    if "cs" in made.kinds:
        try:
            found = driver.co_simulation(path, reference.times, reference.step)
        except FMICallException as failure:
            raise failed(f"as Co-Simulation it does not run: {failure}") from failure
        if not np.array_equal(found, reference.states):
            raise failed("Co-Simulation does not give the same motion as the native run")
    size, error = native_error(start, made.method, reference)
    me = None
    if "me" in made.kinds:
        me = by_another(path, reference, size, error, CVODE)
        if (
            not me.passed and me.difference <= STEADY
        ):  # CVode may be further off than it is from its companion
            me = by_another(path, reference, size, error, CVODE / APART)
        if not me.passed:
            raise failed(f"Model Exchange differs from the native run by {me}")
        if me.parted and _steady(made, reference, size, me.until):
            me = _of_finer_runs(path, reference, size, error, me)
    return Checked(me, reference.times, reference.states, error, size)


def _steady(made: Made, reference: FmuMotion, size: Array, until: float) -> bool:
    """Tell whether the loose tolerance leaves the native run where it is: the motion itself does not magnify errors."""
    loose = replace(made.start.case, tolerance=CVODE * APART)
    if loose.step is not None:
        return False
    try:
        other = _again(replace(made.start, case=loose), made.method, reference)
    except CompileError:  # impacts may not bear it
        return False
    changed = apart(reference.states, other, size, pace_of(reference, size))
    changed = changed[: int(np.sum(reference.times <= until)) + 1]
    return bool(len(changed) and changed.max() < STEADY)


def _of_finer_runs(
    path: Path, reference: FmuMotion, size: Array, error: Array, found: Agreement
) -> Agreement:
    """Judge once more at a finer tolerance, where two runs of CVode went different ways and the motion is not chaotic.

    Errors of CVode that add up, as over hundreds of bounces, become smaller; those of a unit remain.
    """
    finer = by_another(path, reference, size, error, CVODE / APART)
    if not finer.passed:
        raise failed(f"Model Exchange differs from the native run by {finer}")
    if finer.parted:
        raise failed(
            f"at tolerances of {CVODE:g} and {CVODE * APART:g} Model Exchange goes different ways from time {found.until:g} on, "
            f"at {CVODE / APART:g} and {CVODE:g} from {finer.until:g} on, and the looser tolerance hardly changes the native run: "
            "the motion is not chaotic"
        )
    return finer


def _end(start: Start, method: str) -> float:
    """Return the end of the points of a comparison: the stop, or half a step after where the model ends its run."""
    case = start.case
    reached = float(native_motion(start, method, POINTS).times[-1]) - case.begin
    if reached > (case.stop - case.begin) * (1 - 1 / POINTS):
        return case.stop
    return case.begin + reached * POINTS / (POINTS - 0.5)


def _again(start: Start, method: str, motion: FmuMotion) -> FmuMotion:
    """Return the native run from another start, made to stop at the same times."""
    count = len(motion.times) - 1
    return native_motion(start, method, count, start.case.begin + count * motion.step)


def native_error(start: Start, method: str, motion: FmuMotion) -> tuple[Array, Array]:
    """Return the sizes of the states, and the estimated error of the native run at each time, with its safety."""
    size: Array = start.nominal + np.max(np.abs(motion.states), axis=0)
    case = start.case
    tolerance, factor = companion_tolerance(case.tolerance)
    finer = replace(case, tolerance=tolerance, step=case.step / 2 if case.step else case.step)
    companion = _again(replace(start, case=finer), method, motion)
    return size, SAFETY * factor * apart(motion.states, companion, size, pace_of(motion, size))


def by_another(path: Path, native: FmuMotion, size: Array, error: Array, tolerance: float) -> Agreement:
    """Compare a run by CVode with the native one, as far as both have gone whole steps.

    Impacts may not bear the loose tolerance of the companion: the comparison ends where that run does. Raises
    CompileError if the run itself fails or ends early.
    """
    times, pace = native.times, pace_of(native, size)
    try:
        run = driver.by_cvode(path, times, tolerance)
    except (FMICallException, RuntimeError) as failure:
        raise failed(f"as Model Exchange it does not run: {failure}") from failure
    if not np.isfinite(run).all():
        raise failed("as Model Exchange it comes to values that are not finite")
    events: list[tuple[float, Array]] = []
    rows = driver.by_cvode(path, times, tolerance * APART, may_fail=True, events=events)
    companion = motion_of(times, native.step, rows, events)
    spread = apart(run, companion, size, pace)
    whole = int(np.sum(np.diff(times) > native.step * (1 - 1e-9))) + 1
    n = min(len(spread), len(error), whole)
    found = agreement(times, apart(run, native, size, pace)[:n], error[:n] + spread[:n], tolerance)
    # the model may end both runs, one of them just before a point
    if len(run) < whole - 1 and len(rows) >= len(run) and found.until >= times[len(run) - 1]:
        raise failed(f"as Model Exchange it ends at time {found.until:g}, and the native run goes on")
    return found


def failed(reason: str) -> CompileError:
    """Return the error of an FMU that does not pass."""
    return Reporter().fail(
        "",
        f"the FMU fails its check and was not written: {reason}",
        None,
        help="--no-check writes it all the same, for a look at it",
    )


def native_motion(start: Start, method: str, count: int, end: float | None = None) -> FmuMotion:
    """Return a run of ``count`` whole steps, with both sides of its events, and the largest rates at its times.

    ``end``: the last time; the stop without it. Where the model ends the run, that is the last time.
    """
    # output within steps would make the solver take shorter ones; units do not end steps at kinks and points of tables of time
    case = replace(start.case, grid=start.case.grid[:1], problem=replace(start.case.problem, timed_points=()))
    hybrid = start.problem.hybrid
    step = ((case.stop if end is None else end) - case.begin) / count
    times = [case.begin]
    for _ in range(count):
        times.append(times[-1] + step)
    # without events nothing happens at the start
    rows = [] if hybrid else [case.y0.copy()]
    rates = np.zeros(case.y0.size)
    with Solver(
        native.load_kernel(True),
        case,
        method,
        case.tolerance,
        case.tolerance * start.nominal,
        case.step or 0.0,
    ) as solver:
        for t in times[len(rows) :]:
            status = Status.RUNNING
            while status in (Status.RUNNING, Status.EVENTS_FULL):
                if status == Status.EVENTS_FULL:
                    solver.grow_events()
                status = solver.advance(t, 10000)
            if status not in (Status.REACHED, Status.TERMINATED):
                raise failed(f"the native run it is compared with fails at time {solver.report()[0].t:g}")
            rows.append(solver.report()[1].copy())
            if hybrid:
                rates = np.fmax(rates, _rates(case, solver))
            if status == Status.TERMINATED:
                times[len(rows) - 1 :] = [solver.report()[0].t]
                break
        instants = solver.happened()[1] if hybrid else np.empty((0, 1 + 2 * len(rates)))
    ny, half = len(rates), (instants.shape[1] - 1) // 2
    sides = np.stack((instants[:, 1 : 1 + ny], instants[:, 1 + half : 1 + half + ny]), axis=1)
    return FmuMotion(np.array(times), step, np.array(rows), instants[:, 0].copy(), sides, rates)


def _rates(case: Case, solver: Solver) -> Array:
    t, y = solver.report()[0].t, solver.report()[1]
    rates = np.abs(case.functions.rhs(t, y, inputs_at(case, t), solver.discretes(), case.p))
    return np.where(np.isfinite(rates), rates, 0.0)

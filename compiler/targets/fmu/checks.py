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
from mechc.runtime.integrate.solver import FIRST_EVENTS, Solver
from mechc.runtime.native import kernel as native
from mechc.runtime.native.kernel import Status
from mechc.runtime.problem import Array
from mechc.runtime.results.accuracy import companion_tolerance

from . import driver
from .agreement import SAFETY, STEADY, Agreement, agreement, distance
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
            raise _failed("it is not valid: " + "; ".join(p.text for p in problems))
        if fmpy.platform not in fmpy.supported_platforms(str(path)):
            return None
        if made.start.case.stop <= made.start.case.begin:
            return None
        return _check_motion(path, made)


def _failed(reason: str) -> CompileError:
    return Reporter().fail(
        "",
        f"the FMU fails its check and was not written: {reason}",
        None,
        help="--no-check writes it all the same, for a look at it",
    )


def _check_motion(path: Path, made: Made) -> Checked:
    start = made.start
    end = _end(start, made.method)
    times, step, reference = native_points(start, made.method, POINTS, end)
    if "cs" in made.kinds:
        try:
            found = driver.co_simulation(path, times, step)
        except FMICallException as failure:
            raise _failed(f"as Co-Simulation it does not run: {failure}") from failure
        if not np.array_equal(found, reference):
            raise _failed("Co-Simulation does not give the same motion as the native run")
    size, error = native_error(start, made.method, POINTS, reference, end)
    me = None
    if "me" in made.kinds:
        me = by_another(path, times, step, reference, size, error, CVODE)
        if (
            not me.passed and me.difference <= STEADY
        ):  # CVode may be further off than it is from its companion
            me = by_another(path, times, step, reference, size, error, CVODE / APART)
        if not me.passed:
            raise _failed(f"Model Exchange differs from the native run by {me}")
        if me.parted:
            _check_chaos(made, times, reference, size, me.until, end)
    return Checked(me, times, reference, error, size)


def _check_chaos(made: Made, times: Array, reference: Array, size: Array, until: float, end: float) -> None:
    """Refuse runs of an integrator that part from each other where the motion itself does not magnify errors."""
    loose = replace(made.start.case, tolerance=CVODE * APART)
    if loose.step is not None:
        return
    try:
        _, _, other = native_points(replace(made.start, case=loose), made.method, POINTS, end)
    except CompileError:  # impacts may not bear it
        return
    changed = distance(reference, other, size)[: int(np.sum(times <= until)) + 1]
    if len(changed) and changed.max() < STEADY:
        raise _failed(
            f"at tolerances of {CVODE:g} and {CVODE * APART:g} Model Exchange goes different ways from time {until:g} on, while "
            f"the looser tolerance changes the native run by {changed.max():.1e} only: the motion is not chaotic"
        )


def _end(start: Start, method: str) -> float:
    """Return the end of the points of a comparison: the stop, or half a step behind where the model ends its run."""
    case = start.case
    reached = float(native_points(start, method, POINTS)[0][-1]) - case.begin
    if reached > (case.stop - case.begin) * (1 - 1 / POINTS):
        return case.stop
    return case.begin + reached * POINTS / (POINTS - 0.5)


def native_error(
    start: Start, method: str, count: int, states: Array, end: float | None = None
) -> tuple[Array, Array]:
    """Return the sizes of the states, and the estimated error of the native run at each time, with its safety."""
    size: Array = start.nominal + np.max(np.abs(states), axis=0)
    case = start.case
    tolerance, factor = companion_tolerance(case.tolerance)
    finer = replace(case, tolerance=tolerance, step=case.step / 2 if case.step else case.step)
    _, _, companion = native_points(replace(start, case=finer), method, count, end)
    return size, SAFETY * factor * distance(states, companion, size)


def by_another(
    path: Path, times: Array, step: float, states: Array, size: Array, error: Array, tolerance: float
) -> Agreement:
    """Compare a run by CVode with the native one, as far as both have gone whole steps.

    Impacts may not bear the loose tolerance of the companion: the comparison ends where that run does. Raises
    CompileError if the run itself fails or ends early.
    """
    try:
        run = driver.by_cvode(path, times, tolerance)
    except (FMICallException, RuntimeError) as failure:
        raise _failed(f"as Model Exchange it does not run: {failure}") from failure
    if not np.isfinite(run).all():
        raise _failed("as Model Exchange it comes to values that are not finite")
    companion = driver.by_cvode(path, times, tolerance * APART, may_fail=True)
    spread = distance(run, companion, size)
    whole = int(np.sum(np.diff(times) > step * (1 - 1e-9))) + 1
    n = min(len(spread), len(error), whole)
    found = agreement(times, distance(run, states, size)[:n], error[:n] + spread[:n], tolerance)
    # the model may end both runs, one of them just before a point
    if len(run) < whole - 1 and len(companion) >= len(run) and found.until >= times[len(run) - 1]:
        raise _failed(f"as Model Exchange it ends at time {found.until:g}, and the native run goes on")
    return found


def native_points(
    start: Start, method: str, count: int, end: float | None = None
) -> tuple[Array, float, Array]:
    """Return times, their spacing, and the states of the native run, made to stop at each of the times.

    ``end``: the last time; the stop without it. Where the model ends the run, that is the last time.
    """
    # output within steps would make the solver take shorter ones
    case = replace(start.case, grid=start.case.grid[:1])
    step = ((case.stop if end is None else end) - case.begin) / count
    times = [case.begin]
    for _ in range(count):
        times.append(times[-1] + step)
    kernel = native.load_kernel(True)
    # without events nothing happens at the start
    rows = [] if start.problem.hybrid else [case.y0.copy()]
    with Solver(
        kernel, case, method, case.tolerance, case.tolerance * start.nominal, case.step or 0.0
    ) as solver:
        for t in times[len(rows) :]:
            status = Status.RUNNING
            while status in (Status.RUNNING, Status.EVENTS_FULL):
                if status == Status.EVENTS_FULL:
                    solver.start_events(FIRST_EVENTS)
                status = solver.advance(t, 10000)
            if status not in (Status.REACHED, Status.TERMINATED):
                raise _failed(f"the native run it is compared with fails at time {solver.report()[0].t:g}")
            rows.append(solver.report()[1].copy())
            if status == Status.TERMINATED:
                times[len(rows) - 1 :] = [solver.report()[0].t]
                break
    return np.array(times), step, np.array(rows)

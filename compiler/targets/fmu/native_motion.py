"""The native run that an FMU is compared with: made to stop at each time of the comparison."""

from __future__ import annotations

import numpy as np
from msgspec.structs import replace

from mechc.lang.diagnostics import CompileError, Reporter
from mechc.runtime.case import Case, inputs_at
from mechc.runtime.integrate.event_log import MOST_AT_ONCE
from mechc.runtime.integrate.solver import Solver
from mechc.runtime.native import kernel as native
from mechc.runtime.native.status import Status
from mechc.runtime.problem import Array

from .agreement import FmuMotion
from .variables import Start


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
    # output within steps would make the solver take shorter ones
    case = replace(start.case, grid=start.case.grid[:1])
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
                    solver.grow_events(MOST_AT_ONCE)
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

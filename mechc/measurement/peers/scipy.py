"""Methods of SciPy, on compiled functions with nothing between: one evaluation is one call through ctypes into an array made before.

Events are scipy's own, located by its root finder on the dense output; what happens there is the unit's (exchange.py), after which
the run begins again, as it does where a step has left the constraints.
"""

from __future__ import annotations

import functools
import math
import time
import warnings
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from msgspec import Struct

from ...runtime.case import Case
from ...runtime.integrate.solver import SolverOptions
from ...runtime.integrate.trajectory import Statistics, Trajectory, with_unit_rotations
from ...runtime.native import contract
from ...runtime.outcome import Failure, given_up, step_too_small
from ...runtime.problem import Array
from .exchange import Exchange, ExchangeUnit, Stopped, exchanged
from .shared import Library, failure_of

if TYPE_CHECKING:
    from ...model import CompiledModel
    from ...runtime.reference.work_precision import Peer

PREFIX = "scipy:"
METHODS = ("DOP853", "RK45", "LSODA", "Radau", "BDF")
MULTI_STEP = ("LSODA", "BDF")
MOST_EVENTS = 10_000
EMPTY = np.empty(0)
LOOKS = 64
"""Evaluations between two looks at the clock."""

Rates = Callable[[float, Array], Array]


def run_peer(exchange: Exchange, case: Case, options: SolverOptions) -> Trajectory:
    """Run a case by ``scipy:NAME``; a grid of the start alone costs no dense output. ``run_time`` is CPU time.

    Of the options it takes method, tolerance, nominal values and seconds. Raises SimulationError if the problem is none
    for scipy.
    """
    assert (
        options.step is None and options.max_steps is None and options.progress is None and not options.dense
    )
    problem = case.problem
    multi_step = options.method.removeprefix(PREFIX) in MULTI_STEP
    unit = exchange.unit(case, options, multi_step=multi_step) if exchanged(case) else None
    import scipy.integrate  # noqa: F401, loading it is not a part of a run

    begun = time.thread_time()  # other work on the machine adds nothing
    watch = _Watch(begun + options.seconds) if options.seconds < math.inf else None
    try:
        found = _solve(case, options, watch, unit)
    except Stopped as stopped:
        found = _Run(EMPTY, np.empty((0, problem.ny)), 0, 0, failure_of(options, stopped.time, str(stopped)))
    except _TooLong as late:
        failure = given_up(problem, time.thread_time() - begun, late.evaluations, late.time, case.y0)
        found = _Run(EMPTY, np.empty((0, problem.ny)), 0, late.evaluations, failure)
    taken = time.thread_time() - begun
    return Trajectory(
        t=found.t,
        y=with_unit_rotations(problem.rotations, found.y),
        dense=None,
        statistics=Statistics(options.method, found.steps, None, found.evaluations, taken),
        failure=found.failure,
        interrupted=False,
    )


class _TooLong(Exception):
    """A run that was given up at ``time``; scipy lets it through, also from its compiled methods."""

    def __init__(self, time: float, evaluations: int) -> None:
        super().__init__(time, evaluations)
        self.time = time
        self.evaluations = evaluations


class _Watch(Struct):
    """Raises _TooLong at an evaluation after the deadline, in CPU time of the thread."""

    deadline: float
    evaluations: int = 0

    def over(self, rates: Rates) -> Rates:
        def watched(t: float, y: Array) -> Array:
            self.evaluations += 1
            if self.evaluations % LOOKS == 0 and time.thread_time() > self.deadline:
                raise _TooLong(t, self.evaluations)
            return rates(t, y)

        return watched


class _Run(Struct, frozen=True):
    t: Array
    y: Array
    steps: int
    evaluations: int
    failure: Failure | None


class _Steps(Struct):
    """What solve_ivp does not tell where a grid is asked for: the steps, and where the last one ended. ``wanted``: there the unit
    wants to be told, and the run begins again."""

    count: int = 0
    t: float = math.nan
    y: Array = EMPTY
    size: float = 0.0
    wanted: bool = False


def _solve(case: Case, options: SolverOptions, watch: _Watch | None, unit: ExchangeUnit | None) -> _Run:
    from scipy.integrate import solve_ivp

    problem = case.problem
    rates = _rates(case) if unit is None else _rates_of(unit)
    if watch is not None:
        rates = watch.over(rates)
    t, y = case.begin, case.y0 if unit is None else unit.y
    steps, first_step, n_events = _Steps(), None, 0
    of_scipy: dict[str, Any] = {
        "method": _stepping(options.method.removeprefix(PREFIX), steps, unit),
        # scipy raises lower ones itself, with a warning
        "rtol": max(options.tolerance, 100 * np.finfo(float).eps),
        "atol": options.atol,
        "events": None if unit is None else _events(unit),
        # it looks at events at the ends of steps alone
        "max_step": math.inf if unit is None else case.max_step,
    }
    times, rows, evaluations = [], [], 0
    failure = None
    grid = case.grid.size > 1
    with np.errstate(all="ignore"), warnings.catch_warnings(action="ignore"):  # its failures are told
        while t < case.stop and not (unit is not None and unit.ended):
            end = case.stop if unit is None else unit.next
            here = case.grid[(case.grid >= t) & (case.grid <= end)]
            steps.wanted = False
            found = solve_ivp(
                rates, (t, end), y, t_eval=here if grid else None, first_step=first_step, **of_scipy
            )
            evaluations += found.nfev
            if grid and len(found.t):
                times.append(found.t)
                rows.append(found.y.T)
            if found.status < 0:
                failure = step_too_small(problem, 0, float(found.t[-1]) if len(found.t) else t, y)
                break
            if unit is None:
                break
            t, y, first_step = steps.t, steps.y, None
            if found.status == 1:
                k = next(k for k, at in enumerate(found.t_events) if at.size)
                t, y = float(found.t_events[k][0]), found.y_events[k][0]
                n_events += 1
            elif steps.wanted:
                first_step = min(steps.size, 0.5 * (unit.next - t)) or None
            if t >= case.stop:
                break
            y = unit.happen(t, y)
            if n_events > MOST_EVENTS:
                failure = step_too_small(problem, 0, t, y)
                break
    t_rows, y_rows = np.concatenate([np.empty(0), *times]), np.concatenate([np.empty((0, problem.ny)), *rows])
    _, first = np.unique(t_rows, return_index=True)
    return _Run(t_rows[first], y_rows[first], steps.count, evaluations, failure)


def _stepping(method: str, steps: _Steps, unit: ExchangeUnit | None) -> type:
    """Return a method of scipy that notes its steps, and ends where the unit wants to be told."""
    import scipy.integrate

    class Stepping(getattr(scipy.integrate, method)):  # type: ignore[misc]
        def step(self) -> str | None:
            message: str | None = super().step()
            steps.count += 1
            steps.t, steps.y, steps.size = self.t, self.y, self.step_size or 0.0
            going_on = getattr(self, "status", "") == "running"
            if unit is not None and going_on and unit.completed(self.t, self.y):
                steps.wanted, self.status = True, "finished"
            return message

    return Stepping


def _events(unit: ExchangeUnit) -> list[Callable[..., float]] | None:
    """Return one terminal event for each indicator of a unit; those of one place are asked for together."""
    known: dict[str, Any] = {"t": math.nan, "y": EMPTY}
    values = np.empty(unit.count)
    call, address = unit.library.peer_unit_indicators, unit.address

    def look(t: float, y: Array) -> None:
        if t != known["t"] or y is not known["y"]:
            known["t"], known["y"] = t, y
            state = np.ascontiguousarray(y)
            if call(t, state.ctypes.data, values.ctypes.data, address):
                values[:] = math.nan

    def event(k: int) -> Callable[..., float]:
        def indicator(t: float, y: Array) -> float:
            look(t, y)
            return float(values[k])

        indicator.terminal, indicator.direction = True, -1.0  # type: ignore[attr-defined]
        return indicator

    return [event(k) for k in range(unit.count)] or None


def _rates_of(unit: ExchangeUnit) -> Rates:
    """Return dy/dt of a unit for scipy, called through ctypes into an array made before."""
    call, address = unit.library.peer_unit_rates, unit.address
    state, out = np.empty(unit.y.size), np.empty(unit.y.size)
    places = (state.ctypes.data, out.ctypes.data, address)

    def rates(t: float, y: Array) -> Array:
        state[:] = y
        if call(t, *places):
            out[:] = math.nan
        return out.copy()  # scipy keeps what it is given

    return rates


def _rates(case: Case) -> Rates:
    """Return dy/dt for scipy, called through ctypes into an array made before."""
    call = contract.MODEL_FUNCTION(case.functions.struct.rhs)
    ny = case.problem.ny
    state, out, nothing = np.empty(ny), np.empty(ny), np.empty(0)
    places = (state.ctypes.data, nothing.ctypes.data, case.z.ctypes.data, case.p.ctypes.data, out.ctypes.data)

    def rates(t: float, y: Array) -> Array:
        state[:] = y
        call(t, *places)
        return out.copy()  # scipy keeps what it is given

    return rates


def _runs(model: CompiledModel, _parts: frozenset[str]) -> Mapping[str, Peer]:
    run = functools.partial(run_peer, Exchange(model))
    return {PREFIX + name: run for name in METHODS}


SCIPY = Library(
    "scipy",
    "scipy",
    "solve_ivp on compiled functions, one ctypes call for each evaluation",
    _runs,
    by_unit="its own event location; a run begins again after an event, and where a step has left the constraints",
)

"""Methods of SciPy, on compiled functions with nothing between: one evaluation is one call through ctypes into an array made before.

 Constraints are those of the accelerations alone (index 1): scipy has no other form.
Events are scipy's own: located by its root finder on the dense output, after which the run begins again.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from ...runtime.case import Case
from ...runtime.integrate.solver_options import SolverOptions
from ...runtime.integrate.trajectory import Statistics, Trajectory, with_unit_rotations
from ...runtime.native import contract
from ...runtime.outcome import Failure, SimulationError, given_up, step_too_small
from ...runtime.problem import Array
from .shared import Library, hybrid_of, peer_lacks

if TYPE_CHECKING:
    from ...model import CompiledModel
    from ...runtime.reference.work_precision import Peer

PREFIX = "scipy:"
METHODS = ("DOP853", "RK45", "LSODA", "Radau", "BDF")
MOST_EVENTS = 10_000
AHEAD = 1e-9
"""Part of the run by which one looks ahead after an event."""
LOOKS = 64
"""Evaluations between two looks at the clock."""

Rates = Callable[[float, Array], Array]


def run_peer(case: Case, options: SolverOptions) -> Trajectory:
    """Run a case by ``scipy:NAME``; a grid of the start alone costs no dense output. ``run_time`` is CPU time.

    Of the options it takes method, tolerance, nominal values and seconds. Raises SimulationError if the problem is none
    for scipy.
    """
    assert (
        options.step is None and options.max_steps is None and options.progress is None and not options.dense
    )
    problem = case.problem
    lacks = peer_lacks(problem, case.functions)
    if lacks:
        raise SimulationError(f"'{options.method}' {lacks}")
    import scipy.integrate  # noqa: F401, loading it is no part of a run

    begun = time.thread_time()  # other work on the machine adds nothing
    watch = _Watch(begun + options.seconds) if options.seconds < math.inf else None
    try:
        found = _solve(case, options, watch)
    except _TooLong as late:
        failure = given_up(problem, time.thread_time() - begun, late.evaluations, late.time, case.y0)
        found = _Run(np.empty(0), np.empty((0, problem.ny)), 0, late.evaluations, failure)
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


def _solve(
    case: Case,
    options: SolverOptions,
    watch: _Watch | None,
) -> _Run:
    from scipy.integrate import solve_ivp

    problem = case.problem
    case = replace(case, z=case.z.copy())
    rates = _rates(case)
    if watch is not None:
        rates = watch.over(rates)
    watched = _Events(case) if problem.hybrid is not None else None
    t, y = case.begin, case.y0
    if watched is not None:
        y = watched.happen(t, y)
    counter = [0]
    of_scipy: dict[str, Any] = {
        "method": _counting(options.method.removeprefix(PREFIX), counter),
        # scipy raises lower ones itself, with a warning
        "rtol": max(options.tolerance, 100 * np.finfo(float).eps),
        "atol": options.atol,
    }
    times, rows, evaluations = [], [], 0
    failure = None
    grid = case.grid.size > 1
    with np.errstate(all="ignore"):
        while t < case.stop:
            here = case.grid[(case.grid >= t) & (case.grid <= case.stop)]
            found = solve_ivp(
                rates,
                (t, case.stop),
                y,
                t_eval=here if grid else None,
                events=watched.functions() if watched is not None else None,
                **of_scipy,
            )
            evaluations += found.nfev
            if grid and len(found.t):
                times.append(found.t)
                rows.append(found.y.T)
            if found.status < 0:
                failure = step_too_small(problem, 0, float(found.t[-1]) if len(found.t) else t, y)
            if found.status != 1:
                break
            assert watched is not None
            k = next(k for k, at in enumerate(found.t_events) if at.size)
            t, y = float(found.t_events[k][0]), found.y_events[k][0]
            watched.cross(k)
            y = watched.happen(t, y)
            watched.count += 1
            if watched.count > MOST_EVENTS:
                failure = step_too_small(problem, 0, t, y)
                break
    t_rows, y_rows = np.concatenate([np.empty(0), *times]), np.concatenate([np.empty((0, problem.ny)), *rows])
    _, first = np.unique(t_rows, return_index=True)
    return _Run(t_rows[first], y_rows[first], counter[0], evaluations, failure)


def _counting(method: str, counter: list[int]) -> type:
    """Return a method of scipy that counts its steps: solve_ivp tells them only where no grid is asked for."""
    import scipy.integrate

    class Counting(getattr(scipy.integrate, method)):  # type: ignore[misc]
        def step(self) -> str | None:
            counter[0] += 1
            message: str | None = super().step()
            return message

    return Counting


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


class _Events:
    """Located switches and branches of a model, by what its code offers the kernel (``mech_hybrid``)."""

    def __init__(self, case: Case) -> None:
        problem, functions = case.problem, case.functions
        assert problem.hybrid is not None
        hybrid = hybrid_of(functions)
        self._struct = hybrid
        self._case = case
        self._ny, self._nz = problem.ny, case.z.size
        self._size = hybrid.n_switches
        self._checks = [len(branch.checks) for branch in problem.hybrid.branches]
        self._held = np.zeros(len(self._checks), bool)
        self.count = 0
        self._rhs = functions.struct.rhs
        self._settle(case.begin, case.y0)

    def _call(self, address: int | None, size: int, t: float, y: Array) -> Array:
        out, y, nothing = np.empty(size), np.ascontiguousarray(y), np.empty(0)
        if address:
            contract.MODEL_FUNCTION(address)(
                t, *(a.ctypes.data for a in (y, nothing, self._case.z, self._case.p, out))
            )
        return out

    def _settle(self, t: float, y: Array) -> None:
        """Put every switch on the side where the motion goes: at an event a gap is zero up to rounding."""
        ahead = AHEAD * (self._case.stop - self._case.begin)
        y = y + ahead * self._call(self._rhs, self._ny, t, y)
        gaps = self._call(self._struct.indicators, self._size, t + ahead, y)
        for k in range(self._size):
            self._case.z[self._struct.switches[k]] = float(gaps[k] < 0)

    def functions(self) -> list[Callable[..., float]]:
        """Return one terminal event for each switch, that stops where the switch leaves its side."""
        made = []
        for k in range(self._size):
            on = self._case.z[self._struct.switches[k]] > 0.5

            def gap(t: float, y: Array, k: int = k) -> float:
                return float(self._call(self._struct.indicators, self._size, t, y)[k])

            gap.terminal = True  # type: ignore[attr-defined]
            gap.direction = 1.0 if on else -1.0  # type: ignore[attr-defined]
            made.append(gap)
        return made

    def cross(self, k: int) -> None:
        index = self._struct.switches[k]
        self._case.z[index] = 1.0 - self._case.z[index]

    def happen(self, t: float, y: Array) -> Array:
        """Carry out the branches whose condition has become true, until none is left."""
        hybrid = self._struct
        for _ in range(MOST_EVENTS):
            holds = self._call(hybrid.conditions, len(self._checks), t, y) > 0.5
            rising = np.flatnonzero(holds & ~self._held)
            self._held = holds
            if not rising.size:
                return y
            for k in map(int, rising):
                size = self._ny + self._nz + self._checks[k]
                acted = self._call(hybrid.branches[k].act, size, t, y)
                y = acted[: self._ny].copy()
                self._case.z[:] = acted[self._ny : self._ny + self._nz]
            self._settle(t, y)
        raise SimulationError("the events of an instant do not end")


def _runs(_model: CompiledModel, _parts: frozenset[str]) -> Mapping[str, Peer]:
    return {PREFIX + name: run_peer for name in METHODS}


SCIPY = Library(
    "scipy", "scipy", "solve_ivp on compiled functions, one ctypes call for each evaluation", _runs
)

"""The small reference: a run by scipy's methods, or by rk4 in Python, on the functions of a problem.

It needs no C compiler, gives the same trajectory and statistics as the kernel, and is what tests compare the
kernel with. scipy is imported on first use.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
from msgspec import Struct

from ..case import Case, inputs_at
from ..outcome import Failure, assertion_failed, given_up, not_finite, step_too_small, too_many_steps
from ..problem import Array
from .interruption import NotedInterruptions
from .solver_options import SolverOptions
from .trajectory import Reader, Statistics, Trajectory, with_last_point, with_unit_rotations

PREFIX = "scipy:"
SLICE_SECONDS = 0.05
METHODS = ("DOP853", "LSODA", "Radau", "BDF")


class _System(Struct):
    """dy/dt with inputs, of unit quaternions, counted; the last undefined value is remembered.

    A table is held on the piece that begins at ``piece``: within a step it must not jump.
    """

    case: Case
    evaluations: int = 0
    piece: tuple[float, float] = (0.0, 0.0)
    undefined: tuple[int, float] | None = None

    def rhs(self, t: float, y: Array) -> Array:
        norms = [float(np.linalg.norm(y[i : i + 4])) for i in self.case.problem.rotations]
        dy = self.case.functions.rhs(t, self.normalised(y), self.inputs(t), self.case.z, self.case.p).copy()
        for index, norm in zip(self.case.problem.rotations, norms, strict=True):
            dy[index : index + 4] *= norm  # linear in the quaternion, so its direction is exact
        self.evaluations += 1
        if not np.isfinite(dy).all():
            index = int(np.argmin(np.isfinite(dy)))
            self.undefined = (index, float(dy[index]))
        return dy

    def inputs(self, t: float) -> Array:
        begin, end = self.piece
        inside = min(max(t, begin), np.nextafter(end, begin))  # step tables jump at the end of a piece
        return inputs_at(self.case, inside)

    def normalised(self, y: Array) -> Array:
        return with_unit_rotations(self.case.problem.rotations, y)

    def failed_assertion(self, t: float, y: Array) -> Failure | None:
        if self.case.functions.assertions is None:
            return None
        u = inputs_at(self.case, t)
        holds = self.case.functions.assertions(t, self.normalised(y), u, self.case.z, self.case.p) > 0.5
        if holds.all():
            return None
        return assertion_failed(self.case.problem, int(np.argmin(holds)), t, self.normalised(y))


Polynomial = Callable[[Array], Array]
"""times [n] -> states [ny, n]"""


class _Pieces(Struct, frozen=True):
    """Dense output of all steps; ``ends`` are their last times."""

    ends: Array
    polynomials: tuple[Polynomial, ...]

    def __call__(self, t: Array) -> Array:
        step = np.clip(np.searchsorted(self.ends, t, side="left"), 0, self.ends.size - 1)
        values = [self.polynomials[k](t[step == k]) for k in np.unique(step)]
        order = np.argsort(np.argsort(step, kind="stable"), kind="stable")
        rows: Array = np.concatenate(values, axis=1).T[order]
        return rows


class _Rows:
    """The states on the output grid, filled step by step, and the polynomials if they are to be kept."""

    def __init__(self, case: Case, keep: bool) -> None:
        self._times = case.grid
        self._states = np.tile(case.y0, (case.grid.size, 1))
        self._done = int(np.searchsorted(case.grid, case.begin, side="right"))
        self._keep = keep
        self._ends: list[float] = []
        self._polynomials: list[Polynomial] = []

    def take(self, solver: Any) -> None:
        """Fill the rows that the last step passed."""
        reached = int(np.searchsorted(self._times, solver.t, side="right"))
        if not self._keep and reached == self._done:
            return
        polynomial = solver.dense_output()
        if reached > self._done:
            self._states[self._done : reached] = polynomial(self._times[self._done : reached]).T
            self._done = reached
        if self._keep:
            self._ends.append(float(solver.t))
            self._polynomials.append(polynomial)

    def grid(self) -> tuple[Array, Array]:
        return self._times[: self._done], self._states[: self._done]

    def pieces(self) -> _Pieces | None:
        return _Pieces(np.array(self._ends), tuple(self._polynomials)) if self._ends else None


def run_scipy(case: Case, options: SolverOptions, reader: Reader | None = None) -> Trajectory:
    """Run ``case`` by "rk4" or "scipy:NAME"; a ``reader`` reads the rows."""
    system = _System(case)
    stops = np.unique(np.concatenate([[case.stop], *(table.kinks() for table in case.tables.values())]))
    ends = [float(t) for t in stops if case.begin < t <= case.stop]
    make = _maker(system, options)
    rows = _Rows(case, keep=options.dense)
    t, y, steps = case.begin, case.y0, 0
    shortest, longest = np.inf, 0.0
    failure = _first_failure(system, t, y, ends[0] if ends else t)
    begun = told = time.perf_counter()
    with NotedInterruptions(options.interrupted) as interrupted, np.errstate(all="ignore"):
        for end in ends:
            if failure or interrupted():
                break
            system.piece = (t, end)
            solver = make(t, y, end)
            while solver.status == "running" and not failure and not interrupted():
                failure = _step(system, solver)
                if failure:
                    break
                steps += 1
                t, y = float(solver.t), solver.y
                rows.take(solver)
                taken = t - float(solver.t_old)
                shortest, longest = min(shortest, taken), max(longest, taken)
                failure = system.failed_assertion(t, y)
                if t < case.stop and not failure:
                    failure = _given_up(system, options, t, y, steps, time.perf_counter() - begun)
                if options.progress is not None and time.perf_counter() - told > SLICE_SECONDS:
                    options.progress((t - case.begin) / (case.stop - case.begin))
                    told = time.perf_counter()
        stopped = interrupted() and not failure
    seconds = time.perf_counter() - begun
    times, states = rows.grid()
    if failure or stopped:
        times, states = with_last_point(times, states, t, y)
    states = system.normalised(states)
    if reader is not None:
        reader.read(0, times, states, None)
    return Trajectory(
        t=times,
        y=states,
        dense=rows.pieces() if options.dense else None,
        statistics=Statistics(
            method=options.method,
            steps=steps,
            rejected=None,
            evaluations=system.evaluations,
            run_time=seconds,
            shortest_step=float(shortest) if steps else None,
            longest_step=longest if steps else None,
        ),
        failure=failure,
        interrupted=stopped,
    )


def _given_up(
    system: _System, options: SolverOptions, t: float, y: Array, steps: int, seconds: float
) -> Failure | None:
    if options.max_steps is not None and steps >= options.max_steps:
        return too_many_steps(system.case.problem, options.max_steps, t, system.normalised(y))
    if seconds > options.seconds:
        return given_up(system.case.problem, seconds, system.evaluations, t, system.normalised(y))
    return None


def _first_failure(system: _System, t: float, y: Array, end: float) -> Failure | None:
    system.piece = (t, end)
    system.rhs(t, y)
    if system.undefined is not None:
        return not_finite(system.case.problem, *system.undefined, t, y)
    return system.failed_assertion(t, y)


def _step(system: _System, solver: Any) -> Failure | None:
    """Take one step. scipy meets an undefined value by ever smaller steps, or by an error of its algebra."""
    t, y = float(solver.t), system.normalised(solver.y)
    system.undefined = None
    try:
        solver.step()
        failed = solver.status == "failed"
    except (ValueError, np.linalg.LinAlgError):
        if system.undefined is None:
            raise
        failed = True
    if failed and system.undefined is not None:
        return not_finite(system.case.problem, *system.undefined, t, y)
    if failed:
        return step_too_small(system.case.problem, int(np.argmax(np.abs(system.rhs(t, y)))), t, y)
    return None


def _maker(system: _System, options: SolverOptions) -> Callable[[float, Array, float], Any]:
    """Give what makes a solver from time, state and end."""
    if options.method == "rk4":
        return lambda t, y, end: _FixedStep(system.rhs, t, y, end, options.step or 0.0)
    import scipy.integrate

    make = getattr(scipy.integrate, options.method.removeprefix(PREFIX))
    # Below 100 units in the last place scipy raises rtol itself, with a warning.
    rtol = max(options.tolerance, 100 * np.finfo(float).eps)
    return lambda t, y, end: make(
        system.rhs, t, y, end, rtol=rtol, atol=options.atol, max_step=system.case.max_step
    )


class _FixedStep:
    """The classical Runge-Kutta method with the interface of ``scipy.integrate.OdeSolver``."""

    def __init__(
        self, f: Callable[[float, Array], Array], t: float, y: Array, end: float, step: float
    ) -> None:
        self.status = "running"
        self.t = self.t_old = self._origin = t
        self.y, self._f, self._end, self._step = y, f, end, step
        self._count = 0
        self._dy = f(t, y)

    def step(self) -> None:
        self._count += 1
        goal = self._origin + self._count * self._step
        self.t_old = t = self.t
        self.t = self._end if goal + 1e-6 * self._step >= self._end else goal
        h, f, y = self.t - t, self._f, self.y
        k1 = self._dy
        k2 = f(t + h / 2, y + h / 2 * k1)
        k3 = f(t + h / 2, y + h / 2 * k2)
        k4 = f(self.t, y + h * k3)
        self._y_old, self._dy_old = y, k1
        self.y = y + h / 6 * (k1 + 2 * (k2 + k3) + k4)
        self._dy = f(self.t, self.y)
        if not np.isfinite(self._dy).all():
            self.status = "failed"
            self.t = t
        elif self.t == self._end:
            self.status = "finished"

    def dense_output(self) -> Callable[[Array], Array]:
        t, h, y0, y1, f0, f1 = self.t_old, self.t - self.t_old, self._y_old, self.y, self._dy_old, self._dy

        def cubic(at: Array) -> Array:
            s = (np.atleast_1d(at) - t) / h
            r, d = 1 - s, (y1 - y0)[:, None]
            b = h * f0[:, None] - d
            value: Array = y0[:, None] + s * (d + r * (b + s * (d - h * f1[:, None] - b)))
            return value

        return cubic

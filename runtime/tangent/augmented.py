"""The motion with its derivatives as a case of its own: y and W in one state, integrated and error-controlled together."""

from __future__ import annotations

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from ..case import Case, input_values
from ..functions import Functions, load_functions, named_function
from ..integrate.choose_method import Method
from ..integrate.kernel_run import run_kernel
from ..integrate.solver import SolverOptions
from ..integrate.trajectory import Trajectory
from ..outcome import SimulationError
from ..problem import Array, Directions, ModelFunction, Problem

MOST = 40_000
"""Numbers in the state of the motion and its derivatives."""

BEHIND = 1e-2
"""Tolerances, of the time to go: where a motion begins that leaves a state at which a formula has no derivative."""


class Augmented(Struct, frozen=True, eq=False):
    """A case and the problem of its motion with k derivatives. ``p`` and ``z``: those of that problem at the start."""

    case: Case
    directions: Directions
    problem: Problem
    functions: Functions
    p: Array

    @property
    def count(self) -> int:
        return self.directions.count

    @property
    def reals(self) -> list[int]:
        """The discrete variables that have derivatives: the real ones."""
        own = self.case.problem.discretes
        listed = self.problem.discretes[len(own) :]
        return [k for k, q in enumerate(own) if any(d.name.startswith(f"d({q.name})/d(") for d in listed)]

    def split(self, rows: Array, size: int) -> tuple[Array, Array]:
        """Give values [..., size] and derivatives [..., size, k] from rows of both."""
        parts = rows.reshape(*rows.shape[:-1], self.count + 1, size)
        return parts[..., 0, :], np.moveaxis(parts[..., 1:, :], -2, -1)

    def joined(self, y: Array, w: Array) -> Array:
        """Give y [n] and W [n, k] as one row."""
        return np.concatenate([y, w.T.ravel()])

    def discretes(self, z: Array, dz: Array | None = None) -> Array:
        """Give z of this problem between events: discrete variables and their derivatives [real ones, k]."""
        rest = np.zeros(len(self.problem.discretes) - z.size)
        if dz is not None:
            rest[: dz.size] = dz.T.ravel()
        return np.concatenate([z, rest])

    def discretes_at_event(self, z: Array, dz: Array, t: float, dt: Array) -> Array:
        """Give z of this problem at an event: with the derivatives dt [k] of its time, and the rates of inputs there."""
        rates = [self.case.tables[i].rate(t) for i in self.directions.tables]
        row = self.discretes(z, dz)
        row[row.size - self.count - len(rates) :] = [*dt, *rates]
        return row

    def function(self, name: str, size: int) -> ModelFunction:
        """Give a function of the tangent by its name, with ``size`` results for each direction."""
        return named_function(self.problem, self.functions, name, size * self.count)

    def inputs(self, t: float) -> Array:
        return input_values(self.functions, self.case.tables, t, self.p, len(self.problem.inputs))

    def run(
        self,
        method: Method,
        tolerance: float,
        nominal: Array,
        begin: float,
        y: Array,
        z: Array,
        grid: Array,
        max_steps: int | None = None,
    ) -> Trajectory:
        """Integrate from ``begin`` over the times of ``grid`` [n]. ``y``: state and derivatives, ``nominal`` their sizes."""
        first, began = begin, y
        begin, y = self.behind(begin, y, z, float(grid[-1]), tolerance)
        early, grid = grid[grid < begin], grid[grid >= begin]
        if not grid.size:
            begin, y, early, grid = first, began, grid, early
        case = replace(
            self.case,
            problem=self.problem,
            functions=self.functions,
            p=self.p,
            z=z,
            y0=y,
            known=np.ones(y.size, dtype=bool),
            wanted=y,
            assembled=None,
            begin=begin,
            stop=float(grid[-1]),
            grid=grid,
        )
        step = case.step if method.fixed_step else None
        found = run_kernel(case, SolverOptions(method.name, tolerance, nominal, step, max_steps=max_steps))
        if not early.size:
            return found
        states = np.concatenate([np.tile(began, (early.size, 1)), found.y])
        return replace(found, t=np.concatenate([early, found.t]), y=states)

    def behind(self, t: float, y: Array, z: Array, until: float, tolerance: float) -> tuple[float, Array]:
        """Give a time and state with derivatives at which rates are numbers: just after (t, y) where a formula has no
        derivative there, as |v| v at rest, and the motion leaves that at once; the derivatives are as at t."""
        rates = self.functions.rhs(t, y, self.inputs(t), z, self.p)
        size = self.case.problem.ny
        if np.isfinite(rates).all() or not np.isfinite(rates[:size]).all():
            return t, y
        dt = BEHIND * tolerance * (until - t)
        moved = y.copy()
        moved[:size] += dt * rates[:size]
        there = self.functions.rhs(t + dt, moved, self.inputs(t + dt), z, self.p)
        return (t + dt, moved) if t + dt > t and np.isfinite(there).all() else (t, y)


def augment(case: Case, directions: Directions) -> Augmented:
    """Make the problem of a motion with its derivatives. Raises SimulationError where that cannot be made."""
    problem = case.problem
    if problem.tangents is None:
        raise SimulationError(
            f"the functions of '{problem.name}' were not made by the compiler, which alone differentiates them"
        )
    if problem.found:
        names = ", ".join(f"'{problem.parameters[k].name}'" for k in problem.found)
        raise SimulationError(
            f"the start of '{problem.name}' finds {names}, which changes with everything: such a motion has no derivatives yet",
            help="write the value that a run tells in the model, with '='",
        )
    size = problem.ny * (1 + directions.count)
    if size > MOST:
        raise SimulationError(
            f"{directions.count} derivatives of {problem.ny} states are {size} numbers, more than {MOST}",
            help="ask for fewer directions at once",
        )
    found = problem.tangents(directions)
    functions = load_functions(found)
    count = len(problem.parameters)
    p = np.concatenate([case.p[:count], np.full(found.nh, np.nan)])
    functions.parameters(p, np.ones(count, dtype=np.uint8))
    return Augmented(case, directions, found, functions, p)

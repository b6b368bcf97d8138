"""Derivatives of motions by extrapolated differences of precise runs, which share nothing with the tangent flow."""

from __future__ import annotations

import numpy as np
from msgspec.structs import replace

from mechc.runtime.case import SimulationOptions, inputs_at
from mechc.runtime.integrate.kernel_run import run_kernel
from mechc.runtime.integrate.solver import SolverOptions
from mechc.runtime.problem import Array, Problem
from mechc.runtime.studies.runs.simulate import Plan, plan_run


def differences(
    problem: Problem, options: SimulationOptions, name: str, step: float = 2e-3, levels: int = 4
) -> Array:
    """Extrapolated central differences [n, ny] at the output times, of runs at the tightest tolerance.

    ``step``: the longest, over the size of the value; it is halved from ``level`` to level (Richardson).
    """
    return with_uncertainty(problem, options, name, step, levels)[0]


def with_uncertainty(
    problem: Problem, options: SimulationOptions, name: str, step: float = 2e-3, levels: int = 4
) -> tuple[Array, float]:
    """The same, and twice the largest change that the last halving of the step makes."""
    plan, value = plan_run(problem, options), value_of(problem, options, name)
    table: list[list[Array]] = []
    for level in range(levels):
        h = (abs(value) or 1.0) * step / 2**level
        above, below = (_run(problem, options, plan, name, there) for there in (value + h, value - h))
        row = [(above - below) / (2 * h)]
        for m, before in enumerate(table[-1] if table else []):
            row.append(row[m] + (row[m] - before) / (4.0 ** (m + 1) - 1))
        table.append(row)
    return table[-1][-1], 2 * float(np.abs(table[-1][-1] - table[-2][-1]).max())


def one_sided(problem: Problem, options: SimulationOptions, name: str, step: float) -> Array:
    """Differences [2, ny] of the last state to one side and to the other, of the first order."""
    plan, value = plan_run(problem, options), value_of(problem, options, name)
    here = _run(problem, options, plan, name, value)[-1]
    h = (abs(value) or 1.0) * step
    return np.array([(_run(problem, options, plan, name, value + d)[-1] - here) / d for d in (h, -h)])


def value_of(problem: Problem, options: SimulationOptions, name: str) -> float:
    """The value of a parameter, of a stated initial value, or of an input at the start."""
    case = plan_run(problem, options).case
    known = {q.name: v for q, v in zip(problem.parameters, case.p, strict=False)}
    known |= {q.name: v for q, v in zip(problem.states, case.wanted, strict=True)}
    known |= {q.name: v for q, v in zip(problem.inputs, inputs_at(case, case.begin), strict=True)}
    return float(known[name])


def _run(problem: Problem, options: SimulationOptions, plan: Plan, name: str, value: float) -> Array:
    """States [n, ny] at the times of a plan, with another value."""
    case = plan_run(problem, replace(options, values={**options.values, name: value})).case
    precise = SolverOptions("dop853", 1e-14, plan.nominal)
    return run_kernel(replace(case, stop=plan.case.stop, grid=plan.case.grid), precise).y

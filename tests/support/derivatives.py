"""Derivatives of motions by extrapolated differences of precise runs, which share nothing with the tangent flow."""

from __future__ import annotations

import numpy as np
from msgspec.structs import replace

from mechc.runtime.case import SimulationOptions
from mechc.runtime.integrate.kernel_run import run_kernel
from mechc.runtime.integrate.solver_options import SolverOptions
from mechc.runtime.problem import Array, Problem
from mechc.runtime.studies.runs.simulate import plan_run


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
    plan = plan_run(problem, options)
    known = {q.name: v for q, v in zip(problem.parameters, plan.case.p, strict=False)}
    known |= {q.name: v for q, v in zip(problem.states, plan.case.wanted, strict=True)}
    value = float(known[name])
    table: list[list[Array]] = []
    for level in range(levels):
        h = (abs(value) or 1.0) * step / 2**level
        sides = []
        for there in (value + h, value - h):
            case = plan_run(problem, replace(options, values={**options.values, name: there})).case
            precise = SolverOptions("dop853", 1e-14, plan.nominal)
            sides.append(run_kernel(replace(case, stop=plan.case.stop, grid=plan.case.grid), precise).y)
        row = [(sides[0] - sides[1]) / (2 * h)]
        for m, before in enumerate(table[-1] if table else []):
            row.append(row[m] + (row[m] - before) / (4.0 ** (m + 1) - 1))
        table.append(row)
    return table[-1][-1], 2 * float(np.abs(table[-1][-1] - table[-2][-1]).max())

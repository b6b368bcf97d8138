"""A run with the derivatives of its motion, or with the growth of small changes of its start."""

from __future__ import annotations

import numpy as np
from msgspec.structs import replace

from ...outcome import ENDED, SimulationError
from ...problem import Array
from ...results.condition import condition_of
from ...results.sensitivity import Sensitivities
from ...results.solution import Solution
from ...tangent.coordinates import basis
from ...tangent.flow import Tangents
from .companion import Plan


def with_sensitivities(
    solution: Solution, tangents: Tangents, start: Array, *, estimate_error: bool = True
) -> Solution:
    """Differentiate the motion of a run at its times. ``start`` [ny, k]: the derivatives where it begins.

    The motion is integrated once more together with its derivatives, and again at a tighter tolerance for their errors.
    """
    problem, case, times = solution.problem, tangents.case, solution.time
    if not times.size:
        return solution
    grid = times if problem.hybrid is None else case.grid[case.grid <= times[-1]]
    if problem.hybrid is not None and (not grid.size or grid[-1] < times[-1]):
        # Where a branch ended the run; a little later, as the run with derivatives meets it at a time that is rounded otherwise.
        grid = np.append(grid, times[-1] + 1e-6 * (times[-1] - case.begin))
    flow = tangents.flow(case.begin, case.y0, start, grid, both_sides=True)
    tighter = tangents.tighter() if estimate_error else None
    second = tighter.flow(case.begin, case.y0, start, grid, both_sides=True) if tighter else None
    names = [q.name for q in (*problem.states, *problem.outputs)]
    shown = {name: i for i, name in enumerate(names) if not name.startswith("exact(")}
    table = np.full((times.size, len(names), len(tangents.directions)), np.nan)
    found = np.concatenate([flow.tangents, flow.output_tangents], axis=1)
    if not np.allclose(flow.time, times[: flow.time.size], rtol=1e-6):
        raise SimulationError(
            "the run with derivatives met other events than the run alone, so it is not differentiated"
        )
    table[: len(found)] = found
    errors, remark = None, "no second run was asked for"
    if flow.failure is not None:
        remark = f"the motion could not be differentiated to its end: {flow.failure.message}"
    elif second is not None and second.failure is not None:
        remark = f"the second run failed: {second.failure.message}"
    elif second is not None and second.time.size != flow.time.size:
        remark = "the second run met other events"
    elif second is not None:
        other = np.concatenate([second.tangents, second.output_tangents], axis=1)
        errors = {name: np.abs(table - other)[:, i] for name, i in shown.items()}
        remark = ""
    made = Sensitivities(
        to=tuple(d.name for d in tangents.directions),
        columns={name: table[:, i] for name, i in shown.items()},
        units={name: flow.units[i] for name, i in shown.items()},
        errors=errors,
        remark=remark,
    )
    remarks = (*solution.motion.judged().remarks, *flow.remarks)
    return type(solution)(replace(solution.motion.told(remarks=remarks), sensitivities=made))


MOST = 200
"""Times at which growth is told."""


def with_condition(solution: Solution, plan: Plan) -> Solution:
    """Carry all small changes of the start along the motion once more, and tell the norm of what became of them.

    Raises SimulationError where the motion has no derivatives.
    """
    case, problem = plan.case, plan.case.problem
    if solution.outcome not in ENDED:
        solution.add_remark("how errors grow was not looked at, as the run did not reach its end")
        return solution
    ended = float(solution.time[-1]) if solution.time.size else case.begin
    if not ended > case.begin:
        raise SimulationError("a motion that ends where it begins has no growth of errors")
    moving = np.array([q.kind != "account" for q in problem.states])
    directions = basis(problem, case.y0)[moving]
    free = np.flatnonzero(np.abs(directions).max(axis=0, initial=0.0) > 0)
    sizes = 1 / np.linalg.norm(directions[:, free] / plan.nominal[moving, None], axis=0)
    initial = np.zeros((2 * problem.nv + problem.nx, free.size))
    initial[free, np.arange(free.size)] = sizes
    tangents = Tangents(case, plan.method, plan.nominal, (), free.size)
    grid = np.unique(np.linspace(case.begin, ended, MOST))
    flow = tangents.flow(case.begin, case.y0, tangents.start(initial), grid)
    growth = np.array([_norm(w[moving] / plan.nominal[moving, None]) for w in flow.tangents])
    found = condition_of(flow.time, growth, case.tolerance)
    remarks = (*solution.motion.judged().remarks, *flow.remarks)
    if flow.failure is not None:
        remarks = (*remarks, f"the growth of errors is told up to its end only: {flow.failure.message}")
    return type(solution)(replace(solution.motion.told(remarks=remarks), condition=found))


def _norm(w: Array) -> float:
    return float(np.linalg.norm(w, 2)) if np.isfinite(w).all() else np.inf

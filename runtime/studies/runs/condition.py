"""A run with the growth of small changes of its start."""

from __future__ import annotations

import numpy as np
from msgspec.structs import replace

from ...outcome import ENDED, SimulationError
from ...problem import Array
from ...results.condition import condition_of
from ...results.solution import Solution
from ...tangent.coordinates import basis
from ...tangent.flow import Tangents
from .companion import Plan

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

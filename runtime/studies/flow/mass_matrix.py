"""The mass matrix of a model by its kinetic energy, which is a quadratic function of the velocities."""

from __future__ import annotations

import numpy as np

from ...problem import Array
from ...results.evaluate import evaluate_rows
from ..runs.simulate import Plan

KINETIC = "energy.kinetic"


def mass_matrix(plan: Plan, t: float, y: Array) -> Array:
    """Give d(momenta)/d(velocities) [nv, nv] at a state, from the kinetic energy at several velocities."""
    case = plan.case
    problem = case.problem
    nq, nv = problem.nq, problem.nv
    index = [q.name for q in problem.outputs].index(KINETIC)
    scale = np.maximum(plan.nominal[nq : nq + nv], 1e-300)
    unit = np.diag(scale)

    def kinetic(speeds: Array) -> Array:
        rows = np.tile(y, (len(speeds), 1))
        rows[:, nq : nq + nv] = speeds
        found: Array = evaluate_rows(case, "outputs", np.full(len(speeds), t), rows)[:, index]
        return found

    pairs = (unit[:, None, :] + unit[None, :, :]).reshape(-1, nv)
    rest = kinetic(np.zeros((1, nv)))[0]
    both = (kinetic(pairs) + kinetic(-pairs) - 2 * rest).reshape(nv, nv) / 2
    one = (kinetic(unit) + kinetic(-unit) - 2 * rest) / 2
    matrix: Array = (both - one[:, None] - one[None, :]) / np.outer(scale, scale)
    return matrix

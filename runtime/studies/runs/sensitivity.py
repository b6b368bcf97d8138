"""A run with the derivatives of its motion."""

from __future__ import annotations

import numpy as np
from msgspec.structs import replace

from ...outcome import SimulationError
from ...problem import Array
from ...results.sensitivity import Sensitivities
from ...results.solution import Solution
from ...tangent.flow import Tangents


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

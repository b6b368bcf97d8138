"""How far the states of a run are from the constraints, before and after they are projected."""

from __future__ import annotations

import numpy as np

from ..case import Case
from ..integrate.trajectory import DenseOutput, Trajectory
from ..problem import Array
from .accuracy import ConstraintDrift
from .evaluate import input_rows

MOST_STATES = 64
"""States of a run that are measured, evenly spread over its steps."""


def constraint_drifts(case: Case, nominal: Array, main: Trajectory) -> tuple[ConstraintDrift, ...]:
    """Measure what a further projection would change, over nominal + |value|: positions, then velocities.

    The kernel projects at the end of each step, so the beginnings of its steps are measured; of other methods, which
    do not project, the output.
    """
    if case.functions.project_velocity is None:
        return ()
    t, y, z = _projected_states(case, main)
    u = input_rows(case, t)
    largest: dict[str, float] = {}
    for k in range(t.size):
        here = _corrections(case, (float(t[k]), y[k], u[k], z[k]), nominal)
        largest = {level: max(size, largest.get(level, 0.0)) for level, size in here.items()}
    before = {"positions": main.statistics.drift_position, "velocities": main.statistics.drift_velocity}
    return tuple(ConstraintDrift(level, before[level], size) for level, size in largest.items())


def _projected_states(case: Case, main: Trajectory) -> tuple[Array, Array, Array]:
    """Return times [n], states [n, ny] and discrete variables [n, nz] to be measured."""
    if isinstance(main.dense, DenseOutput):
        t, y = main.dense.begin, main.dense.coefficients[:, 0]
    else:
        t, y = main.t, main.y
    if main.happened is not None:  # at an event both sides have the same time
        quiet = ~np.isin(t, main.happened.times)
        t, y = t[quiet], y[quiet]
    chosen = np.unique(np.linspace(0, max(t.size - 1, 0), min(t.size, MOST_STATES)).astype(int))
    t, y = t[chosen], y[chosen]
    if main.happened is not None:
        return t, y, main.happened.discretes(t, case.problem.ny)
    return t, y, np.tile(case.z, (t.size, 1))


def _corrections(case: Case, at: tuple[float, Array, Array, Array], nominal: Array) -> dict[str, float]:
    """Give the relative corrections of one state ``at`` (t, y, u, z), by level; positions if anything holds them."""
    t, y, u, z = at
    functions, p = case.functions, case.p
    nq, nv = case.problem.nq, case.problem.nv
    coordinates, rates = slice(nq), slice(nq, nq + nv)
    assert functions.project_position is not None and functions.project_velocity is not None
    assert functions.displace is not None
    result = {}
    correction = functions.project_position(t, y, u, z, p)
    if correction.size > nv:  # followed by the residuals
        moved = np.array(y)
        moved[rates] = correction[:nv]
        change = functions.displace(t, moved, u, z, p)
        result["positions"] = _relative(change, y[coordinates], nominal[coordinates])
    change = functions.project_velocity(t, y, u, z, p)[:nv]
    result["velocities"] = _relative(change, y[rates], nominal[rates])
    return result


def _relative(change: Array, value: Array, nominal: Array) -> float:
    return float(np.max(np.abs(change) / (nominal + np.abs(value)), initial=0.0))

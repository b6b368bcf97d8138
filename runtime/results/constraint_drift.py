"""How far the states of a run are from the constraints, before and after they are projected."""

from __future__ import annotations

from collections.abc import Callable

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

    The kernel projects at the end of each step, so the beginnings of its steps are measured; the output where they are not kept.
    """
    if case.functions.project_velocity is None:
        return ()
    t, y, z = _projected_states(case, main)
    u = input_rows(case, t)
    largest: dict[str, tuple[float, float]] = {}
    for k in range(t.size):
        here = _corrections(case, (float(t[k]), y[k], u[k], z[k]), nominal)
        largest = {level: max(sizes, largest.get(level, (0.0, 0.0))) for level, sizes in here.items()}
    before = {"positions": main.statistics.drift_position, "velocities": main.statistics.drift_velocity}
    return tuple(ConstraintDrift(level, before[level], *sizes) for level, sizes in largest.items())


def _projected_states(case: Case, main: Trajectory) -> tuple[Array, Array, Array]:
    """Return times [n], states [n, ny] and discrete variables [n, nz] to be measured."""
    if isinstance(main.dense, DenseOutput):
        t, y = main.dense.begin, main.dense.coefficients[:, 0]
    else:
        t, y = main.t, main.y
    if main.happened is not None:  # at an event both sides have the same time
        quiet = ~np.isin(t, main.happened.times)
        t, y = t[quiet], y[quiet]
    chosen = np.linspace(0, max(t.size - 1, 0), min(t.size, MOST_STATES)).astype(int)  # at least 1 apart
    t, y = t[chosen], y[chosen]
    if main.happened is not None:
        return t, y, main.happened.discretes(t, case.problem.ny)
    return t, y, np.tile(case.z, (t.size, 1))


def _corrections(
    case: Case, at: tuple[float, Array, Array, Array], nominal: Array
) -> dict[str, tuple[float, float]]:
    """Give the relative correction of one state ``at`` (t, y, u, z), by level, and what another one would change after
    it; positions if anything holds them."""
    t, y, u, z = at
    functions, p = case.functions, case.p
    nq, nv = case.problem.nq, case.problem.nv
    coordinates, rates = slice(nq), slice(nq, nq + nv)
    assert functions.project_position is not None and functions.project_velocity is not None
    project, project_velocity, displace = (
        functions.project_position,
        functions.project_velocity,
        functions.displace,
    )
    assert displace is not None

    def displaced(state: Array) -> Array:
        moved = np.array(state)
        moved[rates] = project(t, state, u, z, p)[:nv]
        return displace(t, moved, u, z, p)

    def turned(state: Array) -> Array:
        return project_velocity(t, state, u, z, p)[:nv]

    def sizes(correct: Callable[[Array], Array], part: slice) -> tuple[float, float]:
        first = correct(y)
        then = np.array(y)
        then[part] += first
        size, again = (_relative(change, y[part], nominal[part]) for change in (first, correct(then)))
        return size, again

    result = {}
    if project(t, y, u, z, p).size > nv:  # followed by the residuals
        result["positions"] = sizes(displaced, coordinates)
    result["velocities"] = sizes(turned, rates)
    return result


def _relative(change: Array, value: Array, nominal: Array) -> float:
    return float(np.max(np.abs(change) / (nominal + np.abs(value)), initial=0.0))

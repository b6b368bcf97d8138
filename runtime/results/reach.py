"""Loops at the end of their reach: where constraints depend on each other and what moves with time asks for more."""

from __future__ import annotations

import numpy as np
from msgspec.structs import replace

from ..case import Case, inputs_at
from ..interface import array_of
from ..numerics.rank import POSITIONS, decomposed
from ..outcome import Failure, configuration, time_text
from ..problem import Array

KIND = "out of reach"
NEAR = 1e-3
"""Share of the smallest singular value at the start below which constraints count as dependent."""
SHARE = 0.3
"""Part of a unit vector from which on a row is named."""
INSTANT = 1e-4
"""Time, as a share of that until the failure, over which the constraints are compared."""


def with_reach(case: Case, failure: Failure) -> Failure:
    """Say of a failure that a drive asks a loop for a position that it cannot reach, where that is so."""
    y = np.array([failure.state[quantity.name] for quantity in case.problem.states])
    rows = out_of_reach(case, failure.time, y)
    if not rows:
        return failure
    named = [case.problem.assembly[k] for k in rows]
    names = " and ".join(dict.fromkeys(f"'{array_of(row.name)[0]}'" for row in named))
    message = (
        f"what is driven asks for a position out of reach at {time_text(case.problem, failure.time)}: the loop closed by "
        f"{names} is stretched out, or folded, to the end, with {configuration(case.problem, y)}"
    )
    return replace(failure, kind=KIND, message=message, name=named[0].name, origin=named[0].origin)


def out_of_reach(case: Case, t: float, y: Array) -> list[int]:
    """Return the rows of constraints on positions that depend on each other at (t, y), though not at the start, and that
    time drives further apart: indices of ``assembly``; none where there are no such."""
    problem, functions = case.problem, case.functions
    rows = [k for k, row in enumerate(problem.assembly) if row.stage == 1 and row.kind == "constraint"]
    if not rows or functions.assembly is None or functions.assembly_jacobian is None or not t > case.begin:
        return []
    residuals, jacobian = functions.assembly, functions.assembly_jacobian

    def derivatives(time: float, state: Array) -> Array:
        found = jacobian(time, state, inputs_at(case, time), case.z, case.p)
        return found.reshape(-1, problem.nv)[rows]

    first, last = derivatives(case.begin, case.y0), derivatives(t, y)
    if not (np.isfinite(first).all() and np.isfinite(last).all()):
        return []
    begun, now = decomposed(first), decomposed(last)
    rank = begun.rank(POSITIONS)
    if not rank or now.values[rank - 1] > NEAR * begun.values[rank - 1]:
        return []
    direction = now.left[:, rank - 1]
    step = INSTANT * (t - case.begin)
    apart = [residuals(at, y, inputs_at(case, at), case.z, case.p)[rows] for at in (t - step, t + step)]
    if abs(direction @ (apart[1] - apart[0])) <= np.sqrt(NEAR) * np.linalg.norm(apart[1] - apart[0]):
        return []
    return [rows[k] for k in np.flatnonzero(np.abs(direction) > SHARE)]

"""Why a motion cannot go on: coordinates along which nothing has inertia, energies that are undefined."""

from __future__ import annotations

import numpy as np
from msgspec.structs import replace

from ..case import Case, inputs_at
from ..interface import array_of
from ..numerics.rank import POSITIONS, decomposed
from ..outcome import (
    AT_SINGULAR_POSITIONS,
    SINGULAR_MASS,
    Failure,
    assertion_failed,
    configuration,
    not_finite,
    state_at,
    time_text,
    value_text,
)
from ..problem import Array, Problem
from .evaluate import Table

ZERO = 1e-13
"""Share of the inertia of single coordinates below which that of their combination counts as zero."""
VANISHING = 1e-8
"""Share of the inertia at the start."""
MOST = 200
"""Velocities beyond which nothing is looked for: the time grows with the square."""


def failure_at_start(case: Case) -> Failure | None:
    """Look at the first instant of a case that nothing switches: rates that are not numbers, assertions that do not hold."""
    t, y, functions = case.begin, case.y0, case.functions
    u = inputs_at(case, t)
    rates = functions.rhs(t, y, u, case.z, case.p)
    undefined = np.flatnonzero(~np.isfinite(rates))
    if undefined.size:
        index = int(undefined[0])
        return with_cause(case, not_finite(case.problem, index, float(rates[index]), t, y))
    if functions.assertions is not None:
        wrong = np.flatnonzero(~(functions.assertions(t, y, u, case.z, case.p) > 0.5))
        if wrong.size:
            return assertion_failed(case.problem, int(wrong[0]), t, y)
    return None


def with_cause(case: Case, failure: Failure) -> Failure:
    """Say in the message of a failure that the mass matrix is singular, a loop at the end of its reach, or an assertion does not
    hold, where that is so."""
    if failure.kind in AT_SINGULAR_POSITIONS:
        told = with_reach(case, failure)
        if told is not failure:
            return told
    if failure.kind not in ("not finite", "modes", "impact", *AT_SINGULAR_POSITIONS):
        return failure
    y = np.array([failure.state[quantity.name] for quantity in case.problem.states])
    if failure.kind == "not finite" and (broken := _broken(case, failure.time, y)):
        return replace(failure, message=f"{failure.message}: {broken}")
    names, held = without_inertia(case, failure.time, y)
    if names and not held:
        listed = ", ".join(f"'{name}'" for name in names)
        return replace(
            failure,
            message=f"{failure.message}; nothing has inertia along {listed} there (the mass matrix is singular)",
        )
    if not names or (failure.time > case.begin and without_inertia(case, case.begin, case.y0)[0]):
        return failure  # the run went on with a singular mass matrix before
    message = f"{failure.message}; the mass matrix is singular there, and only the constraints decide how it goes on"
    return replace(failure, kind=SINGULAR_MASS, message=message)


def _broken(case: Case, t: float, y: Array) -> str:
    """Say which assertion does not hold at (t, y), as that equations have a solution; nothing where all hold."""
    if case.functions.assertions is None:
        return ""
    holds = case.functions.assertions(t, y, inputs_at(case, t), case.z, case.p) > 0.5
    wrong = np.flatnonzero(~holds)
    return case.problem.assertions[wrong[0]].message if wrong.size else ""


def without_inertia(case: Case, t: float, y: Array) -> tuple[list[str], bool]:
    """Name the coordinates along which the kinetic energy at (t, y) is zero, or vanishes beside that at the start; of those
    that constraints leave free, where there are some. Tell whether constraints hold all of them."""
    first, mass = mass_matrix(case, case.begin, case.y0), mass_matrix(case, t, y)
    if mass is None or first is None:
        return [], False
    names = _lacking(case.problem, mass, first)
    before, now = _constraint_jacobian(case, case.begin, case.y0), _constraint_jacobian(case, t, y)
    if not names or now is None or before is None:
        return names, False
    mean = float(np.trace(first)) / len(first) or 1.0
    free = _lacking(case.problem, mass + mean * now.T @ now, first + mean * before.T @ before)
    return free or names, not free


def _lacking(problem: Problem, mass: Array, first: Array) -> list[str]:
    """Name the coordinates of motions along which a matrix vanishes, by itself or beside the ``first`` one."""
    rates = range(problem.nq, problem.nq + problem.nv)
    own, before = np.diag(mass), np.abs(np.diag(first))
    missing = ~(own > VANISHING * before)
    kept = np.flatnonzero(~missing)
    if kept.size:
        scale = np.sqrt(own[kept])
        values, vectors = np.linalg.eigh(mass[np.ix_(kept, kept)] / np.outer(scale, scale))
        if values[0] < ZERO * kept.size:
            missing[kept[np.abs(vectors[:, 0]) > 0.3]] = True
    return [_coordinate(problem.states[i].name) for i, gone in zip(rates, missing, strict=True) if gone]


def _constraint_jacobian(case: Case, t: float, y: Array) -> Array | None:
    """Return K with rows of length one; None where there are no constraints, or it is undefined."""
    problem, evaluate = case.problem, case.functions.assembly_jacobian
    rows = [k for k, row in enumerate(problem.assembly) if row.stage == 2 and row.kind == "constraint"]
    if not rows or evaluate is None:
        return None
    k = evaluate(t, y, inputs_at(case, t), case.z, case.p).reshape(-1, problem.nv)[rows]
    if not np.isfinite(k).all():
        return None
    sizes = np.sqrt(np.square(k).sum(axis=1, keepdims=True))
    found: Array = k / np.where(sizes > 0, sizes, 1.0)
    return found


def mass_matrix(case: Case, t: float, y: Array) -> Array | None:
    """Return the second derivatives of the kinetic energy by the velocities: exact, as it is quadratic in them. None where
    it is undefined, or has other terms than these."""
    problem, functions = case.problem, case.functions
    names = [quantity.name for quantity in problem.outputs]
    if "energy.kinetic" not in names or functions.outputs is None or not 0 < problem.nv <= MOST:
        return None
    which, n = names.index("energy.kinetic"), problem.nv
    u = inputs_at(case, t)
    evaluate = functions.outputs

    def kinetic(v: Array) -> float:
        state = y.copy()
        state[problem.nq : problem.nq + n] = v
        return float(evaluate(t, state, u, case.z, case.p)[which])

    unit = np.eye(n)
    rest = kinetic(np.zeros(n))
    mass = np.empty((n, n))
    for i in range(n):
        mass[i, i] = kinetic(unit[i]) + kinetic(-unit[i]) - 2 * rest
        for j in range(i):
            both = kinetic(unit[i] + unit[j]) + kinetic(-unit[i] - unit[j]) - 2 * rest
            mass[i, j] = mass[j, i] = (both - mass[i, i] - mass[j, j]) / 2
    return mass if np.isfinite(mass).all() else None


def undefined_energy(problem: Problem, table: Table) -> Failure | None:
    """Give a failure where an energy is undefined from some time to the end, though the accelerations are not.

    Steps may cross a wall of the potential that is thinner than they are; what lies after is not a motion of the model.
    """
    for index, first in _undefined_last(problem, table, "energy"):
        if first == len(table) - 1 and first > 0:
            continue  # at the last point only: a singular place that the motion just reaches
        time, quantity = float(table.t[first]), problem.outputs[index]
        value = float(table.outputs_at(slice(first, first + 1))[0, index])
        message = (
            f"'{quantity.name}' is {value_text(value)} from {time_text(problem, time)} on: "
            "the motion has left the region where the model is defined"
        )
        state = state_at(problem, table.y[first])
        return Failure("not finite", time, quantity.name, message, quantity.origin, state)
    return None


def _undefined_last(problem: Problem, table: Table, kind: str) -> list[tuple[int, int]]:
    """List the outputs of a kind that are not numbers at the end, with the row from which on they are none."""
    if not len(table):
        return []
    last = table.outputs_at(slice(len(table) - 1, len(table)))[0]
    wrong = [i for i in np.flatnonzero(~np.isfinite(last)).tolist() if problem.outputs[i].kind == kind]
    since = dict.fromkeys(wrong, 0)
    for rows, outputs in table.parts() if wrong else ():
        for index in wrong:
            defined = np.flatnonzero(np.isfinite(outputs[:, index]))
            since[index] = rows.start + int(defined[-1]) + 1 if defined.size else since[index]
    return list(since.items())


def undefined_outputs(problem: Problem, table: Table) -> tuple[str, ...]:
    """Say of outputs that are not numbers at the end since when they are none; the motion does not depend on them."""
    since: dict[int, list[str]] = {}
    for index, first in _undefined_last(problem, table, "output"):
        since.setdefault(first, []).append(f"'{problem.outputs[index].name}'")
    return tuple(
        f"no number at the end, from {time_text(problem, float(table.t[first]))} on: {', '.join(names)}"
        for first, names in since.items()
    )


def _coordinate(rate: str) -> str:
    """Return the name of a coordinate from that of its rate."""
    if not rate.startswith("der("):
        return rate
    base, _, component = rate.removeprefix("der(").partition(")")
    return base + component if component else base


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
        f"a drive asks for a position out of reach at {time_text(case.problem, failure.time)}: the loop closed by "
        f"{names} is fully stretched or folded, with {configuration(case.problem, y)}"
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

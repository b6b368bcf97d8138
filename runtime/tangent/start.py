"""Derivatives of a consistent start: of what the model and the experiment state, then of the assembly.

Where the equations of an assembly determine the state, their implicit function theorem gives its derivatives. Where they
leave freedoms, the start is the point nearest to the guesses: its derivatives are extrapolated differences of the
assembly itself (Richardson), moved onto the linearised equations.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from msgspec.structs import replace

from ..case import AGAIN, Case, inputs_at, prepare
from ..interface import Setting
from ..numerics.rank import POSITIONS, inverse, rank
from ..outcome import SimulationError
from ..problem import Array
from ..start.free_state import Flags
from .augmented import Augmented
from .coordinates import basis
from .directions import Direction, chosen

LEFT_OVER = 1e-8
"""Share of a change that the equations of an assembly may leave unanswered for rounding."""

FIRST_STEP, HALVINGS = 1 / 64, 4
"""Of differences of an assembly: the longest step over the size of what is changed, and how often it is halved."""


def start_tangents(augmented: Augmented, listed: Sequence[Direction]) -> Array:
    """Give W [ny, k] of a consistent start: its derivatives in named directions, in the order of ``augmented``.

    Raises SimulationError where a direction has no consistent start beside it.
    """
    case = augmented.case
    w = _stated(augmented, listed)
    if case.assembled is None:
        return w
    dependent = list(case.problem.dependent)
    moving = [i for i in dependent if i < case.problem.nq + case.problem.nv]
    by_caller, by_experiment = chosen(case)
    for _ in range(AGAIN):
        found = assembled(case, listed, w.copy(), lambda w: _left(augmented, w))
        if not dependent:
            return found
        after = found.copy()
        _of_others(augmented, after, by_caller | by_experiment, listed, case.y0)
        w[dependent] = after[dependent]
        if np.allclose(after[moving], found[moving], rtol=1e-13, atol=1e-300):
            break
    return after


def _stated(augmented: Augmented, listed: Sequence[Direction]) -> Array:
    """Give the derivatives of the state as given and guessed."""
    case, problem = augmented.case, augmented.case.problem
    u, unknown = augmented.inputs(case.begin), np.full(augmented.problem.ny, np.nan)
    z = augmented.discretes(case.z)
    _, w = augmented.split(augmented.functions.initial(case.begin, unknown, u, z, augmented.p), problem.ny)
    w = w.copy()
    by_caller, by_experiment = chosen(case)
    for setting in by_caller:
        if setting.array == "y":
            w[setting.index] = 0.0
    _experiment(augmented, w, by_experiment, listed)
    for k, direction in enumerate(listed):
        if direction.array == "y":
            w[:, k] = 0.0
            if direction.index >= 0:
                w[direction.index, k] = 1.0
    if problem.dependent:
        _of_others(augmented, w, by_caller | by_experiment, listed, case.wanted)
    for i in problem.rotations:  # the stated numbers are scaled to unit length
        q = case.wanted[i : i + 4]
        w[i : i + 4] -= np.outer(q, q @ w[i : i + 4])
    return w


def _experiment(augmented: Augmented, w: Array, settings: set[Setting], listed: Sequence[Direction]) -> None:
    """Put in the derivatives of the initial values that the experiment sets."""
    case, problem = augmented.case, augmented.case.problem
    plan = next((e for e in problem.experiments if e.name == case.experiment), None)
    if plan is None or not plan.settings:
        return
    count = len(plan.options) + len(plan.settings)
    function = augmented.function(f"tangent_{plan.function}", count)
    u, unknown = augmented.inputs(case.begin), np.full(augmented.problem.ny, np.nan)
    rows = function(case.begin, unknown, u, augmented.discretes(case.z), augmented.p).reshape(-1, count)
    for setting, change in zip(plan.settings, rows[:, len(plan.options) :].T, strict=True):
        place = Setting(setting.array, setting.index)
        if place not in settings:
            continue
        if setting.array == "y":
            w[setting.index] = change
            continue
        for direction, c in zip(listed, change, strict=True):
            if c != 0 and (direction.array, direction.index) != (setting.array, setting.index):
                arrays = {"p": problem.parameters, "u": problem.inputs}
                other = arrays[setting.array][setting.index].name
                raise SimulationError(
                    f"the experiment sets '{other}' by a formula with '{direction.name}': both would change at once",
                    help=f"give '{other}' a number: --set {other}=..., or set={{'{other}': ...}}",
                )


def _of_others(
    augmented: Augmented, w: Array, settings: set[Setting], listed: Sequence[Direction], y: Array
) -> None:
    """Put in the derivatives of initial values that are stated with those of others, at a state y."""
    case, problem = augmented.case, augmented.case.problem
    function = augmented.function("tangent_initial_of_others", len(problem.dependent))
    u, z = augmented.inputs(case.begin), augmented.discretes(case.z)
    free = [
        [m for m, i in enumerate(problem.dependent) if Setting("y", i) not in settings | {_place(direction)}]
        for direction in listed
    ]
    for _ in problem.dependent:
        values = function(case.begin, augmented.joined(y, w), u, z, augmented.p)
        rows = values.reshape(augmented.count, -1)
        for k, kept in enumerate(free):
            w[[problem.dependent[m] for m in kept], k] = rows[k, kept]


def _place(direction: Direction) -> Setting:
    return Setting(direction.array, direction.index)


# ---------------------------------------------------------------- the assembly


def assembled(case: Case, listed: Sequence[Direction], w: Array, left_by: Callable[[Array], Array]) -> Array:
    """Give W [ny, k] of an assembled start from those ``w`` of the stated one.

    ``left_by`` gives [rows, k]: how the residuals of the assembly change where the state changes by W, in the directions.
    """
    problem = case.problem
    known = np.array([case.known[i] for i in problem.partner], dtype=bool)
    moved = basis(problem, case.y0)
    if not (_determined(case, 1, ~known) and _determined(case, 2, ~case.known[_rates(case)])):
        for k, direction in enumerate(listed):
            if direction.index >= 0:
                w[:, k] = _difference(case, direction)
    for stage, free, first in ((1, ~known, 0), (2, ~case.known[_rates(case)], problem.nv)):
        places = np.flatnonzero(free)
        rows = _rows(case, stage)
        if not rows:
            continue
        matrix = _jacobian(case)[rows]
        left = left_by(w)[rows]
        change = _onto(matrix[:, places], left)
        w = w + moved[:, first + places] @ change
        _check(case, listed, left_by(w)[rows], matrix, w)
    return w


def _rates(case: Case) -> slice:
    return slice(case.problem.nq, case.problem.nq + case.problem.nv)


def _rows(case: Case, stage: int) -> list[int]:
    return [i for i, row in enumerate(case.problem.assembly) if row.stage == stage and row.known]


def _jacobian(case: Case) -> Array:
    problem, function = case.problem, case.functions.assembly_jacobian
    assert function is not None and case.assembled is not None
    u = _inputs(case)
    return function(case.begin, case.y0, u, case.z, case.p).reshape(len(problem.assembly), problem.nv)


def _inputs(case: Case) -> Array:
    return inputs_at(case, case.begin)


def _left(augmented: Augmented, w: Array) -> Array:
    """Give [rows, k]: how the residuals of the assembly change where the state changes by W."""
    case = augmented.case
    function = augmented.function("tangent_assembly", len(case.problem.assembly))
    row = augmented.joined(case.y0, w)
    u, z = augmented.inputs(case.begin), augmented.discretes(case.z)
    return function(case.begin, row, u, z, augmented.p).reshape(augmented.count, -1).T


def _determined(case: Case, stage: int, free: Flags) -> bool:
    """Whether the equations of a stage leave no freedom to what is not given."""
    rows = _jacobian(case)[_rows(case, stage)][:, np.flatnonzero(free)]
    if not rows.shape[1]:
        return True
    return bool(rank(rows / _sizes(rows), POSITIONS) == rows.shape[1])


def _sizes(matrix: Array) -> Array:
    sizes = np.abs(matrix).max(axis=1, initial=0.0)
    return np.where(sizes > 0, sizes, 1.0)[:, None]


def _onto(matrix: Array, left: Array) -> Array:
    """Give the shortest changes that answer what is left."""
    if not matrix.size:
        return np.zeros((matrix.shape[1], left.shape[1]))
    sizes = _sizes(matrix)
    found: Array = -inverse(matrix / sizes, POSITIONS) @ (left / sizes)
    return found


def _check(case: Case, listed: Sequence[Direction], left: Array, matrix: Array, w: Array) -> None:
    sizes = _sizes(matrix) * np.abs(w).max(axis=0, initial=0.0)
    for k in np.flatnonzero((np.abs(left) > LEFT_OVER * np.maximum(sizes, 1e-300)).any(axis=0)):
        problem = case.problem
        given = [
            q.name
            for q, known in zip(problem.states, case.known, strict=True)
            if known and q.kind != "account"
        ]
        raise SimulationError(
            f"a change of '{listed[int(k)].name}' leaves no consistent start: the given initial values determine "
            f"each other ({', '.join(given[:6])})",
            help="let the equations find one of them: state it with guess",
        )


def _difference(case: Case, direction: Direction) -> Array:
    """Give the derivative of the assembled state by extrapolated central differences, in the space of states."""
    asked, problem = case.asked, case.problem
    assert asked is not None
    value = {"p": case.p, "y": case.wanted, "u": _inputs(case)}[direction.array][direction.index]
    size = abs(float(value)) or 1.0
    table: list[Array] = []
    for level in range(HALVINGS):
        h = FIRST_STEP * size / 2**level
        sides = []
        for there in (value + h, value - h):
            changed = replace(asked, values={**asked.values, direction.name: float(there)})
            sides.append(prepare(problem, case.functions, changed).y0)
        row = [(sides[0] - sides[1]) / (2 * h)]
        for m, before in enumerate(table[-1] if table else ()):  # Richardson, even powers
            row.append(row[m] + (row[m] - before) / (4.0 ** (m + 1) - 1))
        table.append(np.array(row))
    best: Array = table[-1][-1]
    return best

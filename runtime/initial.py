"""Consistent initial states: positions nearest to their guesses on the constraints, then velocities likewise.

Known values stay. Coordinates are weighed by one over their characteristic length, angles by one over a radian;
rotations move along their body axes and deviate by the angle of the rotation from the guess.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .functions import Functions
from .least_change import Local, Nearest, nearest
from .nominal import PURE
from .outcome import SimulationError
from .problem import Array, AssemblyRow, Problem

ATTEMPTS = 8
NEAR = 0.3
"""A second assembly within this distance, in radians or characteristic lengths, is told."""

NEARBY, TURNED = 1e-9, 0.1
"""A gradient that changes by this share within this distance, in radians or characteristic lengths, has no direction."""

Flags = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Assembled:
    """``y``: the consistent state; ``weights`` [nv] of the coordinates by velocity; ``residuals`` of all rows before;
    ``steps`` of both stages; ``remarks`` for the user."""

    y: Array
    weights: Array
    residuals: Array
    steps: tuple[int, int]
    remarks: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class _Task:
    """One assembly: the functions at fixed t, u, z, p, and which velocities belong to which coordinates."""

    problem: Problem
    functions: Functions
    t: float
    u: Array
    z: Array
    p: Array
    known: Flags
    partner: tuple[int, ...]
    """Index in y of the coordinate of each velocity; of its first entry for a rotation."""

    def rows(self, stage: int, known: bool) -> list[int]:
        return [i for i, r in enumerate(self.problem.assembly) if r.stage == stage and r.known == known]

    def local(self, y: Array, stage: int, deviation: Array, lengths: float) -> Local:
        """Residuals and Jacobians at y. Wishes are weighed like coordinates."""
        assert self.functions.assembly is not None and self.functions.assembly_jacobian is not None
        values = self.functions.assembly(self.t, y, self.u, self.z, self.p)
        matrix = self.functions.assembly_jacobian(self.t, y, self.u, self.z, self.p)
        matrix = matrix.reshape(len(self.problem.assembly), self.problem.nv)
        hard, soft = self.rows(stage, True), self.rows(stage, False)
        share = np.array([1.0 if self.problem.assembly[i].unit in PURE else 1 / lengths for i in soft])
        return Local(
            values[hard], matrix[hard], share * values[soft], share[:, None] * matrix[soft], deviation
        )


def assemble(
    problem: Problem, functions: Functions, t: float, y0: Array, known: Flags, u: Array, z: Array, p: Array
) -> Assembled:
    """Return the consistent state nearest to ``y0``, of which the ``known`` entries stay as they are.

    Raises ``SimulationError`` with the statements that contradict each other.
    """
    task = _Task(problem, functions, t, u, z, p, known, _partners(problem))
    length = _length(problem, p)
    weights = np.array([_weight(problem, task, j, length) for j in range(problem.nv)])
    assert functions.assembly is not None
    before = functions.assembly(t, y0, u, z, p)
    placed = _positions(task, y0, weights, length)
    _check_directions(task, placed, weights)
    moving = _velocities(task, placed.x, weights, length)
    remarks = _second_assembly(task, y0, placed, weights, length)
    return Assembled(moving.x, weights, before, (placed.steps, moving.steps), remarks)


# ---------------------------------------------------------------- the two stages


def _positions(task: _Task, guess: Array, weights: Array, length: float) -> Nearest:
    free = np.flatnonzero([not task.known[i] for i in task.partner])
    found = _place(task, guess, guess, free, weights, length)
    if found.fulfilled:
        return found
    best = found
    for other in _disturbed(task, guess, free, weights):
        found = _place(task, guess, other, free, weights, length)
        if found.fulfilled:
            return found
        if not best.violations.max() <= found.violations.max():  # nor is it, where it is not a number
            best = found
    everything = np.arange(task.problem.nv)
    released = [_place(task, guess, g, everything, weights, length) for g in (guess, best.x)]
    raise _not_assembled(task, 1, best, weights, any(r.fulfilled for r in released))


def _place(
    task: _Task, guess: Array, start: Array, free: NDArray[np.intp], weights: Array, length: float
) -> Nearest:
    def at(y: Array) -> Local:
        return task.local(y, 1, _deviation(task, y, guess), length)

    return nearest(at, lambda y, d: displaced(task.problem, task.partner, y, d), start, free, weights)


def _velocities(task: _Task, y: Array, weights: Array, length: float) -> Nearest:
    problem = task.problem
    rates = slice(problem.nq, problem.nq + problem.nv)
    guess = y[rates].copy()

    def at(state: Array) -> Local:
        return task.local(state, 2, state[rates] - guess, length)

    def move(state: Array, d: Array) -> Array:
        moved = state.copy()
        moved[rates] += d
        return moved

    free = np.flatnonzero(~task.known[rates])
    found = nearest(at, move, y, free, weights)
    if found.fulfilled:
        return found
    released = nearest(at, move, y, np.arange(problem.nv), weights)
    raise _not_assembled(task, 2, found, weights, released.fulfilled)


def _check_directions(task: _Task, placed: Nearest, weights: Array) -> None:
    """Refuse equations that hold, but whose gradient is undefined there, or turns about within a billionth."""
    hard = [task.problem.assembly[i] for i in task.rows(1, True)]
    numbers = np.random.default_rng(5)
    matrices = [placed.local.hard_jacobian]
    for _ in range(2):
        d = NEARBY * numbers.standard_normal(task.problem.nv) / weights
        there = displaced(task.problem, task.partner, placed.x, d)
        matrices.append(task.local(there, 1, np.zeros(task.problem.nv), 1.0).hard_jacobian)
    for other in matrices[1:]:
        turned = np.abs((other - matrices[0]) / weights).max(axis=1, initial=0.0)
        for row, change, scale in zip(hard, turned, placed.scale, strict=True):
            if not change <= TURNED * scale:
                raise SimulationError(
                    f"{_told(row, 1)} has no direction in the position that it asks for",
                    row.origin,
                    code="E0608",
                    help="a distance of zero has no direction: what coincides is held by a joint, or by an equation "
                    "for each component",
                )


def _disturbed(task: _Task, guess: Array, free: NDArray[np.intp], weights: Array) -> list[Array]:
    """States around the guess, always the same ones: the guess itself may be a position where nothing can begin."""
    numbers = np.random.default_rng(3)
    states = []
    for k in range(ATTEMPTS):
        d = np.zeros(task.problem.nv)
        d[free] = min(0.05 * 2.0**k, 1.5) * numbers.standard_normal(free.size) / weights[free]
        states.append(displaced(task.problem, task.partner, guess, d))
    return states


# ---------------------------------------------------------------- coordinates


def _partners(problem: Problem) -> tuple[int, ...]:
    places = {q.name: i for i, q in enumerate(problem.states[: problem.nq])}
    result = []
    for quantity in problem.states[problem.nq : problem.nq + problem.nv]:
        name = quantity.name.removeprefix("der(")
        base, _, _ = name.rpartition(")")
        result.append(places[base] if base in places else places[f"{base}[1]"])
    return tuple(result)


def _without_velocity(task: _Task) -> list[int]:
    """Coordinates in y whose rates are prescribed: nothing moves them."""
    problem = task.problem
    moved = {i + k for i in task.partner for k in range(4 if i in problem.rotations else 1)}
    return [i for i in range(problem.nq) if i not in moved]


def displaced(problem: Problem, partner: tuple[int, ...], y: Array, d: Array) -> Array:
    """Return y with its coordinates moved along d [nv], rotations about their body axes."""
    moved = y.copy()
    for j, i in enumerate(partner):
        if i not in problem.rotations:
            moved[i] += d[j]
        elif j == 0 or partner[j - 1] != i:
            moved[i : i + 4] = _turned(y[i : i + 4], d[j : j + 3])
    return moved


def _turned(q: Array, turn: Array) -> Array:
    angle = float(np.linalg.norm(turn))
    half = np.array([np.cos(angle / 2), *(np.sinc(angle / (2 * np.pi)) / 2 * turn)])
    product = _product(q, half)
    return product / np.linalg.norm(product)


def _product(a: Array, b: Array) -> Array:
    vector = a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:])
    return np.array([a[0] * b[0] - a[1:] @ b[1:], *vector])


def _deviation(task: _Task, y: Array, guess: Array) -> Array:
    """How far each coordinate is from its guess, [nv]; for a rotation the rotation vector from the guess."""
    result = np.zeros(task.problem.nv)
    for j, i in enumerate(task.partner):
        if i not in task.problem.rotations:
            result[j] = y[i] - guess[i]
        elif j == 0 or task.partner[j - 1] != i:
            result[j : j + 3] = _rotation_vector(guess[i : i + 4], y[i : i + 4])
    return result


def _rotation_vector(a: Array, b: Array) -> Array:
    relative = _product(a * np.array([1.0, -1.0, -1.0, -1.0]), b)
    relative = relative if relative[0] >= 0 else -relative
    size = float(np.linalg.norm(relative[1:]))
    return relative[1:] * (2 * np.arctan2(size, relative[0]) / size if size > 1e-300 else 2.0)


def _length(problem: Problem, p: Array) -> float:
    """The characteristic size of lengths: the geometric mean of the parameters that are lengths, else 1."""
    sizes = [abs(float(x)) for q, x in zip(problem.parameters, p, strict=False) if q.unit == "m" and x != 0]
    return float(np.exp(np.mean(np.log(sizes)))) if sizes else 1.0


def _weight(problem: Problem, task: _Task, j: int, length: float) -> float:
    quantity = problem.states[task.partner[j]]
    if task.partner[j] in problem.rotations:
        return 1.0
    if quantity.nominal is not None:
        return 1 / abs(quantity.nominal)
    return 1.0 if quantity.unit in PURE else 1 / length


# ---------------------------------------------------------------- what is said


def _not_assembled(
    task: _Task, stage: int, found: Nearest, weights: Array, without_known: bool
) -> SimulationError:
    problem = task.problem
    hard = [problem.assembly[i] for i in task.rows(stage, True)]
    off = found.violations
    undefined = [row for row, v in zip(hard, off, strict=True) if not np.isfinite(v)]
    if undefined:
        return SimulationError(
            f"{_told(undefined[0], stage)} has no value at the guesses",
            undefined[0].origin,
            code="E0608",
            help="begin where all its roots, logarithms and quotients are defined",
        )
    worst = float(off.max())
    guilty = [i for i in np.argsort(-off) if off[i] > 1e-3 * worst]
    notes = [f"{_told(hard[i], stage)} is off by {abs(float(found.local.hard[i])):.4g} {hard[i].unit}".rstrip()
             + _where(hard[i]) for i in guilty]  # fmt: skip
    rows = found.local.hard_jacobian[guilty] / weights / found.scale[guilty][:, None]
    touched = np.abs(rows).max(axis=0, initial=0.0)
    first = problem.nq if stage == 2 else 0
    places = [first + j if stage == 2 else task.partner[j] for j in range(problem.nv)]
    stated = dict.fromkeys(
        i for j, i in enumerate(places) if task.known[i] and touched[j] > 1e-6 * touched.max(initial=0.0)
    )
    for i in stated:
        quantity = problem.states[i]
        place = problem.starts[i] if problem.starts else quantity.origin
        line = f" ({place.file}:{place.line})" if place else ""
        unit = f" {quantity.unit}" if quantity.unit else ""
        notes.append(f"{quantity.name} = {found.x[i]:.6g}{unit} is given{line}")
    for i in _without_velocity(task) if stage == 1 else ():
        quantity = problem.states[i]
        unit = f" {quantity.unit}" if quantity.unit else ""
        notes.append(f"{quantity.name} = {found.x[i]:.6g}{unit} stays as it is said: its rate is prescribed")
    origin = hard[guilty[0]].origin
    what = "positions" if stage == 1 else "velocities"
    if without_known and stated:
        return SimulationError(
            f"the initial {what} that are given contradict the constraints",
            origin,
            code="E0604",
            notes=tuple(notes),
            help="replace '=' by '~' in one of the given values: it is then a guess",
        )
    if without_known or _contradictory(task, stage, found, weights):
        return SimulationError(
            f"constraints and initial conditions contradict each other ({what})",
            origin,
            code="E0605",
            notes=tuple(notes),
            help="remove one of them",
        )
    return SimulationError(
        "the mechanism cannot be assembled: its parts do not reach",
        origin,
        code="E0606",
        notes=tuple(notes),
        help="this is the closest position that was found; look at lengths and places, or guess closer",
    )


def _told(row: AssemblyRow, stage: int) -> str:
    if row.kind == "initial":
        return f"the initial condition on '{row.name}'"
    return f"'{row.name}'" if stage == 1 else f"the rate of '{row.name}'"


def _where(row: AssemblyRow) -> str:
    return f" ({row.origin.file}:{row.origin.line})" if row.origin else ""


def _contradictory(task: _Task, stage: int, found: Nearest, weights: Array) -> bool:
    """Whether the rows depend on each other in every position, not in the one that was found alone."""
    if stage == 2:
        return True
    free = np.arange(task.problem.nv)
    deficits = []
    for y in _disturbed(task, found.x, free, weights):
        local = task.local(y, 1, np.zeros(task.problem.nv), 1.0)
        rows = [i for i, v in enumerate(found.violations) if v > 1e-3 * found.violations.max()]
        matrix = local.hard_jacobian[rows] / weights
        values = np.linalg.svd(matrix / found.scale[rows][:, None], compute_uv=False)
        deficits.append(
            int((values < 1e-9 * max(values.max(initial=0.0), 1e-300)).sum()) + max(0, len(rows) - free.size)
        )
    return min(deficits) > 0


def _second_assembly(
    task: _Task, guess: Array, placed: Nearest, weights: Array, length: float
) -> tuple[str, ...]:
    """Look for another position close by, where the given values leave none but isolated ones."""
    free = np.flatnonzero([not task.known[i] for i in task.partner])
    hard = [task.problem.assembly[i] for i in task.rows(1, True)]
    # one scale for all rows of a unit: close to a dead centre a whole row is small
    shared = [max(s for r, s in zip(hard, placed.scale, strict=True) if r.unit == row.unit) for row in hard]
    scale = np.array(shared)[:, None]
    rows = placed.local.hard_jacobian[:, free] / weights[free] / scale
    if not free.size or not rows.size:
        return ()
    _, values, right = np.linalg.svd(rows, full_matrices=True)
    if (values > 1e-10 * max(values.max(), 1e-300)).sum() < free.size - 1 or values.size < free.size:
        return ()
    if values[free.size - 1] > NEAR * values[0]:
        return ()
    best: tuple[float, Array] | None = None
    for size in (0.02, 0.05, 0.1, 0.2, 0.3, 0.45):
        for sign in (-1, 1):
            d = np.zeros(task.problem.nv)
            d[free] = sign * size * right[free.size - 1] / weights[free]
            start = displaced(task.problem, task.partner, placed.x, d)
            other = _place(task, start, start, free, weights, length)
            away = weights * _deviation(task, other.x, placed.x)
            distance = float(np.abs(away).max())
            if not other.fulfilled or not 1e-5 < distance < 2 * NEAR or (best and distance >= best[0]):
                continue
            there = other.local.hard_jacobian[:, free] / weights[free] / scale
            smallest = np.linalg.svd(there, compute_uv=False)[free.size - 1]
            if smallest > 1e-8:  # else the mechanism can move from the one to the other
                best = distance, other.x
    if best is None:
        return ()
    changes = weights * _deviation(task, best[1], placed.x)
    moved = sorted({task.partner[j] for j in np.flatnonzero(np.abs(changes) > 0.1 * np.abs(changes).max())})
    listed = []
    for i in moved[:4]:
        q = task.problem.states[i]
        unit = f" {q.unit}" if q.unit else ""
        listed.append(f"{q.name} = {best[1][i]:.6g}{unit} instead of {placed.x[i]:.6g}{unit}")
    return (
        f"close to a dead centre: there is a second position with {', '.join(listed)}; the guesses chose this one",
    )

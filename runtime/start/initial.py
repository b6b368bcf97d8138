"""Consistent initial states: positions nearest to their guesses on the constraints, then velocities likewise.

Known values stay.
"""

from __future__ import annotations

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from ..functions import Functions
from ..problem import Array, Problem
from .free_state import (
    Flags,
    Task,
    characteristic_length,
    deviation_from,
    displaced,
    disturbed,
    partners,
    weight_of,
)
from .gauss_newton import Local, Nearest, nearest
from .impossible_start import check_directions, not_assembled

ROUNDING = 1e-12
"""Of assembled coordinates, in radians or characteristic lengths."""

NEAR = 0.3
"""A second assembly within this distance, in radians or characteristic lengths, is told."""


class Assembled(Struct, frozen=True):
    """``y``: the consistent state; ``weights`` [nv] of the coordinates by velocity; ``residuals`` of all rows before;
    ``steps`` of both stages; ``remarks`` for the user."""

    y: Array
    weights: Array
    residuals: Array
    steps: tuple[int, int]
    remarks: tuple[str, ...]


def assemble(
    problem: Problem, functions: Functions, t: float, y0: Array, known: Flags, u: Array, z: Array, p: Array
) -> Assembled:
    """Return the consistent state nearest to ``y0``, of which the ``known`` entries stay as they are.

    Raises ``SimulationError`` with the statements that contradict each other.
    """
    task = Task(problem, functions, t, u, z, p, known, partners(problem))
    length = characteristic_length(problem, p)
    weights = np.array([weight_of(problem, task, j, length) for j in range(problem.nv)])
    assert functions.assembly is not None
    before = functions.assembly(t, y0, u, z, p)
    placed = _positions(task, y0, weights, length)
    check_directions(task, placed, weights)
    moving = _velocities(task, placed.x, weights, length)
    remarks = _second_assembly(task, y0, placed, weights, length)
    return Assembled(moving.x, weights, before, (placed.steps, moving.steps), remarks)


def unmoved(problem: Problem, assembled: Assembled, wanted: Array) -> Array:
    """Return the assembled state with what was wanted where the assembly moved a coordinate by no more than rounding."""
    y = assembled.y.copy()
    for j, i in enumerate(partners(problem)):
        if i not in problem.rotations and abs(y[i] - wanted[i]) * assembled.weights[j] < ROUNDING:
            y[i] = wanted[i]
    return y


# ---------------------------------------------------------------- the two stages


def _positions(task: Task, guess: Array, weights: Array, length: float) -> Nearest:
    free = np.flatnonzero([not task.known[i] for i in task.partner])
    found = _place(task, guess, guess, free, weights, length)
    if found.fulfilled:
        return found
    best = found
    for other in disturbed(task, guess, free, weights):
        found = _place(task, guess, other, free, weights, length)
        if found.fulfilled:
            return found
        if not best.violations.max() <= found.violations.max():  # nor is it, where it is not a number
            best = found
    everything = np.arange(task.problem.nv)
    released = [_place(task, guess, g, everything, weights, length) for g in (guess, best.x)]
    raise not_assembled(task, 1, best, weights, any(r.fulfilled for r in released))


def _place(
    task: Task, guess: Array, start: Array, free: NDArray[np.intp], weights: Array, length: float
) -> Nearest:
    def at(y: Array) -> Local:
        return task.local(y, 1, deviation_from(task, y, guess), length)

    return nearest(at, lambda y, d: displaced(task.problem, task.partner, y, d), start, free, weights)


def _velocities(task: Task, y: Array, weights: Array, length: float) -> Nearest:
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
    found = nearest(at, move, y, free, weights, linear=True)
    if found.fulfilled:
        return found
    released = nearest(at, move, y, np.arange(problem.nv), weights, linear=True)
    raise not_assembled(task, 2, found, weights, released.fulfilled)


def _second_assembly(
    task: Task, guess: Array, placed: Nearest, weights: Array, length: float
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
            away = weights * deviation_from(task, other.x, placed.x)
            distance = float(np.abs(away).max())
            if not other.fulfilled or not 1e-5 < distance < 2 * NEAR or (best and distance >= best[0]):
                continue
            there = other.local.hard_jacobian[:, free] / weights[free] / scale
            smallest = np.linalg.svd(there, compute_uv=False)[free.size - 1]
            if smallest > 1e-8:  # else the mechanism can move from the one to the other
                best = distance, other.x
    if best is None:
        return ()
    changes = weights * deviation_from(task, best[1], placed.x)
    moved = sorted({task.partner[j] for j in np.flatnonzero(np.abs(changes) > 0.1 * np.abs(changes).max())})
    listed = []
    for i in moved[:4]:
        q = task.problem.states[i]
        unit = f" {q.unit}" if q.unit else ""
        listed.append(f"{q.name} = {best[1][i]:.6g}{unit} instead of {placed.x[i]:.6g}{unit}")
    return (
        f"close to a dead centre: there is a second position with {', '.join(listed)}; the guesses chose this one",
    )

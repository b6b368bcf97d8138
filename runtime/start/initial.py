"""Consistent initial states: positions nearest to their guesses on the constraints, then velocities likewise.

Known values stay.
"""

from __future__ import annotations

import numpy as np
from msgspec import Struct

from ..functions import Functions
from ..problem import Array, Problem
from .assembly import APART, STARTED, Assembly
from .free_state import Flags, deviation_from, displaced
from .impossible_start import no_start

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
    problem: Problem,
    functions: Functions,
    t: float,
    y0: Array,
    known: Flags,
    u: Array,
    z: Array,
    p: Array,
    *,
    reproducible: bool = False,
) -> Assembled:
    """Return the consistent state nearest to ``y0``, of which the ``known`` entries stay as they are.

    Raises ``SimulationError`` with the statements that contradict each other.
    """
    made = Assembly.of(problem, functions, t, known, u, z, p, reproducible)
    y, report = made.from_guess(y0)
    if report.status != STARTED:
        raise no_start(made, y0, y, report)
    steps = report.steps[0], report.steps[1]
    return Assembled(y, made.weights, made.residuals(y0), steps, _second_assembly(made, y))


def unmoved(problem: Problem, assembled: Assembled, wanted: Array) -> Array:
    """Return the assembled state with what was wanted where the assembly moved a coordinate by no more than rounding, and with zero
    where it has left no more than that."""
    y = assembled.y.copy()
    for j, i in enumerate(problem.partner):
        if i in problem.rotations:
            continue
        if abs(y[i] - wanted[i]) * assembled.weights[j] < ROUNDING:
            y[i] = wanted[i]
        elif abs(y[i]) * assembled.weights[j] < ROUNDING:
            y[i] = 0.0
    return y


def _second_assembly(made: Assembly, y: Array) -> tuple[str, ...]:
    """Look for another position close by, where the given values leave none but isolated ones."""
    problem, free, weights, facts = made.problem, made.free, made.weights, made.facts
    hard = [problem.assembly[i] for i in made.rows(1)]
    if not free.size or len(hard) < free.size:
        return ()
    gradients = made.gradients(y, 1)
    sizes = np.abs(gradients).max(axis=1)
    # one scale for all rows of a unit: close to a dead centre a whole row is small
    shared = [max(s for r, s in zip(hard, sizes, strict=True) if r.unit == row.unit) or 1.0 for row in hard]
    scale = np.array(shared)[:, None]
    rows = gradients[:, free] / scale
    _, values, right = np.linalg.svd(rows, full_matrices=True)
    if (values > 1e-10 * max(values[0], 1e-300)).sum() < free.size - 1:
        return ()
    if values[-1] > NEAR * values[0]:
        return ()
    best: tuple[float, Array] | None = None
    for size in (0.02, 0.05, 0.1, 0.2, 0.3, 0.45):
        for sign in (-1, 1):
            d = np.zeros(facts.nv)
            d[free] = sign * size * right[free.size - 1] / weights[free]
            start = displaced(facts, y, d)
            other, report = made.from_guess(start)
            away = weights * deviation_from(facts, other, y)
            distance = float(np.abs(away).max())
            if report.status == APART or not 1e-5 < distance < 2 * NEAR or (best and distance >= best[0]):
                continue
            there = made.gradients(other, 1)[:, free] / scale
            smallest = np.linalg.svd(there, compute_uv=False)[free.size - 1]
            if smallest > 1e-8:  # else the mechanism can move from the one to the other
                best = distance, other
    if best is None:
        return ()
    changes = weights * deviation_from(facts, best[1], y)
    moved = sorted(
        {facts.partner[int(j)] for j in np.flatnonzero(np.abs(changes) > 0.1 * np.abs(changes).max())}
    )
    listed = []
    for i in moved[:4]:
        q = problem.states[i]
        unit = f" {q.unit}" if q.unit else ""
        listed.append(f"{q.name} = {best[1][i]:.6g}{unit} instead of {y[i]:.6g}{unit}")
    return (
        f"close to a dead centre: there is a second position with {', '.join(listed)}; the guesses chose this one",
    )

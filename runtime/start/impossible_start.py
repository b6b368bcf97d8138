"""Why an initial state cannot be assembled, in the words of the model."""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from ..outcome import SimulationError
from ..problem import AssemblyRow, Problem
from .free_state import Task, displaced, disturbed
from .gauss_newton import Nearest


def not_assembled(
    problem: Problem, task: Task, stage: int, found: Nearest, without_known: bool
) -> SimulationError:
    """``found``: the closest state; ``without_known``: whether there is one if the given values are guesses."""
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
    rows = found.local.hard_jacobian[guilty] / task.weights / found.scale[guilty][:, None]
    touched = np.abs(rows).max(axis=0, initial=0.0)
    first = problem.nq if stage == 2 else 0
    places = [first + j if stage == 2 else task.facts.partner[j] for j in range(problem.nv)]
    stated = dict.fromkeys(
        i for j, i in enumerate(places) if task.known[i] and touched[j] > 1e-6 * touched.max(initial=0.0)
    )
    for i in stated:
        quantity = problem.states[i]
        place = problem.starts[i] if problem.starts else quantity.origin
        line = f" ({place.file}:{place.line})" if place else ""
        where = line if problem.known[i] else " for this run"
        notes.append(f"{quantity.name} = {_in_words(float(found.x[i]), quantity.unit)} is given{where}")
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
            help="replace '=' by '~' in one of the given values: it is then a guess"
            if all(problem.known[i] for i in stated)
            else "leave out one of them: a value that is set for a run is kept; only '~' in the model makes it a guess",
        )
    if without_known or _contradictory(problem, task, stage, found):
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


def _in_words(value: float, unit: str) -> str:
    """Return a value with its unit, an angle in degrees as well."""
    degrees = f" ({math.degrees(value):.6g} deg)" if unit == "rad" else ""
    return f"{value:.6g} {unit}".rstrip() + degrees


def _told(row: AssemblyRow, stage: int) -> str:
    if row.kind == "initial":
        return f"the initial condition on '{row.name}'"
    return f"'{row.name}'" if stage == 1 else f"the rate of '{row.name}'"


def _where(row: AssemblyRow) -> str:
    return f" ({row.origin.file}:{row.origin.line})" if row.origin else ""


def _contradictory(problem: Problem, task: Task, stage: int, found: Nearest) -> bool:
    """Whether the rows depend on each other in every position, not in the one that was found alone."""
    if stage == 2:
        return True
    hard = [problem.assembly[i] for i in task.rows(1, True)]
    off = found.violations
    if len({row.origin for row, v in zip(hard, off, strict=True) if v > 1e-3 * off.max()}) < 2:
        return False  # one statement: nothing else to remove
    free = np.arange(problem.nv)
    deficits = []
    for y in disturbed(task, partial(displaced, task.facts), found.x, free):
        local = task.local(y, 1, np.zeros(problem.nv))
        rows = [i for i, v in enumerate(found.violations) if v > 1e-3 * found.violations.max()]
        matrix = local.hard_jacobian[rows] / task.weights
        values = np.linalg.svd(matrix / found.scale[rows][:, None], compute_uv=False)
        deficits.append(
            int((values < 1e-9 * max(values.max(initial=0.0), 1e-300)).sum()) + max(0, len(rows) - free.size)
        )
    return min(deficits) > 0


def no_direction(row: AssemblyRow) -> SimulationError:
    return SimulationError(
        f"{_told(row, 1)} has no direction in the position that it asks for",
        row.origin,
        code="E0608",
        help="a distance of zero has no direction: what coincides is held by a joint, or by an equation "
        "for each component",
    )


def _without_velocity(task: Task) -> list[int]:
    """Coordinates in y whose rates are prescribed: nothing moves them."""
    facts = task.facts
    moved = {i + k for i in facts.partner for k in range(4 if i in facts.rotations else 1)}
    return [i for i in range(facts.nq) if i not in moved]

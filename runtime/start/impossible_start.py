"""Why an initial state cannot be assembled, in the words of the model."""

from __future__ import annotations

import math

import numpy as np

from ..interface import AssemblyRow
from ..native import kernel as native
from ..outcome import SimulationError
from ..problem import Array
from .assembly import APART, STARTED, UNDIRECTED, Assembly
from .free_state import displaced, even_numbers


def no_start(made: Assembly, guess: Array, y: Array, report: native.StartReportStruct) -> SimulationError:
    """Return why there is no start. ``y``: the closest state to the guess that was found."""
    problem, nothing = made.problem, np.zeros(made.known.size, bool)
    if report.status == UNDIRECTED:
        return no_direction(problem.assembly[report.row])
    if report.status == APART:
        others = [made.from_guess(start, nothing)[1].status for start in (guess, y)]
        return _not_assembled(made, 1, guess, y, any(status != APART for status in others))
    return _not_assembled(made, 2, guess, y, made.from_guess(y, nothing)[1].status == STARTED)


def _not_assembled(
    made: Assembly, stage: int, guess: Array, y: Array, without_known: bool
) -> SimulationError:
    """``without_known``: whether there is a start if the given values are guesses."""
    problem = made.problem
    hard = [problem.assembly[i] for i in made.rows(stage)]
    residuals, scale = made.residuals(y)[made.rows(stage)], made.scales(stage, guess, y)
    off = np.abs(residuals) / scale
    undefined = [row for row, v in zip(hard, off, strict=True) if not np.isfinite(v)]
    if undefined:
        return SimulationError(
            f"{_condition_text(undefined[0], stage)} has no value at the guesses",
            undefined[0].origin,
            code="E0608",
            help="begin where all its roots, logarithms and quotients are defined",
        )
    worst = float(off.max())
    guilty = [i for i in np.argsort(-off) if off[i] > 1e-3 * worst]
    notes = [f"{_condition_text(hard[i], stage)} is off by {abs(float(residuals[i])):.4g} {hard[i].unit}".rstrip()
             + _where(hard[i]) for i in guilty]  # fmt: skip
    rows = made.gradients(y, stage)[guilty] / scale[guilty][:, None]
    touched = np.abs(rows).max(axis=0, initial=0.0)
    first = problem.nq if stage == 2 else 0
    places = [first + j if stage == 2 else made.facts.partner[j] for j in range(problem.nv)]
    stated = dict.fromkeys(
        i for j, i in enumerate(places) if made.known[i] and touched[j] > 1e-6 * touched.max(initial=0.0)
    )
    for i in stated:
        quantity = problem.states[i]
        place = problem.starts[i] if problem.starts else quantity.origin
        line = f" ({place.file}:{place.line})" if place else ""
        where = line if problem.known[i] else " for this run"
        notes.append(f"{quantity.name} = {_in_words(float(y[i]), quantity.unit)} is given{where}")
    for i in _without_velocity(made) if stage == 1 else ():
        quantity = problem.states[i]
        unit = f" {quantity.unit}" if quantity.unit else ""
        notes.append(f"{quantity.name} = {y[i]:.6g}{unit} stays as it is said: its rate is prescribed")
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
    if without_known or _contradictory(made, stage, y, off):
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
        help="this is the closest position that was found; check lengths and places, or give closer guesses",
    )


def _in_words(value: float, unit: str) -> str:
    """Return a value with its unit, an angle in degrees as well."""
    degrees = f" ({math.degrees(value):.6g} deg)" if unit == "rad" else ""
    return f"{value:.6g} {unit}".rstrip() + degrees


def _condition_text(row: AssemblyRow, stage: int) -> str:
    if row.kind == "initial":
        return f"the initial condition on '{row.name}'"
    return f"'{row.name}'" if stage == 1 else f"the rate of '{row.name}'"


def _where(row: AssemblyRow) -> str:
    return f" ({row.origin.file}:{row.origin.line})" if row.origin else ""


ATTEMPTS = 8
"""States around one at which rows are looked at."""


def _contradictory(made: Assembly, stage: int, y: Array, off: Array) -> bool:
    """Whether the rows depend on each other in every position, not in the one that was found alone."""
    if stage == 2:
        return True
    hard = [made.problem.assembly[i] for i in made.rows(1)]
    rows = np.flatnonzero(off > 1e-3 * off.max())
    if len({hard[i].origin for i in rows}) < 2:
        return False  # one statement: nothing else to remove
    nv, scale = made.problem.nv, made.scales(1, y)[rows]
    deficits = []
    for k, numbers in enumerate(even_numbers(3, ATTEMPTS * nv).reshape(ATTEMPTS, nv)):
        there = displaced(made.facts, y, min(0.05 * 2.0**k, 1.5) * numbers / made.weights)
        values = np.linalg.svd(made.gradients(there, 1)[rows] / scale[:, None], compute_uv=False)
        small = (values < 1e-9 * max(values.max(initial=0.0), 1e-300)).sum()
        deficits.append(int(small) + max(0, len(rows) - nv))
    return min(deficits) > 0


def no_direction(row: AssemblyRow) -> SimulationError:
    return SimulationError(
        f"{_condition_text(row, 1)} has no direction in the position that it requires",
        row.origin,
        code="E0608",
        help="a distance of zero has no direction: connect points that coincide by a joint, or by an equation "
        "for each component",
    )


def _without_velocity(made: Assembly) -> list[int]:
    """Coordinates in y whose rates are prescribed: nothing moves them."""
    facts = made.facts
    moved = {i + k for i in facts.partner for k in range(4 if i in facts.rotations else 1)}
    return [i for i in range(facts.nq) if i not in moved]

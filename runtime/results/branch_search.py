"""The solutions that outputs of equations follow along a run: at its rows, its steps, and at both sides of events."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..case import Case
from ..integrate.trajectory import DenseOutput
from ..problem import Array
from .branch_jumps import Jump, JumpPoint, end_of, follow
from .further_solutions import Several, several_at
from .systems import RunSystem, StatesAt, systems_of

LEAST_POINTS, MOST_POINTS = 400, 5000
"""Rows of the results at which a solution is followed: of fewer, others are put between, of more some are left out; as many
steps at most."""


def look_along(
    case: Case,
    rows: tuple[Array, Array, Array | None],
    dense: Callable[[Array], Array] | None,
    states_at: StatesAt,
    failed: bool = False,
) -> tuple[tuple[Jump, ...], tuple[Several, ...], tuple[tuple[tuple[str, ...], float], ...]]:
    """``failed``: the last row is where the run ended, and not where it should. Give the jumps, the further solutions, and the outputs that jump too often with the time until which they were followed."""
    jumps: list[Jump] = []
    several: list[Several] = []
    given_up: list[tuple[tuple[str, ...], float]] = []
    with np.errstate(all="ignore"):
        for system in systems_of(case):
            points = _points(system, rows, dense, states_at)
            finite = [p.values for p in points if np.isfinite(p.values).all()]
            if finite:
                system.largest = np.maximum(np.max(np.abs(finite), axis=0), 1e-300)
            found = several_at(system, points[0])
            several += [] if found is None else [found]
            followed = follow(system, points, states_at)
            jumps += followed.jumps
            told = any(not np.isfinite(jump.after).all() for jump in followed.jumps)
            end = end_of(system, points) if failed and not told else None
            jumps += [] if end is None else [end]
            if followed.until is not None:
                given_up.append((tuple(q.name for q in system.quantities), followed.until))
    return tuple(jumps), tuple(several), tuple(given_up)


def _points(
    system: RunSystem,
    rows: tuple[Array, Array, Array | None],
    dense: Callable[[Array], Array] | None,
    states_at: StatesAt,
) -> list[JumpPoint]:
    t, y, z = rows
    held = system.case.z
    sides = np.zeros(t.size, dtype=bool)  # of events, which stay
    sides[[0, -1]] = True
    equal = np.flatnonzero(t[1:] == t[:-1])
    sides[equal] = sides[equal + 1] = True
    kept = np.flatnonzero(sides | (np.arange(t.size) % (1 + t.size // MOST_POINTS) == 0))
    found = [system.place(float(t[k]), y[k], held if z is None else z[k]) for k in kept]
    further = np.empty(0)
    if isinstance(dense, DenseOutput):
        further = dense.begin[(dense.begin > t[0]) & (dense.begin < t[-1])]
        further = further[:: 1 + further.size // MOST_POINTS]
    if t.size < LEAST_POINTS:
        further = np.append(further, np.linspace(t[0], t[-1], LEAST_POINTS))
    further = np.setdiff1d(further, t)
    if further.size:
        between, modes = states_at(further)
        found += [
            system.place(float(at), between[k], held if modes is None else modes[k])
            for k, at in enumerate(further)
        ]
        found.sort(key=lambda place: place.t)  # keeps the order of both sides of an event
    return [JumpPoint(place, system.reported(place)) for place in found]

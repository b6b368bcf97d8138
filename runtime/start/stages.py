"""The two stages of an assembly: positions nearest to their guesses on the constraints, then velocities likewise.

kernel/start/assemble.c does the same. What follows the marker stands in modules of the Python target, too.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..problem import Array, ModelFunction
from .facts import StartFacts
from .free_state import (
    Flags,
    Task,
    characteristic_length,
    deviation_from,
    displaced,
    disturbed,
    even_numbers,
    weights_of,
)
from .gauss_newton import FULFILLED, Local, Nearest, nearest, restored
from .second_order import beyond, refined

# ---- copied from here

NEARBY, AROUND, TURNED = 1e-9, 1e-6, 0.1
"""A gradient that changes by the last share within these distances, in radians or characteristic lengths, has no direction; the first
of positions that are the nearest ones, the second of those at which the search for these got stuck."""


def make_task(
    facts: StartFacts,
    residuals: ModelFunction,
    jacobian: ModelFunction,
    t: float,
    known: Flags,
    u: Array,
    z: Array,
    p: Array,
) -> Task:
    """Return an assembly whose ``known`` entries [ny] stay."""
    length = characteristic_length(facts, p)
    return Task(facts, residuals, jacobian, t, u, z, p, known, length, weights_of(facts, length))


def placed(task: Task, guess: Array) -> Nearest:
    """Return the positions nearest to the guess; where there are none, the closest ones that were found."""
    free = task.free(1)
    best = place(task, guess, guess, free)
    if best.fulfilled:
        return best
    along = place_along(task, guess, free, best.scale)
    if along.fulfilled:
        return along
    at, move = _positions(task, guess)
    return _around(task, at, move, guess, free, best, lambda start: place(task, guess, start, free))


def _around(
    task: Task,
    at: Callable[[Array], Local],
    move: Callable[[Array, Array], Array],
    first: Array,
    free: NDArray[np.intp],
    best: Nearest,
    search: Callable[[Array], Nearest],
) -> Nearest:
    """Return what is found from beside the ``best`` state, if slopes say nothing there, or from states around the first one: it
    may be one where nothing can begin. Where that is nothing, return the closest state."""
    aside = beyond(at, move, best, free, task.weights)
    for start in ([] if aside is None else [aside]) + disturbed(task, move, first, free):
        found = search(start)
        if found.fulfilled:
            return found
        if not best.violations.max() <= found.violations.max():  # nor is it, where it is not a number
            best = found
    return best


def place(task: Task, guess: Array, start: Array, free: NDArray[np.intp]) -> Nearest:
    """Search for the positions nearest to the guess from another start."""
    at, move = _positions(task, guess)
    found = nearest(at, move, start, free, task.weights)
    if found.settled or not found.fulfilled:
        return found
    return refined(at, move, found, free, task.weights)


def place_along(task: Task, guess: Array, free: NDArray[np.intp], scale: Array) -> Nearest:
    """Go from the guess by the shortest steps onto the equations, then along them."""
    at, move = _positions(task, guess)
    x, here, steps = restored(at, move, guess, at(guess), scale, free, task.weights)
    fulfilled = bool((np.abs(here.hard) / scale).max(initial=0.0) <= FULFILLED)
    found = Nearest(x, here, scale, fulfilled, steps, False)
    return refined(at, move, found, free, task.weights) if fulfilled else found


def _positions(task: Task, guess: Array) -> tuple[Callable[[Array], Local], Callable[[Array, Array], Array]]:
    def at(y: Array) -> Local:
        return task.local(y, 1, deviation_from(task.facts, y, guess))

    return at, lambda y, d: displaced(task.facts, y, d)


def moving(task: Task, y: Array, free: NDArray[np.intp]) -> Nearest:
    """Return y with the velocities nearest to those that it has."""
    rates = slice(task.facts.nq, task.facts.nq + task.facts.nv)
    guess = y[rates].copy()

    def at(state: Array) -> Local:
        return task.local(state, 2, state[rates] - guess)

    def move(state: Array, d: Array) -> Array:
        moved = state.copy()
        moved[rates] += d
        return moved

    def search(start: Array) -> Nearest:
        return nearest(at, move, start, free, task.weights, linear=True)

    best = search(y)
    return best if best.fulfilled else _around(task, at, move, y, free, best, search)


def undirected_row(task: Task, found: Nearest) -> int | None:
    """Return the first hard row that holds, but whose gradient is undefined there, or turns about close by."""
    nv, first = task.facts.nv, found.local.hard_jacobian
    distance = NEARBY if found.settled else AROUND
    for turn in even_numbers(5, 2 * nv).reshape(2, nv):
        there = displaced(task.facts, found.x, distance * turn / task.weights)
        other = task.local(there, 1, np.zeros(nv)).hard_jacobian
        turned = np.abs((other - first) / task.weights).max(axis=1, initial=0.0)
        for row, change, scale in zip(task.rows(1, True), turned, found.scale, strict=True):
            if not change <= TURNED * scale:
                return row
    return None

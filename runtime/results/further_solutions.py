"""Further solutions of the equations for outputs at the start of a run, from a few guesses that are always the same."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from msgspec import Struct

from ..problem import Array
from .branch_jumps import ONE, JumpPoint
from .systems import RunSystem

STARTS = 24
"""Guesses that are tried beside those with other signs."""
REACHES = (0.5, 2.0, 8.0)
"""How far they lie apart, in sizes of the guess."""
ENOUGH = 4
"""Further solutions after which no more are looked for."""
FLATTEST = 1e9
"""Flatness of equations from which on what they determine is not told apart."""
TURN = 2 * math.pi
PRIMES = (2, 3, 5, 7, 11, 13, 17, 19, 23, 29)


class Several(Struct, frozen=True):
    """Names of the outputs of one system, what is reported of them at a time, and other solutions, in SI.

    ``outside``: what is reported lies outside of the range that the model states for it, and others do not.
    """

    names: tuple[str, ...]
    time: float
    taken: tuple[float, ...]
    others: tuple[tuple[float, ...], ...]
    outside: bool


def several_at(system: RunSystem, point: JumpPoint) -> Several | None:
    """Look for solutions beside the one that is reported; None where there is only that within the ranges of the model."""
    taken = point.values
    if not np.isfinite(taken).all():
        return None
    low, high = _range(system)
    periods = _periods(system, point)
    known, others = [taken], []
    for start in _starts(system, point, low, high):
        found = system.found(point.at, start)
        if found is None or not np.isfinite(found).all():
            continue
        found = found - periods * np.round((found - taken) / TURN)
        if any(_one(system, found, x, periods) for x in known):
            continue
        if system.flatness(system.look(point.at, found), found) >= FLATTEST:
            continue
        known.append(found)
        if _inside(found, low, high):
            others.append(found)
        if len(others) == ENOUGH:
            break
    if not others:
        return None
    names = tuple(q.name for q in system.quantities)
    shown = tuple(tuple(map(float, x)) for x in others)
    return Several(names, point.at.t, tuple(map(float, taken)), shown, not _inside(taken, low, high))


def _range(system: RunSystem) -> tuple[Array, Array]:
    low = [-np.inf if q.minimum is None else q.minimum for q in system.quantities]
    high = [np.inf if q.maximum is None else q.maximum for q in system.quantities]
    return np.array(low), np.array(high)


def _inside(values: Array, low: Array, high: Array) -> bool:
    slack = ONE * np.abs(values)
    return bool(np.all((low - slack <= values) & (values <= high + slack)))


def _one(system: RunSystem, a: Array, b: Array, periods: Array) -> bool:
    difference = a - b
    difference = difference - periods * np.round(difference / TURN)
    return system.alike(b + difference, b, ONE)


def _periods(system: RunSystem, point: JumpPoint) -> Array:
    """Give a full turn [n] for unknowns whose equations are the same after it, 0 for others."""
    found = np.zeros(system.count)
    for i in range(system.count):
        same = True
        for share in (0.37, -0.83):
            here = point.values + share * np.maximum(system.sizes(point.values), 0.1)
            there = here.copy()
            there[i] += TURN
            a, b = system.look(point.at, here), system.look(point.at, there)
            off = np.abs(a.rows * a.sizes - b.rows * b.sizes)
            same = same and bool(np.all(off <= ONE * a.sizes)) and bool(np.any(a.matrix[:, i]))
        if same:
            found[i] = TURN
    return found


def _starts(system: RunSystem, point: JumpPoint, low: Array, high: Array) -> Iterator[Array]:
    """Yield guesses: the taken solution with other signs, then points that fill the range, or surroundings of the guess."""
    taken = point.values
    guess = system.look(point.at, taken).guess
    yield -taken
    for i in range(system.count if system.count > 1 else 0):
        mirrored = taken.copy()
        mirrored[i] = -mirrored[i]
        yield mirrored
    size = np.maximum(np.abs(taken), np.where(np.isfinite(guess), np.abs(guess), 0.0))
    nominal = [1.0 if q.nominal is None else q.nominal for q in system.quantities]
    size = np.where(size > 0, size, np.maximum(system.largest, nominal))
    bounded = np.isfinite(low) & np.isfinite(high)
    for k in range(STARTS):
        place = np.array([_halton(k + 1, PRIMES[i]) for i in range(system.count)])
        around = taken + REACHES[k % len(REACHES)] * size * (2 * place - 1)
        within = np.where(bounded, low + (high - low) * place, 0.0)
        yield np.where(bounded, within, np.clip(around, low, high))


def _halton(index: int, base: int) -> float:
    result, share = 0.0, 1.0
    while index:
        share /= base
        index, digit = divmod(index, base)
        result += share * digit
    return result

"""What begins while nothing moves: looked for between the rows of a run, as its steps grow without bound there.

Where velocities and states stay what they are, every method is exact and takes the longest steps it may; a push that is
shorter than these is passed over by the run and its companion alike. Such stretches are looked at more closely.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...case import Case
from ...integrate.trajectory import Trajectory
from ...limits_of_time import LOOKS
from ...memo import once
from ...problem import Array, Problem
from ...results.evaluate import evaluate_rows
from ...rows import AT_ONCE, slices

OF_ITS_LENGTH = 4
"""Steps in the shortest thing that was seen."""

STILL = 1e-13
"""Change of a velocity or a state between two rows that counts as none, as a share of its size."""

UNSEEN = 1e-9
"""Change of a derivative that counts as none, as a share of what would reach the size of its state within the run."""


UNCOUNTED, LEAST_SHARE, ROUNDING = 0.25, 1e-6, 1e-15
"""What an account of energy lacks between two rows is more than the first share of what its rates there come to, and in all more than the
second share of what it reaches, and than rounding of its nominal value."""


class UnseenStart(NamedTuple):
    """``time`` at which something acts on what the run left as it was, and the longest ``step`` that shows it."""

    time: float
    step: float


@once
def _own(problem: Problem) -> list[int]:
    """Give the indices of velocities and states, without accounts."""
    return [i for i, q in enumerate(problem.states) if q.kind not in ("coordinate", "account")]


def _largest(main: Trajectory, i: int) -> float:
    if len(main.y) <= AT_ONCE:
        return _size(main.y[:, i])
    return max([_size(main.y[rows, i]) for rows in slices(len(main.y), main.y)])


def _size(column: Array) -> float:
    """Give the largest size of some numbers: sooner than their maximum is found."""
    sizes = np.abs(column)
    return float(sizes[sizes.argmax()])


def _still(main: Trajectory, own: list[int], least: Array) -> NDArray[np.intp] | None:
    """Find the rows from which velocities and states stay what they are until the next one; None or none, where they always move."""
    sizes: list[float] = []
    found = []
    for part in slices(main.t.size - 1, main.t, main.y):
        rows = slice(part.start, part.stop + 1)
        still: NDArray[np.bool_] | None = None
        for k, i in enumerate(own):
            if k == len(sizes):
                size = float(least[i])
                sizes.append(max(size if math.isfinite(size) else 0.0, _largest(main, i)))
            column = main.y[rows, i]
            moves = np.abs(column[1:] - column[:-1])
            if moves[moves.argmin()] > STILL * sizes[k]:  # mostly the first one tells
                break
            rests = moves <= STILL * sizes[k]
            still = rests if still is None else still & rests
            if not still.any():
                break
        else:
            t = main.t[rows]
            going = t[1:] > t[:-1]
            found.append(part.start + np.flatnonzero(going if still is None else going & still))
    return np.concatenate(found) if found else None


@once
def _accounts(problem: Problem) -> list[int]:
    return [i for i, q in enumerate(problem.states) if q.kind == "account"]


def _rates(
    case: Case, t: Array, lengths: Array, y: Array, here: Array, z: Array | None, each: int
) -> tuple[Array, Array]:
    """Give rates along straight lines from t [n] and y [n, ny], and how these differ from those ``here``, each [n * each, ny]."""
    ahead = np.outer(lengths, (np.arange(each) + 0.5) / each)
    times = (t[:, None] + ahead).ravel()
    begun = np.repeat(here, each, axis=0)
    states = np.repeat(y, each, axis=0) + ahead.reshape(-1, 1) * begun
    held = None if z is None else np.repeat(z, each, axis=0)
    rates = evaluate_rows(case, "rhs", times, states, held)
    return rates, np.abs(rates - begun)


def _uncounted(rates: Array, changes: Array, lengths: Array, size: float, least: float) -> NDArray[np.bool_]:
    """Tell [n, each] where the ``rates`` [n, each] of an account show what its ``changes`` [n] lack, which the run has passed over."""
    with np.errstate(invalid="ignore"):
        lacks = np.abs(rates.mean(axis=1) * lengths - changes)
        comes_to = np.abs(rates).mean(axis=1) * lengths
        lacking = lacks > UNCOUNTED * comes_to
        most = max(LEAST_SHARE * max(size, float(np.nansum(comes_to))), ROUNDING * least)
        if not lacks[lacking].sum() > most:
            return np.zeros(rates.shape, dtype=bool)
        lacking &= lacks > most / lacks.size
        beside = np.abs(rates - (changes / lengths)[:, None])
        found: NDArray[np.bool_] = lacking[:, None] & (
            beside > UNCOUNTED * np.abs(rates).max(axis=1)[:, None]
        )
    return found


def begins_unseen(case: Case, main: Trajectory, nominal: Array) -> UnseenStart | None:
    """Return where something acts on what the run left as it was; None where nothing is seen to."""
    problem, span = case.problem, case.stop - case.begin
    if main.t.size < 2 or span <= 0:
        return None
    own = _own(problem)
    rows = _still(main, own, nominal)
    if rows is None or not rows.size:
        return None
    least = np.where(np.isfinite(nominal), nominal, 0.0)
    if problem.rotations:  # a quaternion does not go on in a straight line
        rows = rows[np.all(main.y[rows, : problem.nq] == main.y[rows + 1, : problem.nq], axis=1)]
    if rows.size and main.happened is not None:  # what an event changes is seen already
        events = main.happened.events.times
        before = np.searchsorted(events, main.t[rows], side="left")
        rows = rows[before == np.searchsorted(events, main.t[rows + 1], side="right")]
    if not rows.size:
        return None
    sizes = np.maximum(least, [_largest(main, i) for i in range(problem.ny)])
    all_modes = None if main.happened is None else main.happened.discretes(main.t, problem.ny)
    modes = None if all_modes is None else all_modes[rows]
    here = evaluate_rows(case, "rhs", main.t[rows], main.y[rows], modes)
    then = evaluate_rows(case, "rhs", main.t[rows + 1], main.y[rows + 1], modes)
    with np.errstate(over="ignore"):  # in a moment nothing moves
        slow = UNSEEN * sizes[own] / span
    rests = (np.abs(here[:, own]) <= slow).all(axis=1) | (np.abs(then[:, own]) <= slow).all(axis=1)
    rows, here = rows[rests], here[rests]  # the others went forth and came back
    if not rows.size:
        return None
    modes = None if modes is None else modes[rests]
    each = max(2, LOOKS // (main.t.size - 1))
    lengths = main.t[rows + 1] - main.t[rows]
    limits = np.full(problem.ny, np.inf)
    limits[own] = slow
    rates, beside = _rates(case, main.t[rows], lengths, main.y[rows], here, modes, each)
    moved = np.any(beside > limits, axis=1)
    follows = (  # one law from row to row
        np.ones(rows.size, dtype=bool)
        if all_modes is None
        else np.all(all_modes[rows] == all_modes[rows + 1], axis=1)
    )
    for i in _accounts(problem):
        changes = main.y[rows + 1, i] - main.y[rows, i]
        seen = rates[:, i].reshape(rows.size, each)
        lacks = _uncounted(seen, changes, lengths, float(sizes[i]), float(least[i]))
        moved |= (lacks & follows[:, None]).ravel()
    if not np.any(moved):
        return None
    times = (main.t[rows, None] + np.outer(lengths, (np.arange(each) + 0.5) / each)).ravel()
    ends = np.flatnonzero(np.diff(np.r_[False, moved, False].astype(int)))
    shortest = int(np.min(ends[1::2] - ends[::2]))  # places in a row that show it
    apart = span / (each * (main.t.size - 1))
    return UnseenStart(float(times[np.argmax(moved)]), apart * max(1.0, shortest / OF_ITS_LENGTH))

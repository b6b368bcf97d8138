"""Where a function changes its sign or is greatest between neighbouring times: many roots and extrema at once."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...problem import Array
from ...results.solution import Solution

ITERATIONS = 60
"""As many as bisection alone would take to rounding."""
PLACES = 9
ROUNDS = 8
"""Rounds of so many places each, in which an extremum is looked for between three instants: to a few bits of the time."""


def fine_times(solution: Solution, begin: float, end: float) -> Array:
    """Return times from one to the other, closer together than the steps of the run."""
    return np.linspace(begin, end, 8 * max(solution.statistics.steps, 100) + 1)


def extrema(solution: Solution, name: str, t: Array, sign: float) -> Array:
    """Return where a quantity is greatest (``sign`` 1) or least (-1) among its neighbours, each bracket narrowed by places."""
    x = sign * solution(t)[name]
    (k,) = np.nonzero((x[1:-1] > x[:-2]) & (x[1:-1] >= x[2:]))
    low, high = t[k], t[k + 2]
    for _ in range(ROUNDS if k.size else 0):
        places = np.linspace(low, high, PLACES)
        there = (sign * solution(places.ravel())[name]).reshape(places.shape)
        best = np.clip(there.argmax(axis=0), 1, PLACES - 2)
        columns = np.arange(k.size)
        low, high = places[best - 1, columns], places[best + 1, columns]
    return np.asarray((low + high) / 2)


def turns(solution: Solution, name: str, begin: float = -np.inf) -> tuple[Array, Array]:
    """Return times and values between which a quantity only rises or only falls: extrema, both sides of events, and what is between."""
    begin, end = max(begin, float(solution.time[0])), float(solution.time[-1])
    fine = fine_times(solution, begin, end)
    more = np.concatenate([fine, *(extrema(solution, name, fine, sign) for sign in (1.0, -1.0))])
    rows = solution.time >= begin
    t = np.concatenate([solution.time[rows], more])
    x = np.concatenate([np.asarray(solution[name], dtype=float)[rows], solution(more)[name]])
    order = np.argsort(t, kind="stable")
    kept = np.concatenate([[True], np.diff(t[order]) > 0]) | (order < np.count_nonzero(rows))
    return t[order][kept], x[order][kept]


def crossings(t: Array, g: Array, value: Callable[[Array], Array], direction: str) -> Array:
    """Give the times [m] at which ``value`` goes through zero between the times ``t`` [n], where it is ``g`` [n].

    ``direction``: up, down, both. A value of exactly zero belongs to the positive side.
    """
    negative = g < 0
    up, down = negative[:-1] & ~negative[1:], ~negative[:-1] & negative[1:]
    chosen = {"up": up, "down": down, "both": up | down}[direction]
    (k,) = np.nonzero(chosen & (t[1:] > t[:-1]) & np.isfinite(g[:-1]) & np.isfinite(g[1:]))
    return chandrupatla(value, t[k], t[k + 1], g[k], g[k + 1])


def chandrupatla(value: Callable[[Array], Array], a: Array, b: Array, fa: Array, fb: Array) -> Array:
    """Give a root of ``value`` [n] between each ``a`` and ``b``, where its signs differ, to rounding.

    Inverse quadratic interpolation where it is safe, else bisection (Chandrupatla 1997).
    """
    b, fb, a, fa = a.copy(), fa.copy(), b.copy(), fb.copy()  # b: the last point, a: beyond the root
    c, fc = a.copy(), fa.copy()
    share = np.full(a.shape, 0.5)
    for _ in range(ITERATIONS if a.size else 0):
        x = a + share * (b - a)
        f = value(x)
        same = np.sign(f) == np.sign(fa)
        c, fc = np.where(same, a, b), np.where(same, fa, fb)
        b, fb = np.where(same, b, a), np.where(same, fb, fa)
        a, fa = x, f
        best = np.where(np.abs(fa) < np.abs(fb), a, b)
        tolerance = 4 * np.finfo(float).eps * np.maximum(np.abs(best), np.abs(b - a))
        width = np.abs(b - a)
        done = (width <= 2 * tolerance) | (fa == 0) | (fb == 0)
        if done.all():
            break
        with np.errstate(all="ignore"):
            xi, phi = (a - b) / (c - b), (fa - fb) / (fc - fb)
            smooth = (phi**2 < xi) & ((1 - phi) ** 2 < 1 - xi)
            inner = fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
            least = np.where(width > 0, tolerance / np.where(width > 0, width, 1.0), 0.5)
        share = np.where(smooth & np.isfinite(inner), inner, 0.5)
        share = np.clip(share, np.minimum(least, 0.5), np.maximum(1 - least, 0.5))
        share = np.where(done, 0.0, share)
    roots: Array = np.where(np.abs(fa) <= np.abs(fb), a, b)
    return roots

"""Polynomials of one element on -1 <= xi <= 1: Hermite functions of its two ends, and bubbles that vanish there.

With ``r`` continuous values (q and r - 1 derivatives) the bubbles are r-fold integrals of Legendre polynomials, which
keeps the matrices well conditioned (Szabo, Babuska, Finite element analysis, 1991, ch. 3).
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.polynomial import legendre

from ..problem import Array


@lru_cache(maxsize=32)
def coefficients(degree: int, r: int) -> Array:
    """Return the Legendre coefficients of the degree + 1 functions, a column each: r of the left end, r of the right, bubbles."""
    table = np.zeros((degree + 1, degree + 1))
    conditions = np.zeros((2 * r, 2 * r))
    for j in range(2 * r):
        unit = np.zeros(2 * r)
        unit[j] = 1.0
        for m in range(r):
            derived = legendre.legder(unit, m) if m else unit
            conditions[m, j] = legendre.legval(-1.0, derived)
            conditions[r + m, j] = legendre.legval(1.0, derived)
    table[: 2 * r, : 2 * r] = np.linalg.inv(conditions)
    for column, k in enumerate(range(r, degree - r + 1), start=2 * r):
        bubble: Array = np.zeros(k + 1)
        bubble[k] = np.sqrt(2 * k + 1.0)
        for _ in range(r):
            bubble = np.asarray(legendre.legint(bubble, lbnd=-1), dtype=np.float64)
        table[: len(bubble), column] = bubble
    return table


def values(degree: int, r: int, xi: Array, depth: int) -> Array:
    """Return the functions and ``depth`` derivatives at places: shape (depth + 1, places, degree + 1)."""
    table = coefficients(degree, r)
    found = np.zeros((depth + 1, len(xi), degree + 1))
    for k in range(depth + 1):
        derived = legendre.legder(table, k) if k else table
        found[k] = legendre.legval(xi, derived).T if len(derived) else 0.0
    return found


@lru_cache(maxsize=64)
def gauss(count: int) -> tuple[Array, Array]:
    """Return the places and weights of Gauss."""
    return legendre.leggauss(count)


@lru_cache(maxsize=64)
def lobatto(intervals: int) -> tuple[Array, Array]:
    """Return intervals + 1 places and weights of Lobatto, both ends among them."""
    unit = np.zeros(intervals + 1)
    unit[intervals] = 1.0
    inner = np.sort(legendre.legroots(legendre.legder(unit)).real) if intervals > 1 else np.zeros(0)
    for _ in range(3):  # the roots of the companion matrix, polished
        slope = legendre.legval(inner, legendre.legder(unit, 2)) if intervals > 1 else 1.0
        inner = inner - legendre.legval(inner, legendre.legder(unit)) / slope if intervals > 1 else inner
    places = np.concatenate([[-1.0], inner, [1.0]])
    weights = 2.0 / (intervals * (intervals + 1) * legendre.legval(places, unit) ** 2)
    return places, weights

"""The elements of a curve over 0 <= s <= 1: their borders, and how places in them are spread where an end is steep.

The polynomials of one element on -1 <= xi <= 1 are Hermite functions of its two ends, and bubbles that vanish there. With
``r`` continuous values (q and r - 1 derivatives) the bubbles are r-fold integrals of Legendre polynomials, which keeps the
matrices well conditioned (Szabo, Babuska, Finite element analysis, 1991, ch. 3).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from itertools import pairwise

import numpy as np
from msgspec import Struct
from numpy.polynomial import legendre
from numpy.typing import NDArray

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


POWER = 2
"""Of s by which integrals over an element with a steep end are spread: 1/sqrt(s) becomes constant."""
SHARE = 0.15
"""Of a steep element that its steep part keeps when it is halved: about the best for singular ends."""


class Mesh(Struct, frozen=True, eq=False):
    """``nodes`` ascend from 0 to 1; ``steep`` is -1 or 1 in an element whose left or right end is steep, else 0."""

    nodes: Array
    steep: NDArray[np.int64]
    degree: int

    @property
    def count(self) -> int:
        return len(self.steep)

    def places(self, xi: Array) -> Array:
        """Return s at places of all elements, shape (elements, places)."""
        left, right = self.nodes[:-1, None], self.nodes[1:, None]
        return np.where(xi > 0, right - (right - left) * (1 - xi) / 2, left + (right - left) * (1 + xi) / 2)

    def derivatives(self, r: int, xi: Array, depth: int) -> Array:
        """Return the functions of each element and their derivatives by s: shape (depth + 1, elements, places, functions)."""
        return self._scaled(r, values(self.degree, r, xi, depth)[:, None], slice(None))

    def values_in(self, element: NDArray[np.int64], r: int, xi: Array, depth: int) -> Array:
        """Return the functions at one place in each of some elements: shape (depth + 1, places, functions)."""
        half = np.diff(self.nodes)[element, None] / 2
        found = values(self.degree, r, xi, depth)
        for k in range(1, depth + 1):
            found[k] /= half**k
        for m in range(1, r):
            found[:, :, [m, r + m]] *= half**m
        return found

    def _scaled(self, r: int, by_xi: Array, which: slice | NDArray[np.bool_]) -> Array:
        half = np.diff(self.nodes)[which, None, None] / 2
        found = np.empty((len(by_xi), len(half), *by_xi.shape[2:]))
        for k in range(len(by_xi)):
            found[k] = by_xi[k] / half**k
        for m in range(1, r):  # derivatives at the ends are those by s
            for j in (m, r + m):
                found[:, :, :, j] *= half[None, :, :, 0] ** m
        return found

    def quadrature(self, r: int, xi: Array, weights: Array, depth: int) -> tuple[Array, Array, Array]:
        """Return places s, functions with their derivatives, and weights; dense at steep ends."""
        s = self.places(xi)
        functions = self.derivatives(r, xi, depth)
        spread = weights * np.diff(self.nodes)[:, None] / 2
        for side in (-1, 1):
            rows = self.steep == side
            if not rows.any():
                continue
            left, right = self.nodes[:-1][rows, None], self.nodes[1:][rows, None]
            eta = (1 - side * xi) / 2
            near = (right - left) * eta**POWER
            s[rows] = right - near if side > 0 else left + near
            spread[rows] = weights * (right - left) * POWER * eta ** (POWER - 1) / 2
            inside = side * (1 - 2 * eta**POWER)
            functions[:, rows] = self._scaled(r, values(self.degree, r, inside, depth)[:, None], rows)
        return s, functions, spread

    def find(self, s: Array) -> tuple[NDArray[np.int64], Array]:
        """Return the element of each place and xi in it; a border belongs to the element on its right."""
        element = np.clip(np.searchsorted(self.nodes, s, side="right") - 1, 0, self.count - 1)
        left, right = self.nodes[element], self.nodes[element + 1]
        share = np.clip((s - left) / (right - left), 0.0, 1.0)
        rest = np.clip((right - s) / (right - left), 0.0, 1.0)
        return element, np.where(share < 0.5, 2 * share - 1, 1 - 2 * rest)

    def refined(self, marked: NDArray[np.bool_]) -> Mesh:
        """Return the mesh with marked elements halved; a steep one stays steep in its outer half."""
        nodes: list[float] = [0.0]
        steep: list[int] = []
        for e in range(self.count):
            left, right, side = self.nodes[e], self.nodes[e + 1], int(self.steep[e])
            if marked[e]:
                share = 0.5 if not side else SHARE if side < 0 else 1 - SHARE
                nodes.append(left + share * (right - left))
                steep.append(side if side < 0 else 0)
                steep.append(side if side > 0 else 0)
            else:
                steep.append(side)
            nodes.append(right)
        return Mesh(np.array(nodes), np.array(steep, dtype=np.int64), self.degree)

    def of_degree(self, degree: int) -> Mesh:
        return Mesh(self.nodes, self.steep, degree)


def mesh_of(breaks: Sequence[float], elements: int, degree: int, steep: tuple[bool, bool]) -> Mesh:
    """Return elements of about one length between borders that are given."""
    borders = np.unique(np.concatenate([[0.0, 1.0], np.asarray(breaks, dtype=float)]))
    keep = [borders[0]]
    for b in borders[1:]:
        if b - keep[-1] > 1e-12:
            keep.append(b)
    keep[-1] = 1.0
    nodes = [0.0]
    for a, b in pairwise(keep):
        count = max(1, round(elements * (b - a)))
        nodes += [a + (b - a) * k / count for k in range(1, count)] + [b]
    flags = np.zeros(len(nodes) - 1, dtype=np.int64)
    if steep[0]:
        flags[0] = -1
    if steep[1]:
        flags[-1] = 1
    if steep[0] and steep[1] and len(flags) == 1:
        return Mesh(np.array([0.0, 0.5, 1.0]), np.array([-1, 1], dtype=np.int64), degree)
    return Mesh(np.array(nodes), flags, degree)

"""Matrices whose rank is in question: shortest solutions, null spaces, inverses.

What counts as zero is ``relative`` to the largest singular value, so rows and columns of different units must be divided by
their sizes before. Without it, what the rounding of the entries makes counts as zero. A matrix that may be all rounding, as a
difference or a product, needs the ``size`` of what it was made of: the largest singular value counts as no smaller than that.
"""

from __future__ import annotations

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

Array = NDArray[np.float64]

EPSILON = float(np.finfo(float).eps)
FORMULAS = 1e-13
"""Values of formulas, exact to rounding, of which a sum is to be found: columns that differ little must count as different."""
NEWTON = 1e-11
"""Exact derivatives at states that are on their way to a solution. A step along a weaker direction would multiply the rounding of
the residual by more than 1e11: into steps that never become short."""
POSITIONS = 1e-9
"""Derivatives of constraints and of other equations at states that are known to 1e-10 of their size, as after Newton's method."""
GRADIENTS = 1e-7
"""Gradients at states that were integrated or are farther from their constraints."""
MOTIONS = 1e-6
"""Derivatives of whole motions, which are known to about the tolerance of the integration."""


class Decomposed(Struct, frozen=True, eq=False):
    """Singular values, largest first, and the directions that belong to them: columns of ``left`` and rows of ``right``, all of
    them, also those without a value."""

    left: Array
    values: Array
    right: Array

    def rank(self, relative: float, size: float = 1e-300) -> int:
        return _above(self.values, relative, size)

    def null_space(self, relative: float, size: float = 1e-300) -> Array:
        """Return an orthonormal basis [n, n - rank] of what the matrix sends to zero."""
        return self.right[self.rank(relative, size) :].T

    def inverse(self, relative: float) -> Array:
        """Return the inverse, with the directions that count as zero left out (Moore and Penrose)."""
        kept = self.rank(relative)
        return np.asarray(
            (self.right[:kept].T / self.values[:kept]) @ self.left[:, :kept].T, dtype=np.float64
        )


def decomposed(matrix: Array) -> Decomposed:
    if not matrix.size:
        return Decomposed(np.eye(len(matrix)), np.zeros(0), np.eye(matrix.shape[1]))
    return Decomposed(*np.linalg.svd(matrix, full_matrices=True))


def decomposed_columns(matrix: Array) -> Decomposed:
    """Return what :func:`decomposed` does of a matrix with many more rows than columns, of which no row is wanted."""
    return decomposed(np.asarray(np.linalg.qr(matrix, mode="r")) if len(matrix) > matrix.shape[1] else matrix)


def singular_values(matrix: Array) -> Array:
    return np.asarray(np.linalg.svd(matrix, compute_uv=False), dtype=np.float64)


def rank(matrix: Array, relative: float, size: float = 1e-300) -> int:
    return _above(singular_values(matrix), relative, size)


def _above(values: Array, relative: float, size: float) -> int:
    return int((values > relative * values.max(initial=size)).sum())


def condition(matrix: Array) -> float:
    return float(np.linalg.cond(matrix)) if matrix.size else 1.0


def null_space(matrix: Array, relative: float, size: float = 1e-300) -> Array:
    return decomposed(matrix).null_space(relative, size)


def solve(matrix: Array, wanted: Array, relative: float | None = None) -> Array:
    """Return the shortest of all x [n] or [n, k] that leave the least of ``matrix`` x - ``wanted``."""
    return np.asarray(np.linalg.lstsq(matrix, wanted, rcond=relative)[0], dtype=np.float64)


def inverse(matrix: Array, relative: float | None = None, *, symmetric: bool = False) -> Array:
    """Return the inverse, with the directions that count as zero left out (Moore and Penrose)."""
    if relative is None:
        relative = EPSILON * max(matrix.shape)
    return np.asarray(np.linalg.pinv(matrix, relative, symmetric), dtype=np.float64)


def independent_rows(matrix: Array, relative: float, least: Array | float = 0.0) -> list[int]:
    """Return the rows of which more than a ``relative`` part is not a combination of rows before them (Gram and Schmidt, twice for
    accuracy); those no larger than the ``least`` [n], or undefined, say nothing."""
    basis: list[Array] = []
    chosen: list[int] = []
    sizes = np.linalg.norm(matrix, axis=1)
    for i in np.flatnonzero((sizes > least) & np.isfinite(sizes)):
        rest = matrix[i] / sizes[i]
        for _ in range(2):
            for b in basis:
                rest = rest - (b @ rest) * b
        length = float(np.linalg.norm(rest))
        if length > relative:
            basis.append(rest / length)
            chosen.append(int(i))
    return chosen

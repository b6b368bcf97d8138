"""Singular values of small matrices, by rotations of their columns, which take less time than NumPy takes to load."""

from __future__ import annotations

import math
import sys

from ..arrays.choice import np
from ..problem import Array

MOST = 20_000
"""Products in one round of rotations above which NumPy does it."""
ROUNDS = 60
"""Rounds at most; few are needed, each squares what is left."""


def singular_values(rows: Array) -> list[float]:
    """Give the singular values of a matrix [m, n] with m >= n > 0, the largest first.

    M. R. Hestenes, Inversion of matrices by biorthogonalization and related results, J. SIAM 6 (1958).
    """
    m, n = rows.shape
    if m * n * n > MOST:
        return [float(value) for value in np.linalg.svd(rows, compute_uv=False)]
    columns = [rows[:, k].tolist() for k in range(n)]
    for _ in range(ROUNDS):
        turned = [_turn(columns, i, j) for i in range(n) for j in range(i + 1, n)]
        if not any(turned):
            break
    return sorted((math.hypot(*column) for column in columns), reverse=True)


def _turn(columns: list[list[float]], i: int, j: int) -> bool:
    """Turn two columns so that they are orthogonal; tell whether they were not."""
    a, b = columns[i], columns[j]
    aa, bb, ab = _product(a, a), _product(b, b), _product(a, b)
    if not abs(ab) > sys.float_info.epsilon * math.sqrt(aa * bb):
        return False
    half = (bb - aa) / (2 * ab)
    t = math.copysign(1.0, half) / (abs(half) + math.hypot(1.0, half))
    c = 1 / math.hypot(1.0, t)
    s = c * t
    columns[i] = [c * x - s * y for x, y in zip(a, b, strict=True)]
    columns[j] = [s * x + c * y for x, y in zip(a, b, strict=True)]
    return True


def _product(a: list[float], b: list[float]) -> float:
    return sum(x * y for x, y in zip(a, b, strict=True))

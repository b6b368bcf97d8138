"""Determinants by their definition (Leibniz), and systems of equations by Gauss and Jordan with exchanges of rows."""

from __future__ import annotations

from itertools import permutations
from typing import Any

import numpy as np

from oracle.series import real


def determinant(a: Any) -> Any:
    """Sum over all permutations of the products of elements, with their signs."""
    total: Any = 0.0
    for order in permutations(range(len(a))):
        turned = sum(order[i] > order[j] for i in range(len(a)) for j in range(i + 1, len(a)))
        term: Any = -1.0 if turned % 2 else 1.0
        for i, j in enumerate(order):
            term = term * a[i, j]
        total = total + term
    return total


def solved(a: Any, b: Any) -> Any:
    """Return x with a x = b, a vector or a matrix."""
    n = len(a)
    rows = [[*a[i], *(b[i] if b.ndim == 2 else [b[i]])] for i in range(n)]
    for k in range(n):
        pivot = max(range(k, n), key=lambda i: abs(real(rows[i][k])))
        rows[k], rows[pivot] = rows[pivot], rows[k]
        rows[k] = [x / rows[k][k] for x in rows[k]]
        for i in range(n):
            if i != k:
                factor = rows[i][k]
                rows[i] = [x - factor * y for x, y in zip(rows[i], rows[k], strict=True)]
    found = np.empty(b.shape, object)
    for i in range(n):
        for j, x in enumerate(rows[i][n:]):
            found[(i, j) if b.ndim == 2 else i] = x
    return found

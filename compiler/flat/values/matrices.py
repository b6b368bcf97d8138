"""Matrices whose values are known: exactly where their numbers are short, rounded elsewhere."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

Rows = list[list[Fraction]]

_LARGEST, _LONGEST = 8, 64
"""Rows of a matrix, and bits of a number in it, up to which results are exact."""


def determinant(a: Rows) -> Fraction:
    if not _is_short(a):
        import numpy as np

        return Fraction(float(np.linalg.det(_floats(a))))
    return _eliminated(a, [[] for _ in a])[0]


def solve(a: Rows, b: Rows) -> Rows:
    """Return x with a x = b. Raises ZeroDivisionError where a is singular."""
    if _is_short(a) and _is_short(b):
        value, found = _eliminated(a, b)
        if not value:
            raise ZeroDivisionError
        return found
    import numpy as np

    try:
        rounded = np.linalg.solve(_floats(a), _floats(b))
    except np.linalg.LinAlgError:
        raise ZeroDivisionError from None
    return [[Fraction(float(x)) for x in row] for row in rounded]


def eigenvalues(a: Rows) -> list[Fraction] | None:
    """Return real eigenvalues, the smallest first; None where some are complex."""
    import numpy as np

    matrix = _floats(a)
    if (matrix == matrix.T).all():
        found = np.linalg.eigvalsh(matrix)
    else:
        complex_ones = np.linalg.eigvals(matrix)
        if np.abs(complex_ones.imag).max() > 1e-9 * np.abs(complex_ones).max():
            return None
        found = np.sort(complex_ones.real)
    return [Fraction(float(x)) for x in found]


def _floats(rows: Rows) -> Any:
    import numpy as np

    return np.array([[float(x) for x in row] for row in rows])


def _is_short(rows: Rows) -> bool:
    return len(rows) <= _LARGEST and all(
        x.numerator.bit_length() + x.denominator.bit_length() <= _LONGEST for row in rows for x in row
    )


def _eliminated(a: Rows, b: Rows) -> tuple[Fraction, Rows]:
    """Return the determinant, and the solution where that is not zero (Gauss and Jordan)."""
    rows = [[*x, *y] for x, y in zip(a, b, strict=True)]
    n, value = len(a), Fraction(1)
    for k in range(n):
        pivot = next((i for i in range(k, n) if rows[i][k]), None)
        if pivot is None:
            return Fraction(0), []
        if pivot != k:
            rows[k], rows[pivot], value = rows[pivot], rows[k], -value
        value *= rows[k][k]
        rows[k] = [x / rows[k][k] for x in rows[k]]
        for i in range(n):
            if i != k and (factor := rows[i][k]):
                rows[i] = [x - factor * y for x, y in zip(rows[i], rows[k], strict=True)]
    return value, [row[n:] for row in rows]

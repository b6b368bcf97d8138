"""Functions of numbers that Python's ``math`` lacks; generated modules hold those that they use.

``lookup`` follows ``graph.Table`` and the C text operation by operation, so that all give the same bits.
"""

from __future__ import annotations

import math
from bisect import bisect_right


def floor(x: float) -> float:
    return math.copysign(float(math.floor(x)), x)


def sign(x: float) -> float:
    return 1.0 if x > 0.0 else -1.0 if x < 0.0 else x


# C's fmin and fmax drop NaN; these keep it, like NumPy


def minimum(a: float, b: float) -> float:
    return a if a < b or a != a else b


def maximum(a: float, b: float) -> float:
    return a if a > b or a != a else b


def select(condition: bool, a: float, b: float) -> float:
    return a if condition else b


def negation(condition: bool) -> bool:
    return not condition


def lookup(table: tuple[tuple[float, ...], ...], order: int, x: float) -> float:
    """Return the value (order 0) or a derivative of the cubic through (points, values, slopes) at x."""
    points, values, slopes = table
    if x != x:
        return x
    if not points[0] <= x < points[-1]:
        end = 0 if x < points[0] else -1
        if order == 0:
            return values[end] + slopes[end] * (x - points[end])
        return slopes[end] if order == 1 else 0.0
    i = bisect_right(points, x) - 1
    h = points[i + 1] - points[i]
    s = x - points[i]
    d0, d1 = slopes[i], slopes[i + 1]
    secant = (values[i + 1] - values[i]) / h
    c2 = (3.0 * secant - 2.0 * d0 - d1) / h
    c3 = (d0 + d1 - 2.0 * secant) / (h * h)
    if order == 0:
        return values[i] + s * (d0 + s * (c2 + s * c3))
    if order == 1:
        return d0 + s * (2.0 * c2 + s * 3.0 * c3)
    return 2.0 * c2 + 6.0 * c3 * s if order == 2 else 6.0 * c3


def element(values: tuple[float, ...], index: float) -> float:
    """Return the number with an index, a whole one; the first and last ones beyond the ends."""
    last = len(values) - 1
    return values[int(index)] if 0.0 < index < last else values[last if index >= last else 0]


def cell(points: tuple[float, ...], x: float) -> float:
    """Return the index of the last point but one that is not above x."""
    return float(bisect_right(points, x, 1, len(points) - 1) - 1) if x == x else 0.0

"""Tables: cubic interpolation of given points with a continuous first derivative, and plain numbers to read and search."""

from __future__ import annotations

from bisect import bisect_right
from itertools import pairwise

from msgspec import Struct

from .scalar_functions import cell, element

ELEMENT, CELL = 4, 5
"""Questions about ``Samples`` that stand where the order of the derivative of a ``Table`` stands."""


class Samples(Struct, frozen=True, tag=True):
    """Numbers that formulas read one at a time, or whose interval around an argument they look for."""

    values: tuple[float, ...]

    def __call__(self, x: float, question: int) -> float:
        """Return the number with the index ``x``, a whole one, the first and last ones beyond the ends (ELEMENT); or the
        index of the last number but one that is not above ``x``, of ascending ones (CELL)."""
        return element(self.values, x) if question == ELEMENT else cell(self.values, x)


class Table(Struct, frozen=True, tag=True):
    """A C1 cubic through (points[i], values[i]) with slopes[i]; ``points`` ascend strictly.

    Outside the range it goes on as a straight line with the slope at the end.
    """

    points: tuple[float, ...]
    values: tuple[float, ...]
    slopes: tuple[float, ...]

    def __post_init__(self) -> None:
        if len(self.points) < 2:
            raise ValueError("a table needs at least two points")
        if not len(self.points) == len(self.values) == len(self.slopes):
            raise ValueError("points, values and slopes of a table differ in number")
        if any(b <= a for a, b in pairwise(self.points)):
            raise ValueError("the points of a table must ascend")

    def __call__(self, x: float, order: int = 0) -> float:
        """Return the value (order 0) or a derivative (1 to 3) at ``x``; NaN at NaN.

        At a breakpoint the higher derivatives are those of the interval on its right.
        """
        points = self.points
        if not points[0] <= x < points[-1]:
            return self._beyond(x, order)
        i = bisect_right(points, x) - 1
        h = points[i + 1] - points[i]
        d0, d1 = self.slopes[i], self.slopes[i + 1]
        secant = (self.values[i + 1] - self.values[i]) / h
        # value + s (d0 + s (c2 + s c3)) with s = x - points[i]
        c2 = (3.0 * secant - 2.0 * d0 - d1) / h
        c3 = (d0 + d1 - 2.0 * secant) / (h * h)
        s = x - points[i]
        match order:
            case 0:
                return self.values[i] + s * (d0 + s * (c2 + s * c3))
            case 1:
                return d0 + s * (2.0 * c2 + s * 3.0 * c3)
            case 2:
                return 2.0 * c2 + 6.0 * c3 * s
            case 3:
                return 6.0 * c3
            case _:
                raise ValueError(f"derivative of order {order}")

    def _beyond(self, x: float, order: int) -> float:
        if x != x:
            return x
        end = 0 if x < self.points[0] else -1
        match order:
            case 0:
                return self.values[end] + self.slopes[end] * (x - self.points[end])
            case 1:
                return self.slopes[end]
            case _:
                return 0.0


def answers(table: Table | Samples, order: int) -> bool:
    """Tell whether a table has an answer to a question."""
    return order in ((ELEMENT, CELL) if isinstance(table, Samples) else range(ELEMENT))


def question(order: int) -> str:
    """Return the name of the function that answers a question, the same in all targets."""
    return {ELEMENT: "element", CELL: "cell"}.get(order, "lookup")


def monotone_table(points: tuple[float, ...], values: tuple[float, ...]) -> Table:
    """Return the table whose slopes keep rising data rising and falling data falling."""
    return Table(points, values, monotone_slopes(points, values))


def monotone_slopes(points: tuple[float, ...], values: tuple[float, ...]) -> tuple[float, ...]:
    """Return slopes at points that keep rising data rising and falling data falling.

    They are weighted harmonic means of the neighbouring secants (F. N. Fritsch, J. Butland, SIAM J. Sci.
    Stat. Comput. 5 (1984) 300); at the ends a limited three-point formula.
    """
    if len(points) != len(values) or len(points) < 2:
        raise ValueError("a table needs at least two points, and one value for each")
    if any(b <= a for a, b in pairwise(points)):
        raise ValueError("the points of a table must ascend")
    h = [b - a for a, b in pairwise(points)]
    secants = [(b - a) / w for a, b, w in zip(values, values[1:], h, strict=False)]
    if len(points) == 2:
        return secants[0], secants[0]
    slopes = [_end_slope(h[0], h[1], secants[0], secants[1])]
    for i in range(1, len(points) - 1):
        left, right = secants[i - 1], secants[i]
        if left * right <= 0.0:
            slopes.append(0.0)
        else:
            w1, w2 = 2.0 * h[i] + h[i - 1], h[i] + 2.0 * h[i - 1]
            slopes.append((w1 + w2) / (w1 / left + w2 / right))
    slopes.append(_end_slope(h[-1], h[-2], secants[-1], secants[-2]))
    return tuple(slopes)


def _end_slope(h0: float, h1: float, s0: float, s1: float) -> float:
    slope = ((2.0 * h0 + h1) * s0 - h0 * s1) / (h0 + h1)
    if slope * s0 <= 0.0:
        return 0.0
    if s0 * s1 <= 0.0 and abs(slope) > 3.0 * abs(s0):
        return 3.0 * s0
    return slope

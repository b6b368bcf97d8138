"""Gragg's method with extrapolation, in any arithmetic: any order, so any precision, where there is no compiled kernel.

E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd ed., Springer 1993, section II.9.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

Numbers = list[Any]
Rates = Callable[[Any, Numbers], Numbers]

COLUMNS = 16
"""Most rows of the table: order 32."""
FEWEST = 6
"""A step that converges earlier is followed by a longer one."""


class NoConvergence(Exception):
    """The step has become too small."""


def extrapolate(
    rates: Rates, begin: Any, y: Numbers, times: Sequence[Any], sizes: Sequence[Any], tolerance: Any
) -> list[Numbers]:
    """Solve y' = rates(t, y) from ``begin`` and return the states at ascending times, in the arithmetic of ``y``.

    The local error of each step stays below tolerance (sizes + |y|). Raises NoConvergence.
    """
    rows: list[Numbers] = []
    t, step = begin, None
    for end in times:
        while t < end:
            left = end - t
            h = left if step is None or step > left else step
            found, columns = _step(rates, t, y, h, sizes, tolerance)
            if found is None:
                step = h / 2
                if step < left * tolerance:
                    raise NoConvergence(f"at t = {float(t):g}")
                continue
            y, t = found, end if h == left else t + h
            if columns <= FEWEST:
                step = 2 * h
            elif step is None or h == step:
                step = h if columns < COLUMNS - 3 else 3 * h / 4
        rows.append(list(y))
    return rows


def _step(
    rates: Rates, t: Any, y: Numbers, h: Any, sizes: Sequence[Any], tolerance: Any
) -> tuple[Numbers | None, int]:
    """Return the state after a step and the rows it took; None where the table does not converge."""
    first = rates(t, y)
    table: list[Numbers] = []
    for k in range(1, COLUMNS + 1):
        row = _midpoints(rates, t, y, first, h, 2 * k)
        previous, table = table, [row]
        for j in range(1, k):
            ratio = _ratio(h, k, k - j)
            table.append([a + (a - b) / ratio for a, b in zip(table[j - 1], previous[j - 1], strict=True)])
        if k > 2:
            differences = zip(table[-1], table[-2], sizes, strict=True)
            if all(abs(a - b) <= tolerance * (size + abs(a)) for a, b, size in differences):
                return table[-1], k
    return None, COLUMNS


def _ratio(number: Any, k: int, j: int) -> Any:
    """Return (k/j)^2 - 1 in the arithmetic of a number."""
    one = number / number
    return one * (k * k - j * j) / (j * j)


def _midpoints(rates: Rates, t: Any, y: Numbers, first: Numbers, step: Any, count: int) -> Numbers:
    """Return Gragg's smoothed midpoint rule with an even number of parts."""
    h = step / count
    before, now = y, [a + h * b for a, b in zip(y, first, strict=True)]
    for i in range(1, count):
        f = rates(t + i * h, now)
        before, now = now, [a + 2 * h * b for a, b in zip(before, f, strict=True)]
    f = rates(t + step, now)
    return [(a + b + h * c) / 2 for a, b, c in zip(now, before, f, strict=True)]

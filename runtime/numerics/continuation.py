"""Solutions followed along a branch, in steps that are halved where there is none near and grow where it was easily found.

H. B. Keller, in: Applications of Bifurcation Theory (P. Rabinowitz, ed.), Academic Press 1977, 359.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Generic, TypeVar

from msgspec import Struct

from .roots import root

P = TypeVar("P")

FIRST, SHORTEST, LONGEST = 0.02, 1e-5, 0.05
"""Steps along a branch, in sizes of the unknowns and of the range of the parameter."""
GROWTH = 1.5


class Reached(Struct, Generic[P], frozen=True, eq=False):
    """Points after the last one of a branch; how many times as long the next step may be (infinite: as long as can be), and
    why the branch ends with them, if it does."""

    points: Sequence[P]
    growth: float = 1.0
    end: str = ""


def follow(
    points: Sequence[P],
    advance: Callable[[list[P], float], Reached[P] | None],
    *,
    first: float = FIRST,
    shortest: float = SHORTEST,
    longest: float = LONGEST,
    most: int,
    what: str = "point",
) -> tuple[list[P], str]:
    """Return the points of a branch from given ones on, and why they end; ``what`` a point is called.

    ``advance`` gives what lies a step of some length after the last point, None where nothing was found. It may change the last
    point in place of that. A step just after a halved one does not grow.
    """
    branch, length, shortened = list(points), first, False
    while len(branch) < most:
        found = advance(branch, length)
        if found is None:
            length, shortened = length / 2, True
            if length < shortest:
                return branch, f"no further {what} is found"
            continue
        branch += found.points
        if found.end:
            return branch, found.end
        if not shortened or found.growth == math.inf:
            length = max(shortest, min(longest, found.growth * length))
        shortened = False
    return branch, f"{most} {what}s are enough"


class _Lost(Exception):
    pass


def located(
    at: Callable[[float], P | None], test: Callable[[P], float], low: float, high: float, within: float
) -> P | None:
    """Return the point, ``within`` of its place, at which a test changes its sign; None where a point on the way is missing, or the
    sign does not change."""

    def on(place: float) -> float:
        found = at(place)
        if found is None:
            raise _Lost
        return test(found)

    try:
        return at(root(on, low, high, within))
    except (_Lost, ValueError):
        return None

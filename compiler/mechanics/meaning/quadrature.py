"""Rules for integrals inside expressions: places and weights on [0, 1], and a coarser companion that tells the error."""

from __future__ import annotations

import math
from fractions import Fraction
from functools import cache

from msgspec import Struct

Points = tuple[tuple[Fraction, Fraction], ...]
"""(place, weight), places rising."""

STEP = Fraction(1, 32)
FAR, NEAR = Fraction(113, 32), Fraction(99, 32)
"""Ends of the variable of tanh-sinh: the last place is 1e-24 from an end, which is a number of its own where the end is 0,
or 4e-16 of the width, which is one beside any end."""
SHORTER = Fraction(4, 32)
"""By so much the companion ends earlier: what both leave out at a singular end would not show."""


BENT = 5.0
"""Where an integrand bends inside of a piece, a rule is off by at most this much times its largest difference from its
companions: a power of the distance from one place, anywhere but next to an end (tests/compiler/mechanics/test_integrals.py)."""


class Rule(Struct, frozen=True):
    """``companions``: other rules, whose differences estimate the error. The first has fewer points: of what is smooth its
    difference is mostly far too large; of what bends it vanishes now and then, and those of all never together."""

    words: str
    points: Points
    companions: tuple[Points, ...]

    def seen(self, bent: bool) -> tuple[Points, ...]:
        """Return the companions that tell the error; ``bent``: the integrand may bend inside of a piece."""
        return self.companions if bent else self.companions[:1]

    def places(self, bent: bool) -> int:
        """Return how many places it takes, with those that tell the error."""
        return sum(map(len, (self.points, *self.seen(bent))))


SHORT = ((1, 8), (1, 16), (2, 16))
"""Panels and points that come first between the points of a table, of which there are many."""


@cache
def rules(pieces: bool = False) -> tuple[Rule, ...]:
    """Return the rules in the order in which they are tried: smooth integrands first, singular ends last.

    ``pieces``: between the points of a table, where short ones may do.
    """
    panels_of_points = ((4, 12), (8, 16), (16, 16), (32, 16))
    return (
        *(
            Rule(
                f"{panels} panels of {points} points",
                gauss(panels, points),
                (gauss(panels, points - 3), gauss(panels, points - 1), gauss(panels + 1, points + 1)),
            )
            for panels, points in (*(SHORT if pieces else ()), *panels_of_points)
        ),
        *(
            Rule(
                "points that crowd at the ends",
                tanh_sinh(STEP, low, high),
                (
                    tanh_sinh(2 * STEP, low - SHORTER, high - SHORTER),
                    tanh_sinh(2 * STEP / 3, low - SHORTER, high - SHORTER),
                ),
            )
            for low, high in ((FAR, FAR), (FAR, NEAR), (NEAR, FAR), (NEAR, NEAR))
        ),
    )


@cache
def gauss(panels: int, points: int) -> Points:
    """Return Gauss-Legendre quadrature on equal panels; exact to degree 2 points - 1 on each."""
    from numpy.polynomial.legendre import leggauss

    places, weights = leggauss(points)
    return tuple(
        (
            (Fraction(float(x)) + 1) / (2 * panels) + Fraction(k, panels),
            Fraction(float(w)) / (2 * panels),
        )
        for k in range(panels)
        for x, w in zip(places, weights, strict=True)
    )


@cache
def tanh_sinh(step: Fraction, low: Fraction, high: Fraction) -> Points:
    """Return double exponential quadrature (Takahasi, Mori 1974), for integrands that are singular at an end."""
    found = []
    for k in range(-int(low / step), int(high / step) + 1):
        t = float(k * step)
        inner = math.pi / 2 * math.sinh(t)
        near = Fraction(1.0 / (1.0 + math.exp(2 * abs(inner))))
        weight = Fraction(float(step) * math.pi / 4 * math.cosh(t) / math.cosh(inner) ** 2)
        found.append((near if k < 0 else 1 - near, weight))
    return tuple(found)

"""Nodes and weights for integrals inside expressions."""

from __future__ import annotations

from fractions import Fraction
from functools import cache

PANELS = 4
POINTS = 12


@cache
def panels() -> tuple[tuple[Fraction, Fraction], ...]:
    """Return (place, weight) on [0, 1]: Gauss-Legendre, 12 points on each of 4 panels."""
    from numpy.polynomial.legendre import leggauss

    places, weights = leggauss(POINTS)
    return tuple(
        (
            (Fraction(float(x)) + 1) / (2 * PANELS) + Fraction(k, PANELS),
            Fraction(float(w)) / (2 * PANELS),
        )
        for k in range(PANELS)
        for x, w in zip(places, weights, strict=True)
    )

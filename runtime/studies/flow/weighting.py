"""How people feel vibration: the frequency weightings of ISO 2631-1:1997 (Annex A), as filters of an acceleration."""

from __future__ import annotations

import math

import numpy as np
import scipy.linalg
from msgspec import Struct
from numpy.typing import NDArray

from ...local.zeros import Complex
from ...problem import Array

BUTTERWORTH = 1 / math.sqrt(2)


class Weighting(Struct, frozen=True):
    """Corner frequencies in Hz and quality factors, by the numbers of the standard: a band ``f1`` to ``f2``, the transition from acceleration to
    velocity ``f3``, ``f4``, ``q4``, and the step upward ``f5``, ``q5``, ``f6``, ``q6``; None where the weighting has none."""

    f1: float
    f2: float
    f3: float | None = None
    f4: float | None = None
    q4: float = 1.0
    f5: float | None = None
    q5: float = 1.0
    f6: float = 1.0
    q6: float = 1.0

    def polynomials(self) -> tuple[Array, Array]:
        """Return numerator and denominator in s, from the highest power down."""
        w1, w2 = 2 * math.pi * self.f1, 2 * math.pi * self.f2
        above: NDArray[np.floating] = np.array([1.0, 0.0, 0.0])
        below: NDArray[np.floating] = np.polymul(
            _quadratic(w1, BUTTERWORTH) * w1**2, _quadratic(w2, BUTTERWORTH)
        )
        if self.f4 is not None:
            below = np.polymul(below, _quadratic(2 * math.pi * self.f4, self.q4))
        if self.f3 is not None:
            above = np.polymul(above, [1 / (2 * math.pi * self.f3), 1.0])
        if self.f5 is not None:
            above = np.polymul(above, _quadratic(2 * math.pi * self.f5, self.q5) * (self.f5 / self.f6) ** 2)
            below = np.polymul(below, _quadratic(2 * math.pi * self.f6, self.q6))
        return np.asarray(above, dtype=float), np.asarray(below, dtype=float)

    def factors(self, frequencies: Array) -> Array:
        """Return by what the amplitudes of sines are multiplied; frequencies in Hz."""
        above, below = self.polynomials()
        s = 2j * math.pi * frequencies
        return np.asarray(np.abs(np.polyval(above, s) / np.polyval(below, s)))

    def weighted(self, x: Array, step: float) -> Array:
        """Return a signal [n], ``step`` seconds apart, after the filter, which is at rest before; a cubic spline goes through the samples, and
        the filter answers that exactly."""
        from scipy.interpolate import CubicSpline
        from scipy.signal import lfilter

        above, below = self.polynomials()
        poles: Complex = np.asarray(np.roots(below), dtype=complex)
        shares = np.polyval(above, poles) / np.polyval(np.polyder(below), poles)
        pieces = CubicSpline(step * np.arange(len(x)), x).c[::-1]  # by powers of the time in each piece
        found = np.zeros(len(x), dtype=complex)
        for pole, share in zip(poles, shares, strict=True):
            chain = np.diag(np.array([pole, 0, 0, 0, 0])) + np.diag(np.ones(4), 1)
            moved = scipy.linalg.expm(chain * step)[0]
            push = moved[1:] * np.array([1, 1, 2, 6]) @ pieces
            found[1:] += share * lfilter([1.0], [1.0, -moved[0]], push)
        return np.asarray(found.real)


def _quadratic(w: float, q: float) -> Array:
    """Return 1 + s/(q w) + (s/w)^2."""
    return np.array([1 / w**2, 1 / (q * w), 1.0])


WEIGHTINGS = {
    "ISO2631-Wk": Weighting(0.4, 100, 12.5, 12.5, 0.63, 2.37, 0.91, 3.35, 0.91),
    "ISO2631-Wd": Weighting(0.4, 100, 2, 2, 0.63),
    "ISO2631-Wf": Weighting(0.08, 0.63, None, 0.25, 0.86, 0.0625, 0.80, 0.1, 0.80),
    "ISO2631-Wc": Weighting(0.4, 100, 8, 8, 0.63),
    "ISO2631-We": Weighting(0.4, 100, 1, 1, 0.63),
    "ISO2631-Wj": Weighting(0.4, 100, None, None, 1.0, 3.75, 0.91, 5.32, 0.91),
}
"""Vertical and horizontal vibration of the seat, motion sickness, the backrest, rotation, the head of who lies."""

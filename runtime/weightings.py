"""How people feel vibration: the frequency weightings of ISO 2631-1:1997 (Annex A), as filters of an acceleration."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from msgspec import Struct

if TYPE_CHECKING:
    from .problem import Array
else:  # the compiler takes the filters as formulas, without NumPy
    Array = Any

BUTTERWORTH = 1 / math.sqrt(2)

Quadratic = tuple[float, float, float]
"""Coefficients of 1, s and s^2."""


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

    def sections(self) -> tuple[tuple[Quadratic, Quadratic], ...]:
        """Return numerators and denominators in s of filters that follow each other."""
        w1 = 2 * math.pi * self.f1
        found = [
            ((0.0, 0.0, 1 / w1**2), _quadratic(self.f1, BUTTERWORTH)),
            (ONE, _quadratic(self.f2, BUTTERWORTH)),
        ]
        if self.f4 is not None:
            falls = ONE if self.f3 is None else (1.0, 1 / (2 * math.pi * self.f3), 0.0)
            found.append((falls, _quadratic(self.f4, self.q4)))
        if self.f5 is not None:
            step = (self.f5 / self.f6) ** 2
            a, b, c = _quadratic(self.f5, self.q5)
            found.append(((step * a, step * b, step * c), _quadratic(self.f6, self.q6)))
        return tuple(found)

    def polynomials(self) -> tuple[Array, Array]:
        """Return numerator and denominator in s, from the highest power down."""
        import numpy as np

        above = below = np.ones(1)
        for numerator, denominator in self.sections():
            above, below = np.polymul(above, numerator[::-1]), np.polymul(below, denominator[::-1])
        return above, below

    def factors(self, frequencies: Array) -> Array:
        """Return by what the amplitudes of sines are multiplied; frequencies in Hz."""
        import numpy as np

        above, below = self.polynomials()
        s = 2j * math.pi * frequencies
        return np.asarray(np.abs(np.polyval(above, s) / np.polyval(below, s)))

    def weighted(self, x: Array, step: float) -> Array:
        """Return a signal [n], ``step`` seconds apart, after the filter, which is at rest before; a cubic spline goes through the samples, and
        the filter answers that exactly."""
        import numpy as np
        import scipy.linalg
        from scipy.interpolate import CubicSpline
        from scipy.signal import lfilter

        above, below = self.polynomials()
        poles = np.asarray(np.roots(below), dtype=complex)
        shares = np.polyval(above, poles) / np.polyval(np.polyder(below), poles)
        pieces = CubicSpline(step * np.arange(len(x)), x).c[::-1]  # by powers of the time in each piece
        found = np.zeros(len(x), dtype=complex)
        for pole, share in zip(poles, shares, strict=True):
            chain = np.diag(np.array([pole, 0, 0, 0, 0])) + np.diag(np.ones(4), 1)
            moved = scipy.linalg.expm(chain * step)[0]
            push = moved[1:] * np.array([1, 1, 2, 6]) @ pieces
            found[1:] += share * lfilter([1.0], [1.0, -moved[0]], push)
        return np.asarray(found.real)


ONE: Quadratic = (1.0, 0.0, 0.0)


def _quadratic(f: float, q: float) -> Quadratic:
    """Return 1 + s/(q w) + (s/w)^2."""
    w = 2 * math.pi * f
    return 1.0, 1 / (q * w), 1 / w**2


WEIGHTINGS = {
    "ISO2631-Wk": Weighting(0.4, 100, 12.5, 12.5, 0.63, 2.37, 0.91, 3.35, 0.91),
    "ISO2631-Wd": Weighting(0.4, 100, 2, 2, 0.63),
    "ISO2631-Wf": Weighting(0.08, 0.63, None, 0.25, 0.86, 0.0625, 0.80, 0.1, 0.80),
    "ISO2631-Wc": Weighting(0.4, 100, 8, 8, 0.63),
    "ISO2631-We": Weighting(0.4, 100, 1, 1, 0.63),
    "ISO2631-Wj": Weighting(0.4, 100, None, None, 1.0, 3.75, 0.91, 5.32, 0.91),
}
"""Vertical and horizontal vibration of the seat, motion sickness, the backrest, rotation, the head of who lies."""

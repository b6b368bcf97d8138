"""Roots and minima of functions of one variable, by SciPy."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

EPSILON = float(np.finfo(float).eps)


def root(function: Callable[[float], float], low: float, high: float, within: float = 0.0) -> float:
    """Return where a function vanishes, to rounding of the place or of the interval, or ``within`` (absolute).

    Raises ValueError where its values at both ends have one sign.
    """
    from scipy.optimize import brentq

    apart = max(within, EPSILON * abs(high - low), 1e-300)
    return float(brentq(function, low, high, xtol=apart, rtol=4 * EPSILON, maxiter=1000))


def minimum(
    function: Callable[[float], float], low: float, high: float, within: float
) -> tuple[float, float]:
    """Return where a function that falls and then rises has its least value, ``within`` (absolute), and that value."""
    from scipy.optimize import minimize_scalar

    found = minimize_scalar(function, bounds=(low, high), method="bounded", options={"xatol": within})
    return float(found.x), float(found.fun)

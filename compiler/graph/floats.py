"""Functions of floats that give what C gives: nothing raises, 1/0 is infinite, sqrt(-1) is NaN."""

from __future__ import annotations

import math
from collections.abc import Callable


def quiet(f: Callable[..., float]) -> Callable[..., float]:
    """Return the function with NaN outside its domain and infinity where it overflows."""

    def safe(*x: float) -> float:
        try:
            return f(*x)
        except ValueError:
            return math.nan
        except OverflowError:
            return math.inf

    return safe


def divide(a: float, b: float) -> float:
    if b:
        return a / b
    return (
        math.copysign(math.inf, math.copysign(1.0, a) * math.copysign(1.0, b)) if a == a and a else math.nan
    )


def log(x: float) -> float:
    if x > 0.0:
        return math.log(x)
    return -math.inf if x == 0.0 else math.nan


def atanh(x: float) -> float:
    return math.copysign(math.inf, x) if abs(x) == 1.0 else quiet(math.atanh)(x)


def sinh(x: float) -> float:
    try:
        return math.sinh(x)
    except OverflowError:
        return math.copysign(math.inf, x)


def floor(x: float) -> float:
    return math.copysign(float(math.floor(x)), x) if math.isfinite(x) else x


def modulo(a: float, b: float) -> float:
    """Return a - b floor(a/b), which takes the sign of b."""
    return a % b if b and math.isfinite(a) else math.nan


def power(a: float, b: float) -> float:
    if a == 0.0 and b < 0.0:
        return math.copysign(math.inf, a) if b % 2.0 == 1.0 else math.inf
    try:
        return math.pow(a, b)
    except OverflowError:
        return -math.inf if a < 0.0 and b % 2.0 == 1.0 else math.inf
    except ValueError:
        return math.nan

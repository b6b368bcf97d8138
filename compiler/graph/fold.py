"""Functions of exact constants, where the result is rational; None where it is not.

Everything else stays an expression (sin(1), sqrt(2)): the target computes it once, in its own arithmetic.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from math import floor, isqrt
from typing import Final

from .field import half_turns

FOLD_BITS: Final = 1024
"""Constants with larger numerators or denominators are no longer multiplied out exactly."""

# sine of the multiples of pi/6; None where it is irrational
_SINES = (
    *(Fraction(0), Fraction(1, 2), None, Fraction(1), None, Fraction(1, 2)),
    *(Fraction(0), Fraction(-1, 2), None, Fraction(-1), None, Fraction(-1, 2)),
)


def only(argument: int, value: int) -> Callable[[Fraction], Fraction | None]:
    """Return the rule of a function that is rational at one rational argument alone."""
    return lambda x: Fraction(value) if x == argument else None


def sine(x: Fraction) -> Fraction | None:
    return _sine(x, 0)


def cosine(x: Fraction) -> Fraction | None:
    return _sine(x, 3)


def _sine(x: Fraction, sixths: int) -> Fraction | None:
    """Return sin(x + sixths pi/6).

    A constant within one rounding of a multiple of pi is taken for it, so that quarter turns are exact.
    """
    turns = half_turns(x)
    if turns is None or (turns * 6).denominator != 1:
        return None
    return _SINES[(turns.numerator * 6 // turns.denominator + sixths) % 12]


def root(x: Fraction) -> Fraction | None:
    if x < 0:
        return None
    n, d = isqrt(x.numerator), isqrt(x.denominator)
    return Fraction(n, d) if n * n == x.numerator and d * d == x.denominator else None


def sign(x: Fraction) -> Fraction:
    return Fraction((x > 0) - (x < 0))


def whole(x: Fraction) -> Fraction:
    return Fraction(floor(x))


def modulo(a: Fraction, b: Fraction) -> Fraction:
    return a - b * floor(a / b)


def is_short(c: Fraction) -> bool:
    """Tell whether a constant is still multiplied out exactly."""
    return c.numerator.bit_length() <= FOLD_BITS and c.denominator.bit_length() <= FOLD_BITS

"""Functions of exact constants, where the result is rational.

Everything else stays an expression (sin(1), sqrt(2)): the target computes it once, in its own arithmetic.
"""

from __future__ import annotations

from fractions import Fraction
from math import floor, isqrt
from typing import Final

from . import operations as ops
from .field import half_turns

FOLD_BITS: Final = 1024
"""Constants with larger numerators or denominators are no longer multiplied out exactly."""

_AT_ZERO = {
    ops.SIN: 0,
    ops.COS: 1,
    ops.TAN: 0,
    ops.ASIN: 0,
    ops.ATAN: 0,
    ops.SINH: 0,
    ops.COSH: 1,
    ops.TANH: 0,
    ops.ASINH: 0,
    ops.ATANH: 0,
    ops.EXP: 1,
}
_AT_ONE = {ops.ACOS: 0, ops.LOG: 0, ops.ACOSH: 0}

# sine of the multiples of pi/6; None where it is irrational
_SINES = (
    *(Fraction(0), Fraction(1, 2), None, Fraction(1), None, Fraction(1, 2)),
    *(Fraction(0), Fraction(-1, 2), None, Fraction(-1), None, Fraction(-1, 2)),
)


def exact_unary(code: int, x: Fraction) -> Fraction | None:
    """Return the function of x if it is rational, else None.

    A constant within one rounding of a multiple of pi is taken for it, so that quarter turns are exact.
    """
    if x == 0 and code in _AT_ZERO:
        return Fraction(_AT_ZERO[code])
    if x == 1 and code in _AT_ONE:
        return Fraction(0)
    match code:
        case ops.SIN:
            return _sine(x, 0)
        case ops.COS:
            return _sine(x, 3)
        case ops.SQRT:
            return _root(x)
        case ops.ABS:
            return abs(x)
        case ops.SIGN:
            return Fraction((x > 0) - (x < 0))
        case ops.FLOOR:
            return Fraction(floor(x))
        case _:
            return None


def exact_binary(code: int, a: Fraction, b: Fraction) -> Fraction | None:
    """Return the function or comparison of two constants if it is rational, else None."""
    match code:
        case ops.MINIMUM:
            return min(a, b)
        case ops.MAXIMUM:
            return max(a, b)
        case ops.MODULO:
            return a - b * floor(a / b)
        case ops.ATAN2:
            return Fraction(0) if a == 0 and b > 0 else None
        case ops.LESS:
            return Fraction(a < b)
        case ops.LESS_EQUAL:
            return Fraction(a <= b)
        case ops.EQUAL:
            return Fraction(a == b)
        case _:
            return None


def _sine(x: Fraction, sixths: int) -> Fraction | None:
    """Return sin(x + sixths pi/6)."""
    turns = half_turns(x)
    if turns is None or (turns * 6).denominator != 1:
        return None
    return _SINES[(turns.numerator * 6 // turns.denominator + sixths) % 12]


def _root(x: Fraction) -> Fraction | None:
    if x < 0:
        return None
    n, d = isqrt(x.numerator), isqrt(x.denominator)
    return Fraction(n, d) if n * n == x.numerator and d * d == x.denominator else None


def is_short(c: Fraction) -> bool:
    """Tell whether a constant is still multiplied out exactly."""
    return c.numerator.bit_length() <= FOLD_BITS and c.denominator.bit_length() <= FOLD_BITS

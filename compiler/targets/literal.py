"""Exact constants in the words of a program text.

In double precision each form evaluates to the correctly rounded constant (multiples of pi may be rounded
twice); in higher precision none loses digits that the exact value has.
"""

from __future__ import annotations

from enum import Enum
from fractions import Fraction
from functools import lru_cache
from math import pi
from typing import Final

from msgspec import Struct

_EXACT_DIGITS: Final = 28
"""Longest finite decimal that is written out."""
_DIGITS: Final = 40
"""Enough for 113 binary digits: 36 decimal ones, and some more."""
_PI: Final = Fraction(pi)
_LARGEST_FACTOR: Final = 10**6
_POWERS: Final = (1, 2, -1, 3, -2, 4)
"""Of pi, that arise where angles and rates are squared and divided by."""
PI_DIGITS: Final = "3.1415926535897932384626433832795028841972"


class LiteralForm(Enum):
    DOUBLE = "double"  # the text of a number that a double holds exactly
    DECIMAL = "decimal"  # a decimal to be rounded in the working precision
    RATIO = "ratio"  # two whole numbers, to be divided in the working precision
    PI = "pi"  # a whole number times pi, divided by another one


class LiteralText(Struct, frozen=True):
    """``text`` of the number, or of a factor of pi; ``divisor`` of a ratio, "" for one."""

    form: LiteralForm
    text: str
    divisor: str = ""


@lru_cache(maxsize=4096)
def constant(number: Fraction) -> LiteralText:
    """Return the form in which to write an exact constant.

    Multiples of the double nearest to pi stand for multiples of pi, which is what the language means by
    them. Raises OverflowError where the number exceeds the range of a double.
    """
    turns = number / _PI
    if number and max(abs(turns.numerator), turns.denominator) < _LARGEST_FACTOR:
        n, d = turns.numerator, turns.denominator
        return LiteralText(LiteralForm.PI, {1: "", -1: "-"}.get(n, f"{n}.0"), f"{d}.0" if d != 1 else "")
    nearest = float(number)
    if nearest == number:
        return LiteralText(LiteralForm.DOUBLE, repr(nearest))
    number = with_true_pi(number)
    nearest = float(number)
    decimal = _finite_decimal(number)
    if decimal is not None:
        return LiteralText(LiteralForm.DECIMAL, decimal)
    if max(abs(number.numerator), number.denominator) < 1 << 53:
        return LiteralText(LiteralForm.RATIO, f"{number.numerator}.0", f"{number.denominator}.0")
    return LiteralText(LiteralForm.DECIMAL, _rounded_decimal(number, nearest))


def with_true_pi(number: Fraction, pi: Fraction = Fraction(PI_DIGITS)) -> Fraction:
    """Return a constant with the digits of pi instead of those of the double nearest to it, if it holds a power of that."""
    for power in _POWERS:
        factor = number / _PI**power
        if max(abs(factor.numerator), factor.denominator) < _LARGEST_FACTOR:
            return factor * pi**power
    return number


def _finite_decimal(number: Fraction) -> str | None:
    """Return the exact decimal of a number that has a short one."""
    denominator = number.denominator
    twos = (denominator & -denominator).bit_length() - 1
    rest = denominator >> twos
    fives = 0
    while rest % 5 == 0:
        rest //= 5
        fives += 1
    if rest != 1:
        return None
    places = max(twos, fives)
    return _text(number.numerator * 10**places // denominator, -places, _EXACT_DIGITS)


def _text(digits: int, exponent: int, longest: int) -> str | None:
    """Return digits 10^exponent as a decimal; None where it has more than ``longest`` digits."""
    sign = "-" if digits < 0 else ""
    text = str(abs(digits))
    stripped = text.rstrip("0")
    exponent += len(text) - len(stripped)
    if len(stripped) > longest:
        return None
    # the place of the point, counted from the first digit
    point = len(stripped) + exponent
    if not -4 < point <= longest:
        return f"{sign}{stripped[0]}.{stripped[1:] or '0'}e{point - 1}"
    if point <= 0:
        return f"{sign}0.{'0' * -point}{stripped}"
    return f"{sign}{stripped[:point].ljust(point, '0')}.{stripped[point:] or '0'}"


def _rounded_decimal(number: Fraction, nearest: float) -> str:
    """Return the number to 40 digits, or to so many that a double takes the same value from them."""
    exponent = len(str(abs(number.numerator))) - len(str(number.denominator))
    for digits in (_DIGITS, 2 * _DIGITS, 1200):
        places = digits - exponent
        text = _text(round(number * Fraction(10) ** places), -places, digits + 1)
        if text is not None and float(text) == nearest:
            return text
    raise AssertionError(f"no decimal for {number}")

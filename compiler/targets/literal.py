"""Exact constants in the words of a program text.

In double precision each form evaluates to the correctly rounded constant; in higher precision none loses
digits that the exact value has.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from fractions import Fraction
from functools import lru_cache
from math import pi
from typing import Final

_EXACT_DIGITS: Final = 28
"""Longest finite decimal that is written out."""
_DIGITS: Final = 40
"""Enough for 113 binary digits: 36 decimal ones, and some more."""
_PI: Final = Fraction(pi)
PI_DIGITS: Final = "3.1415926535897932384626433832795028841972"


class Form(Enum):
    DOUBLE = "double"  # the text of a number that a double holds exactly
    DECIMAL = "decimal"  # a decimal to be rounded in the working precision
    RATIO = "ratio"  # two whole numbers, to be divided in the working precision
    PI = "pi"


@dataclass(frozen=True, slots=True)
class Constant:
    """``text`` of the number; the divisor, of a ratio, in ``divisor``."""

    form: Form
    text: str
    divisor: str = ""


@lru_cache(maxsize=4096)
def constant(number: Fraction) -> Constant:
    """Return the form in which to write an exact constant.

    The double that is nearest to pi stands for pi, which is what the language means by it. Raises
    OverflowError where the number exceeds the range of a double.
    """
    nearest = float(number)
    if abs(number) == _PI:
        return Constant(Form.PI, "-" if number < 0 else "")
    if nearest == number:
        return Constant(Form.DOUBLE, repr(nearest))
    decimal = _finite_decimal(number)
    if decimal is not None:
        return Constant(Form.DECIMAL, decimal)
    if max(abs(number.numerator), number.denominator) < 1 << 53:
        return Constant(Form.RATIO, f"{number.numerator}.0", f"{number.denominator}.0")
    return Constant(Form.DECIMAL, _rounded_decimal(number, nearest))


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
    digits = abs(number.numerator) * 10**places // denominator
    if len(str(digits)) > _EXACT_DIGITS:
        return None
    return ("-" if number < 0 else "") + _point(digits, places)


def _point(digits: int, places: int) -> str:
    """Return digits / 10^places as text."""
    text = str(digits)
    if places > len(text) + 4 or places < 0:
        mantissa = text[0] + "." + (text[1:].rstrip("0") or "0")
        return f"{mantissa}e{len(text) - 1 - places}"
    text = text.rjust(places + 1, "0")
    whole, fraction = text[: len(text) - places], text[len(text) - places :]
    return f"{whole}.{fraction or '0'}"


def _rounded_decimal(number: Fraction, nearest: float) -> str:
    """Return the number to 40 digits, or to so many that a double takes the same value from them."""
    magnitude = abs(number)
    exponent = len(str(magnitude.numerator)) - len(str(magnitude.denominator))
    for digits in (_DIGITS, 2 * _DIGITS, 1200):
        places = digits - exponent
        scaled = round(magnitude * Fraction(10) ** places)
        text = ("-" if number < 0 else "") + _point(scaled, places)
        if float(text) == nearest:
            return text
    raise AssertionError(f"no decimal for {number}")

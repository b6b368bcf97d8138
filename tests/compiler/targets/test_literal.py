"""Exact constants as text: correctly rounded in double precision, and no digit lost in higher precision."""

from __future__ import annotations

import random
from fractions import Fraction
from math import pi

import pytest

from mechc.compiler.targets.c_forms import literal as c_literal
from mechc.compiler.targets.literal import PI_DIGITS, LiteralForm, constant
from mechc.compiler.targets.python_forms import literal as python_literal


@pytest.mark.parametrize(
    ("number", "text"),
    [
        (Fraction(0), "0.0"),
        (Fraction(7, 2), "3.5"),
        (Fraction(-3), "-3.0"),
        (Fraction(1, 10), "real(0.1)"),
        (Fraction(-981, 100), "-real(9.81)"),
        (Fraction(0.1), "0.1"),
        (Fraction(1, 3), "ratio(1.0, 3.0)"),
        (Fraction(-2, 7), "ratio(-2.0, 7.0)"),
        (Fraction(pi), "PI"),
        (-Fraction(pi), "-PI"),
        (-Fraction(pi) / 6, "-PI / 6.0"),
        (2 * Fraction(pi), "2.0 * PI"),
        (Fraction(pi) * 3 / 4, "3.0 * PI / 4.0"),
        (Fraction(pi) / 180, "PI / 180.0"),
        (Fraction(pi) * 7 / 180, "7.0 * PI / 180.0"),
        (Fraction(667430, 10**16), "real(6.6743e-11)"),
        (Fraction(10**30), "real(1.0e30)"),
        (Fraction(10**22), "1e+22"),
        (Fraction(10**30 + 1, 10), "real(100000000000000000000000000000.1)"),
        (Fraction(1, 3 * 10**20), "real(3.333333333333333333333333333333333333333e-21)"),
    ],
)
def test_text_in_c(number: Fraction, text: str) -> None:
    assert c_literal(number)[0] == text


@pytest.mark.parametrize("power", [2, 3, 4, -1, -2])
def test_powers_of_pi_have_all_digits(power: int) -> None:
    """What holds the square of the double nearest to pi means that of pi: else references are off by 1e-17."""
    text, _ = c_literal(Fraction(pi) ** power * Fraction(-4, 9))
    told = Fraction(text.replace("real(", "").replace(")", ""))
    assert abs(told / (Fraction(PI_DIGITS) ** power * Fraction(-4, 9)) - 1) < Fraction(1, 10**38)
    assert float(told) == pytest.approx(-4 / 9 * pi**power, rel=1e-15)


def values() -> list[Fraction]:
    rng = random.Random(3)
    found = [Fraction(rng.randint(-(10**9), 10**9), rng.randint(1, 10**9)) for _ in range(200)]
    found += [Fraction(rng.gauss(0, 1)) * Fraction(10) ** rng.randint(-300, 300) for _ in range(200)]
    found += [Fraction(rng.randint(1, 10**6), 10 ** rng.randint(0, 40)) for _ in range(200)]
    found += [Fraction(rng.randint(1, 10**60), rng.randint(1, 10**60)) for _ in range(200)]
    found += [
        Fraction(10) ** 308,
        Fraction(5e-324),
        Fraction(1, 10**310),
        Fraction(2**53 + 1),
        Fraction(2**54 + 3, 3),
    ]
    return found


def test_python_text_is_the_correctly_rounded_constant() -> None:
    for number in values():
        assert eval(python_literal(number)[0], {"pi": pi}) == float(number), number


def test_decimal_text_is_right_to_36_digits() -> None:
    """A double takes the rounded value from it, a quadruple 113 binary digits."""
    for number in values():
        c = constant(number)
        if c.form is LiteralForm.DECIMAL:
            assert float(c.text) == float(number)
            assert abs(Fraction(c.text) - number) <= abs(number) / 10**36
        elif c.form is LiteralForm.DOUBLE:
            assert Fraction(float(c.text)) == number
        else:
            assert Fraction(c.text) / Fraction(c.divisor) == number


def test_multiples_of_pi_mean_pi() -> None:
    """Not the double nearest to it: exactly n pi / d, which in double precision takes two roundings."""
    for degrees in range(1, 720):
        c = constant(Fraction(pi) * degrees / 180)
        assert c.form is LiteralForm.PI
        assert Fraction(c.text or 1) / Fraction(c.divisor or 1) == Fraction(degrees, 180)
        value = eval(python_literal(Fraction(pi) * degrees / 180)[0], {"pi": pi})
        assert value == pytest.approx(float(Fraction(PI_DIGITS) * degrees / 180), rel=3.4e-16, abs=0)


def test_a_number_beyond_doubles_is_refused() -> None:
    with pytest.raises(OverflowError):
        constant(Fraction(10) ** 400)

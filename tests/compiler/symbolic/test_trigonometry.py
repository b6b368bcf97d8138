"""Sums of products of sines and cosines become short, and stay equal."""

from __future__ import annotations

from random import Random

import pytest
import sympy as sp

from mechc.compiler.symbolic.equations import decimals
from mechc.compiler.symbolic.trigonometry import shorten

a, b, m, x = sp.symbols("a b m x")


@pytest.mark.parametrize(
    ("long", "short"),
    [
        (sp.cos(a) * sp.cos(b) + sp.sin(a) * sp.sin(b), sp.cos(a - b)),
        (m * sp.sin(a) ** 2 + m * sp.cos(a) ** 2, m),
        (x - x * sp.cos(a) ** 2, x * sp.sin(a) ** 2),
        (x * sp.sin(a) ** 2, x * sp.sin(a) ** 2),
        (sp.sin(a + b) * sp.cos(b) - sp.cos(a + b) * sp.sin(b), sp.sin(a)),
        (2 * sp.sin(a) * sp.cos(a) * m, m * sp.sin(2 * a)),
        (sp.cos(a) ** 2 - sp.sin(a) ** 2, sp.cos(2 * a)),
        (sp.sin(a) * sp.sin(b) / (1 + x), sp.sin(a) * sp.sin(b) / (1 + x)),
        (sp.S.Zero, sp.S.Zero),
    ],
)
def test_short_forms(long: sp.Expr, short: sp.Expr) -> None:
    assert sp.expand(shorten(long) - short) == 0


def test_random_sums_stay_equal() -> None:
    random = Random(3)
    angles = (a, b, a + b, a - 2 * b, 3 * a)
    for _ in range(30):
        terms = []
        for _ in range(random.randint(1, 8)):
            waves = [
                random.choice((sp.sin, sp.cos))(random.choice(angles)) for _ in range(random.randint(0, 4))
            ]
            terms.append(
                sp.Rational(random.randint(-5, 5), 3) * random.choice((1, m, x**2, m / x)) * sp.Mul(*waves)
            )
        total = sp.Add(*terms)
        at = {s: random.uniform(0.5, 2) for s in (a, b, m, x)}
        assert float(shorten(total).evalf(subs=at)) == pytest.approx(float(total.evalf(subs=at)), abs=1e-12)


@pytest.mark.parametrize(
    ("number", "shown"),
    [
        (sp.Rational(1.0471975511965976), "pi/3"),
        (-sp.Rational(0.7853981633974483), "-pi/4"),
        (sp.Rational(981, 100), "9.81"),
        (sp.Rational(1, 12), "1/12"),
        (sp.Rational(1, 35), "1/35"),
        (sp.Rational(1.2345678901), "1.2345678901"),
    ],
)
def test_numbers_as_readers_expect_them(number: sp.Rational, shown: str) -> None:
    assert str(decimals(number)) == shown

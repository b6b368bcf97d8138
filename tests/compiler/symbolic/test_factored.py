"""Factors of expressions are taken out where they make them shorter and are found soon."""

from __future__ import annotations

import pytest
import sympy as sp

import mechc
from mechc.compiler.symbolic.express import factored
from mechc.compiler.symbolic.layouts import write_equations

x, y, t = sp.symbols("x y t")


def test_factors_make_it_shorter_or_are_left() -> None:
    assert factored(x * y + x * t) == x * (y + t)
    assert factored(1 / (x * x + 2 * x * y + y * y)) == (x + y) ** -2
    assert factored(x * x - 1 + y) == x * x - 1 + y


@pytest.mark.parametrize(
    "high",
    [sp.Rational(67, 100) ** (sp.Rational(549999, 10**6) * t), sp.exp(x + sp.Rational(1, 400) * t), x**99],
)
def test_powers_are_not_taken_for_polynomials(high: sp.Expr, monkeypatch: pytest.MonkeyPatch) -> None:
    """Dense ones of several variables took 23 GB."""
    monkeypatch.setattr(sp, "factor", None)
    assert factored(x * high + y / (1 + x)) == x * high + y / (1 + x)


def test_equations_of_a_law_of_powers_in_time() -> None:
    text = """
    coordinate x = 1 m; kinetic 1/2*1 kg*der(x)^2; potential 1 J.m/sqrt((x - 0.7 m)^2 + 0.3 m^2);
    potential 0.56 J*0.67^(0.549999*time/(1 s));
    """
    assert "67^(0.549999*t)" in write_equations(mechc.loads(text).compilation.system, "text")

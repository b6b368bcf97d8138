"""Bounds on slopes, against closed forms: u'' = 4 where the bound is free, and the multiplier's rate is 8 where it holds."""

from __future__ import annotations

import math

import mpmath as mp
import pytest

import mechc

TEXT = """
dimensionless;
independent x from 0 to 1;
coordinate u ~ 0;
initial u = 0;
final u = 0;
stationary integral(der(u)^2 + 8*u);
{bounds}
output deep = at(u, 1/2);
"""

START = 1 - math.sqrt(0.5)
"""Where the bound lets go: -1 + 2 (1 - x)^2 = 0."""
RISE = math.sqrt(0.5)
VALUE = (START + RISE - 4 * RISE**2 + 16 / 3 * RISE**3) - 8 * (
    -(START**2) / 2 + START * (2 * RISE**2 - RISE) - RISE**2 / 2 + 4 / 3 * RISE**3
)


@pytest.mark.parametrize(
    "bounds",
    ["constraint steep: der(u) >= -1;", "constraint steep: -1 <= der(u);", "constraint steep: -der(u) <= 1;"],
)
def test_a_descent_that_is_not_to_be_steeper(bounds: str) -> None:
    found = mechc.loads(TEXT.format(bounds=bounds)).solve()
    assert (found.kind, found.outcome.value) == ("minimum", "completed")
    assert found.stationary == pytest.approx(VALUE, abs=1e-11)
    assert found(0.1)["u"] == pytest.approx(-0.1, abs=1e-12)
    rest = 0.5 - START
    assert found.outputs["deep"] == pytest.approx(-START - rest + 2 * rest**2, abs=1e-10)
    assert found(0.1)["multiplier(steep)"] == pytest.approx(8 * (0.1 - START), abs=1e-5)


def test_a_bound_on_both_sides() -> None:
    """u' = 4 x - 2 between -1 and 1: u'^2 gives 1/2 + 1/6, and u = -(x - 1/2) u' by parts twice 1/48 + 3/32."""
    bounds = "constraint falls: der(u) >= -1; constraint rises: der(u) <= 1;"
    found = mechc.loads(TEXT.format(bounds=bounds)).solve()
    places = (0.1, 0.3, 0.6, 0.9)
    slopes = [max(-1.0, min(1.0, 4 * x - 2)) for x in places]
    assert [found(x)["der(u)"] for x in places] == pytest.approx(slopes, abs=1e-8)
    assert found.stationary == pytest.approx(2 / 3 - 8 * 2 * (1 / 48 + 3 / 32), abs=1e-10)


def test_a_bound_that_is_never_reached_changes_nothing() -> None:
    """u = 2 x^2 - 2 x: 4/3 - 8/3."""
    found = mechc.loads(TEXT.format(bounds="constraint steep: der(u) >= -3;")).solve()
    assert found.stationary == pytest.approx(-4 / 3, abs=1e-12)
    assert (found.kind, found.outcome.value) == ("minimum", "completed")


def test_a_bound_on_one_of_two_coordinates() -> None:
    found = mechc.loads(
        TEXT.format(
            bounds="coordinate v ~ x; initial v = 0; final v = 1; constraint steep: der(u) >= -1;"
        ).replace("8*u)", "8*u + der(v)^2 + v^2)")
    ).solve()
    assert found.stationary == pytest.approx(VALUE + 1 / math.tanh(1), abs=1e-10)


NEWTON = """
model Newton "body of least resistance with a flat nose"
  dimensionless;
  parameter H = {height};
  independent r from 0 to 1;
  coordinate u ~ H*(1 - r);
  initial u = H;
  final u = 0;
  stationary integral(2*r/(1 + der(u)^2));
  constraint down: der(u) <= 0;
  {further}
end Newton;
"""


def newton(height: float) -> tuple[float, float]:
    """Return radius of the nose and resistance: r = (c/4) (1 + p^2)^2/p from p = 1 on, where r = c."""

    def ends(p: mp.mpf) -> tuple[mp.mpf, mp.mpf]:
        c = 4 * p / (1 + p**2) ** 2
        u = c / 4 * (p**2 + mp.mpf(3) / 4 * p**4 - mp.log(p) - mp.mpf(7) / 4)
        return c, u

    last = mp.findroot(lambda p: ends(p)[1] - height, (1.01, 8), solver="anderson")
    c = ends(last)[0]
    side = mp.quad(
        lambda p: 2 * (c / 4) * (1 + p**2) / p * (c / 4) * (3 * p**4 + 2 * p**2 - 1) / p**2, [1, last]
    )
    return float(c), float(c**2 + side)


@pytest.mark.parametrize("height", [1.0, 2.0, 4.0])
def test_newtons_body_has_a_flat_nose(height: float) -> None:
    nose, value = newton(height)
    found = mechc.loads(NEWTON.format(height=height, further="")).solve()
    assert (found.kind, found.outcome.value) == ("minimum", "completed")
    assert found.stationary == pytest.approx(value, abs=1e-11)
    assert found(nose / 2)["multiplier(down)"] == pytest.approx(-nose, rel=1e-4)
    slopes = [found(nose + aside)["der(u)"] for aside in (-1e-5, 1e-5)]
    assert slopes == pytest.approx([0, -1], abs=1e-3)


def test_the_nose_below_an_obstacle_that_it_touches() -> None:
    """A known number: 0.37481598763, with a nose of 0.3509426."""
    found = mechc.loads(NEWTON.format(height=1, further="constraint below: u <= H;")).solve()
    assert found.outcome.value == "completed"
    assert found.stationary == pytest.approx(0.37481598763, abs=1e-11)

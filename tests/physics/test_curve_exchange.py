"""Curves whose slope is infinite at an end, or that turn back: the variables are exchanged, which is told."""

from __future__ import annotations

import math

import mpmath as mp
import numpy as np
import pytest

import mechc
from mechc.runtime.curves.found import CurveSolution

mp.mp.dps = 30

DESCENT = """
model Descent
  parameter g = 9.81 m/s^2;
  parameter h = 1 m;
  independent x from 0 m to 1 m;
  coordinate y ~ {guess};
  initial y = 0 m;
  {end}
  stationary integral(sqrt((1 + der(y)^2)/(2*g*y)));
  output length = integral(sqrt(1 + der(y)^2));
  output slope = der(y);
  output bottom = at(y, 1 m);
end Descent;
"""


def cycloid(h: float) -> tuple[mp.mpf, mp.mpf]:
    """Return radius and angle of the cycloid from (0, 0) to (1, h)."""
    a = mp.findroot(lambda a: (1 - mp.cos(a)) / (a - mp.sin(a)) - h, (0.1, 6.28), solver="anderson")
    return 1 / (a - mp.sin(a)), a


@pytest.fixture(scope="module")
def descent() -> CurveSolution:
    found: CurveSolution = mechc.loads(DESCENT.format(guess="x", end="final y = h;")).solve()
    return found


def test_the_fastest_descent_over_the_width(descent: CurveSolution) -> None:
    r, a = cycloid(1)
    exact = float(mp.sqrt(r / mp.mpf("9.81")) * a)
    assert abs(descent.stationary - exact) <= 30 * descent.error <= 1e-9
    assert abs(descent.outputs["length"] - float(4 * r * (1 - mp.cos(a / 2)))) < 1e-9
    assert descent.outputs["bottom"] == pytest.approx(1.0, abs=1e-14)
    assert (descent.kind, descent.negative_directions) == ("minimum", 0)
    assert "the slope is infinite at x = 0 m" in descent.remarks[-1]
    assert descent.coordinates == ("y",)


def test_the_exchanged_curve_is_asked_by_its_own_variable(descent: CurveSolution) -> None:
    r, a = cycloid(1)
    for share in (0.1, 0.5, 0.9):
        t = share * a
        at = descent(float(r * (t - mp.sin(t))))
        assert at["y"] == pytest.approx(float(r * (1 - mp.cos(t))), rel=1e-8)
        assert at["slope"] == pytest.approx(float(mp.sin(t) / (1 - mp.cos(t))), rel=1e-6)
        assert at["der(y)"] == pytest.approx(at["slope"], rel=1e-12)
    assert np.all(np.diff(descent.places) > -1e-12)
    value, drift = descent.first_integrals["energy"]
    assert value == pytest.approx(float(-1 / mp.sqrt(4 * r * mp.mpf("9.81"))), rel=1e-9)
    # pointwise: beside the start x goes as y^(3/2), which no polynomial does
    assert drift < 1e-4 * abs(value)


@pytest.mark.parametrize(
    ("guess", "h"),
    [
        ("1 m", 1),
        pytest.param("5*x", 5, marks=pytest.mark.slow),
        pytest.param("0.3*x", 0.3, marks=pytest.mark.slow),
        # nearly level: far below both ends on the way
        ("0.1*x", 0.1),
        pytest.param("0.03*x", 0.03, marks=pytest.mark.slow),
        pytest.param("0.001*x", 0.001, marks=pytest.mark.slow),
    ],
)
def test_rough_guesses_of_it(guess: str, h: float) -> None:
    found = mechc.loads(DESCENT.format(guess=guess, end="final y = h;")).solve(set={"h": h})
    r, a = cycloid(h)
    assert abs(found.stationary - float(mp.sqrt(r / mp.mpf("9.81")) * a)) <= 30 * found.error <= 1e-9


def test_a_free_end_arrives_level() -> None:
    found = mechc.loads(DESCENT.format(guess="x", end="")).solve()
    assert abs(found.stationary - math.sqrt(math.pi / 9.81)) <= 30 * found.error <= 1e-9


ROPE = """
model Rope
  independent x from 0 m to 2 m;
  coordinate y ~ x*(2 m - x)/1 m;
  initial y = 0 m;
  final y = 0 m;
  stationary integral(y);
  constraint rope: integral(sqrt(1 + der(y)^2)) = 4 m;
end Rope;
"""


def test_a_rope_longer_than_the_half_circle_turns_back() -> None:
    """Dido's arc of length 4 over the chord 2: 2 r sin(t) = 2, 2 r t = 4, with t > pi/2."""
    t = mp.findroot(lambda t: mp.sin(t) / t - mp.mpf(1) / 2, 1.9)
    r = 2 / t
    found = mechc.loads(ROPE).solve()
    exact = float(r**2 * (t - mp.sin(t) * mp.cos(t)))
    assert abs(found.stationary - exact) <= 30 * found.error <= 1e-9
    assert found.kind == "maximum"
    assert found.multipliers["rope"] == pytest.approx(float(-r), rel=1e-9)
    value, drift = found.first_integrals["energy"]
    assert drift < 1e-9 * abs(value)
    assert "it is not a function of 'x'" in found.remarks[-1]
    with pytest.raises(ValueError, match="it turns back"):
        found(1.0)


def test_curves_that_are_found_are_left_as_they_are() -> None:
    found = mechc.loads(DESCENT.format(guess="0.2 m + x", end="").replace("y = 0 m", "y = 0.2 m")).solve()
    assert found.remarks == []

"""The curve nearest to the guess: modes of strings, and descents whose outputs lie inside of the range."""

from __future__ import annotations

import math

import mpmath as mp
import pytest

import mechc

STRING = """
model String "modes of a string whose mass per length is {weight}"
  dimensionless;
  parameter A = 1;
  independent x from 0 to 1;
  coordinate z ~ A*sin({k}*pi*x);
  initial z = 0;
  final z = 0;
  stationary integral(der(z)^2);
  constraint unit_norm: integral({weight}*z^2) = 1;
  output first = at(z, 0.25);
end String;
"""

ELSEWHERE = "little of the shape of the guess"


@pytest.mark.parametrize("k", [1, 2, 3, 4, 7])
@pytest.mark.parametrize("amplitude", [0.5, 1.4, 10])
def test_the_mode_that_is_guessed(k: int, amplitude: float) -> None:
    found = mechc.loads(STRING.format(k=k, weight=1)).solve(set={"A": amplitude})
    assert found.stationary == pytest.approx((k * math.pi) ** 2, rel=1e-11)
    assert found.negative_directions == k - 1
    assert abs(found.outputs["first"]) == pytest.approx(
        abs(math.sqrt(2) * math.sin(k * math.pi / 4)), abs=1e-9
    )
    assert not any(ELSEWHERE in r for r in found.remarks)


@pytest.mark.parametrize("k", [1, 2, 3, 4])
def test_modes_of_a_tapered_string(k: int) -> None:
    """z = (1 + x)^(1/2) sin(k pi ln(1 + x)/ln 2) solves z'' + lambda z/(1 + x)^2 = 0."""
    found = mechc.loads(STRING.format(k=k, weight="(1 + x)^(-2)")).solve(set={"A": math.sqrt(2)})
    assert found.stationary == pytest.approx((k * math.pi / math.log(2)) ** 2 + 0.25, rel=1e-11)
    assert found.negative_directions == k - 1


def test_a_curve_far_from_its_guess_is_told() -> None:
    """No mode of this string is near to five equal waves; the report says that it went elsewhere."""
    found = mechc.loads(STRING.format(k=5, weight="(1 + x)^(-2)")).solve(set={"A": math.sqrt(2)})
    modes = [(k * math.pi / math.log(2)) ** 2 + 0.25 for k in range(1, 12)]
    k = min(range(11), key=lambda i: abs(modes[i] - found.stationary))
    assert found.stationary == pytest.approx(modes[k], rel=1e-10)
    told = any(ELSEWHERE in r for r in found.remarks)
    assert told or k + 1 == 5


DESCENT = """
parameter g = 9.81 m/s^2;
independent x from 0 m to 1 m;
coordinate Length z ~ 0.7*x;
initial z = 0 m;
stationary integral(sqrt((1 + der(z)^2)/(2*g*z)));
output mid = at(z, 0.5 m);
output slope = at(der(z), 0.25 m);
output last = at(z, 1 m);
"""


def test_a_descent_to_a_vertical_line_with_values_inside() -> None:
    """A cycloid x = (t - sin t)/pi, z = (1 - cos t)/pi that arrives level, in sqrt(pi L/g)."""

    def turn(x: float) -> mp.mpf:
        return mp.findroot(lambda t: t - mp.sin(t) - mp.pi * x, 2.0)

    found = mechc.loads(DESCENT).solve()
    assert found.stationary == pytest.approx(math.sqrt(math.pi / 9.81), rel=1e-11)
    assert found.outputs["last"] == pytest.approx(2 / math.pi, rel=1e-10)
    assert found.outputs["mid"] == pytest.approx(float((1 - mp.cos(turn(0.5))) / mp.pi), rel=1e-10)
    assert found.outputs["slope"] == pytest.approx(float(mp.cot(turn(0.25) / 2)), rel=1e-9)


def test_a_curve_that_turns_back_has_no_value_at_a_place() -> None:
    """An arc of length 4 over the chord 2 is longer than the half circle, and overhangs."""
    found = mechc.loads(
        "independent x from 0 m to 2 m; coordinate Length y ~ x*(2 m - x)/(1 m); initial y = 0 m; final y = 0 m; "
        "stationary integral(y); constraint rope: integral(sqrt(1 + der(y)^2)) = 4 m; output beside = at(y, 0.1 m);"
    ).solve()
    assert any("turns back" in r for r in found.remarks)
    assert math.isnan(found.outputs["beside"])

"""Constraints that bend at a point: a corner takes what it must of the velocities, and a motion that comes to rest in it ends in words."""

from __future__ import annotations

import numpy as np
import pytest

import mechc

WIRE = """
model Wire
  parameter v = 1 m/s;
  coordinate Length x = -1 m;
  coordinate Length y ~ 1 m;
  initial der(x) = v;
  kinetic 1/2*(1 kg)*(der(x)^2 + der(y)^2);
  potential 1 kg*9.81 m/s^2*y;
  constraint %s;
  experiment(stop = 40 s);
end Wire;
"""


@pytest.mark.parametrize("law", ["y = abs(x)", "y = abs(x)/2", "y = max(-x, 2*x)", "abs(x) = y"])
@pytest.mark.parametrize("v", [1.0, -3.0])
def test_a_bead_in_the_corner_of_a_wire_comes_to_rest_in_words(law: str, v: float) -> None:
    """Without a direction at the corner, there is no motion after: for ever is no answer."""
    solution = mechc.loads(WIRE % law).simulate(set={"v": v}, estimate_error=False)
    assert solution.outcome.value == "failed"
    assert "where a constraint bends" in solution.message
    assert abs(solution["x"][-1]) < 1e-3


@pytest.mark.slow
def test_a_bend_that_is_passed_often_is_no_corner_to_rest_in() -> None:
    """Three thousand times at the same place; the motion is stated."""
    solution = mechc.loads("""
        coordinate x = 0 m;
        coordinate y = 0 m;
        kinetic 1/2*(1 kg)*(der(x)^2 + der(y)^2);
        drive x = 0.1 m*sin(time*1 s^-1*2*pi);
        constraint y = abs(x);
    """).simulate(stop=1500.1, estimate_error=False)
    assert solution.outcome.value == "completed"
    assert solution["y"][-1] == pytest.approx(0.1 * np.sin(0.2 * np.pi), rel=1e-6)


@pytest.mark.parametrize("slope", [0.5, 0.1])
def test_a_bend_takes_the_part_of_a_velocity_across_it(slope: float) -> None:
    """Without weight: the speed after is that before, times the cosine of the angle between both sides."""
    solution = mechc.loads((WIRE % f"y = {slope}*abs(x)").replace("9.81", "0")).simulate(
        stop=3.0, estimate_error=False
    )
    cosine = (1 - slope**2) / (1 + slope**2)
    assert solution["der(x)"][-1] == pytest.approx(cosine, rel=1e-8)
    assert solution["x"][-1] == pytest.approx(2 * cosine, rel=1e-8)

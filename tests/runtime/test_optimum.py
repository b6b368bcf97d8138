"""Optima: against those of closed forms."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

import mechc

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def example(name: str) -> mechc.Model:
    return mechc.load(EXAMPLES / f"{name}.mech")


def test_a_pebble_down_a_slope() -> None:
    """15 degrees above the horizontal, 7.4641 v^2/g along the slope of 60 degrees."""
    found = example("pebble_down_slope").optimum(vary="angle", goal="far")
    assert found["angle"] == pytest.approx(math.radians(15), abs=1e-8)
    assert found["far"] == pytest.approx(2 * (2 + math.sqrt(3)), rel=1e-12)
    (angle,) = (v for v in found.values if v.name == "angle")
    assert angle.error is not None and abs(angle.value - math.radians(15)) < max(angle.error, 1e-9) * 10


def test_a_car_goes_farthest_without_a_pause() -> None:
    """With the peak speed 38.730 m/s it stands after 25.8199 s at 500 m: the brakes go on at 19.365 s."""
    goal = "-(far - 500 m)^2/(1 m^2)"
    found = example("car_from_rest_to_rest").optimum(vary={"until": ("15 s", "22 s")}, goal=goal)
    assert found["until"] == pytest.approx(38.7298335 / 2, abs=1e-5)
    assert found.runs[0].time[-1] == pytest.approx(25.8198890, abs=1e-5)


def test_two_values_at_once() -> None:
    """The least of a quadratic form of the start, and the highest point of a throw."""
    text = """\
model M
  dimensionless;
  parameter a = 0.3;
  parameter b = -0.2;
  coordinate x = 0;
  initial der(x) = 1;
  kinetic 1/2*der(x)^2;
  potential x;
  output q = (a - 1)^2 + 2*(b + 2)^2 + (a - 1)*(b + 2) + 3;
  experiment(stop = 3);
end M;
"""
    found = mechc.loads(text).optimum(vary="a, b", goal="q", least=True)
    assert found["a"] == pytest.approx(1, abs=1e-7) and found["b"] == pytest.approx(-2, abs=1e-7)
    assert found["q"] == pytest.approx(3, abs=1e-13)


def test_a_bound_and_mistakes() -> None:
    model = example("pebble_down_slope")
    found = model.optimum(vary="angle = 0.5 .. 1", goal="far")
    assert found["angle"] == pytest.approx(0.5, abs=1e-4) and "bound" in found.remarks[0]
    with pytest.raises(mechc.SimulationError, match="--vary"):
        model.optimum(goal="far")
    with pytest.raises(mechc.SimulationError, match="what counts"):
        model.optimum(vary="angle", goal="far", when="later")

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
    """15 degrees above the horizontal, 7.4641 v^2/g along the slope of 60 degrees; 45 degrees less half of the slope."""
    model = example("pebble_down_slope")
    slow = model.optimum(vary="angle", goal="far", set={"slope": math.radians(20), "v0": 3, "g": 9.81})
    assert slow["angle"] == pytest.approx(math.radians(35), abs=1e-8)
    steep = math.sin(math.radians(20))  # far = v^2/(g (1 - sin(slope)))
    assert slow["far"] == pytest.approx(9 / (9.81 * (1 - steep)), rel=1e-12)
    found = model.optimum(vary="angle", goal="far")
    assert found["angle"] == pytest.approx(math.radians(15), abs=1e-8)
    assert found["far"] == pytest.approx(2 * (2 + math.sqrt(3)), rel=1e-12)
    assert found["far"] == pytest.approx(7.4641, abs=5e-5)
    (angle,) = (v for v in found.values if v.name == "angle")
    assert angle.error is not None and abs(angle.value - math.radians(15)) < max(angle.error, 1e-9) * 10


def test_a_car_goes_farthest_without_a_pause() -> None:
    """With the peak speed 38.730 m/s it stands after 25.8199 s at 500 m: the brakes go on at 19.365 s. With a pause before
    them the same way takes longer: v^2/2 (1/a + 1/b) + v p = d, in the time v (1/a + 1/b) + p."""
    goal = "-(far - 500 m)^2/(1 m^2)"
    model = example("car_from_rest_to_rest")
    found = model.optimum(vary={"until": ("15 s", "22 s")}, goal=goal)
    assert found["until"] == pytest.approx(38.7298335 / 2, abs=1e-5)
    assert found.runs[0].time[-1] == pytest.approx(25.8198890, abs=1e-5)
    assert found.runs[0]["der(x)"].max() < 38.7298335 + 1e-4
    assert found.runs[0](found["until"])["der(x)"] == pytest.approx(38.730, abs=5e-4)
    for a, b, d in ((2, 6, 500), (3, 4, 200)):
        least, both = math.sqrt(2 * d * (1 / a + 1 / b)), 1 / a + 1 / b
        for pause in (0, 0.1, 3):
            speed = (math.sqrt(pause**2 + 2 * both * d) - pause) / both
            run = model.simulate(set={"a": a, "b": b, "until": speed / a, "pause": pause}, tolerance=1e-12)
            assert isinstance(run, mechc.Solution)
            assert run["far"][-1] == pytest.approx(d, rel=1e-10)
            late = run.time[-1] - least
            assert abs(late) < 1e-9 if pause == 0 else late > 1e-4


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

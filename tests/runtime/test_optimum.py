"""Optima: against those of closed forms."""

from __future__ import annotations

import math

import pytest
from shared_models import example

import mechc


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


CLIMB = """\
model Climb
  parameter c(min = 0 N.s/m) = 0.3 N.s/m;
  parameter k = 4 N/m;
  coordinate x = 1 m;
  coordinate y = 0 m;
  initial der(y) = 1 m/s;
  kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
  potential 1/2*k*x^2 + 9.81 N*y;
  damping c on x;
  experiment(stop = 10 s, every = 1 s);
end Climb;
"""
"""A mass on a spring, and a throw whose highest point lies between two points of the output."""


def test_the_highest_value_lies_between_the_points_of_the_output() -> None:
    """v^2/(2 g), after v/g: half a second at 5 m/s, where the output has a point each second."""
    climb = mechc.loads(CLIMB)
    found = climb.optimum(vary="der(y) = 0 m/s .. 5 m/s", goal="y", when="highest")
    assert found["y"] == pytest.approx(25 / (2 * 9.81), rel=1e-12)
    lowest = climb.optimum(vary="c = 0.1 N.s/m .. 0.2 N.s/m", goal="x", when="lowest")
    decay, swing = (
        0.1,
        math.sqrt(4 - 0.1**2),
    )  # at c = 0.2 the first swing ends at -exp(-c/2 pi/w), less at less
    assert lowest["x"] == pytest.approx(-math.exp(-decay * math.pi / swing), rel=1e-10)


def test_a_value_is_looked_for_over_its_whole_range_wherever_the_model_begins() -> None:
    """cos(sqrt(k) 10 s) is greatest where sqrt(k) 10 s is a multiple of 2 pi; the model begins at 4 N/m, out of each range."""
    swing = mechc.loads(CLIMB)
    for low, high, turns in ((10, 15, 6), (4.5, 7, 4), (1.2, 2, 2)):
        found = swing.optimum(vary=f"k = {low} N/m .. {high} N/m", goal="x", set={"c": 0})
        assert found["k"] == pytest.approx((turns * 2 * math.pi / 10) ** 2, rel=1e-7)
        assert found["x"] == pytest.approx(1, abs=1e-9)


def test_a_simplex_begins_within_its_bounds() -> None:
    """The range of a throw without drag, v^2 sin(2 a)/g: at the greatest speed, 45 degrees up, from neither of which it begins."""
    text = """\
model Throw
  parameter a = 10 deg;
  parameter v = 1 m/s;
  coordinate x = 0 m;
  coordinate y = 0 m;
  initial der(x) = v*cos(a);
  initial der(y) = v*sin(a);
  kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
  potential 9.81 N*y;
  when y < 0 m then terminate("down"); end when;
  experiment(stop = 9 s);
end Throw;
"""
    found = mechc.loads(text).optimum(vary="a = 20 deg .. 80 deg, v = 2 m/s .. 4 m/s", goal="x")
    assert found["v"] == 4 and found["a"] == pytest.approx(math.pi / 4, abs=1e-4)
    assert found["x"] == pytest.approx(16 / 9.81, rel=1e-7)
    assert found.remarks[0].startswith("v: at its bound")


@pytest.mark.parametrize("bounds", ["c = 0 N.s/m .. 0.5 N.s/m", "c"])
def test_a_bound_of_zero_is_reached(bounds: str) -> None:
    """Without damping the swing is fastest, at 2 m/s; a negative one is out of the range of the model."""
    found = mechc.loads(CLIMB).optimum(vary=bounds, goal="der(x)", when="highest")
    assert found["c"] == 0 and found["der(x)"] == pytest.approx(2, rel=1e-9)
    assert found.remarks[0] == "c: at its bound, where the goal may still grow beyond"


def test_the_end_of_what_was_looked_at_is_told() -> None:
    """Without bounds a value is looked for between nothing and twice that of the model."""
    found = mechc.loads(CLIMB).optimum(vary="k", goal="-k/(1 N/m)", least=True)
    assert found["k"] == pytest.approx(8, rel=1e-5)
    assert "k: at an end of 0 .. 8, where it was looked for as it has no bounds" in found.remarks[0]

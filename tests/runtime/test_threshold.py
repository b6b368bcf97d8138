"""Thresholds by bisection against closed forms and against motions that share no code."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from shared_models import example

import mechc
from mechc.runtime.outcome import SimulationError

THROWN = """\
model Thrown
  dimensionless;
  parameter v = 1;
  coordinate h = 0;
  initial der(h) = v;
  kinetic 1/2*der(h)^2;
  potential 9.81*h;
  experiment(stop = 3);
end Thrown;
"""

TIPPING = """\
model Tipping
  dimensionless;
  parameter push = 1;
  coordinate theta = 0;
  initial der(theta) = push;
  kinetic 1/2*der(theta)^2;
  potential -cos(theta - 0.5);
  when theta > 4 then
    terminate("over");
  end when;
  experiment(stop = 60);
end Tipping;
"""


def test_a_thrown_stone_just_touches() -> None:
    """v^2 = 2 g h; the motion touches the height between two steps."""
    found = mechc.loads(THROWN).threshold(over="v = 1 .. 8", reaches="h = 1.5").summary()
    (one,) = found["thresholds"]
    assert not one["below"] and one["above"]
    assert abs(one["parameter"]["v"] - math.sqrt(2 * 9.81 * 1.5)) <= one["error"] < 1e-8


def test_the_smallest_push_that_tips() -> None:
    """Over the top at theta = pi + 0.5, from theta = 0: push^2/2 = 1 + cos(0.5), as far as motions of 60 units of time tell."""
    found = mechc.loads(TIPPING).threshold(over="push = 0 .. 3").summary()
    (one,) = found["thresholds"]
    assert one["parameter"]["push"] == pytest.approx(math.sqrt(2 * (1 + math.cos(0.5))), abs=1e-9)


def breaks(c: float, gamma: float, stop: float) -> bool:
    def beyond(t: float, y: Any) -> float:
        return float(y[0] + 2)

    beyond.terminal = True  # type: ignore[attr-defined]
    run = solve_ivp(
        lambda t, y: [y[1], c * math.sin(0.2 * t) - y[0] - y[0] ** 2 - gamma * y[1]],
        (0, stop), [0, 0], method="DOP853", rtol=1e-11, atol=1e-11, events=beyond,
    )  # fmt: skip
    return bool(len(run.t_events[0]))


def test_an_ear_drum_breaks() -> None:
    """U92: c* = 0.25688 within t = 200 (with another change of mind below it), as scipy's motions have it."""
    drum = example("forced_drum")
    found = drum.threshold(over="c = 0.2565 .. 0.2570, 6", stop=200).summary()
    (one,) = found["thresholds"]
    place = one["parameter"]["c"]
    assert place == pytest.approx(0.25688, abs=5e-6)
    assert breaks(place + 1e-8, 0.2, 200) and not breaks(place - 1e-8, 0.2, 200)


@pytest.mark.parametrize(
    ("a", "over", "exact"), [(1, "x = 0.4 .. 0.6, 3", 0.5), (-1, "x = -0.6 .. -0.4, 3", -0.5)]
)
def test_an_ear_drum_escapes_from_rest_beyond_one_half(a: int, over: str, exact: float) -> None:
    """U86: of x'' + x + a x^2 = 0; a motion that begins 1e-12 beyond has left by the time 60."""
    found = example("ear_drum").threshold(over=over, reaches=f"x = {-2 * a}", stop=60, set={"a": a}).summary()
    (one,) = found["thresholds"]
    assert one["parameter"]["x"] == pytest.approx(exact, abs=1e-11)
    assert one["above"] is (a == 1)


def test_a_slow_drive_folds_the_drum_at_a_quarter() -> None:
    """U92: x + x^2 = c has no solution below c = -1/4, where the drum is at x = -1/2."""
    text = "model D dimensionless; parameter c = 0; coordinate x = 0; kinetic 1/2*der(x)^2; potential x^2/2 + x^3/3 - c*x; end D;"
    (fold,) = mechc.loads(text).study("equilibria", over="c = -0.4 .. 0.1").summary()["special"]
    assert fold["kind"] == "fold" and fold["parameter"]["c"] == pytest.approx(-1 / 4, abs=1e-12)
    assert fold["values"]["x"] == pytest.approx(-1 / 2, abs=1e-9)


@pytest.mark.slow
def test_the_damped_drum_breaks_late() -> None:
    """U92: c* = 0.25641 within 1e4."""
    damped = (
        example("forced_drum").threshold(over="c = 0.2560 .. 0.2570, 21", stop=1e4).summary()["thresholds"]
    )
    assert damped[0]["parameter"]["c"] == pytest.approx(0.25641, abs=5e-6)


@pytest.mark.parametrize(
    ("stop", "over", "stated"),
    [
        (200, "c = 0.2360 .. 0.2361, 3", 0.2360),
        (1000, "c = 0.23420 .. 0.23425, 2", 0.2342),
        pytest.param(1e4, "c = 0.2314 .. 0.2315, 3", 0.2315, marks=pytest.mark.slow),
    ],
)
def test_thresholds_of_the_undamped_drum(stop: float, over: str, stated: float) -> None:
    """U92: 0.2360 within 200, 0.2342 within 1000, 0.2315 within 1e4 are edges that scipy's motions have, too. There are
    others, as the edge is a fractal: within 1000 one at 0.2315144, within 200 one at 0.2358204."""
    found = example("forced_drum").threshold(over=over, stop=stop, set={"gamma": 0}).summary()
    (one,) = found["thresholds"]
    place = one["parameter"]["c"]
    assert one["above"] and not one["below"] and place == pytest.approx(stated, abs=5e-5)
    if stop <= 1000:
        assert breaks(place + 1e-8, 0, stop) and not breaks(place - 1e-8, 0, stop)


def test_an_end_that_always_or_never_comes() -> None:
    model = mechc.loads(TIPPING)
    assert "at every value" in model.threshold(over="push = 2.5 .. 3, 3").message
    assert "at no value" in model.threshold(over="push = 0 .. 1, 3").message


def test_a_motion_that_fails_before_it_can_be_told_is_refused() -> None:
    text = THROWN.replace("experiment", 'assert h < 1, "too high"; experiment')
    with pytest.raises(SimulationError, match=r"whether it happens at v = .* cannot be told"):
        mechc.loads(text).threshold(over="v = 1 .. 8, 2", reaches="h = 1.5")


def test_what_is_missing_is_said() -> None:
    with pytest.raises(SimulationError, match="a threshold is sought over one quantity"):
        mechc.loads(THROWN).threshold(reaches="h = 1")


@pytest.mark.slow
def test_initial_values_and_inputs_are_varied_too() -> None:
    text = THROWN.replace("  parameter v = 1;\n", "").replace("= v;", "= 5;")
    found = mechc.loads(text).threshold(over="der(h) = 1 .. 8", reaches="h = 1.5").summary()
    assert found["thresholds"][0]["parameter"]["der(h)"] == pytest.approx(math.sqrt(3 * 9.81), abs=1e-9)
    driven = text.replace("coordinate", "input Real u = 0; coordinate").replace("9.81*h", "(9.81 - u)*h")
    (one,) = mechc.loads(driven).threshold(over="u = 0 .. 5", reaches="h = 1.5").summary()["thresholds"]
    assert one["parameter"]["u"] == pytest.approx(9.81 - 25 / 3, abs=1e-9)
    assert np.isfinite(one["error"])


@pytest.mark.parametrize("level", ["-5 m/s", "2.5 m/s"])
def test_what_jumps_reaches_both_sides_of_its_jumps(level: str) -> None:
    """A ball hits the floor with sqrt(2 g h) and leaves it with half of that: with 5 and 2.5 m/s from h = 25/(2 g) on."""
    ball = mechc.loads("""
model Ball
  parameter Length h = 1 m;
  coordinate Length y = h;
  kinetic 1/2*1 kg*der(y)^2;
  potential 9.81 N*y;
  contact floor: y restitution 0.5;
  experiment(stop = 3 s);
end Ball;
""")
    found = ball.threshold(over="h = 1 m .. 2 m, 3", reaches=f"der(y) = {level}").details["thresholds"]
    assert [one["parameter"]["h"] for one in found] == [pytest.approx(25 / (2 * 9.81), rel=1e-10)]
    assert found[0]["above"] and not found[0]["below"]
    assert not ball.threshold(over="h = 0.5 m .. 1.2 m, 3", reaches=f"der(y) = {level}").details["thresholds"]


def test_a_level_on_which_a_wall_stands_is_reached_by_every_impact() -> None:
    """A block slides to the wall from v = sqrt(2 mu g d) on; at impacts rounding decides on which side of d it is."""
    text = """
model Block
  parameter v = 3 m/s;
  coordinate Length x = 0 m;
  initial der(x) = v;
  kinetic 1/2*2 kg*der(x)^2;
  friction 0.3*2 kg*9.81 m/s^2 on x;
  contact wall: 1.5 m - x restitution 0.5;
  experiment(stop = 5 s);
end Block;
"""
    found = mechc.loads(text).threshold(over="v = 0.5 m/s .. 6 m/s, 12", reaches="x = 1.5 m")
    (one,) = found.details["thresholds"]
    assert one["above"] and one["parameter"]["v"] == pytest.approx(math.sqrt(2 * 0.3 * 9.81 * 1.5), rel=1e-9)

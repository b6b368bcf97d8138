"""Constraints that are open from the start only if the start says so: `when initial() and c then release lock;`.

Judges: closed forms of the motion with and without the constraint.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

import mechc

WHEEL = """
model Wheel
  input Angle a;
  input Angle b;
  nonholonomic constraint lock: der(b) = der(a);
  when initial() and der(b) > der(a) then release lock; end when;
end Wheel;
model M
  parameter w = 1 rad/s;
  coordinate Angle a = 0 rad;
  coordinate Angle b = 0 rad;
  initial der(a) GIVEN w;
  initial der(b) = 1 rad/s;
  kinetic 1/2*1 kg.m^2*(der(a)^2 + 3*der(b)^2);
  force 8 N.m on a;
  Wheel wheel(a = a, b = b);
  output locked = closed(wheel.lock);
  experiment(stop = 1 s);
end M;
"""


@pytest.mark.parametrize("w", [0.0, 0.5])
def test_what_runs_ahead_is_open(w: float) -> None:
    found = mechc.loads(WHEEL.replace("GIVEN", "=")).simulate(set={"w": w}, estimate_error=False)
    assert found["b"][-1] == pytest.approx(1, rel=1e-10)
    assert found["a"][-1] == pytest.approx(w + 4, rel=1e-10)
    assert not found["locked"][-1]


@pytest.mark.parametrize(("sign", "w"), [("=", 1.0), ("~", 3.0)])
def test_what_does_not_is_held_from_the_start(sign: str, w: float) -> None:
    """Guessed faster, a takes the speed of b: it is the assembly that sees to it, and nothing is lost."""
    found = mechc.loads(WHEEL.replace("GIVEN", sign)).simulate(set={"w": w}, estimate_error=False)
    assert found["a"] == pytest.approx(found["b"], abs=1e-9)
    assert found["der(b)"][-1] == pytest.approx(1 + 8 / 4, rel=1e-9)
    assert found["locked"][1:].all()  # the first row is before what happens at the start
    assert found["energy.dissipated"][-1] == pytest.approx(0, abs=1e-12)


def test_of_positions_by_a_parameter() -> None:
    text = (
        "parameter far = 0; coordinate Length x ~ 0.3 m; coordinate Length y = 2 m; initial der(x) = 0 m/s; initial der(y) = 0 m/s;\n"
        "kinetic 1/2*1 kg*(der(x)^2 + der(y)^2); potential 1/2*4 N/m*x^2; constraint hook: x = y;\n"
        "when initial() and far > 0.5 then release hook; end when; experiment(stop = 1 s);"
    )
    model = mechc.loads(text)
    held = model.simulate(estimate_error=False)
    assert held["x"] == pytest.approx(2 * np.cos(math.sqrt(2) * held.time), abs=1e-8)
    free = model.simulate(set={"far": 1.0}, estimate_error=False)
    assert free["x"] == pytest.approx(0.3 * np.cos(2 * free.time), abs=1e-8)
    assert free["y"] == pytest.approx(2, abs=1e-12)


def test_of_a_cut_joint() -> None:
    text = (
        "import mech.planar.*; parameter open = 0; gravity {0, -9.81} m/s^2; Bar bar(m = 1 kg, l = 1 m);\n"
        "Revolute pin(world -> bar.a, angle ~ 10 deg); cut Revolute hook(bar.b -> world * trans({0.6, -0.8} m));\n"
        "when initial() and open > 0.5 then release hook; end when; experiment(stop = 0.5 s);"
    )
    model = mechc.loads(text)
    held = model.simulate(estimate_error=False)
    assert held["pin.angle"] == pytest.approx(-math.atan2(0.8, 0.6), abs=1e-9)
    free = model.simulate(set={"open": 1.0}, estimate_error=False)
    assert free["pin.angle"][0] == pytest.approx(math.radians(10), rel=1e-12)
    assert free["pin.angle"][-1] < 0


def test_it_may_be_engaged_later() -> None:
    text = WHEEL.replace("GIVEN", "=").replace(
        "then release lock; end when;",
        "then release lock; elsewhen der(b) < der(a) then engage lock; end when;",
    )
    found = mechc.loads(text).simulate(set={"w": 0.0}, estimate_error=False)
    # a reaches 1 rad/s at 1/8 s; from there on both accelerate with 2 rad/s^2
    assert found["der(b)"][-1] == pytest.approx(1 + 2 * 7 / 8, rel=1e-8)


def test_several_and_plain_ones() -> None:
    text = WHEEL.replace("GIVEN", "=").replace(
        "when initial() and der(b) > der(a)", "when der(b) > der(a) and initial() and time < 1 s"
    )
    assert mechc.loads(text).simulate(set={"w": 0.0}, estimate_error=False)["b"][-1] == pytest.approx(
        1, rel=1e-10
    )

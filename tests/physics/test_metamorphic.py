"""Hybrid models beside their twins: turned, scaled, doubled, and run back to where they began."""

from __future__ import annotations

import pytest

import mechc

DISC = """
parameter al = 0 deg;
parameter g = 9.81 m/s^2;
gravity {g*sin(20 deg + al), -g*cos(20 deg + al)};
coordinate Length x ~ 0 m;
coordinate Length y ~ 0 m;
coordinate Angle a = 0 rad;
let s = cos(al)*x + sin(al)*y;
let h = -sin(al)*x + cos(al)*y;
initial s = 0 m;
initial h = 0.5 m;
initial der(a) = 10 rad/s;
frame disc = world * trans({x, y}) * rot(a);
mass 1 kg at disc;
inertia 0.005 kg.m^2 on disc;
contact floor: h - 0.1 m restitution 0.5 friction 0.3 along der(s) + 0.1 m*der(a);
output along = s;
output up = h;
"""


def test_a_disc_on_a_slope_that_is_drawn_in_other_axes() -> None:
    """Two dozen bounces, sliding and rolling, in axes turned by any angle."""
    model = mechc.loads(DISC)
    names = ("along", "up", "a", "der(a)")
    first, *others = [model.simulate(stop=2, set={"al": f"{al} deg"}) for al in (0, 30, 90, 137)]
    for other in others:
        assert len(other.events) == len(first.events)
        for name in names:
            assert other[name][-1] == pytest.approx(first[name][-1], rel=1e-9)


BALL = """
coordinate Length x{i} = 0 {unit};
coordinate Length y{i} = 0.5 {unit};
initial der(x{i}) = 1 {unit}/s;
kinetic 1/2*1 kg*(der(x{i})^2 + der(y{i})^2);
potential 1 kg*9.81 {unit}/s^2*y{i} + 1/2*3 N/m*x{i}^2;
friction 1e-1 kg.{unit}/s^2 on x{i};
contact floor{i}: y{i} restitution 0.6 friction 0.2 along der(x{i});
contact wall{i}: 0.3 {unit} - x{i} restitution 0.5;
"""


@pytest.mark.parametrize(("unit", "size"), [("mm", 1e-3), ("km", 1e3)])
def test_sizes_make_no_difference(unit: str, size: float) -> None:
    plain = mechc.loads(BALL.format(i=1, unit="m")).simulate(stop=3)
    scaled = mechc.loads(BALL.format(i=1, unit=unit)).simulate(stop=3)
    assert [e.kind for e in scaled.events] == [e.kind for e in plain.events]
    assert scaled["x1"][-1] == pytest.approx(size * plain["x1"][-1], rel=1e-9)


def test_a_system_beside_its_like() -> None:
    """What happens to two at one instant happens to each as if it were alone."""
    alone = mechc.loads(BALL.format(i=1, unit="m")).simulate(stop=3)
    both = mechc.loads(BALL.format(i=1, unit="m") + BALL.format(i=2, unit="m")).simulate(stop=3)
    assert len(both.events) == 2 * len(alone.events)
    for name in ("x1", "x2"):
        assert both[name][-1] == pytest.approx(alone["x1"][-1], abs=1e-9)


def test_back_through_steps_and_elastic_impacts() -> None:
    """Rates that are turned round lead back through every event."""
    solution = mechc.loads("""
    coordinate Length x = 0.2 m;
    coordinate Length y = 0.5 m;
    initial der(x) = 1 m/s;
    kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
    potential 1 kg*9.81 m/s^2*y + (if x > 0.6 m then 0.2 J else 0) + 0.05 J*floor(y/0.17 m);
    contact floor: y restitution 1;
    contact right: 1 m - x restitution 1;
    contact left: x restitution 1;
    when time > 1.5 s then
      reinit(der(x), -der(x));
      reinit(der(y), -der(y));
    end when;
    """).simulate(stop=3)
    assert len(solution.events) == 29  # fourteen, the turn, and the fourteen again
    end = [solution[name][-1] for name in ("x", "y", "der(x)", "der(y)")]
    assert end == pytest.approx([0.2, 0.5, -1, 0], abs=1e-12)


def test_back_through_impacts_of_a_tumbling_body() -> None:
    solution = mechc.loads("""
    gravity {0, 0, -9.81} m/s^2;
    coordinate Length x = 0 m;
    coordinate Length y = 0 m;
    coordinate Length z = 0.6 m;
    coordinate Rotation R;
    initial der(x) = 0.3 m/s;
    initial der(R) = {1, 2, 3} rad/s;
    frame body = world * trans({x, y, z}) * R;
    mass 1 kg at body;
    inertia diag({0.01, 0.02, 0.025} kg.m^2) on body;
    point a = body * {0.2, 0.1, -0.05} m;
    point b = body * {-0.2, 0.1, -0.05} m;
    point c = body * {0.1, -0.2, 0.1} m;
    contact at_a: a[3] restitution 1;
    contact at_b: b[3] restitution 1;
    contact at_c: c[3] restitution 1;
    when time > 0.6 s then
      reinit(der(R), -der(R));
      reinit(der(x), -der(x));
      reinit(der(y), -der(y));
      reinit(der(z), -der(z));
    end when;
    """).simulate(stop=1.2)
    assert [e.name for e in solution.events if e.kind == "impact"] == [
        "at_a",
        "at_c",
        "at_b",
        "at_b",
        "at_c",
        "at_a",
    ]
    end = [solution[name][-1] for name in ("x", "z", "der(x)", "der(R)[3]")]
    assert end == pytest.approx([0, 0.6, -0.3, -3], abs=1e-7)
    assert abs(solution["R[1]"][-1]) == pytest.approx(1, abs=1e-12)

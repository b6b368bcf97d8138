"""Dry friction where the motion is prescribed: reactions are m a + F sign(v), by hand; at rest the force is open."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import mechc

DRIVEN = """
model Driven
  coordinate Length x;
  drive x = {drive};
  kinetic 1/2*(2 kg)*der(x)^2;
  friction {law} on x;
  output F = reaction(x);
  experiment(stop = 2 s, every = 0.05 s);
end Driven;
"""
SINE = "0.1 m*sin(2 rad/s*time)"


def driven(drive: str = SINE, law: str = "5 N static 7 N") -> mechc.Model:
    return mechc.loads(DRIVEN.format(drive=drive, law=law))


@pytest.mark.parametrize("method", ["dop853", "radau5"])
def test_the_reaction_of_a_driven_slide(method: str) -> None:
    found = driven().simulate(method=method)
    t = found.time
    wanted = -0.8 * np.sin(2 * t) + 5 * np.sign(np.cos(2 * t))
    np.testing.assert_allclose(found["F"], wanted, atol=1e-12)
    assert found(1.0)["F"] == pytest.approx(-5.727437942, abs=1e-8)
    way = 0.1 * (2 - np.sin(4.0))  # forwards to 0.1, back to -0.0757
    assert found["energy.dissipated"][-1] == pytest.approx(5 * way, rel=1e-6)


def test_the_law_that_is_regularised() -> None:
    text = DRIVEN.format(drive=SINE, law="5 N").replace(
        "output", 'friction 1 N on x, law = "regularized", v_stick = 1 cm/s; output'
    )
    found = mechc.loads(text).simulate()
    t = found.time
    v = 0.2 * np.cos(2 * t)
    np.testing.assert_allclose(
        found["F"], -0.8 * np.sin(2 * t) + 5 * np.sign(v) + np.tanh(v / 0.01), atol=1e-11
    )


def test_at_rest_the_force_counts_as_zero_and_a_note_says_so() -> None:
    """At rest until 0.5 s, then 0.1 (t - 0.5)^4."""
    model = driven("if time < 0.5 s then 0 m else 0.1 m/s^4*(time - 0.5 s)^4")
    (note,) = [d for d in model.compilation.diagnostics if d.code == "N0724"]
    assert "at rest it may be anything up to its limit" in (note.help or "")
    found = model.simulate()
    after = found.time - 0.5
    wanted = np.where(after > 1e-9, 2.4 * after**2 + 5, 0.0)
    late = np.abs(after) > 1e-9
    np.testing.assert_allclose(found["F"][late], wanted[late], atol=1e-11)


def test_a_motion_that_begins_at_rest() -> None:
    found = driven("0.1 m*(1 - cos(2 rad/s*time))").simulate()
    t = found.time[1:]
    np.testing.assert_allclose(found["F"][1:], 0.8 * np.cos(2 * t) + 5 * np.sign(np.sin(2 * t)), atol=1e-12)


def test_a_motion_that_is_measured(tmp_path: Path) -> None:
    model = mechc.loads(
        DRIVEN.format(drive="u", law="5 N").replace(
            "coordinate", 'input Length u(interpolation = "spline") = 0 m; coordinate', 1
        )
    )
    times = np.linspace(0, 2, 21)
    file = tmp_path / "u.csv"
    rows = [f"{t!r},{math.sin(3 * t)!r}" for t in times.tolist()]
    file.write_text("\n".join(["time [s],u [m]", *rows]))
    found = model.simulate(inputs={"u": file})
    spline = CubicSpline(times, np.sin(3 * times), bc_type="natural")
    wanted = 2 * spline(found.time, 2) + 5 * np.sign(spline(found.time, 1))
    np.testing.assert_allclose(found["F"], wanted, atol=1e-10)


def test_between_two_drives_and_on_a_driven_hinge() -> None:
    """The slip of the pad against the disk decides for both; a hinge in the plane with friction in it."""
    pads: Any = mechc.loads("""
    coordinate Angle a; coordinate Angle b;
    drive a = 1 rad*sin(3 rad/s*time); drive b = 2 rad/s*time;
    kinetic 1/2*(1 kg.m^2)*(der(a)^2 + der(b)^2);
    friction 4 N.m on a - b;
    output A = reaction(a); output B = reaction(b);
    experiment(stop = 2 s);
    """).simulate()
    side = np.sign(3 * np.cos(3 * pads.time) - 2)
    np.testing.assert_allclose(pads["A"], -9 * np.sin(3 * pads.time) + 4 * side, atol=1e-11)
    np.testing.assert_allclose(pads["B"], -4 * side, atol=1e-11)
    hinge = mechc.loads("""
    import mech.planar.*;
    Bar arm(m = 3 kg, l = 1 m);
    Revolute hinge(world -> arm.a);
    drive hinge.angle = 1 rad*sin(2 rad/s*time);
    friction 0.7 N.m on hinge.angle;
    output M = reaction(hinge.angle);
    experiment(stop = 2 s);
    """).simulate()
    t = hinge.time
    np.testing.assert_allclose(hinge["M"], -4 * np.sin(2 * t) + 0.7 * np.sign(np.cos(2 * t)), atol=1e-11)


def test_a_contact_that_is_rubbed_by_a_drive() -> None:
    """A block lies on a table that is driven below it, held sideways: the drive carries mu m g against its motion."""
    found = mechc.loads("""
    coordinate Length x; coordinate Length h = 0 m;
    drive x = 0.1 m*sin(2 rad/s*time);
    kinetic 1/2*(2 kg)*der(h)^2 + 1/2*(1 kg)*der(x)^2;
    potential (2 kg)*(9.81 m/s^2)*h;
    contact top: h friction 0.3 along der(x);
    output F = reaction(x);
    experiment(stop = 2 s);
    """).simulate()
    t = found.time
    wanted = -0.4 * np.sin(2 * t) + 0.3 * 19.62 * np.sign(np.cos(2 * t))
    np.testing.assert_allclose(found["F"], wanted, atol=1e-10)
    both = mechc.loads("""
    coordinate Length x; coordinate Length y; coordinate Length h = 0 m;
    drive x = 0.3 m*sin(2 rad/s*time); drive y = 0.3 m*cos(2 rad/s*time);
    kinetic 1/2*(2 kg)*der(h)^2;
    potential (2 kg)*(9.81 m/s^2)*h;
    contact top: h friction 0.3 along {der(x), der(y)};
    output F = reaction(x); output G = reaction(y);
    experiment(stop = 2 s);
    """).simulate()
    t = both.time
    np.testing.assert_allclose(both["F"], 0.3 * 19.62 * np.cos(2 * t), atol=1e-10)
    np.testing.assert_allclose(both["G"], -0.3 * 19.62 * np.sin(2 * t), atol=1e-10)


def test_a_limit_that_follows_another_force() -> None:
    """A pendulum on a driven slide presses it: friction by the normal force, which the motion does not feel."""
    found = mechc.loads("""
    coordinate Length x; coordinate Angle a = 0.3 rad;
    parameter g = 9.81 m/s^2;
    drive x = 0.1 m*sin(2 rad/s*time);
    kinetic 1/2*(1 kg)*(der(x)^2 + 2*(1 m)*cos(a)*der(x)*der(a) + (1 m)^2*der(a)^2);
    potential -(1 kg)*g*(1 m)*cos(a);
    friction 0.2*abs(1 kg*g + 1 kg*(1 m)*der(a)^2) on x;
    output F = reaction(x);
    output N = 1 kg*g + 1 kg*(1 m)*der(a)^2;
    output rate = der(a);
    experiment(stop = 2 s);
    """).simulate(tolerance=1e-11)
    t, a, w = found.time, found["a"], found["rate"]
    ddx = -0.4 * np.sin(2 * t)
    dda = -9.81 * np.sin(a) - np.cos(a) * ddx
    wanted = ddx + np.cos(a) * dda - np.sin(a) * w**2 + 0.2 * found["N"] * np.sign(np.cos(2 * t))
    np.testing.assert_allclose(found["F"], wanted, atol=1e-8)

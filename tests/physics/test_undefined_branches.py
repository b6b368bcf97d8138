"""A branch that is not defined beyond its surface (Hertz's law) ends at the surface, not in a failure."""

from __future__ import annotations

import math

import pytest

import mechc

TOLERANCE = 1e-10


@pytest.mark.parametrize(("law", "power"), [("(x/1 m)^1.5", 1.5), ("sqrt(x/1 m)", 0.5)])
def test_a_mass_meets_an_elastic_contact_and_leaves_it(law: str, power: float) -> None:
    """It comes with 1 m/s, is pushed back, and leaves with 1 m/s; the time inside is by quadrature (beta function)."""
    stiffness = 200.0
    text = f"""
    coordinate Length x = -0.5 m;
    initial der(x) = 1 m/s;
    kinetic 1/2*1 kg*der(x)^2;
    force (if x > 0 m then -{stiffness} N*{law} else 0 N) on x;
    experiment(stop = 2 s, tolerance = {TOLERANCE});
    """
    solution = mechc.loads(text).simulate(estimate_error=False)
    n = power + 1
    depth = (n / (2 * stiffness)) ** (1 / n)  # v^2/2 = k d^n/n with v = 1
    inside = 2 * depth * math.gamma(1 + 1 / n) * math.gamma(1 / 2) / math.gamma(1 / n + 1 / 2)
    assert solution.outcome.value == "completed"
    assert solution["der(x)"][-1] == pytest.approx(-1, abs=1000 * TOLERANCE)
    assert solution["x"][-1] == pytest.approx(-(2 - 0.5 - inside), abs=1000 * TOLERANCE)


def test_a_body_leaves_an_elastic_contact_that_is_written_as_a_potential() -> None:
    """The energy of the branch that ends is undefined where it ends; a step of the energy it is not."""
    text = f"""
    coordinate Length x = 0 m;
    coordinate Length y = 1 m;
    initial der(x) = 1 m/s;
    kinetic 1/2*1 kg*der(x)^2 + 1/2*3 kg*der(y)^2;
    let depth = x - y + 0.1 m;
    potential if depth > 0 m then 2/5*1e9 N/m^1.5*depth^2.5 else 0 J;
    experiment(stop = 2 s, tolerance = {TOLERANCE});
    """
    solution = mechc.loads(text).simulate(estimate_error=False)
    assert not solution.events
    assert solution["der(x)"][-1] == pytest.approx(-0.5, abs=1000 * TOLERANCE)
    assert solution["der(y)"][-1] == pytest.approx(0.5, abs=1000 * TOLERANCE)


def test_an_energy_that_is_undefined_behind_a_surface_ends_the_run() -> None:
    """No jump can be told, so neither passing nor reflection is right; an infinite energy is a wall."""
    text = """
    coordinate Length x = 0 m;
    initial der(x) = 1 m/s;
    kinetic 1/2*1 kg*der(x)^2;
    potential if x > 1 m then BEHIND else 0 J;
    experiment(stop = 3 s);
    """
    undefined = mechc.loads(text.replace("BEHIND", "1 J*sqrt(-x/(1 m))")).simulate()
    assert undefined.outcome.value == "failed"
    assert undefined.time[-1] == pytest.approx(1, rel=1e-12)
    assert "a potential energy is not a number beyond the surface" in undefined.message
    wall = mechc.loads(text.replace("BEHIND", "1 J*(x/(1 m) + 1e200)^2")).simulate()
    assert [e.kind for e in wall.events] == ["reflection"]
    assert wall["x"][-1] == pytest.approx(-1, abs=1e-6)


def test_a_contact_that_is_undefined_at_the_start_is_named() -> None:
    text = """
    coordinate Length x = -1.2 m;
    coordinate Length y = 1.5 m;
    kinetic 1/2*(1 kg)*(der(x)^2 + der(y)^2);
    contact dome: y - sqrt(1 m^2 - x^2);
    experiment(stop = 1 s);
    """
    run = mechc.loads(text).simulate()
    assert run.outcome.value == "failed"
    assert run.message.startswith("the force of 'dome' is not a number at t = 0 s")


GUARDED = """
import mech.planar.*;
gravity {0, -9.81 m/s^2};
Body bob(m = 1 kg, J = 0.1 kg.m^2, com = {0 m, -1 m});
Revolute pin(world -> bob.a, angle = 0.3 rad);
coordinate Length rail;
drive rail = 2 m;
let v = %s;
force (if v > 0 m/s then -1 kg.m^2/s^2*(1 m/s)/v else 0.5 N.m) on pin.angle;
output hold = reaction(pin);
experiment(stop = 1 s, tolerance = 1e-10);
"""


@pytest.mark.parametrize("v", ["der(rail)", "der(pos(bob.a)[1])", "vel(bob.a)[2]", "0 m/s"])
def test_a_branch_that_is_never_taken_may_divide_by_zero(v: str) -> None:
    """What vanishes by a drive, at a joint, or by itself; beside the reaction that displaces the joint to be found."""
    guarded = mechc.loads(GUARDED % v).simulate(estimate_error=False)
    plain = mechc.loads(
        GUARDED.replace("(if v > 0 m/s then -1 kg.m^2/s^2*(1 m/s)/v else 0.5 N.m)", "0.5 N.m") % v
    )
    solution = plain.simulate(estimate_error=False)
    for name in ("pin.angle", "der(pin.angle)", "hold[1]", "hold[2]"):
        assert guarded[name] == pytest.approx(solution[name], abs=1e-9)

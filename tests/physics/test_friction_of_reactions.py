"""Dry friction whose limit holds the size of a reaction: closed forms, and equations written by hand."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from gallery import Array
from happenings import follow, times
from scipy.integrate import solve_ivp

import mechc

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"

RAIL = """model Rail
  parameter m = 1 kg;
  coordinate Length x = 0 m;
  coordinate Length y = 0 m;
  kinetic 1/2*m*(der(x)^2 + der(y)^2);
  initial der(x) = 5 m/s;
  force 3 N*cos(2 rad/s*time) on y;
  constraint rail: y = 0 m;
  friction 0.1*SIZE on x;
  experiment(stop = 4 s);
end Rail;
"""
N = "multiplier(rail)"


@pytest.mark.parametrize(
    ("size", "share"),
    [
        (f"abs({N})", 1.0),
        (f"max({N}, -{N})", 1.0),
        (f"-min({N}, -{N})", 1.0),
        (f"sign({N})*{N}", 1.0),
        (f"(if {N} < 0 N then -{N} else {N})", 1.0),
        (f"(if 0 N <= {N} then {N} else -{N})", 1.0),
        (f"max({N}, 0 N)", 0.0),
    ],
)
def test_block_pressed_to_and_fro_in_a_slot(size: str, share: float) -> None:
    """N = -3 N cos(2 t): the speed falls by 0.1 times the integral of |N|, or of the part in which N is positive."""
    solution = mechc.loads(RAIL.replace("SIZE", size)).simulate(tolerance=1e-11)
    # cos(u) over 0 to 8: 1 above to pi/2, 2 below to 3 pi/2, 2 above to 5 pi/2, then a rest below
    rest = 1 - math.cos(8 - 5 * math.pi / 2)
    below, above = 2 + rest, 3.0
    lost = 0.1 * 3 / 2 * (below + share * above)
    assert solution["der(x)"][-1] == pytest.approx(5 - lost, rel=1e-10)
    assert solution["energy.dissipated"][-1] == pytest.approx((25 - (5 - lost) ** 2) / 2, rel=1e-9)


def by_hand(t: float, state: Array) -> list[float]:
    """Angle and speed of the crank, from the equations of Newton and Euler of the three bodies."""
    (theta, omega), mu, g = state, 0.1, 9.81
    m1, m2, m3, l1, l2 = 0.5, 0.4, 0.8, 0.1, 0.3
    s, c = math.sin(theta), math.cos(theta)
    sp = -l1 * s / l2
    cp = math.sqrt(1 - sp**2)
    w = -l1 * c * omega / (l2 * cp)
    v = -l1 * s * omega - l2 * sp * w
    h = l2 / 2
    for side in (1.0, -1.0):
        # unknown: both angular accelerations, that of the piston, forces crank -> rod and rod -> piston, normal force
        a = np.array(
            [
                [m1 * l1**2 / 3, 0, 0, -l1 * s, l1 * c, 0, 0, 0],
                [-m2 * l1 * s, -m2 * h * sp, 0, -1, 0, 1, 0, 0],
                [m2 * l1 * c, m2 * h * cp, 0, 0, -1, 0, 1, 0],
                [0, m2 * l2**2 / 12, 0, -h * sp, h * cp, -h * sp, h * cp, 0],
                [0, 0, m3, 0, 0, -1, 0, mu * side * np.sign(v)],
                [0, 0, 0, 0, 0, 0, 1, 1],
                [l1 * s, l2 * sp, 1, 0, 0, 0, 0, 0],
                [l1 * c, l2 * cp, 0, 0, 0, 0, 0, 0],
            ]
        )
        b = [
            -m1 * g * l1 / 2 * c,
            m2 * (l1 * c * omega**2 + h * cp * w**2),
            m2 * (l1 * s * omega**2 + h * sp * w**2 - g),
            0,
            0,
            m3 * g,
            -l1 * c * omega**2 - l2 * cp * w**2,
            l1 * s * omega**2 + l2 * sp * w**2,
        ]
        found = np.linalg.solve(a, b)
        if found[-1] * side >= 0:
            return [omega, found[0]]
    raise AssertionError("the normal force has no sign")


def test_slider_crank_with_friction_in_its_guide() -> None:
    """The normal force of the guide changes its sign twice a turn, the friction at each dead centre."""
    solution = follow("slider_crank_friction", "coasting", tolerance=1e-11)
    assert solution["side"].min() < -10 and solution["side"].max() > 10
    hand = solve_ivp(by_hand, (0, 0.5), [math.pi / 6, 60], method="DOP853", rtol=1e-12, atol=1e-12)
    assert len(times(solution, "slip")) == int(hand.y[0, -1] / math.pi)
    # the steps of the equations by hand go over the jumps of the friction
    assert solution["main.angle"][-1] == pytest.approx(hand.y[0, -1], abs=1e-7)
    assert solution["der(main.angle)"][-1] == pytest.approx(hand.y[1, -1], abs=1e-6)


def test_work_of_the_friction_in_the_guide() -> None:
    """The heat is the integral of mu |N v|, with N and v from the outputs."""
    model = mechc.load(EXAMPLES / "slider_crank_friction.mech")
    solution = model.simulate(experiment="coasting", every=25e-6)
    power = 0.1 * np.abs(solution["side"] * solution["sliding"])
    heat = np.sum((power[1:] + power[:-1]) / 2 * np.diff(solution.time))
    # with some twenty kinks, each of which costs a trapezoid h^2/2 times its change of slope
    assert solution["energy.dissipated"][-1] == pytest.approx(heat, rel=1e-6)


PIVOT = """
import mech.planar.*;
gravity {0, -9.81} m/s^2;
Bar b(m = 1 kg, l = 1 m);
Revolute h(world -> b.a, angle = 20 deg, der(angle) = 2 rad/s);
dissipation 0.5 s^-1*WHAT;
output r = reaction(h);
output mo = moment(h);
experiment(stop = 0.1 s);
"""
WRITTEN = "(0.5*1 kg*norm(vel(b.c))^2 + 0.5*(1 kg*(1 m)^2/12)*angvel(b.a)^2)"


@pytest.mark.parametrize("asked", ["energy()", "kinetic_energy()"])
def test_a_dissipation_of_the_energy_acts_on_the_bodies_that_have_it(asked: str) -> None:
    """-p/2 on the centre and -I w/2 about it: the hinge bears the force, and no moment."""
    found, written = (mechc.loads(PIVOT.replace("WHAT", what)).simulate() for what in (asked, WRITTEN))
    assert np.abs(found["mo"]).max() < 1e-12
    for name in ("r[1]", "r[2]", "h.angle"):
        assert np.abs(found[name] - written[name]).max() < 1e-9
    a, w, s = (found[n] for n in ("h.angle", "der(h.angle)", "time"))
    assert s[-1] == 0.1
    spin = -3 / 2 * 9.81 * np.cos(a) - 0.5 * w
    across = 0.5 * spin * np.cos(a) - 0.5 * w**2 * np.sin(a) + 9.81 + 0.25 * w * np.cos(a)
    assert np.abs(found["r[2]"] - across).max() < 1e-9


@pytest.mark.parametrize(("law", "force"), [("cos(r/(1 N))", 1.0), ("acos(0.9*sin(2 N^-1*r))", math.pi / 2)])
def test_laws_of_a_reaction_that_is_always_zero(law: str, force: float) -> None:
    """What slides along a rail presses it nowhere in that direction: the law is a number, and no other force enters it."""
    text = f"""
import mech.spatial.*;
gravity {{0, 0, -9.81}} m/s^2;
Sphere ball(m = 1 kg, r = 0.5 m);
Prismatic fall(world -> ball.a, axis = {{0, 0, 1}});
Sphere slide(m = 2 kg, r = 0.5 m);
Prismatic rail(world -> slide.a, axis = {{0, 1, 0}});
let r = reaction(fall)[3];
force ({law})*1 N on rail.position;
output a = der(rail.position, 2);
"""
    solution = mechc.loads(text).simulate(stop=0.0)
    assert solution["a"][0] == pytest.approx(force / 2, rel=1e-12)

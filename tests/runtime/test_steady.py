"""Steady motions against closed forms: governor, tops, conical pendulum, circular orbits."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechc
from mechc.runtime.outcome import SimulationError
from mechc.runtime.studies.findings import Findings

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def steady(name: str, **settings: Any) -> list[dict[str, Any]]:
    found = mechc.load(EXAMPLES / f"{name}.mech").steady(**settings).summary()["steady"]
    assert isinstance(found, list)
    return found


def frequencies(one: dict[str, Any]) -> list[float]:
    return sorted(abs(v[1]) for v in one["eigenvalues"] if v[1] > 0)


def test_governor_leans_out_at_a_given_speed() -> None:
    """cos(theta) = g/(l w^2), and 0 and 180 degrees."""
    found = steady("governor", vary="theta")
    lean = math.acos(9.81 / (0.5 * 64))
    places = [one["values"]["theta"] for one in found]
    assert places == pytest.approx([-lean, 0, lean, math.pi], abs=1e-12)
    assert [one["stable"] for one in found] == [True, False, True, False]


def test_governor_with_the_momentum_of_its_start() -> None:
    """p = (I + 2 m l^2 sin^2) w with cos = g/(l w^2); the frequency is that of U'' at this momentum, by differences."""
    p = (0.2 + 0.5 * math.sin(0.5) ** 2) * 8
    for one in steady("governor"):
        theta, w = one["values"]["theta"], one["values"]["der(phi)"]
        assert (0.2 + 0.5 * math.sin(theta) ** 2) * w == pytest.approx(p, rel=1e-13)
        assert math.sin(theta) * (math.cos(theta) * 0.5 * w**2 - 9.81) == pytest.approx(0, abs=1e-11)
        if one["stable"]:

            def u(x: float) -> float:
                return p**2 / (2 * (0.2 + 0.5 * math.sin(x) ** 2)) - 9.81 * math.cos(x)

            h = 1e-3
            slope = (
                -u(theta - 2 * h) + 16 * u(theta - h) - 30 * u(theta) + 16 * u(theta + h) - u(theta + 2 * h)
            ) / (12 * h * h)
            assert frequencies(one) == pytest.approx([math.sqrt(slope / 0.5)], rel=1e-7)


def test_steady_precessions_of_a_top_are_two() -> None:
    """P13: A W^2 cos(theta) - C w3 W + m g l = 0 with w3 = psi' + W cos(theta); the stated errors hold."""
    found = steady("heavy_symmetric_top", vary="der(phi)")
    a, c, weight, theta = 0.5, 0.2, 9.81 / 2, 0.5
    spin = found[0]["values"]["der(psi)"]
    exact = sorted(np.roots([(a - c) * math.cos(theta), -c * spin, weight]))
    assert len(found) == 2 and all(one["stable"] for one in found)
    for one, rate in zip(found, exact, strict=True):
        assert abs(one["values"]["der(phi)"] - rate) <= one["errors"]["der(phi)"] + 4e-16 * rate
        assert one["errors"]["der(phi)"] < 1e-12


def test_a_top_that_spins_too_slowly_has_none() -> None:
    """(C w3)^2 < 4 A m g l cos(theta)."""
    assert steady("heavy_symmetric_top", vary="der(phi)", set={"der(psi)": 3.0}) == []


def test_conical_pendulum_and_circular_orbit() -> None:
    """W^2 = g/(l cos(theta)), in both directions; r = p^2/(m k) and the period of small deviations is that of the orbit."""
    found = steady("spherical_pendulum", vary="der(phi)")
    model = mechc.load(EXAMPLES / "spherical_pendulum.mech").simulate(stop=0.01)
    rate = math.sqrt(model.parameters["g"] / model.parameters["l"] / math.cos(model["theta"][0]))
    assert [one["values"]["der(phi)"] for one in found] == pytest.approx([-rate, rate], rel=1e-13)
    (one,) = steady("orbit_equation")
    assert one["values"] == pytest.approx({"r": 1, "der(phi)": 1}, rel=1e-13)
    assert frequencies(one) == pytest.approx([1], rel=1e-12)


def test_orbits_in_steep_fields_are_unstable() -> None:
    """U = -1/r^3: a maximum of the effective potential."""
    text = """\
model Steep
  dimensionless;
  coordinate r(min = 0.1) = 1;
  coordinate phi = 0;
  initial der(phi) = 2;
  kinetic 1/2*(der(r)^2 + r^2*der(phi)^2);
  potential -1/r^3;
end Steep;
"""
    (one,) = mechc.loads(text).steady().summary()["steady"]
    assert one["values"]["r"] == pytest.approx(3 / 4, rel=1e-12)  # p^2/r^3 = 3/r^4
    assert one["stable"] is False


def test_over_a_quantity() -> None:
    """From the speed sqrt(g/l) on the governor leans out: the number of steady motions changes there."""
    found = steady("governor", vary="theta", over="der(phi) = 4 .. 5, 5")
    for one in found:
        w, theta = one["parameter"]["der(phi)"], one["values"]["theta"]
        assert one["stable"] is (abs(theta) < 1e-9 if w < math.sqrt(2 * 9.81) else 1e-9 < abs(theta) < 3)
    assert len(found) == sum(2 if 4 + k / 4 < math.sqrt(2 * 9.81) else 4 for k in range(5))


def test_over_a_rate_that_only_gives_the_momentum() -> None:
    """The governor starts at 0.5 rad: the rate of the steady motion at that momentum is another, and the table showed that of the
    start alone, under the name of both."""
    model = mechc.load(EXAMPLES / "governor.mech")
    answer = model.study("steady", over="der(phi) = 6 .. 8, 2")
    assert isinstance(answer, Findings)
    head, *_ = answer.tables[0].head
    assert head[0] == "der(phi) at the start" and ("der(phi)", "rad/s") in answer.tables[0].head
    p = 0.2 + 0.5 * math.sin(0.5) ** 2
    for row in answer.tables[0].rows:
        start, theta, w = (float(str(cell)) for cell in row[:3])
        assert (0.2 + 0.5 * math.sin(theta) ** 2) * w == pytest.approx(p * start, rel=1e-12)
    other = model.study("steady", vary="theta", over="der(phi) = 6 .. 8, 2")
    assert isinstance(other, Findings)
    held = other.tables[0].head
    assert held[0] == ("der(phi)", "rad/s") and held.count(("der(phi)", "rad/s")) == 1


def test_friction_on_the_shaft_leaves_only_rest() -> None:
    text = (EXAMPLES / "governor.mech").read_text(encoding="utf-8")
    model = mechc.loads(text.replace("experiment", "damping 0.1 N.m.s on phi; experiment"))
    assert model.steady(vary="theta").summary()["steady"] == []


CONICAL = """\
model Conical
  parameter l = 0.7 m;
  parameter g = 9.81 m/s^2;
  coordinate x = 0.3 m;
  coordinate y = 0 m;
  coordinate z ~ -0.6 m;
  initial der(y) = 1.5 m/s;
  kinetic 1/2*(2 kg)*(der(x)^2 + der(y)^2 + der(z)^2);
  potential (2 kg)*g*z;
  constraint x^2 + y^2 + z^2 = l^2;
end Conical;
"""
LOOPS = """\
model Loops "governor of four rods: two balls and a sleeve"
  parameter l = 0.3 m;
  parameter m = 1 kg;
  parameter M = 2 kg;
  coordinate phi = 0 rad;
  coordinate x(min = 0.01 m) = 0.2 m;
  coordinate z ~ -0.2 m;
  coordinate s(max = -0.01 m) ~ -0.4 m;
  initial der(phi) = 12 rad/s;
  kinetic m*(der(x)^2 + der(z)^2 + x^2*der(phi)^2) + 1/2*M*der(s)^2;
  potential (9.81 m/s^2)*(2*m*z + M*s);
  constraint upper: x^2 + z^2 = l^2;
  constraint lower: x^2 + (z - s)^2 = l^2;
end Loops;
"""
DISK = """\
model Disk "thin, rolls without slipping"
  parameter m = 0.5 kg;
  parameter r = 0.2 m;
  let A = m*r^2/4;
  let C = m*r^2/2;
  coordinate x = 0 m;
  coordinate y = 0 m;
  coordinate psi = 0 rad;
  coordinate theta = 0.3 rad;
  coordinate phi = 0 rad;
  initial der(psi) = 2 rad/s;
  initial der(phi) = -8 rad/s;
  kinetic 1/2*m*(der(x)^2 + der(y)^2 + r^2*sin(theta)^2*der(theta)^2)
    + 1/2*A*(der(theta)^2 + cos(theta)^2*der(psi)^2) + 1/2*C*(der(phi) + sin(theta)*der(psi))^2;
  potential m*(9.81 m/s^2)*r*cos(theta);
  constraint cos(psi)*der(x) + sin(psi)*der(y) = -r*(der(phi) + sin(theta)*der(psi));
  constraint cos(psi)*der(y) - sin(psi)*der(x) = r*cos(theta)*der(theta);
end Disk;
"""


PARTS = """\
import mech.spatial.*;
model Lib "governor: arms hinged on a turning shaft, rods to a sleeve"
  gravity {0, 0, -9.81} m/s^2;
  Body shaft(m = 1 kg, J = diag({0.01, 0.01, 0.02} kg.m^2));
  Revolute spin(world -> shaft.a, axis = {0, 0, 1}, angle = 0 rad, der(angle) = 12 rad/s);
  Bar arm(m = 1 kg, l = 0.3 m);
  Revolute hinge(shaft.a -> arm.a, axis = {0, 1, 0}, angle = 60 deg);
  Particle sleeve(m = 2 kg);
  Prismatic guide(shaft.a -> sleeve.a, axis = {0, 0, -1}, position ~ 0.3 m);
  constraint norm(pos(sleeve.a) - pos(arm.b)) = 0.3 m;
end Lib;
"""


def steady_of(text: str, **settings: Any) -> list[dict[str, Any]]:
    found = mechc.loads(text).steady(**settings).summary()["steady"]
    assert isinstance(found, list)
    return found


@pytest.mark.slow
def test_conical_pendulum_as_a_point_on_a_sphere() -> None:
    """m r^2 W = L with W^2 = g/|z|; small motions: W^2 (1 + 3 cos^2) as of the spherical pendulum. Then the speed at this height."""
    (one,) = steady_of(CONICAL)
    x, z, rate = (one["values"][name] for name in ("x", "z", "turn(x, y)"))
    assert one["values"]["y"] == pytest.approx(0, abs=1e-12) and math.hypot(x, z) == pytest.approx(
        0.7, rel=1e-14
    )
    assert 2 * x**2 * rate == pytest.approx(2 * 0.3 * 1.5, rel=1e-13)
    assert rate**2 == pytest.approx(9.81 / -z, rel=1e-13)
    assert one["stable"] is True and one["momenta"] == pytest.approx({"x, y": 0.9}, rel=1e-13)
    assert frequencies(one) == pytest.approx([math.sqrt(rate**2 * (1 + 3 * (z / 0.7) ** 2))], rel=1e-10)
    assert all(error < 1e-13 for error in one["errors"].values())
    (there,) = steady_of(CONICAL, vary="der(y)")
    assert there["values"]["x"] == pytest.approx(0.3, rel=1e-14)
    assert there["values"]["turn(x, y)"] == pytest.approx(
        math.sqrt(9.81 / math.sqrt(0.7**2 - 0.3**2)), rel=1e-13
    )


@pytest.mark.slow
def test_governor_of_rods_in_loops() -> None:
    """cos(theta) = (m + M) g/(m l w^2), over the speed; below it leans in, and only where rods lie along the shaft is rest."""
    found = steady_of(LOOPS, vary="x", over="der(phi) = 8 .. 16, 5")
    speeds = [w for w in (8, 10, 12, 14, 16) if 0.3 * w**2 > 3 * 9.81]
    assert [one["parameter"]["der(phi)"] for one in found] == speeds
    for one, w in zip(found, speeds, strict=True):
        height = 3 * 9.81 / w**2
        assert one["values"]["s"] == pytest.approx(-2 * height, rel=1e-12)
        assert one["values"]["x"] == pytest.approx(math.sqrt(0.3**2 - height**2), rel=1e-12)


@pytest.mark.slow
def test_rods_in_loops_have_the_frequencies_of_one_angle() -> None:
    """The same governor in its lean alone: frequencies and stability with the momentum of the start."""
    free = """\
model Free
  coordinate phi = 0 rad;
  coordinate theta(min = 0.01 rad, max = 1.5 rad) = 0.7297276562269663 rad;
  initial der(phi) = 12 rad/s;
  let l = 0.3 m;
  kinetic 1 kg*l^2*(der(theta)^2 + sin(theta)^2*der(phi)^2) + 1/2*(2 kg)*(2*l*sin(theta)*der(theta))^2;
  potential -(9.81 m/s^2)*(2 kg + 4 kg)*l*cos(theta);
end Free;
"""
    (tied,), (one,) = steady_of(LOOPS), steady_of(free)
    assert tied["values"]["x"] == pytest.approx(0.3 * math.sin(one["values"]["theta"]), rel=1e-10)
    assert frequencies(tied) == pytest.approx(frequencies(one), rel=1e-9)
    assert tied["stable"] is one["stable"] is True


@pytest.mark.slow
def test_governor_of_library_parts() -> None:
    """An arm on a turning shaft, from the horizontal: sin = 3 g/(2 l w^2) where the sleeve stands at the hinge and pulls at nothing."""
    found = [one for one in steady_of(PARTS) if abs(math.cos(one["values"]["hinge.angle"])) > 1e-6]
    assert len(found) == 2
    for one in found:
        angle, rate = one["values"]["hinge.angle"], one["values"]["der(spin.angle)"]
        assert math.sin(angle) == pytest.approx(1.5 * 9.81 / (0.3 * rate**2), rel=1e-12)
        assert (0.02 + 0.03 * math.cos(angle) ** 2) * rate == pytest.approx(0.0275 * 12, rel=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("vary", [None, "der(phi)", "der(psi)"])
def test_a_disk_rolls_in_circles(vary: str | None) -> None:
    """(C + m r^2) s W cos - A W^2 sin cos + m g r sin = 0 with s = phi' + W sin, from the moment about the centre."""
    found = steady_of(DISK, **({"vary": vary} if vary else {}))
    assert found
    for one in found:
        lean, turn, spin = (one["values"][name] for name in ("theta", "turn(psi; x, y)", "der(phi)"))
        s = spin + turn * math.sin(lean)
        terms = (
            1.5 * 0.04 * s * turn * math.cos(lean),
            -0.25 * 0.04 * turn**2 * math.sin(lean) * math.cos(lean),
            9.81 * 0.2 * math.sin(lean),
        )
        assert sum(terms) == pytest.approx(0, abs=1e-12 * max(map(abs, terms)))
        assert math.hypot(one["values"]["der(x)"], one["values"]["der(y)"]) == pytest.approx(
            abs(0.2 * s), rel=1e-12
        )
        if vary:
            assert lean == pytest.approx(0.3, abs=1e-13)
        assert vary == "der(psi)" or turn == pytest.approx(2, rel=1e-13)
        assert vary == "der(phi)" or spin == pytest.approx(-8, rel=1e-13)


@pytest.mark.slow
def test_a_disk_stands_up_from_a_speed_on() -> None:
    """Straight on: stable for s^2 > A m g r/((C + m r^2) C), which here is (s r)^2 > g r/3; eigenvalues in between are not told."""
    text = DISK.replace("theta = 0.3", "theta = 0").replace("= 2 rad/s", "= 0 rad/s")
    slow, fast = (math.sqrt(9.81 / 0.2 / 3) * factor for factor in (0.99, 1.01))
    told = [steady_of(text, set={"der(phi)": f"{-speed} rad/s"}) for speed in (slow, fast)]
    assert [[one["stable"] for one in found if abs(one["values"]["theta"]) < 1e-9] for found in told] == [
        [False],
        [None],
    ]
    for speed, found in zip((slow, fast), told, strict=True):
        (one,) = (one for one in found if abs(one["values"]["theta"]) < 1e-9)
        expected = (1.5 * 0.5 * speed**2 / 0.25 - 9.81 / 0.2) / 1.25
        largest = max((complex(*v) for v in one["eigenvalues"]), key=abs)
        assert (largest**2).real == pytest.approx(-expected, rel=1e-8)


@pytest.mark.slow
def test_circular_orbit_in_plane_coordinates() -> None:
    """r = L^2 and W = 1/L^3; the start of an ellipse has velocities that no move has, and its momentum is held."""
    (one,) = steady("kepler")
    assert one["values"] == pytest.approx({"x": 0.64, "y": 0, "turn(x, y)": 0.8**-3}, rel=1e-13)
    assert frequencies(one) == pytest.approx([0.8**-3], rel=1e-12) and one["stable"] is True


def test_what_leaves_a_family_is_refused() -> None:
    with pytest.raises(SimulationError, match="form a family when these are sought"):
        steady_of(DISK, vary="der(psi), der(phi), theta")


@pytest.mark.parametrize(
    ("name", "settings", "said"),
    [
        (
            "henon_heiles",
            {},
            "no cyclic coordinate: its forces depend on q1, q2, and no shift of them and no turn",
        ),
        ("pendulum_cartesian", {}, "no cyclic coordinate: its forces depend on x, y"),
        pytest.param("rolling_coin", {}, "has rotations", marks=pytest.mark.slow),
        ("stick_slip_belt", {}, "switches"),
        ("lorenz", {}, "states of first order"),
        ("governor", {"vary": "phi"}, "'phi' cannot be sought"),
        ("governor", {"vary": "theta, der(phi)"}, "1 equations are left"),
    ],
)
def test_what_moves_otherwise_is_refused(name: str, settings: dict[str, str], said: str) -> None:
    with pytest.raises(SimulationError, match=said):
        steady(name, **settings)


def test_a_pole_is_left_out() -> None:
    """Two spherical pendulums lean by cos(a) = g/(l w^2), each to either side; at the poles, where a bob hangs or stands, an azimuth
    means nothing, and no rate of it is a steady motion."""
    text = """
model Two
  parameter w = 20 rad/s;
  coordinate Angle phi[2] = {0, 0} rad;
  coordinate Angle a[2] = {20, 30} deg;
  initial der(phi) = {w, w};
  kinetic sum(1/2*i*1 kg*(0.3 m)^2*(der(a[i])^2 + sin(a[i])^2*der(phi[i])^2) for i in 1:2);
  potential -sum(i*9.81 N*0.3 m*cos(a[i]) for i in 1:2);
end Two;
"""
    found = mechc.loads(text).steady(vary="a[1], a[2]")
    lean = math.acos(9.81 / (0.3 * 400))
    places = sorted((one["values"]["a[1]"], one["values"]["a[2]"]) for one in found.details["steady"])
    assert np.allclose(
        places, [(-lean, -lean), (-lean, lean), (lean, -lean), (lean, lean)], rtol=0, atol=1e-12
    )
    frequency = math.sqrt(400 * math.sin(lean) ** 2 + 4 * 400 * math.cos(lean) ** 2)  # w^2 (1 + 3 cos^2 a)
    for one in found.details["steady"]:
        assert one["stable"] and np.allclose(np.abs(one["eigenvalues"]).max(axis=1), frequency)
    assert any("loses its meaning there" in remark for remark in found.remarks)

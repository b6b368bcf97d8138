"""Satellites against SciPy, closed forms and textbook rates."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import mechc

MU, A, J2 = 3.986004418e14, 6378137.0, 1.08263e-3


def run(text: str, stop: float, **given: Any) -> mechc.Solution:
    whole = (
        f"import mech.spatial.*;\nimport mech.space.*;\nmodel M\n{text}\n"
        f"  experiment(stop = {stop} s, tolerance = 1e-11);\nend M;\n"
    )
    solution = mechc.loads(whole).simulate(**given)
    assert solution.outcome.value == "completed", solution.message
    return solution


ORBIT = "gravity earth; Particle s(m = 5 kg); Translation t(world -> s.a, position = {7000, 0, 0} km, der(position) = {0, 5, 6} km/s);"


def test_an_orbit_around_the_flattened_earth() -> None:
    """SciPy with the gradient of the potential by hand; the node turns by -3/2 n J2 (a/p)^2 cos i on the mean."""
    s = run(ORBIT, 20000)

    def rate(t: float, y: np.ndarray) -> np.ndarray:
        r, v = y[:3], y[3:]
        d = np.linalg.norm(r)
        k = 1.5 * J2 * MU * A**2 / d**5
        z2 = (r[2] / d) ** 2
        return np.concatenate([v, -MU * r / d**3 + k * r * np.array([5 * z2 - 1, 5 * z2 - 1, 5 * z2 - 3])])

    y0 = [7e6, 0, 0, 0, 5e3, 6e3]
    found = solve_ivp(rate, (0, 20000), y0, "DOP853", rtol=1e-12, atol=1e-3).y[:, -1]
    assert [s[f"t.position[{i}]"][-1] for i in (1, 2, 3)] == pytest.approx(found[:3], abs=1.0)
    r = np.array([s[f"t.position[{i}]"] for i in (1, 2, 3)])
    v = np.array([s[f"der(t.position[{i}])"] for i in (1, 2, 3)])
    h = np.cross(r.T, v.T)
    a = 1 / (2 / 7e6 - 61e6 / MU)
    p = float(h[0] @ h[0]) / MU
    node = np.unwrap(np.arctan2(h[:, 0], -h[:, 1]))
    expected = -1.5 * math.sqrt(MU / a**3) * J2 * (A / p) ** 2 * 5 / math.sqrt(61)
    assert np.polyfit(s.time, node, 1)[0] == pytest.approx(expected, rel=0.05)  # three orbits


def test_a_satellite_swings_about_the_vertical() -> None:
    """Pitch in a circular orbit: w^2 = 3 n^2 (Jx - Jz)/Jy, small angles; the long axis points down."""
    radius = 7e6
    n = math.sqrt(MU / radius**3)
    s = run(
        f"gravity round_earth; Body b(m = 10 kg, J = diag({{3, 5, 4}} kg.m^2)); Free f(world -> b.a, position = {{{radius!r}, 0, 0}} m, orientation = roty(-0.01 rad));"
        f"initial der(f.position) = {{0, 0, {n * radius!r}}} m/s; initial der(f.orientation) = {{0, {-n!r}, 0}} rad/s;"
        "GravityGradient g(to = b.a, J = diag({3, 5, 4} kg.m^2)); output pitch = asin(dot(direction(b.a, {1, 0, 0}), cross({0, 1, 0}, pos(b.a)/norm(pos(b.a)))));",
        3000,
    )
    w = n * math.sqrt(3 * (4 - 3) / 5)
    swing = s["pitch"]
    assert swing == pytest.approx(swing[0] * np.cos(w * s.time), abs=2e-6)
    assert abs(swing[0]) == pytest.approx(0.01, rel=1e-9)


def test_sunlight_pushes_and_the_shadow_does_not() -> None:
    s = run("Particle a(m = 2 kg); Translation ta(world -> a.a, position = {0, 9000, 0} km); SunPressure pa(to = a.a, area = 3 m^2, Cr = 1.5, sun = {2, 0, 0});"
            "Particle b(m = 2 kg); Translation tb(world -> b.a, position = {-9000, 1000, 0} km); SunPressure pb(to = b.a);", 100)  # fmt: skip
    assert s["ta.position[1]"][-1] == pytest.approx(-4.56e-6 * 3 * 1.5 / 2 * 100**2 / 2, rel=1e-6)
    assert s["tb.position[1]"][-1] == pytest.approx(-9e6, rel=1e-15)


def test_a_wheel_turns_its_body_the_other_way() -> None:
    """About an inclined axis of a ball: both momenta cancel, and the motor gives no more than its largest torque."""
    s = run(
        "Body b(m = 1 kg, J = 0.4*identity(3) kg.m^2); Spherical f(world -> b.a);"
        "ReactionWheel w(from = b.a, axis = {1, 2, 2}, motor = 0.3 N.m, J = 2e-3 kg.m^2);"
        "output turn = dot(angvel(b.a), {1, 2, 2})/3;",
        2,
    )
    assert s["w.momentum"][-1] == pytest.approx(0.1 * 2, rel=1e-9)
    assert s["turn"][-1] == pytest.approx(-0.2 / 0.4, rel=1e-9)


def test_a_thruster_takes_propellant() -> None:
    s = run("Body b(m = 50 kg, J = identity(3)*1 kg.m^2); Free f(world -> b.a); Thruster t(to = b.a, axis = {0, 2, 0}, throttle = if time < 3 s then 0.5 else 2, thrust = 10 N, Isp = 200 s);", 5)  # fmt: skip
    assert s["der(f.position[2])"][-1] == pytest.approx((5 * 3 + 10 * 2) / 50, rel=1e-9)
    assert s["t.used"][-1] == pytest.approx(35 / (200 * 9.80665), rel=1e-9)


def test_a_coil_is_a_compass() -> None:
    """Above the equator the field points north: a dipole swings about that with sqrt(m B/J)."""
    s = run(
        "Body b(m = 1 kg, J = 0.1*identity(3) kg.m^2); frame orbit = world * trans({7000, 0, 0} km); Spherical f(orbit -> b.a, orientation = rotx(1e-3 rad));"
        "MagneticTorquer m(to = b.a, dipole = {0, 0, 500} A.m^2, most = 200 A.m^2); output tilt = direction(b.a, {0, 0, 1})[2];",
        60,
    )
    w = math.sqrt(200 * 31.2e-6 * (6371.2 / 7000) ** 3 / 0.1)
    assert s["tilt"] == pytest.approx(-1e-3 * np.cos(w * s.time), abs=2e-9)

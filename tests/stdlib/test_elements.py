"""Ropes, belts, cams, muscles, floats, wings against closed forms, statics, published figures and SciPy."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import mechc


def run(text: str, stop: float = 1.0, space: str = "planar", **given: Any) -> mechc.Solution:
    whole = (
        f"import mech.{space}.*;\nimport mech.elements.*;\nmodel M\n{text}\n"
        f"  experiment(stop = {stop} s, tolerance = 1e-11);\nend M;\n"
    )
    solution = mechc.loads(whole).simulate(**given)
    assert solution.outcome.value == "completed", solution.message
    return solution


def asked(*formulas: str) -> list[float]:
    """Return the values of formulas of the package."""
    outputs = "".join(f"output f{i} = {f};" for i, f in enumerate(formulas))
    s = run(outputs, 0.0, estimate_error=False)
    return [float(s[f"f{i}"][0]) for i in range(len(formulas))]


def test_springs_along_the_axes_of_a_turned_frame() -> None:
    """Each axis swings for itself, damped as it is."""
    s = run(
        "frame post = world * rot(30 deg); Particle p(m = 2 kg); Translation t(post -> p.a, position = {0.3, 0.2} m);"
        "CartesianSpring c(post -> p.a, k = {50, 18} N/m, c = {4, 0} N.s/m, rest = {0.1, 0} m);"
    )
    w = math.sqrt(24)
    t = s.time
    swing = np.exp(-t) * (np.cos(w * t) + np.sin(w * t) / w)
    assert s["t.position[1]"] == pytest.approx(0.1 + 0.2 * swing, abs=1e-9)
    assert s["t.position[2]"] == pytest.approx(0.2 * np.cos(3 * t), abs=1e-9)


def test_a_bushing_at_rest_under_a_load() -> None:
    """Small displacements and rotations solve the 6 x 6 equations; the damping takes what the fall supplies."""
    K, R, Q = np.diag([4e5, 3e5, 2e5]), np.diag([3e3, 2e3, 1e3]), np.zeros((3, 3))
    Q[0, 1], Q[2, 0] = 5e3, -2e3
    words = "{{0, 5e3, 0}, {0, 0, 0}, {-2e3, 0, 0}}"
    s = run(
        "gravity {0.1, 0.2, -0.3} m/s^2; Body b(m = 2 kg, J = 0.02*identity(3) kg.m^2);"
        "Free f(world -> b.a); torque {0.1, 0.2, -0.3} N.m on b.a;"
        f"Bushing j(world -> b.a, K = diag({{4e5, 3e5, 2e5}}) N/m, R = diag({{3e3, 2e3, 1e3}}) N.m/rad, Q = {words} N,"
        "C = 800*identity(3) N.s/m, D = 8*identity(3) N.m.s);",
        0.3,
        "spatial",
    )
    load = np.array([0.2, 0.4, -0.6, 0.1, 0.2, -0.3])
    rest = np.linalg.solve(np.block([[K, Q], [Q.T, R]]), load)
    found = [s[f"f.position[{i}]"][-1] for i in (1, 2, 3)]
    found += [2 * s[f"f.orientation[{i}]"][-1] for i in (2, 3, 4)]
    # angles of 3e-4 rad: squares are 1e-7, times the largest one
    assert found == pytest.approx(rest, abs=3e-8)


def test_a_bearing_lets_its_shaft_turn() -> None:
    """The weight sinks by m g/k, tilts swing with sqrt(k/J), and the turn goes on."""
    s = run(
        "Body b(m = 2 kg, J = 0.5*identity(3) kg.m^2); Free f(world -> b.a, orientation = rotx(1e-4 rad));"
        "initial f.position = {0, 0, 1e-5} m; Bearing j(world -> b.a, radial = 800 N/m, axial = 200 N/m, tilting = 50 N.m/rad);",
        1.0,
        "spatial",
    )
    assert s["f.position[3]"] == pytest.approx(1e-5 * np.cos(10 * s.time), abs=1e-13)
    assert 2 * s["f.orientation[2]"] == pytest.approx(1e-4 * np.cos(10 * s.time), abs=1e-10)
    s = run("Body b(m = 2 kg, J = 0.5*identity(3) kg.m^2); Free f(world -> b.a); initial der(f.orientation) = {0, 0, 7} rad/s; Bearing j(world -> b.a); output w = angvel(b.a)[3];", 0.1, "spatial")  # fmt: skip
    assert s["w"] == pytest.approx(7, abs=1e-9)


def test_a_bump_stop_takes_the_energy_of_a_mass() -> None:
    """Without damping the depth follows from 1/2 m v^2; with it, SciPy has the same law."""
    mass = "coordinate Length x = 0.1 m; initial der(x) = -1 m/s; kinetic 1/2*3 kg*der(x)^2;"
    s = run(f"{mass} BumpStop b(from = 0 m, to = x, rest = 0.05 m, k = 1e3 N/m, k3 = 4e6 N/m^3);", 0.3)
    depth = brentq(lambda d: 500 * d**2 + 1e6 * d**4 - 1.5, 0, 1, xtol=1e-15)
    assert s["x"].min() == pytest.approx(0.05 - depth, abs=5e-6)  # of 500 points
    assert s["der(x)"][-1] == pytest.approx(1, rel=1e-9)
    s = run(
        f"{mass} BumpStop b(from = 0 m, to = x, rest = 0.05 m, k = 1e3 N/m, k3 = 4e6 N/m^3, b = 0.3 s/m);",
        0.3,
    )

    def rate(t: float, y: np.ndarray) -> list[float]:
        d = max(0.0, 0.05 - y[0])
        return [y[1], max(0.0, (1e3 * d + 4e6 * d**3) * (1 - 0.3 * y[1])) / 3]

    found = solve_ivp(rate, (0, 0.3), [0.1, -1.0], "DOP853", rtol=1e-11, atol=1e-13, max_step=1e-3)
    assert s["der(x)"][-1] == pytest.approx(found.y[1][-1], rel=1e-7)
    assert s["energy.dissipated"][-1] == pytest.approx(1.5 * (1 - found.y[1][-1] ** 2), rel=1e-6)


def test_an_angle_stays_between_two_directions() -> None:
    """A shaft that keeps 70 deg to the vertical precesses and spins, as a top on a guide: no work is done."""
    s = run(
        "Body b(m = 1 kg, J = diag({1, 2, 2}) kg.m^2); Spherical p(world -> b.a, orientation ~ roty(20 deg));"
        "initial der(p.orientation) = {3, 0, 0.7} rad/s; ConstantAngle a(world -> b.a, angle = 70 deg);"
        "output c = direction(b.a, {1, 0, 0})[3];",
        2.0,
        "spatial",
    )
    assert s["c"] == pytest.approx(math.cos(math.radians(70)), abs=1e-10)
    assert s["energy.kinetic"] == pytest.approx(s["energy.kinetic"][0], rel=1e-9)


def test_a_rope_pulls_and_never_pushes() -> None:
    """A weight falls freely until its rope is taut; the longest rope follows from the energy."""
    s = run("gravity {0, -10} m/s^2; Particle p(m = 2 kg); Translation t(world -> p.a, position = {0, -0.5} m); Rope r(world -> p.a, l = 1 m, EA = 4e3 N);", 1.0)  # fmt: skip
    assert s(0.2)["t.position[2]"] == pytest.approx(-0.5 - 0.2, abs=1e-10)
    assert s["r.tension"].min() == 0
    stretch = brentq(lambda u: 2e3 * u**2 - 20 * (0.5 + u), 0, 1, xtol=1e-15)
    assert s["t.position[2]"].min() == pytest.approx(-1 - stretch, abs=1e-4)  # of 500 points
    assert s["energy.total"] == pytest.approx(s["energy.total"][0], rel=1e-9)


def test_a_tether_jerks_and_holds() -> None:
    s = run("gravity {0, -10} m/s^2; Particle p(m = 2 kg); Translation t(world -> p.a, position = {0, -0.5} m); Tether r(world -> p.a, l = 1 m);", 1.0)  # fmt: skip
    jerk = math.sqrt(0.1)
    assert s.events[0].time == pytest.approx(jerk, rel=1e-10)
    assert s["t.position[2]"][-1] == pytest.approx(-1, abs=1e-12) and s["r.tension"][-1] == pytest.approx(20)
    assert s["energy.dissipated"][-1] == pytest.approx(10, rel=1e-9)


def test_a_tackle_halves_the_force() -> None:
    """Weights of 1 and 2 kg hang in balance from a wheel, the second in two parts of the rope."""
    s = run(
        "gravity {0, -10} m/s^2; frame wheel = world * trans({0, 3} m); Particle a(m = 1 kg); Particle b(m = 2 kg);"
        "Translation ta(world -> a.a, position ~ {0, 1} m); Translation tb(world -> b.a, position = {0, 1} m);"
        "Pulley p(from = a.a, over = wheel, to = b.a, falls = 2, l = 5.9 m, EA = 1e3 N);"
        "initial ta.position[1] = 0 m; initial stationary ta.position[2]; initial der(ta.position) = {0, 0} m/s; initial der(tb.position) = {0, 0} m/s;"
    )
    assert s["p.tension"] == pytest.approx(10, rel=1e-9)
    assert s["ta.position[2]"] == pytest.approx(3 - 5.9 * 1.01 + 4, rel=1e-9)


def test_a_winch_lifts_and_its_drum_feels_the_load() -> None:
    """At rest the torque is m g r and half the strain more, which the rope takes with it onto the drum."""
    s = run(
        "gravity {0, -10} m/s^2; Particle p(m = 3 kg); Translation t(world -> p.a, position ~ {0, -1} m);"
        "coordinate Angle q = 0 rad; kinetic 1/2*0.2 kg.m^2*der(q)^2; force 6.003 N.m on q; initial der(q) = 0; initial t.position[1] = 0 m; initial der(t.position) = {0, 0} m/s; initial der(t.position[2], 2) = 0;"
        "Winch w(world -> p.a, drum = q, r = 0.2 m, stored = 1 m, EA = 3e4 N);"
    )
    assert s["w.tension"] == pytest.approx(30, rel=1e-9) and s["q"] == pytest.approx(0, abs=1e-9)
    assert s["t.position[2]"] == pytest.approx(-1.001, rel=1e-9)


def test_a_belt_drive_turns_at_the_ratio_of_its_radii() -> None:
    """At rest under a torque: the strands differ by M/r1, with the preload as their mean; then one goes slack."""
    text = "coordinate Angle a ~ 0 rad; coordinate Angle b = 0 rad; kinetic 1/2*0.01 kg.m^2*der(a)^2 + 1/2*der(b)^2*0.35 kg.m^2; BeltDrive d(a -> b, r1 = 60 mm, r2 = 150 mm, l = 0.55 m, EA = 60 kN, preload = 400 N, c = 15 N.s/m);"
    s = run(f"{text} force 30 N.m on a; force -75 N.m on b; initial stationary;", 0.01)
    assert s["d.tight"] == pytest.approx(650, rel=1e-9) and s["d.slack"] == pytest.approx(150, rel=1e-9)
    s = run(f"{text} force 60 N.m on a; force -150 N.m on b; initial stationary;", 0.01)
    assert s["d.tight"] == pytest.approx(1000, rel=1e-9) and s["d.slack"] == pytest.approx(0, abs=1e-9)


def test_a_belt_slips_where_euler_says() -> None:
    """Locked on the driven side, it carries the difference of the tensions at which T1/T2 = exp(mu wrap)."""
    s = run(
        "coordinate Angle a = 0 rad; kinetic 1/2*0.01 kg.m^2*der(a)^2; force 40 N.m on a; damping 0.5 N.m.s on a;"
        "SlippingBelt d(a -> 0 rad, preload = 100 N, c = 300 N.s/m, mu = 0.3, wrap = 150 deg); output F = multiplier(d.grip);",
        1.0,
    )
    ratio = math.exp(0.3 * math.radians(150))
    assert s["d.tight"][-1] / s["d.slack"][-1] == pytest.approx(ratio, rel=1e-6)
    assert s["der(a)"][-1] == pytest.approx((40 - 0.1 * 200 * (ratio - 1) / (ratio + 1)) / 0.5, rel=1e-5)


def test_profiles_of_cams() -> None:
    assert asked("cycloidal(0.25)", "polynomial345(0.25)", "cycloidal(1)", "cam_lift(750 deg, 12 mm, 60 deg, 20 deg, 60 deg)") == pytest.approx([0.25 - 1 / (2 * math.pi), 10 / 64 - 15 / 256 + 6 / 1024, 1, 0.006], rel=1e-12)  # fmt: skip


@pytest.mark.slow  # its jumps are looked for over thousands of turns
@pytest.mark.parametrize("speed", [1500, 3000])
def test_a_follower_lifts_off_where_the_spring_is_too_weak(speed: int) -> None:
    """Where k s + F0 + m w^2 s'' of a cycloidal rise is negative for the first time, and not below that speed."""
    s = run(
        f"parameter w = {speed} rpm; coordinate Length x = 0 mm; kinetic 1/2*140 g*der(x)^2; potential 180 N*x + 1/2*30 N/mm*x^2;"
        "Cam c(lift = cam_lift(w*time, 12 mm, 60 deg, 20 deg, 60 deg), follower = x);",
        0.9 * 60 / speed * 60 / 360,
    )
    w, beta = speed * math.pi / 30, math.pi / 3

    def push(t: float) -> float:
        u = w * t / beta
        lift = 0.012 * (u - math.sin(2 * math.pi * u) / (2 * math.pi))
        return 30e3 * lift + 180 + 0.14 * 2 * math.pi * 0.012 / beta**2 * math.sin(2 * math.pi * u) * w**2

    opened = [e.time for e in s.events if e.kind == "lift-off"]
    times = np.linspace(0, s.time[-1], 2000)
    negative = [t for t in times if push(t) < 0]
    assert bool(opened) == bool(negative)
    if negative:
        assert opened[0] == pytest.approx(brentq(push, negative[0] - times[1], negative[0]), rel=1e-8)


def test_curves_of_muscles_have_the_figures_of_opensim() -> None:
    """As its own tests state them: to the digits that are printed there."""
    got = asked("tendon_curve(1, 0.049)", "tendon_curve(1.049, 0.049)", "passive_curve(1)", "passive_curve(0.2)", "passive_curve(1.6)", "active_curve(1)", "velocity_curve(-1)", "velocity_curve(0)", "velocity_curve(1)", "inverse_velocity_curve(velocity_curve(0.4))")  # fmt: skip
    assert got[2] == pytest.approx(0.0182288, abs=5e-8) and got[8] == pytest.approx(1.794, abs=5e-4)
    assert [*got[:2], *got[3:8], got[9]] == pytest.approx([0, 1, 0, 1, 1, 0, 1, 0.4], abs=2e-7)


def curves() -> tuple[Any, Any, Any, Any]:
    """Write the four curves again, with asinh for the logarithm."""
    bells = ((0.8150671134243542, 1.055033428970575, 0.162384573599574, 0.063303448465465), (0.433004984392647, 0.716775413397760, -0.029947116970696, 0.200356847296188), (0.1, 1.0, 0.353553390593274, 0.0))  # fmt: skip
    tendon = lambda x: 0.2 * (np.exp(np.log(6) / 0.049 * (x - 1)) - 1)  # noqa: E731
    active = lambda x: sum(a * np.exp(-0.5 * ((x - b) / (c + d * x)) ** 2) for a, b, c, d in bells)  # noqa: E731
    passive = lambda x: (np.exp(4 * (x - 1) / 0.6) - np.exp(-3.2 / 0.6)) / (np.exp(4) - np.exp(-3.2 / 0.6))  # noqa: E731
    velocity = lambda v: -0.3211346127989808 * np.arcsinh(-8.149 * v - 0.374) + 0.8825327733249912  # noqa: E731
    return tendon, active, passive, velocity


def test_a_muscle_with_a_stiff_tendon() -> None:
    """Against SciPy, with its pennation; at rest with a load its length is that of the statics."""
    _, active, passive, velocity = curves()
    s = run("coordinate Length x = 0.29 m; kinetic 1/2*30 kg*der(x)^2; potential -30 kg*9.81 m/s^2*x; Muscle m(length = x, activation = 0.6, pennation = 20 deg);", 0.5)  # fmt: skip
    width = 0.1 * math.sin(math.radians(20))

    def rate(t: float, y: np.ndarray) -> list[float]:
        along = y[0] - 0.2
        lm = math.hypot(along, width)
        F = (
            1000
            * (0.6 * active(lm / 0.1) * velocity(along / lm * y[1] / 1.0) + passive(lm / 0.1))
            * along
            / lm
        )
        return [y[1], 9.81 - F / 30]

    found = solve_ivp(rate, (0, 0.5), [0.29, 0.0], "DOP853", rtol=1e-11, atol=1e-13)
    assert s["x"][-1] == pytest.approx(found.y[0][-1], abs=1e-9)


def test_a_muscle_with_an_elastic_tendon() -> None:
    """SciPy solves for the speed of the fibres by bisection; both begin in equilibrium."""
    tendon, active, passive, velocity = curves()
    s = run("coordinate Length x = 0.31 m; kinetic 1/2*20 kg*der(x)^2; potential -20 kg*9.81 m/s^2*x; Activation a(excitation = if time < 0.1 s then 0.2 else 0.8, y = 0.2); ElasticMuscle m(length = x, activation = a.y); initial stationary m.lm;", 0.4)  # fmt: skip

    def force(x: float, lm: float) -> float:
        return float(tendon((x - lm) / 0.2))

    def rate(t: float, y: np.ndarray) -> list[float]:
        x, v, lm, a = y
        f = force(x, lm)
        speed = brentq(
            lambda s: a * active(lm / 0.1) * velocity(s) + passive(lm / 0.1) - f, -2, 2, xtol=1e-14
        )
        e = 0.2 if t < 0.1 else 0.8
        side, z = 0.5 * math.tanh(10 * (e - a)), 0.5 + 1.5 * a
        return [
            v,
            9.81 - 1000 * f / 20,
            speed,
            ((side + 0.5) / (0.015 * z) + (0.5 - side) * z / 0.06) * (e - a),
        ]

    lm = brentq(lambda q: 0.2 * active(q / 0.1) + passive(q / 0.1) - force(0.31, q), 0.05, 0.15, xtol=1e-15)
    assert s["m.lm"][0] == pytest.approx(lm, rel=1e-9)
    y = np.array([0.31, 0.0, lm, 0.2])
    for span in ((0, 0.1 - 1e-12), (0.1, 0.4)):
        y = solve_ivp(rate, span, y, "DOP853", rtol=1e-9, atol=1e-12).y[:, -1]
    assert [s["x"][-1], s["m.lm"][-1], s["a.y"][-1]] == pytest.approx([y[0], y[2], y[3]], abs=1e-7)


def test_a_tendon_stores_what_it_takes() -> None:
    s = run(
        "coordinate Length x = 0.19 m; initial der(x) = 1 m/s; kinetic 1/2*2 kg*der(x)^2; Tendon t(length = x);",
        0.05,
    )
    assert s["energy.total"] == pytest.approx(1, rel=1e-9)
    assert s["der(x)"][-1] == pytest.approx(-1, rel=1e-9) and s["t.tension"].max() > 100


def test_a_magnetic_coupling_pulls_out() -> None:
    """Small swings have sqrt(poles peak/J); the largest torque at rest is the peak."""
    s = run("coordinate Angle a = 1e-4 rad; kinetic 1/2*0.5 kg.m^2*der(a)^2; MagneticCoupling m(a -> 0 rad, peak = 2 N.m, poles = 4);")  # fmt: skip
    assert s["a"] == pytest.approx(1e-4 * np.cos(4 * s.time), abs=1e-11)
    text = "coordinate Angle a = 0 rad; kinetic 1/2*0.5 kg.m^2*der(a)^2; MagneticCoupling m(a -> 0 rad, peak = 2 N.m, poles = 4, c = 3 N.m.s); force {} N.m on a;"
    held = run(text.format(1.9), 20.0)
    assert held["a"][-1] == pytest.approx(math.asin(0.95) / 4, rel=1e-6)
    assert run(text.format(2.1), 20.0)["a"][-1] > 1.5


def test_a_ball_floats_as_deep_as_archimedes_says() -> None:
    s = run("gravity {0, -9.80665} m/s^2; Particle p(m = 1 kg); Translation t(world -> p.a, position ~ {0, 0} m); Buoyancy b(to = p.a, r = 0.1 m); initial t.position[1] = 0 m; initial stationary;", 0.1)  # fmt: skip
    depth = brentq(lambda d: math.pi * d**2 * (0.1 - d / 3) * 1000 - 1, 0, 0.2, xtol=1e-15)
    assert s["t.position[2]"] == pytest.approx(0.1 - depth, rel=1e-8)
    assert asked("cap_volume(1 m, 0.1 m)") == pytest.approx([4 / 3 * math.pi * 1e-3])


def test_a_barge_on_four_floats_rolls_with_its_metacentric_height() -> None:
    """GM = I/V + KB - KG: four columns of the area A at +/- b give I = 4 A b^2; w^2 = m g GM/J."""
    s = run(
        "gravity {0, -9.80665} m/s^2; Body hull(m = 1000 kg, J = 800 kg.m^2); Free f(world -> hull.a, y ~ 0 m, angle = 1e-4 rad);"
        "frame foot[i in 1:2] = hull.a * trans({if i == 1 then -1.5 else 1.5, -0.6} m);"
        "Float column[i in 1:2](to = foot[i], area = 2 m^2, h = 2 m); initial stationary f.y; initial der(f.angle) = 0; initial der(f.x) = 0; initial f.x = 0 m;",
        3.0,
    )
    draught = 1000 / 4000
    above = -0.6 + draught / 2  # centre of buoyancy over the mass centre
    GM = 4 * 1.5**2 / 1.0 * 1.0 + above
    w = math.sqrt(1000 * 9.80665 * GM / 800)
    assert s["f.angle"] == pytest.approx(1e-4 * np.cos(w * s.time), abs=2e-8)


def test_a_propeller_hovers() -> None:
    """At n = sqrt(m g/(kT density D^4)) the body rests; the torque turns the body against the propeller."""
    n = math.sqrt(9.81 / (0.1 * 1.225 * 0.3**4))
    s = run(
        f"gravity {{0, 0, -9.81}} m/s^2; Body b(m = 1 kg, J = 0.1*identity(3) kg.m^2); Free f(world -> b.a);"
        f"Propeller p(to = b.a, speed = {n * 2 * math.pi!r} rad/s, kT1 = 0.05);",
        0.5,
        "spatial",
    )
    assert s["f.position[3]"] == pytest.approx(0, abs=1e-9)
    assert s["der(f.orientation)[3]"][-1] == pytest.approx(
        -0.01 * 1.225 * n**2 * 0.3**5 / 0.1 * 0.5, rel=1e-9
    )


def test_a_wing_glides_at_its_ratio() -> None:
    """In a steady glide lift and drag carry the weight: tan(angle of the path) = CD/CL, both of the angle of attack."""
    a = math.radians(4)
    slope = 2 * math.pi / (1 + 2 / 8)
    CL = slope * a
    CD = 0.01 + CL**2 / (math.pi * 0.9 * 8)
    glide = math.atan2(CD, CL)
    v = math.sqrt(2 * 5 * 9.81 * math.cos(glide) / (1.225 * CL))
    for space, gravity, at, axis in (
        ("planar", "{0, -9.81}", f"rot({a - glide!r} rad)", "{{{}, {}}}"),
        ("spatial", "{0, 0, -9.81}", f"roty({glide - a!r} rad)", "{{{}, 0, {}}}"),
    ):
        s = run(
            f"gravity {gravity} m/s^2; Particle p(m = 5 kg); Translation t(world -> p.a); initial der(t.position) = {axis.format(v * math.cos(glide), -v * math.sin(glide))} m/s;"
            f"frame wing = p.a * {at}; Wing w(to = wing);",
            2.0,
            space,
        )
        n = 2 if space == "planar" else 3
        # the stall takes 7e-5 of the lift
        assert s[f"der(t.position[{n}])"] == pytest.approx(-v * math.sin(glide), rel=2e-4)
        assert s["w.alpha"] == pytest.approx(a, rel=2e-4)


def test_a_stalled_wing_is_a_plate() -> None:
    a = math.radians(40)
    assert asked("stalling(40 deg, 5, 12 deg)", "stalling(2 deg, 5, 12 deg)") == pytest.approx([2 * math.sin(a) ** 2 * math.cos(a), 5 * math.radians(2)], rel=1e-3)  # fmt: skip


def test_a_parachute_opens_and_sinks() -> None:
    """While it fills, SciPy; then its final speed is sqrt(2 m g/(density CdS))."""
    s = run("gravity {0, -9.81} m/s^2; Particle p(m = 80 kg); Translation t(world -> p.a, der(position) = {40, 0} m/s); Parachute c(to = p.a, CdS = 30 m^2, open = 1 s, fill = 2 s);", 20.0)  # fmt: skip

    def rate(t: float, v: np.ndarray) -> np.ndarray:
        share = min(max((t - 1) / 2, 0.0), 1.0) ** 2
        return np.asarray(np.array([0, -9.81]) - 0.5 * 1.225 * 30 * share * np.hypot(*v) * v / 80)

    found = solve_ivp(rate, (0, 3), [40.0, 0.0], "DOP853", rtol=1e-10, atol=1e-10, max_step=0.1).y[:, -1]
    assert [float(s(3.0)[f"der(t.position[{i}])"]) for i in (1, 2)] == pytest.approx(found, rel=1e-6)
    assert s["der(t.position[2])"][-1] == pytest.approx(-math.sqrt(2 * 80 * 9.81 / (1.225 * 30)), rel=1e-8)


@pytest.mark.parametrize("space", ["planar", "spatial"])
def test_a_spring_after_a_damper_relaxes(space: str) -> None:
    """A Maxwell element that is held at a length e beyond rest: k e exp(-k t/c), and what the spring loses is dissipated."""
    origin = "{0, 3}" if space == "planar" else "{0, 0, 3}"
    s = run(f"frame end_ = world * trans({origin} m); Maxwell m(world -> end_, k = 50 N/m, c = 20 N.s/m, rest = 2.9 m, oil = 0 m);", space=space)  # fmt: skip
    assert s["m.tension"] == pytest.approx(5 * np.exp(-2.5 * s.time), abs=1e-9)
    assert s["energy.dissipated"][-1] == pytest.approx(0.25 * (1 - math.exp(-5)), rel=1e-8)


def test_dampers_of_ropes_and_buffers_dissipate() -> None:
    """A load jumps on a rope, a mass on a buffer: what is missing at the end is booked as dissipated, and nothing as supplied."""
    falls = "gravity {0, -9.81} m/s^2; Particle p(m = 1 kg); Translation t(world -> p.a, position = {0.2, -0.9} m);"
    for text in (
        f"{falls} Rope r(world -> p.a, EA = 1e4 N, c = 3 N.s/m);",
        f"{falls} Pulley r(from = world * trans({{1, 0}} m), over = world, to = p.a, EA = 1e4 N, c = 3 N.s/m);",
        "Particle p(m = 1 kg); Prismatic t(world -> p.a, position = 0.1 m, der(position) = -2 m/s); BumpStop r(0 m -> t.position, b = 0.8 s/m);",
    ):
        s = run(text)
        lost = s["energy.total"][0] - s["energy.total"][-1]
        assert lost > 0.2
        assert s["energy.dissipated"][-1] == pytest.approx(lost, rel=1e-7)
        assert "energy.supplied" not in s.quantities

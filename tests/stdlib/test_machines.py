"""Machines of library parts, each against statics, a closed form or SciPy; and how much shorter they are."""

from __future__ import annotations

import math

import numpy as np
import pytest
from gallery import load
from gallery import run as run_example
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq


def test_a_blade_has_the_frequencies_of_a_cantilever() -> None:
    """b^2 sqrt(EI/(mu L^4)) with cos(b) cosh(b) = -1; 20 bars leave less than a hundredth."""
    roots = [brentq(lambda b: math.cos(b) * math.cosh(b) + 1, low, low + 1) for low in (1.5, 4.2, 7.4)]
    expected = [b**2 * math.sqrt(1e4 / (6 * 5.5**4)) for b in roots]
    poles = [complex(*p) for p in load("helicopter_blade").linearize().details["poles"]]
    found = sorted(p.imag for p in poles if p.imag > 0)[:3]
    assert found == pytest.approx(expected, rel=1e-2)
    assert found[0] == pytest.approx(expected[0], rel=2e-3)


def test_a_belt_starts_a_machine() -> None:
    s = run_example("belt_drive")

    def rate(t: float, y: np.ndarray) -> list[float]:
        a, b, v, w = y
        e, de = 0.06 * a - 0.15 * b, 0.06 * v - 0.15 * w
        pull = 60e3 / 0.55 * e + 15 * de
        T = max(0.0, 400 + pull) - max(0.0, 400 - pull)
        load = 60 + 0.02 * w if w > 0 else min(60.0, 0.15 * T)
        return [v, w, (30 - 0.06 * T) / 0.01, (0.15 * T - load) / 0.35 if w > 0 or 0.15 * T > 60 else 0.0]

    found = solve_ivp(rate, (0, 0.5), [0, 0, 0, 0], "DOP853", rtol=1e-9, atol=1e-11, max_step=1e-4)
    assert s["der(machine.angle)"][-1] == pytest.approx(found.y[3][-1], rel=1e-4)
    assert s["belt.tight"] + s["belt.slack"] == pytest.approx(800, rel=0.2) and s["belt.slack"].min() == 0


def test_a_valve_lifts_off_its_cam() -> None:
    """Where the force of the contact, F0 + k s + c s' + m s'', vanishes on the cycloidal rise."""
    s = run_example("valve_train")
    w, beta, h = 3000 * math.pi / 30, math.pi / 3, 0.012

    def push(t: float) -> float:
        u = w * t / beta
        lift = h * (u - math.sin(2 * math.pi * u) / (2 * math.pi))
        speed = h * w / beta * (1 - math.cos(2 * math.pi * u))
        return (
            180
            + 30e3 * lift
            + 8 * speed
            + 0.14 * 2 * math.pi * h * (w / beta) ** 2 * math.sin(2 * math.pi * u)
        )

    first = next(e.time for e in s.events if e.kind == "lift-off")
    assert first == pytest.approx(brentq(push, 0.5 * beta / w, 0.75 * beta / w), rel=1e-6)


def test_a_crane_stops_the_swing_of_its_load() -> None:
    """Accelerated for one swing, the load hangs back by 2 a/g in its middle and not at all after it: small angles."""
    s = run_example("tower_crane")
    assert s["load.angle"].min() == pytest.approx(-2 * 0.05 / 9.81, rel=1e-4)
    after = s.time > 2 * math.pi * math.sqrt(20 / 9.81)
    assert np.abs(s["load.angle"][after]).max() < 1e-6
    assert s["load.tension"].min() > 29000


def test_a_damper_on_its_rig() -> None:
    """The force of a measured sine, by its formula; splines of 2000 points are as good as 1e-6."""
    t = np.linspace(0, 4, 2001)
    stroke = 0.02 * np.sin(3 * math.pi * t)
    s = load("damper_rig").simulate(inputs={"stroke": (t, stroke)})
    v = 0.02 * 3 * math.pi * np.cos(3 * math.pi * s.time)
    assert s["damper.pull"] == pytest.approx(100 + 1000 * v + 300 * np.tanh(v / 0.15), abs=0.01)


def test_a_hoist_jerks_its_load_off_the_ground() -> None:
    s = run_example("rope_hoist")

    def rate(t: float, y: np.ndarray) -> list[float]:
        rest = 12.05 - 0.25 * t
        u, du = 12 - y[0] - rest, -y[1] + 0.25
        F = max(0.0, 18e6 / rest * u + 4e3 * du) if u > 0 else 0.0
        a = F / 2000 - 9.81
        return [y[1], a if y[0] > 0 or a > 0 else 0.0]

    found = solve_ivp(rate, (0, 2), [0.0, 0.0], "DOP853", rtol=1e-9, atol=1e-11, max_step=1e-3)
    assert s["guide.position"][-1] == pytest.approx(found.y[0][-1], abs=1e-5)  # SciPy steps over the lift-off
    assert s["rope.tension"].max() == pytest.approx(
        2000 * 9.81 + 0.25 * math.sqrt(18e6 / 12 * 2000), rel=0.03
    )


def test_a_loader_lifts_by_virtual_work() -> None:
    """Slowly: the force of the cylinder times its rate is the rate of the potential energy."""
    s = run_example("front_loader")
    power = np.gradient(s["energy.potential"], s.time, edge_order=2)
    assert s["forces[1]"][2:-2] * 1e-3 == pytest.approx(power[2:-2], rel=1e-4)
    assert s["pressure"] == pytest.approx(s["forces[1]"] / (2 * math.pi / 4 * 0.11**2), rel=1e-12)


def test_a_servo_comes_to_rest_where_the_friction_holds() -> None:
    """Within half of the play of 90 deg; the torque of the shaft is within the static friction, that of the motor within the losses."""
    s = run_example("geared_servo")
    assert math.degrees(s["load.angle"][-1]) == pytest.approx(90, abs=0.4)
    assert abs(s["der(load.angle)"][-1]) < 1e-6
    assert abs(s["shaft.torque"][-1]) <= 2.0 + 1e-6
    assert s["motor.i"][-1] == pytest.approx(s["speed.y"][-1] / 0.32, rel=1e-6)
    needed = abs(s["shaft.torque"][-1]) / 43
    assert 0.72 * needed <= abs(0.0302 * s["motor.i"][-1]) + 1e-9
    assert abs(0.0302 * s["motor.i"][-1]) <= needed / 0.72 + 1e-9
    assert 0.7 * 24 / 0.0302 < s["der(rotor.angle)"].max() < 24 / 0.0302 or s["speed.y"].max() <= 24


def test_a_car_changes_its_lane() -> None:
    s = run_example("lane_change")

    def magic(alpha: float, load: float) -> float:
        x = 9.5 * alpha
        return (
            load
            * 1.05
            * (1 - 0.08 * (load / 4000 - 1))
            * math.sin(1.35 * math.atan(x + 0.6 * (x - math.atan(x))))
        )

    def rate(t: float, q: np.ndarray) -> list[float]:
        x, y, p, vx, vy, r, d = q
        ahead, seen = x + 25 * math.cos(p), y + 25 * math.sin(p)
        lane = 3.5 * min(max(ahead / 60 - 1, 0.0), 1.0)
        u, v = math.cos(p) * vx + math.sin(p) * vy, -math.sin(p) * vx + math.cos(p) * vy
        Ff = 2 * magic(d - math.atan2(v + 1.15 * r, u), 4223.75)
        Fr = 2 * magic(-math.atan2(v - 1.55 * r, u), 3133.75)
        fx, fy = -Ff * math.sin(d) + 5000 * (25 - u), Ff * math.cos(d) + Fr
        ax = (math.cos(p) * fx - math.sin(p) * fy) / 1500
        ay = (math.sin(p) * fx + math.cos(p) * fy) / 1500
        dr = (1.15 * Ff * math.cos(d) - 1.55 * Fr) / 2600
        return [vx, vy, r, ax, ay, dr, (0.25 * (lane - seen) / 25 - d) / 0.15]

    found = solve_ivp(rate, (0, 8), [0, 0, 0, 25, 0, 0, 0], "DOP853", rtol=1e-9, atol=1e-10, max_step=0.02)
    assert [s["pose.y"][-1], s["pose.angle"][-1]] == pytest.approx([found.y[1][-1], found.y[2][-1]], abs=1e-6)


def test_a_quarter_car_on_a_random_road() -> None:
    """SciPy with the same road, wave by wave, and the same forces."""
    s = run_example("quarter_car")
    n = 0.011 * np.exp((np.arange(1, 61) - 0.5) * math.log(2.83 / 0.011) / 60)
    height = np.sqrt(2 * 256e-6 * (0.1 / n) ** 2 * n * math.log(2.83 / 0.011) / 60)
    k = np.arange(1, 61)
    phase = 2 * np.pi * np.mod(7 * 0.7548776662466927 + k * k * 0.5698402909980532, 1)

    def rate(t: float, y: np.ndarray) -> list[float]:
        b, w, db, dw = y
        angle = 2 * np.pi * n * 20 * t + phase
        road = height @ np.cos(angle)
        climb = -(height * 2 * np.pi * n * 20) @ np.sin(angle)
        depth = 0.32 - (w - road)
        tyre = max(0.0, 190e3 * depth - 100 * (dw - climb)) if depth > 0 else 0.0
        v, d = db - dw, max(0.0, 0.30 - (b - w))
        strut = 22e3 * (b - w - 0.5) + 900 * v + 900 * 0.15 * math.tanh(v / 0.15) - 50e3 * d - 2e7 * d**3
        return [db, dw, -strut / 320 - 9.81, (strut + tyre) / 40 - 9.81]

    start = [float(s[name][0]) for name in ("body.s", "wheel.s", "der(body.s)", "der(wheel.s)")]
    found = solve_ivp(rate, (0, 5), start, "DOP853", rtol=1e-9, atol=1e-11, max_step=5e-3)
    assert [s["body.s"][-1], s["wheel.s"][-1]] == pytest.approx(found.y[:2, -1], abs=1e-7)


def test_an_excavator_holds_its_bucket() -> None:
    """Virtual work at the end, where it all but rests: forces times changes of the lengths between eyes are those of the weights."""

    def place(q: np.ndarray, along: float, across: float) -> np.ndarray:
        x, y, angle = q
        c, s = math.cos(angle), math.sin(angle)
        return np.array([x + c * along - s * across, y + s * along + c * across, angle])

    def turned(q: np.ndarray, angle: float) -> np.ndarray:
        other: np.ndarray = q + np.array([0, 0, angle])
        return other

    def told(q: np.ndarray) -> tuple[float, np.ndarray]:
        """Give the potential energy and the lengths; the rocker by the two circles on which its end lies."""
        boom = turned(np.zeros(3), q[0])
        stick = turned(place(boom, 5.2, 0), q[1])
        bucket = turned(place(stick, 2.6, 0), q[2])
        pin, end = place(stick, 2.2, 0)[:2], place(bucket, 0, 0.45)[:2]
        d = end - pin
        half, out = np.linalg.norm(d) / 2, np.array([-d[1], d[0]]) / np.linalg.norm(d)
        knee = pin + d / 2 + math.sqrt(0.6**2 - half**2) * out
        heights = (
            1500 * place(boom, 2.6, 0.4)[1] + 800 * place(stick, 0.9, 0.1)[1] + 600 * place(bucket, 0.5, 0)[1]
            + 900 * place(bucket, 0.7, 0.1)[1] + 40 * (pin + knee)[1] / 2 + 50 * (knee + end)[1] / 2
        )  # fmt: skip
        eyes = [
            (place(boom, 2, 0.3)[:2], np.array([0.6, -0.4])),
            (place(stick, -0.7, 0.35)[:2], place(boom, 2.4, 0.9)[:2]),
            (knee, place(stick, 0.1, 0.5)[:2]),
        ]
        return 9.81 * heights, np.array([np.linalg.norm(a - b) for a, b in eyes])

    s = run_example("excavator")
    q = np.array([s[f"{name}.angle"][-1] for name in ("foot", "elbow", "wrist")])
    assert told(q)[1] == pytest.approx([s[f"reach[{i}]"][-1] for i in (1, 2, 3)], abs=1e-9)
    work, lengths = np.zeros(3), np.zeros((3, 3))
    for j, d in enumerate(np.eye(3) * 1e-5):
        ahead, behind = told(q + d), told(q - d)
        work[j], lengths[j] = (ahead[0] - behind[0]) / 2e-5, (ahead[1] - behind[1]) / 2e-5
    forces = np.linalg.solve(lengths, work)
    found = np.array([s[f"push[{i}]"][-1] for i in (1, 2, 3)])
    assert found == pytest.approx(forces, rel=1e-2)  # of which it still swings


def test_a_half_car_over_a_measured_road() -> None:
    """SciPy with its own spline and the same forces, from the start that is found by hand."""
    x = [0, 2, 4, 5, 6, 6.5, 7, 8, 10, 12, 13, 14, 15, 16, 18, 20, 24, 30, 40, 60]
    height = 1e-3 * np.array([0, 0, 0, 0, 8, 25, 60, 70, 68, 64, 20, -12, *[0] * 8])
    road = CubicSpline(x, height)
    arm, k = np.array([1.1, -1.5]), np.array([22e3, 20e3])

    def rate(t: float, y: np.ndarray) -> np.ndarray:
        z, pitch, v, w = y[0], y[1], y[4], y[5]
        s, ds = y[2:4], y[6:8]
        length = z - arm * np.sin(pitch) - s
        speed = v - arm * np.cos(pitch) * w - ds
        strut = k * (0.46 - length) - 1500 * speed + 40e3 * np.maximum(0, 0.24 - length)
        at = 15 * t + arm
        ground, climb = np.where(at < 0, 0, road(at)), np.where(at < 0, 0, 15 * road(at, 1))
        depth = np.maximum(0, 0.32 - (s - ground))
        tyre = np.maximum(0, 190e3 * depth - 100 * (ds - climb) * (depth > 0))
        turning = -np.cos(pitch) * arm @ strut / 1100
        return np.array([v, w, *ds, strut.sum() / 700 - 9.81, turning, *((tyre - strut) / 40 - 9.81)])

    s = run_example("half_car")
    names = ("z", "pitch", "wheel[1].s", "wheel[2].s")
    start = np.array([s[name][0] for name in names] + [0.0] * 4)
    assert rate(0.0, start) == pytest.approx(np.zeros(8), abs=1e-8)
    found = solve_ivp(rate, (0, 3), start, "DOP853", rtol=1e-10, atol=1e-12, max_step=2e-3)
    assert [s[name][-1] for name in names] == pytest.approx(found.y[:4, -1], abs=1e-7)
    assert s["buffer[1].push"].max() > 100


def test_a_satellite_is_turned_by_wheels_and_unloaded_by_coils() -> None:
    """SciPy: Euler's equations with wheels and quaternions, on a circle around the dipole of the earth."""
    J = np.diag([6.0, 5.0, 4.0])
    tilt = math.radians(46)

    def matrix(q: np.ndarray) -> np.ndarray:
        w, x, y, z = q / np.linalg.norm(q)
        skew = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        turned: np.ndarray = np.eye(3) + 2 * w * skew + 2 * skew @ skew
        return turned

    def rate(t: float, s: np.ndarray) -> np.ndarray:
        q, w, h = s[:4], s[4:7], s[7:10]
        u = math.sqrt(3.986004418e14 / 7e6**3) * t
        r = 7e6 * np.array([math.cos(u), math.sin(u) * math.cos(tilt), math.sin(u) * math.sin(tilt)])
        R = matrix(q)
        left = R.T @ sum(np.cross(R[:, i], np.eye(3)[i]) for i in range(3)) / 2
        wanted = 0.02 * left - 0.4 * w
        far = np.linalg.norm(r)
        B = R.T @ (31.2e-6 * (6371200 / far) ** 3 * (np.array([0, 0, 1]) - 3 * r[2] / far * r / far))
        dipole = np.clip(1e-3 * np.cross(h, B) / (B @ B), -100, 100)
        motor = np.clip(-wanted, -0.1, 0.1)
        dw = np.linalg.solve(J, np.cross(dipole, B) - motor - np.cross(w, J @ w + h))
        dq = 0.5 * np.array([-q[1:] @ w, *(q[0] * w + np.cross(q[1:], w))])
        return np.concatenate([dq, dw, motor])

    axis, angle = np.array([1, 2, 2]) / 3, math.radians(40)
    start = [math.cos(angle / 2), *(math.sin(angle / 2) * axis), *[0.0] * 6]
    found = solve_ivp(rate, (0, 1500), start, "DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
    s = run_example("satellite")
    # the momentum of a wheel is that of its own axis, which turns with the body too
    assert [s[f"wheel[{i}].momentum"][-1] for i in (1, 2, 3)] == pytest.approx(found[7:10], abs=1e-9)
    assert [s[f"attitude.orientation[{i}]"][-1] for i in (2, 3, 4)] == pytest.approx(found[1:4], abs=1e-9)
    assert s["momentum"][-1] < 0.1 * s["momentum"].max()


@pytest.mark.parametrize(("speed", "grows"), [(6.0, False), (8.5, True), (12.0, False)])
def test_a_rotor_on_its_wheels_shakes_itself_to_pieces_at_a_middle_speed(speed: float, grows: bool) -> None:
    """R. P. Coleman, A. M. Feingold 1958: with z = x + iy of the hub and the sum q of lag angles turned to the world, coefficients are
    constant, (M + n m) z'' + C z' + K z + i n/2 m l q'' = 0, I (q'' - 2 i W q' - W^2 q) + c (q' - i W q) + m e l W^2 q = i m l z''."""
    M, K, C, m, e, arm, c, n = 1500, 60e3, 300, 60, 0.3, 2.5, 60, 3
    inertia = m * arm**2 + m * (2 * arm) ** 2 / 12
    second = np.array([[M + n * m, 0.5j * n * m * arm], [-1j * m * arm, inertia]])
    first = np.diag([C, c - 2j * inertia * speed])
    none = np.diag([K, m * e * arm * speed**2 - 1j * speed * c - inertia * speed**2])
    moved = np.linalg.solve(second, np.hstack([-none, -first]))
    poles = np.linalg.eigvals(np.vstack([np.hstack([np.zeros((2, 2)), np.eye(2)]), moved]))
    T = 2 * math.pi / speed
    model = load("ground_resonance")
    answer = model.floquet(period=T, set={"W": speed, "x": 0.0})
    sizes = sorted({round(abs(complex(*x)), 7) for x in answer.details["multipliers"]})
    for size in np.abs(np.exp(poles * T)):
        assert min(abs(size - other) for other in sizes) < 2e-7
    assert (poles.real.max() > 0) == grows == (sizes[-1] > 1)


def test_a_muscle_carries_the_moment_of_a_forearm() -> None:
    """The tension times its arm is the weights times theirs, the damping and what still accelerates."""
    t = np.linspace(0.5, 4, 701)
    s = run_example("elbow")(t)
    q, w = s["elbow.angle"], s["der(elbow.angle)"]
    x, y = 0.04 * np.cos(q), 0.04 * np.sin(q)
    arm = 0.04 * 0.3 * np.cos(q) / np.hypot(x, y - 0.3)
    weights = 9.81 * np.cos(q) * (1.5 * 0.15 + 2 * 0.32)
    inertia = 0.01 + 1.5 * 0.15**2 + 2 * 0.32**2
    left = s["biceps.tension"] * arm - weights - 1.5 * w
    assert left[5:-5] == pytest.approx(inertia * np.gradient(w, t)[5:-5], abs=2e-3)
    assert weights.max() > 4
    assert q[-1] > q[0] and abs(w[-1]) < 0.02


def test_a_gearbox_shifts_under_load() -> None:
    """In first gear all turns together; then the second clutch slips at its torque until engine and car fit."""
    s = run_example("gear_shift")
    M = 0.12 * 6 * 0.1 * 3000
    a = 120 * 12 / (150 + 0.3 * 144)
    car, engine = 20 + a, 12 * (20 + a)
    rates = (120 - M) / 0.3, 8 * M / 150
    slipping = (engine - 8 * car) / (8 * rates[1] - rates[0])
    stick = next(e.time for e in s.events if e.kind == "stick")
    assert stick == pytest.approx(1 + slipping, rel=1e-9)
    last = car + rates[1] * slipping + 120 * 8 / (150 + 0.3 * 64) * (1 - slipping)
    assert s["der(car.angle)"][-1] == pytest.approx(last, rel=1e-9)
    # what the slipping plates turn into heat: torque times the angle between both sides
    assert s["energy.dissipated"][-1] == pytest.approx(M * (engine - 8 * car) * slipping / 2, rel=1e-9)


def test_a_drive_runs_up_at_its_largest_current() -> None:
    """J w' = K i while the controller of the speed is at its limit, and the lag of the current is its own."""
    s = run_example("current_limit")
    steady = (s.time > 0.1) & (s.time < 0.3)
    assert s["motor.i"][steady] == pytest.approx(20, abs=0.3)
    gained = s["der(rotor.angle)"][steady][-1] - s["der(rotor.angle)"][steady][0]
    current = np.trapezoid(s["motor.i"][steady], s.time[steady])
    assert gained == pytest.approx(0.4 * current / 0.02, rel=1e-5)
    assert s["motor.i"].max() < 21 and s["motor.i"].min() > -21
    assert s(0.99)["der(rotor.angle)"] == pytest.approx(150, abs=1.5)
    assert s["der(rotor.angle)"][-1] == pytest.approx(-50, abs=0.1)


def test_a_conveyor_takes_its_parcels_along() -> None:
    s = run_example("conveyor")
    slide = 1.5 / (0.4 * 9.81)
    found = [e.time for e in s.events if e.kind == "stick"]
    assert found == pytest.approx([i * 0.5 + slide for i in (1, 2, 3, 4)], rel=1e-9)
    assert s["energy.supplied"][-1] == pytest.approx(4 * 8 * 1.5**2, rel=1e-9)
    assert s["energy.dissipated"][-1] == pytest.approx(2 * 8 * 1.5**2, rel=1e-9)


def test_a_catamaran_rolls_and_heaves() -> None:
    """Roll by the metacentric height: J w^2 = 2 rho g A (beam/2)^2 - m g (height of the mass centre - draught/2)."""
    poles = [
        complex(*p)
        for p in load("catamaran")
        .linearize(at="pose.y = -0.7317073170731707, pose.angle = 0")
        .details["poles"]
    ]
    found = sorted(p.imag for p in poles if p.imag > 0.1)
    water, draught = 1025 * 9.81 * 4, 6000 / (1025 * 8)
    heave = math.sqrt(2 * water / 6000)
    roll = math.sqrt((2 * water * 2.5**2 - 6000 * 9.81 * (1.6 - draught / 2)) / 3e4)
    assert found == pytest.approx(sorted([heave, roll]), rel=1e-6)

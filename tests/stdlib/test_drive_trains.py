"""Parts of drive trains and slides against closed forms, statics, and SciPy."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from gallery import run as run_example
from scipy.integrate import solve_ivp
from scipy.linalg import expm

import mechc


def run(package: str, text: str, stop: float = 1.0, **given: Any) -> mechc.Solution:
    whole = f"import mech.{package}.*;\nmodel M\n{text}\n  experiment(stop = {stop} s, tolerance = 1e-11);\nend M;\n"
    solution = mechc.loads(whole).simulate(**given)
    assert solution.outcome.value == "completed", solution.message
    return solution


def test_two_rotors_on_a_shaft() -> None:
    """The twist swings damped with the reduced inertia, and the momentum stays."""
    s = run("rotational", "Rotor a(J = 2 kg.m^2); Rotor b(J = 3 kg.m^2); SpringDamper k(a.angle -> b.angle, k = 50 N.m/rad, c = 2 N.m.s); initial der(a.angle) = 4 rad/s;")  # fmt: skip
    J = 1.2
    d, w = 2 / (2 * J), math.sqrt(50 / J - (1 / J) ** 2)
    t = s.time
    assert s["b.angle"] - s["a.angle"] == pytest.approx(-4 / w * np.exp(-d * t) * np.sin(w * t), abs=1e-9)
    assert 2 * s["der(a.angle)"] + 3 * s["der(b.angle)"] == pytest.approx(8, abs=1e-9)


def test_springs_in_series_meet_at_a_node() -> None:
    """1/k = 1/k1 + 1/k2, with nothing that has inertia between them."""
    s = run("rotational", "Rotor a(J = 2 kg.m^2); Node n; SpringDamper one(0 rad -> n.angle, k = 30 N.m/rad); SpringDamper two(n.angle -> a.angle, k = 60 N.m/rad); initial a.angle = 0.1 rad;")  # fmt: skip
    assert s["a.angle"] == pytest.approx(0.1 * np.cos(math.sqrt(20 / 2) * s.time), abs=1e-9)


@pytest.mark.parametrize(("torque", "load"), [(3.0, 2.0), (-1.0, 30.0)])
def test_a_lossy_gear_in_both_directions(torque: float, load: float) -> None:
    """Where the motor drives, 80 % of its torque arrives; where the load does, 60 % of it does."""
    s = run("rotational", f"Rotor a(J = 0.1 kg.m^2); Rotor b(J = 4 kg.m^2); LossyGear g(a.angle -> b.angle, ratio = 5, efficiency = 0.8, back_efficiency = 0.6); force {torque} N.m on a.angle; force -{load} N.m on b.angle; initial der(b.angle) = 0.01 rad/s*{1 if torque > 0 else -1};")  # fmt: skip
    if torque > 0:
        wanted = (5 * 0.8 * torque - load) / (4 + 0.8 * 25 * 0.1)
    else:
        wanted = (5 * torque - 0.6 * load) / (25 * 0.1 + 0.6 * 4)
    rate = s["der(b.angle)"]
    assert rate[-1] - rate[0] == pytest.approx(wanted, rel=1e-9)


def test_a_self_locking_gear_holds_its_load() -> None:
    s = run("rotational", "Rotor a(J = 0.1 kg.m^2); Rotor b; LossyGear g(a.angle -> b.angle, ratio = 20, efficiency = 0.4, back_efficiency = -0.2); force -30 N.m on b.angle;")  # fmt: skip
    assert np.abs(s["b.angle"]).max() < 1e-9


def test_a_planetary_and_a_differential() -> None:
    """With the ring held the carrier turns 1/(1 + ratio) of the sun; both shafts of a differential get half of the torque."""
    s = run("rotational", "Rotor sun(J = 1 kg.m^2); Rotor carrier(J = 5 kg.m^2); Planetary g(sun = sun.angle, ring = 0 rad, carrier = carrier.angle, ratio = 3); force 2 N.m on sun.angle;")  # fmt: skip
    assert s["carrier.angle"][-1] == pytest.approx(0.5 * (2 * 4 / (5 + 16)), rel=1e-10)
    assert s["sun.angle"] == pytest.approx(4 * s["carrier.angle"], abs=1e-12)
    s = run("rotational", "Rotor c(J = 1 kg.m^2); Rotor l(J = 2 kg.m^2); Rotor r(J = 5 kg.m^2); Differential d(cage = c.angle, left = l.angle, right = r.angle); force 3 N.m on c.angle;")  # fmt: skip
    matrix = np.array([[1.0, 0, 0, -2], [0, 2, 0, 1], [0, 0, 5, 1], [-2, 1, 1, 0]])
    rates = np.linalg.solve(matrix, [3, 0, 0, 0])[:3]
    assert [s[f"der({name}.angle)"][-1] for name in "clr"] == pytest.approx(rates, rel=1e-10)


def test_a_clutch_slips_until_both_sides_turn_alike() -> None:
    """After dw/(M (1/J1 + 1/J2)); what is lost is half the reduced inertia times the square of the difference."""
    s = run("rotational", "Rotor a(J = 2 kg.m^2); Rotor b(J = 3 kg.m^2); Clutch k(a.angle -> b.angle, press = 50 N, radius = 0.2 m, mu = 0.4, faces = 2); initial der(a.angle) = 5 rad/s;")  # fmt: skip
    torque = 0.4 * 2 * 0.2 * 50
    (stick,) = [e.time for e in s.events if e.kind == "stick"]
    assert stick == pytest.approx(5 / (torque * (1 / 2 + 1 / 3)), rel=1e-10)
    assert s["der(b.angle)"][-1] == pytest.approx(2.0, rel=1e-10)
    assert s["energy.dissipated"][-1] == pytest.approx(1 / 2 * 1.2 * 25, rel=1e-10)


def test_a_freewheel_takes_along_and_lets_run() -> None:
    """Driven by a torque both turn; when it brakes, the driven side goes on."""
    s = run("rotational", "Rotor a(J = 2 kg.m^2); Rotor b(J = 3 kg.m^2); OneWayClutch f(a.angle -> b.angle, drag = 0.3 N.m); force (if time < 0.5 s then 10 N.m else -8 N.m) on a.angle;")  # fmt: skip
    assert s(0.5)["der(b.angle)"] == pytest.approx(10 * 0.5 / 5, rel=1e-9)
    assert s["der(b.angle)"][-1] == pytest.approx(1 - 0.3 / 3 * 0.5, rel=1e-9)
    assert s["der(a.angle)"][-1] == pytest.approx(1 + (-8 + 0.3) / 2 * 0.5, rel=1e-9)


def test_freewheels_between_nodes_without_mass() -> None:
    """Two dampings of c pass on c/2 of a difference of speeds, but never more than the drag backwards: small steps by hand."""
    s = mechc.loads("""
        import mech.rotational.*;
        model Hub
          parameter AngularVelocity speed;
          coordinate Angle drum = 0 rad; kinetic 1/2*2 kg.m^2*der(drum)^2;
          coordinate Angle a = 0 rad; coordinate Angle b = 0 rad;
          dissipation 0.25 N.m.s*(der(a) - speed*cos(2*time/(1 s)))^2; damping 0.5 N.m.s on drum - b;
          OneWayClutch pawl(from = a, to = b, drag = 0.3 N.m);
        end Hub;
        model M
          Hub hub[2](speed = {10, 7} rad/s);
          experiment(stop = 4 s, tolerance = 1e-11);
        end M;
        """).simulate()
    for i, speed in enumerate((10, 7), 1):

        def torque(t: float, w: float, speed: float = speed) -> float:
            return max(-0.3, 0.25 * (speed * math.cos(2 * t) - w))

        hand = solve_ivp(lambda t, w: [torque(t, w[0]) / 2], (0, 4), [0.0], rtol=1e-10, atol=1e-12, max_step=2e-3)  # fmt: skip
        assert s[f"der(hub[{i}].drum)"][-1] == pytest.approx(hand.y[0, -1], rel=1e-7)
        assert s[f"hub[{i}].pawl.torque"][-1] == pytest.approx(torque(4, hand.y[0, -1]), rel=1e-7)


def test_a_shaft_runs_down_in_its_bearing() -> None:
    """J w' = -M - c w comes to rest after J/c log(1 + c w0/M)."""
    s = run("rotational", "Rotor a(J = 2 kg.m^2); BearingFriction f(from = a.angle, coulomb = 3 N.m, viscous = 0.5 N.m.s); initial der(a.angle) = 4 rad/s;", 5)  # fmt: skip
    (stick,) = [e.time for e in s.events if e.kind == "stick"]
    assert stick == pytest.approx(2 / 0.5 * math.log(1 + 0.5 * 4 / 3), rel=1e-10)


def test_stops_throw_back() -> None:
    s = run("rotational", "Rotor a; Stop e(from = a.angle, low = -0.2 rad, high = 0.3 rad, restitution = 0.5); initial der(a.angle) = 2 rad/s;")  # fmt: skip
    assert s.events[0].time == pytest.approx(0.15, rel=1e-10) and s.events[1].time == pytest.approx(
        0.65, rel=1e-10
    )
    assert s["der(a.angle)"][-1] == pytest.approx(0.5, rel=1e-10)


def test_a_dc_motor_runs_up() -> None:
    """(w, i)' = A (w, i) + b, by the exponential of the matrix."""
    s = run("rotational", "Rotor a(J = 0.01 kg.m^2); DCMotor m(from = a.angle, voltage = 12 V, R = 2 Ohm, L = 50 mH, K = 0.3 N.m/A); damping 0.01 N.m.s on a.angle;")  # fmt: skip
    A = np.array([[-1, 30, 0], [-6, -40, 240], [0, 0, 0]])
    for t in (0.05, 0.3, 1.0):
        w, i, _ = expm(A * t) @ [0, 0, 1]
        assert s(t)["der(a.angle)"] == pytest.approx(w, rel=1e-8) and s(t)["m.i"] == pytest.approx(
            i, rel=1e-8
        )


def test_play_is_passed_without_torque() -> None:
    """From the middle of the play at 0.5 rad/s: 0.05 rad take 0.1 s, and half a swing of the teeth follows."""
    s = run("rotational", "Rotor a; Backlash g(from = a.angle, k = 400 N.m/rad, play = 0.1 rad); initial der(a.angle) = 0.5 rad/s;")  # fmt: skip
    assert s(0.1)["a.angle"] == pytest.approx(0.05, rel=1e-10)
    back = 0.1 + math.pi / 20
    assert s(back + 0.05)["a.angle"] == pytest.approx(0.05 - 0.5 * 0.05, abs=1e-9)
    assert s["energy.total"] == pytest.approx(0.125, rel=1e-9)


def test_a_speed_source_tells_its_torque() -> None:
    s = run("rotational", "Rotor a(J = 2 kg.m^2); SpeedSource v(from = a.angle, speed = (3 rad/s^2)*time); output M = multiplier(v.follow);")  # fmt: skip
    assert s["M"] == pytest.approx(6, abs=1e-9) and s["a.angle"][-1] == pytest.approx(1.5, rel=1e-9)


def test_slides() -> None:
    """A mass on a spring with a damper; a rack; a screw; Stribeck friction runs down as SciPy says."""
    s = run(
        "translational",
        "Slider a(m = 2 kg); SpringDamper k(from = 0 m, to = a.s, k = 50 N/m, c = 4 N.s/m, rest = 0.1 m);",
    )
    w = math.sqrt(25 - 1)
    t = s.time
    assert s["a.s"] == pytest.approx(0.1 - 0.1 * np.exp(-t) * (np.cos(w * t) + np.sin(w * t) / w), abs=1e-9)
    s = run("translational", "coordinate Angle q = 0 rad; kinetic 1/2*(0.01 kg.m^2)*der(q)^2; Slider a(m = 2 kg); Rack r(q -> a.s, r = 5 cm); force 0.3 N.m on q;")  # fmt: skip
    assert s["a.s"][-1] == pytest.approx(0.5 * 0.3 / 0.05 / (2 + 0.01 / 0.05**2), rel=1e-10)
    s = run("translational", "coordinate Angle q = 0 rad; kinetic 1/2*(0.01 kg.m^2)*der(q)^2; Slider a(m = 2 kg); LeadScrew r(q -> a.s, lead = 10 mm); force 0.3 N.m on q; output F = multiplier(r.thread);")  # fmt: skip
    i = 2 * math.pi / 0.01
    assert s["a.s"][-1] == pytest.approx(0.5 * 0.3 * i / (2 + 0.01 * i**2), rel=1e-9)
    s = run("translational", "Slider a(m = 2 kg); StribeckFriction f(from = a.s, coulomb = 1 N, stribeck = 2 N, speed = 0.3 m/s, viscous = 0.5 N.s/m); initial der(a.s) = 1 m/s;", 3)  # fmt: skip

    def stops(t: float, y: np.ndarray) -> float:
        return float(y[0])

    stops.terminal = True  # type: ignore[attr-defined]
    found = solve_ivp(lambda t, v: -(1 + 2 * np.exp(-v / 0.3) + 0.5 * v) / 2, (0, 3), [1.0], "DOP853", events=stops, rtol=1e-11, atol=1e-12)  # fmt: skip
    (stick,) = [e.time for e in s.events if e.kind == "stick"]
    assert stick == pytest.approx(found.t_events[0][0], rel=1e-8)


def test_a_gap_pushes_and_never_pulls() -> None:
    """A mass that runs into it at 1 m/s comes back as a damped half swing lets it: SciPy with the same law."""
    s = run("translational", "Slider a(m = 2 kg); Gap g(from = 0 m, to = a.s, k = 800 N/m, c = 20 N.s/m, rest = 0.2 m); initial a.s = 0.3 m; initial der(a.s) = -1 m/s;", 0.5)  # fmt: skip

    def rate(t: float, y: np.ndarray) -> list[float]:
        depth = 0.2 - y[0]
        return [y[1], max(0.0, 800 * depth - 20 * y[1]) / 2 if depth > 0 else 0.0]

    found = solve_ivp(rate, (0, 0.5), [0.3, -1.0], "DOP853", rtol=1e-10, atol=1e-12, max_step=1e-3)
    assert s["a.s"][-1] == pytest.approx(found.y[0][-1], abs=1e-7)
    assert (s["g.push"] >= -1e-9).all()


def test_a_gas_spring_is_adiabatic() -> None:
    """p V^n stays: the energy of a mass that compresses it is that of the gas, p1 V1 ((V1/V)^(n - 1) - 1)/(n - 1)."""
    s = run("translational", "Slider a(m = 2 kg); GasSpring g(from = 0 m, to = a.s, area = 10 cm^2, charged = 30 cm, volume = 20 cm, pressure = 0.2 MPa, n = 1.4); initial a.s = 0.3 m; initial der(a.s) = -3 m/s;", 0.05)  # fmt: skip
    V1, V = 0.2e-3, (0.2 + s["a.s"] - 0.3) * 1e-3
    gas = 0.2e6 * V1 * ((V1 / V) ** 0.4 - 1) / 0.4
    assert 0.5 * 2 * s["der(a.s)"] ** 2 + gas == pytest.approx(9, rel=1e-8)


def oil(p: float, air: float = 0.001, bulk: float = 1.4e9) -> float:
    """Bulk modulus of oil and bubbles of air side by side: both give way, each by its own share of the volume."""
    bubbles: float = air * math.pow(1.01325e5 / (1.01325e5 + p), 1 / 1.4)
    shares = bubbles / (1 + bubbles)
    return 1 / ((1 - shares) / bulk + shares / (1.4 * (1.01325e5 + p)))


def closed_account(s: mechc.Solution) -> np.ndarray:
    """What is there, less what came in, with what was lost."""
    account = s["energy.total"] - s["energy.supplied"]
    return account + s["energy.dissipated"] if "energy.dissipated" in s.quantities else account


def test_a_hydraulic_cylinder() -> None:
    """It is stiff; SciPy's Radau solves the same six lines."""
    text = "Slider a(m = 100 kg); Cylinder c(from = 0 m, to = a.s, flow1 = 2e-4 m^3/s, flow2 = -1.2e-4 m^3/s, leak = 1e-12 m^3/s/Pa); damping 500 N.s/m on a.s; initial a.s = 0.1 m;"
    s = run("translational", text, 0.5)

    def rate(t: float, y: np.ndarray) -> list[float]:
        x, v, p1, p2 = y
        return [
            v,
            (p1 * 20e-4 - p2 * 12e-4 - 500 * v) / 100,
            oil(p1) * (2e-4 - 20e-4 * v - 1e-12 * (p1 - p2)) / (50e-6 + 20e-4 * x),
            oil(p2) * (-1.2e-4 + 12e-4 * v + 1e-12 * (p1 - p2)) / (50e-6 + 12e-4 * (0.5 - x)),
        ]

    found = solve_ivp(rate, (0, 0.5), [0.1, 0, 0, 0], "Radau", rtol=1e-9, atol=[1e-10, 1e-10, 1e-3, 1e-3])
    assert s["a.s"][-1] == pytest.approx(found.y[0][-1], abs=1e-7)
    assert s["c.p1"][-1] == pytest.approx(found.y[2][-1], abs=5e-1)


def test_a_cylinder_that_is_pulled_comes_near_a_vacuum() -> None:
    """Stiff oil, closed: the bubbles alone grow, p V^1.4 of them stays, and the pressure stays above that of a vacuum."""
    text = "Slider a; drive a.s = 0.1 m + 0.3 m*sin(time/0.2 s)^2; SingleActingCylinder c(from = 0 m, to = a.s, bulk = 1e15 Pa, air = AIR, stops = false);"
    s = run("translational", text.replace("AIR", "0.02"), 1.0)
    volume = (50e-6 + 20e-4 * s["a.s"]) / (50e-6 + 20e-4 * 0.1)
    bubbles = 1.02 * volume - 1
    assert s["c.p"] == pytest.approx(101325 * ((0.02 / bubbles) ** 1.4 - 1), abs=1e-2)
    assert -101325 < s["c.p"].min() < -100000
    with pytest.raises(AssertionError, match="pulls its oil below a vacuum"):
        run("translational", text.replace("AIR", "0"))


def test_a_jack_lifts_lands_and_sinks() -> None:
    """A plunger pumped against its spring and a load, then leaking: SciPy's Radau until it meets its foot, and statics there."""
    text = (
        "Slider a(m = 200 kg); SingleActingCylinder c(from = 0 m, to = a.s, flow = (if time < 2 s then 1e-4 m^3/s else 0 m^3/s), leak = 4e-11 m^3/s/Pa,"
        " k = 5 kN/m, preload = 300 N, stroke = 0.3 m); force -200 kg*9.81 m/s^2 on a.s; damping 4 kN.s/m on a.s;"
        " initial a.s = 5 mm; initial c.p = 1.14 MPa;"
    )
    s = run("translational", text, 12.0)
    assert closed_account(s) == pytest.approx(closed_account(s)[0], abs=1e-5)

    def rate(t: float, y: np.ndarray, flow: float) -> list[float]:
        x, v, p = y
        force = p * 20e-4 - 300 - 5e3 * x - 4e3 * v - 200 * 9.81
        return [v, force / 200, oil(p) * (flow - 20e-4 * v - 4e-11 * p) / (50e-6 + 20e-4 * x)]

    def at_foot(t: float, y: np.ndarray, flow: float) -> float:
        return float(y[0])

    at_foot.terminal = True  # type: ignore[attr-defined]
    settings = {"method": "Radau", "rtol": 1e-10, "atol": [1e-12, 1e-12, 1e-4]}
    up = solve_ivp(rate, (0, 2), [5e-3, 0, 1.14e6], args=(1e-4,), **settings)
    assert [s(2.0)["a.s"], s(2.0)["c.p"]] == pytest.approx(up.y[[0, 2], -1], rel=1e-7)
    down = solve_ivp(rate, (2, 12), up.y[:, -1], args=(0.0,), events=at_foot, **settings)
    landed = next(e.time for e in s.events if e.kind == "impact")
    assert landed == pytest.approx(float(down.t_events[0][0]), rel=1e-7)
    assert s["a.s"][-1] == pytest.approx(0, abs=1e-9)
    assert s["c.stop"][-1] == pytest.approx(200 * 9.81 + 300 - s["c.push"][-1], rel=1e-9)


def test_a_valve_drives_a_cylinder_to_its_stop() -> None:
    """A dead zone, compressible oil, a stop: SciPy's Radau solves the way, and at the stop one chamber is at the pump, the other at the tank."""
    text = (
        "Slider a(m = 100 kg); Cylinder c(from = 0 m, to = a.s, flow1 = v.flow1, flow2 = v.flow2, stroke = 0.4 m, retracted = 0.05 m);"
        " Valve v(u = u, p1 = c.p1, p2 = c.p2, overlap = 0.05); let u = 0.6*(1 - exp(-time/0.02 s)) - 0.01; damping 500 N.s/m on a.s;"
        " initial a.s = 0.1 m; initial c.p1 = 3 MPa; initial c.p2 = 5 MPa; output Q1 = v.flow1;"
    )
    s = run("translational", text, 2.0)
    stiff = text.replace("stroke =", "air = 1e-4, stroke =")
    assert run("translational", stiff, 30.0).statistics.method == "radau5"  # chosen where it is pressed on
    assert closed_account(s) == pytest.approx(closed_account(s)[0], abs=1e-5)

    def edge(dp: float) -> float:
        return 40e-3 / 60 / math.sqrt(3.5e6) * dp / math.sqrt(math.hypot(dp, 5e4))

    def rate(t: float, y: np.ndarray) -> list[float]:
        x, v, p1, p2 = y
        u = 0.6 * (1 - math.exp(-t / 0.02)) - 0.01
        o = math.copysign(max(0.0, abs(u) - 0.05), u) / 0.95
        Q1 = o * edge(20e6 - p1 if o > 0 else p1)
        Q2 = -o * edge(p2 if o > 0 else 20e6 - p2)
        force = (p1 * 20e-4 - p2 * 12e-4 - 500 * v) / 100
        return [
            v,
            force,
            oil(p1) * (Q1 - 20e-4 * v) / (50e-6 + 20e-4 * (x - 0.05)),
            oil(p2) * (Q2 + 12e-4 * v) / (50e-6 + 12e-4 * (0.45 - x)),
        ]

    def at_stop(t: float, y: np.ndarray) -> float:
        return float(y[0] - 0.45)

    at_stop.terminal = True  # type: ignore[attr-defined]
    found = solve_ivp(
        rate,
        (0, 2),
        [0.1, 0, 3e6, 5e6],
        "Radau",
        events=at_stop,
        rtol=1e-9,
        atol=[1e-11, 1e-10, 1e-3, 1e-3],
        max_step=0.01,
    )
    hit = next(e.time for e in s.events if e.kind == "impact")
    assert hit == pytest.approx(float(found.t_events[0][0]), abs=1e-7)
    assert s["a.s"][-1] == pytest.approx(0.45, abs=1e-9) and s["c.p1"][-1] == pytest.approx(20e6, rel=1e-6)
    assert s["c.p2"][-1] == pytest.approx(0, abs=200) and s["v.heat"][-1] == pytest.approx(0, abs=1)
    assert s["c.stop"][-1] == pytest.approx(-s["c.push"][-1], rel=1e-9) == pytest.approx(-40e3, rel=1e-4)


def test_a_hydraulic_axis_rests_in_its_dead_zone() -> None:
    """Within overlap/gain of its target; there the oil between closed edges is a spring, bulk (A1^2/V1 + A2^2/V2)."""
    s = run_example("hydraulic_axis", stop=8.0)
    before = float(s(3.99)["load.s"])
    assert abs(0.3 - before) <= 0.04 / 20 * (1 + 1e-9)
    p1, p2 = float(s(3.99)["cylinder.p1"]), float(s(3.99)["cylinder.p2"])
    stiffness = oil(p1) * 20e-4**2 / (50e-6 + 20e-4 * before) + oil(p2) * 12e-4**2 / (
        50e-6 + 12e-4 * (0.5 - before)
    )
    assert s["load.s"][-1] - before == pytest.approx(5000 / stiffness, rel=1e-2)


def test_a_motor_lifts_a_load_through_a_lossy_gear() -> None:
    """At the end as the statics of the train say: u = R i + K w, i = (M + m)/(ratio efficiency K)."""
    s = run_example("drive_train")
    current = 8.5 / (20 * 0.8 * 0.05)
    assert s["motor.i"][-1] == pytest.approx(current, rel=1e-9)
    assert s["der(drum.angle)"][-1] == pytest.approx((24 - 0.5 * current) / (20 * 0.05), rel=1e-9)
    assert s["pinion.angle"][-1] - s["drum.angle"][-1] == pytest.approx(8.5 / 200, rel=1e-9)


def test_a_screw_press_comes_to_rest_on_its_workpiece() -> None:
    s = run_example("screw_press")
    force = 2 * math.pi * 0.4 / 0.01
    assert s["ram.s"][-1] == pytest.approx((force + 20e3 * 0.03) / 20.5e3, rel=1e-7)
    assert s["workpiece.push"][-1] + s["back.pull"][-1] == pytest.approx(force, rel=1e-6)


def test_a_motor_runs_up_along_its_torque_curve() -> None:
    """Where the curve is a straight line the speed is an exponential: M = 100 - 0.5 w after 60 % between -10 and 110 N.m."""
    s = run("rotational", "Rotor a(J = 2 kg.m^2); TorqueCurve m(from = a.angle, load = 0.6, speeds = {0, 100} rad/s, full = {110, 50} N.m, dragged = {-10, -35} N.m);", 3)  # fmt: skip
    start, slope = 0.6 * 110 - 0.4 * 10, (0.6 * 50 - 0.4 * 35 - 62) / 100
    w = start / slope * (np.exp(slope * s.time / 2) - 1)
    assert w[-1] < 100
    assert s["der(a.angle)"] == pytest.approx(w, abs=1e-8)
    assert s["m.torque"] == pytest.approx(start + slope * w, abs=1e-8)


def test_a_servo_without_limits_is_an_oscillator() -> None:
    """J x'' + kv x' + kp kv x = kp kv: w^2 = kp kv/J."""
    s = run("rotational", "Rotor a(J = 0.1 kg.m^2); Servo m(from = a.angle, target = 0.1 rad, kp = 20 s^-1, kv = 4 N.m.s);")  # fmt: skip
    d, w = 4 / 0.2, math.sqrt(20 * 4 / 0.1 - 20**2)
    t = s.time
    x = 0.1 * (1 - np.exp(-d * t) * (np.cos(w * t) + d / w * np.sin(w * t)))
    assert s["a.angle"] == pytest.approx(x, abs=1e-10)


def test_a_servo_is_limited_in_torque_and_speed() -> None:
    """With torque at its limit of 3 N.m it reaches the limit of 2 rad/s, less what kv lacks of it, and runs at that."""
    s = run("rotational", "Rotor a(J = 0.1 kg.m^2); Servo m(from = a.angle, target = 5 rad, kp = 20 s^-1, kv = 40 N.m.s, speed = 2 rad/s, limit = 3 N.m);", 1)  # fmt: skip
    until = (2 - 3 / 40) * 0.1 / 3
    t = s.time
    early = t < until
    assert s["a.angle"][early] == pytest.approx(15 * t[early] ** 2, abs=1e-10)
    rest = t[~early] - until
    rate = 2 - 3 / 40 * np.exp(-40 / 0.1 * rest)
    assert s["der(a.angle)"][~early] == pytest.approx(rate, abs=1e-8)
    assert s["m.torque"][early] == pytest.approx(3, abs=1e-12)


@pytest.mark.parametrize("soft", [False, True])
def test_a_gap_and_teeth_that_bounce_lose_what_their_dampers_take(soft: bool) -> None:
    """A mass falls on a gap, again and again: place and speed by SciPy, whose steps end where it touches and parts, and what is lost is dissipated."""
    k, c, g = 1e4, 20.0, 9.81

    def touching(t: float, y: np.ndarray) -> list[float]:
        push = k * -y[0]
        damper = np.clip(-c * y[1], -push, push) if soft else max(-push, -c * y[1])
        return [y[1], -g + push + damper, -damper * y[1]]

    def falling(t: float, y: np.ndarray) -> list[float]:
        return [y[1], -g, 0.0]

    def zero(t: float, y: np.ndarray) -> float:
        return float(y[0])

    zero.terminal = True  # type: ignore[attr-defined]
    t, y, inside = 0.0, np.array([0.1, 0.0, 0.0]), False
    while t < 1:
        zero.direction = 1.0 if inside else -1.0  # type: ignore[attr-defined]
        found = solve_ivp(touching if inside else falling, (t, 1.0), y, "DOP853", events=zero, rtol=1e-11, atol=1e-13, max_step=1e-2)  # fmt: skip
        t, y, inside = float(found.t[-1]), found.y[:, -1].copy(), not inside
    given = f"k = {k} N/m, c = {c} N.s/m, soft = {str(soft).lower()}"
    s = run("translational", f"Slider a(s = 0.1 m); force -9.81 N on a.s; Gap p(0 m -> a.s, {given});")
    assert s["a.s"][-1] == pytest.approx(y[0], abs=1e-8)
    assert s["energy.dissipated"][-1] == pytest.approx(y[2], rel=1e-7)
    turned = given.replace("N/m", "N.m/rad").replace("N.s/m", "N.m.s")
    s = run("rotational", f"Rotor a(angle = 0.1 rad); force -9.81 N.m on a.angle; Backlash p(1 rad -> a.angle, play = 2 rad, {turned});")  # fmt: skip
    assert s["a.angle"][-1] == pytest.approx(y[0], abs=1e-8)
    assert s["energy.dissipated"][-1] == pytest.approx(y[2], rel=1e-7)


def test_what_sticks_more_than_it_slides() -> None:
    """With peak = 1.5 a bearing of 2 N.m breaks loose at 3 N.m, and then slides at 2."""
    s = run("rotational", "Rotor a(J = 2 kg.m^2); BearingFriction f(from = a.angle, coulomb = 2 N.m, peak = 1.5); force (10 N.m/s)*time on a.angle;")  # fmt: skip
    (slip,) = [e.time for e in s.events if e.kind == "slip"]
    assert slip == pytest.approx(0.3, rel=1e-9)
    assert s["der(a.angle)"][-1] == pytest.approx((5 * (1 - 0.09) - 2 * 0.7) / 2, rel=1e-9)


def test_an_eddy_current_brake() -> None:
    """J w' = -2 M w w0/(w^2 + w0^2): log w/w1 + (w^2 - w1^2)/(2 w0^2) falls by 2 M t/(J w0)."""
    s = run("rotational", "Rotor a(J = 2 kg.m^2, der(angle) = 5 rad/s); EddyCurrentBrake b(from = a.angle, peak = 3 N.m, speed = 4 rad/s, heated = 0.5);")  # fmt: skip
    w = s["der(a.angle)"]
    fallen = np.log(5 / w) + (25 - w**2) / (2 * 2.0**2)
    assert fallen == pytest.approx(2 * 3 * s.time / (2 * 2), abs=1e-8)
    assert s["energy.dissipated"][-1] == pytest.approx(25 - w[-1] ** 2, rel=1e-8)
    s = run("translational", "Slider a(m = 2 kg, der(s) = 5 m/s); EddyCurrentBrake b(from = a.s, peak = 3 N, speed = 4 m/s, heated = 0.5);")  # fmt: skip
    assert s["der(a.s)"][-1] == pytest.approx(w[-1], rel=1e-8)


def test_a_gear_without_any_efficiency_is_none() -> None:
    """At 0 the loss of a driven gear would be infinite: below the range, as what is above 1."""
    for value in ("0", "1.1"):
        with pytest.raises(mechc.SimulationError) as caught:
            mechc.loads(f"import mech.rotational.*;\nmodel M Rotor a; Rotor b; LossyGear g(a.angle -> b.angle, efficiency = {value}); experiment(stop = 1 s); end M;").simulate()  # fmt: skip
        assert "g.efficiency" in str(caught.value)


@pytest.mark.parametrize(
    "part", ["SpringDamper oil(from = shaft.angle, c", "BearingFriction oil(from = shaft.angle, viscous"]
)
def test_a_damper_alone_brings_no_spring_and_no_dry_friction(part: str) -> None:
    """J w' = T - c w, so w = T/c (1 - exp(-c t/J))."""
    motion = mechc.loads(
        "import mech.rotational.*; Rotor shaft(J = 0.5 kg.m^2, angle = 0 rad);"
        f"TorqueSource motor(from = shaft.angle, torque = 10 N.m); {part} = 0.2 N.m.s); experiment(stop = 5 s);"
    ).simulate()
    assert motion["der(shaft.angle)"][-1] == pytest.approx(50 * (1 - np.exp(-2.0)), rel=1e-8)

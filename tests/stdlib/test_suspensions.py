"""Suspensions against their loops solved by SciPy: angles of the wheel and its rate over travel and steering, poles, forces of joints."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from gallery import ROOT
from gallery import run as run_example
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.optimize import fsolve
from scipy.spatial.transform import Rotation

import mechc

POINTS = {
    "DoubleWishbone": {
        "lower_front": (0.15, 0.35, 0.2),
        "lower_rear": (-0.2, 0.35, 0.21),
        "ball": (0.01, 0.7, 0.19),
        "upper_front": (0.12, 0.42, 0.5),
        "upper_rear": (-0.14, 0.42, 0.48),
        "upper": (-0.02, 0.66, 0.49),
        "tie_inner": (-0.13, 0.36, 0.24),
        "tie_outer": (-0.14, 0.69, 0.24),
        "spring_top": (0, 0.44, 0.6),
        "spring_seat": (0, 0.58, 0.2),
        "centre": (0, 0.76, 0.32),
    },
    "McPherson": {
        "lower_front": (0.12, 0.35, 0.2),
        "lower_rear": (-0.22, 0.35, 0.21),
        "ball": (0.01, 0.7, 0.19),
        "tie_inner": (-0.13, 0.34, 0.26),
        "tie_outer": (-0.14, 0.68, 0.27),
        "spring_top": (-0.03, 0.57, 0.85),
        "spring_seat": (-0.01, 0.65, 0.5),
        "centre": (0, 0.76, 0.32),
    },
}
"""The defaults of the parts: hard points of the left wheel."""
K, PRELOAD, RADIUS, CAMBER, TOE = 4e4, 3000.0, 0.3, -0.02, 0.004


class Loop:
    """The links of a suspension as closed loops of points, solved for a height of the wheel."""

    def __init__(self, kind: str, **changed: tuple[float, float, float]) -> None:
        self.kind = kind
        self.p = {k: np.array(v, float) for k, v in (POINTS[kind] | changed).items()}

    def arm(self, which: str, ball: str, angle: float) -> Rotation:
        line = self.p[f"{which}_rear"] - self.p[f"{which}_front"]
        return Rotation.from_rotvec(angle * line / np.linalg.norm(line))

    def end(self, which: str, ball: str, angle: float, point: str | None = None) -> np.ndarray:
        front = self.p[f"{which}_front"]
        return np.asarray(front + self.arm(which, ball, angle).apply(self.p[point or ball] - front))

    def carried(self, x: np.ndarray, point: str) -> np.ndarray:
        """Return a point of the upright."""
        turned = Rotation.from_rotvec(x[1:4]).apply(self.p[point] - self.p["ball"])
        return np.asarray(self.end("lower", "ball", x[0]) + turned)

    def errors(self, x: np.ndarray, z: float, rack: float) -> list[float]:
        p = self.p
        tie = self.carried(x, "tie_outer") - p["tie_inner"] - [0, rack, 0]
        found = [
            np.linalg.norm(tie) - np.linalg.norm(p["tie_outer"] - p["tie_inner"]),
            self.carried(x, "centre")[2] - p["centre"][2] - z,
        ]
        if self.kind == "DoubleWishbone":
            return [*found, *(self.carried(x, "upper") - self.end("upper", "upper", x[4]))]
        strut = p["spring_top"] - p["spring_seat"]
        off = np.cross(
            Rotation.from_rotvec(x[1:4]).apply(strut), p["spring_top"] - self.carried(x, "spring_seat")
        )
        return [*found, off[0], off[1]]

    def solve(self, z: float, rack: float = 0) -> np.ndarray:
        start = np.zeros(5 if self.kind == "DoubleWishbone" else 4)
        x = np.asarray(fsolve(self.errors, start, (z, rack), xtol=1e-14, full_output=True)[0])
        assert np.abs(self.errors(x, z, rack)).max() < 1e-14
        return x

    def length(self, z: float, rack: float = 0) -> float:
        x = self.solve(z, rack)
        seat = (
            self.end("lower", "ball", x[0], "spring_seat")
            if self.kind == "DoubleWishbone"
            else self.carried(x, "spring_seat")
        )
        return float(np.linalg.norm(self.p["spring_top"] - seat))

    def wheel(self, z: float, rack: float = 0) -> dict[str, float]:
        """Return what the part reports."""
        x = self.solve(z, rack)
        static = Rotation.from_euler("ZX", [-TOE, -CAMBER])
        n = (Rotation.from_rotvec(x[1:4]) * static).apply([0, 1, 0])

        def contact(n: np.ndarray, centre: np.ndarray) -> float:
            down = np.cross(np.cross([0, 0, 1], n), n)
            return float((centre + RADIUS * down / np.linalg.norm(down))[1])

        rest = contact(static.apply([0, 1, 0]), self.p["centre"])
        h = 1e-5
        rate = (self.length(z + h, rack) - self.length(z - h, rack)) / (2 * h)
        push = PRELOAD + K * (self.length(0) - self.length(z, rack))
        return {
            "camber": -np.arcsin(n[2]),
            "toe": np.arctan2(n[0], n[1]),
            "track": contact(n, self.carried(x, "centre")) - rest,
            "length": self.length(z, rack),
            "force": -push * rate,  # virtual work: F dz + push dlength = 0
        }


def compiled(text: str) -> mechc.Model:
    return mechc.loads(
        f"import mech.spatial.*;\nimport mech.suspension.*;\nmodel M\n{text}\n  experiment(stop = 0 s, tolerance = 1e-10);\nend M;\n"
    )


def run(text: str, **options: Any) -> mechc.Solution:
    solution = compiled(text).simulate(**options)
    assert solution.outcome.value == "completed", solution.message
    return solution


HELD = f"preload = {PRELOAD} N, k = {K} N/m, static_camber = {CAMBER} rad, static_toe = {TOE} rad, radius = {RADIUS} m"
REPORTED = ("camber", "toe", "track", "length")


@pytest.mark.parametrize("kind", POINTS)
def test_angles_track_and_wheel_rate_over_travel(kind: str) -> None:
    """And on the right, mirrored; the force that holds the wheel is that of virtual work, to the error of its difference."""
    heights = (-0.07, -0.02, 0.0, 0.03, 0.08)
    parts = "parameter Length z = 0 m;" + "".join(
        f"{kind} {name}(from = world, side = {side}, {HELD}); constraint hold_{name}: {name}.travel = z; output F_{name} = multiplier(hold_{name});"
        + "".join(f" output {name}_{what} = {name}.{what};" for what in REPORTED)
        for name, side in (("l", 1), ("r", -1))
    )
    model = compiled(parts)
    for z in heights:
        s = model.simulate(set={"z": z}, estimate_error=False)
        expected = Loop(kind).wheel(z)
        for name in ("l", "r"):
            found = {what: float(s[f"{name}_{what}"][0]) for what in REPORTED}
            assert found == pytest.approx({what: expected[what] for what in REPORTED}, abs=1e-11), (z, name)
            assert s[f"F_{name}"][0] == pytest.approx(expected["force"], rel=1e-8), (z, name)


@pytest.mark.parametrize("kind", POINTS)
def test_steering_by_the_rack(kind: str) -> None:
    """Of other hard points, which are ordinary parameters; the rack moves to the left, so both wheels turn right."""
    changed = {"tie_inner": (-0.12, 0.37, 0.25), "ball": (0.012, 0.69, 0.18)}
    points = ", ".join("{} = {{{}, {}, {}}} m".format(k, *v) for k, v in changed.items())
    parts = "".join(
        f"{kind} {name}(from = world, side = {side}, rack = {rack} m, {HELD}, {points}); constraint h_{name}: {name}.travel = 0.04 m;"
        + "".join(f" output {name}_{what} = {name}.{what};" for what in REPORTED)
        for name, side, rack in (("l", 1, 0.03), ("r", -1, 0.03), ("m", -1, -0.03))
    )
    s = run(parts, estimate_error=False)
    loop = Loop(kind, **changed)
    for name, rack in (("l", 0.03), ("r", -0.03), ("m", 0.03)):  # mirrored, the rack moves the other way
        expected = loop.wheel(0.04, rack)
        found = {what: float(s[f"{name}_{what}"][0]) for what in REPORTED}
        assert found == pytest.approx({what: expected[what] for what in REPORTED}, abs=1e-11), name
    assert s["l_toe"][0] > 0.05 and s["r_toe"][0] < -0.05


@pytest.mark.parametrize("kind", POINTS)
def test_a_wheel_swings_on_a_chassis_that_stands(kind: str) -> None:
    """Its frequency by the masses of its links, whose speeds are differences along the loop, and by the second difference of the energy."""
    loop, h = Loop(kind), 1e-4
    m, J, lower, upper = 17.0, np.diag([0.4, 0.2, 0.3]), 5.0, 4.0
    low, high = loop.solve(-h), loop.solve(h)

    def speed(point: str) -> np.ndarray:
        return np.asarray((loop.carried(high, point) - loop.carried(low, point)) / (2 * h))

    spin = (Rotation.from_rotvec(high[1:4]) * Rotation.from_rotvec(low[1:4]).inv()).as_rotvec() / (2 * h)
    mass = m * speed("centre") @ speed("centre") + spin @ J @ spin + lower / 3 * speed("ball") @ speed("ball")
    arms = f"lower_mass = {lower} kg"
    if kind == "DoubleWishbone":
        mass += upper / 3 * speed("upper") @ speed("upper")
        arms += f", upper_mass = {upper} kg"

    def energy(z: float) -> float:
        e = loop.length(z) - loop.length(0)
        return K / 2 * e**2

    stiffness = (energy(h) + energy(-h)) / h**2
    text = f"{kind} s(from = world, k = {K} N/m, m = {m} kg, J = diag({{0.4, 0.2, 0.3}}) kg.m^2, {arms});"
    found = compiled(text).linearize().details["poles"]
    expected = np.sqrt(stiffness / mass)
    assert np.abs([p[1] for p in found]).max() == pytest.approx(expected, rel=1e-6)


def test_forces_of_the_ball_joints() -> None:
    """Of a wheel on which side force, weight and brake act: six equations of the upright's statics in NumPy."""
    loop = Loop("DoubleWishbone")
    s = run(
        f"DoubleWishbone s(from = world, k = {K} N/m, preload = {PRELOAD} N); constraint hold: s.travel = 0 m;"
        " force {-2000, 1500, 300} N on s.hub; torque {100, -600, 50} N.m on s.hub;"
        " output lower = reaction(s.lower_ball); output upper = reaction(s.upper_ball); output rod = multiplier(s.tie); output F = multiplier(hold);",
        estimate_error=False,
    )
    p = loop.p
    columns, right = [], np.array([2000, -1500, -300, -100, 600, -50.0])
    for place, direction in [
        ("ball", np.eye(3)),
        ("upper", np.eye(3)),
        ("tie_outer", [(p["tie_inner"] - p["tie_outer"]) / np.linalg.norm(p["tie_inner"] - p["tie_outer"])]),
        ("centre", [np.array([0, 0, 1.0])]),
    ]:
        columns += [
            np.concatenate([e, np.cross(p[place] - p["centre"], e)]) for e in np.asarray(direction, float)
        ]
    # each arm turns freely about its bearings: the moment of the forces on it about their line is zero
    A = np.array(columns).T
    rows, known = list(A), list(right)
    for which, ball, at in (("lower", "ball", 0), ("upper", "upper", 3)):
        line = p[f"{which}_rear"] - p[f"{which}_front"]
        row = np.zeros(8)
        row[at : at + 3] = np.cross(line, p[ball] - p[f"{which}_front"])
        spring = p["spring_seat"] - p["spring_top"]
        moment = np.cross(p["spring_seat"] - p[f"{which}_front"], PRELOAD * spring / np.linalg.norm(spring))
        rows.append(row)
        known.append(line @ moment if which == "lower" else 0.0)
    expected = np.linalg.solve(np.array(rows), known)
    found = [*(s[f"lower[{i}]"][0] for i in (1, 2, 3)), *(s[f"upper[{i}]"][0] for i in (1, 2, 3))]
    assert [*found, s["rod"][0], s["F"][0]] == pytest.approx(list(expected), abs=1e-6)


class Corner:
    """The example wishbone_corner with two freedoms: height of the body and travel, along which its loop is a table."""

    def __init__(self) -> None:
        loop, s, h = Loop("DoubleWishbone"), np.linspace(-0.08, 0.08, 33), 1e-4
        rows = []
        for z in s:
            low, here, high = (loop.solve(z + e) for e in (-h, 0, h))

            def speed(point: str, low: np.ndarray = low, high: np.ndarray = high) -> np.ndarray:
                def place(x: np.ndarray) -> np.ndarray:
                    if point == "upper":
                        return loop.end("upper", "upper", x[4])
                    return loop.end("lower", "ball", x[0]) if point == "ball" else loop.carried(x, point)

                rate: np.ndarray = (place(high) - place(low)) / (2 * h)
                return rate

            spin = (Rotation.from_rotvec(high[1:4]) * Rotation.from_rotvec(low[1:4]).inv()).as_rotvec() / (
                2 * h
            )
            R = Rotation.from_rotvec(here[1:4])
            J = R.as_matrix() @ np.diag([0.3, 0.2, 0.3]) @ R.as_matrix().T
            n = R.apply(Rotation.from_euler("X", 1, degrees=True).apply([0, 1, 0]))
            disk = 18 * 0.3**2 / 4 * (np.eye(3) + np.outer(n, n))
            A = 38 * speed("centre") @ speed("centre") + spin @ (J + disk) @ spin
            A += 3 / 3 * speed("ball") @ speed("ball") + 2 / 3 * speed("upper") @ speed("upper")
            # a rod of mass m whose one end is held: its centre moves half as fast as the other end
            P = 38 * speed("centre")[2] + 3 / 2 * speed("ball")[2] + 2 / 2 * speed("upper")[2]
            rows.append((A, P, loop.length(z)))
        self.A, self.P, self.length = (CubicSpline(s, column) for column in np.array(rows).T)
        self.designed = loop.length(0)
        k = np.arange(1, 61)
        step = np.log(2.83 / 0.011) / 60
        self.n = 0.011 * np.exp((k - 0.5) * step)
        self.phase = 2 * np.pi * ((7 * 0.7548776662466927 + k**2 * 0.5698402909980532) % 1)
        self.size = np.sqrt(2 * 64e-6 * (0.1 / self.n) ** 2 * self.n * step)

    def rate(self, t: float, y: np.ndarray) -> list[float]:
        zb, s, v, w = y
        M, g, A, P = 300 + 38 + 5, 9.81, self.A(s), self.P(s)
        x = 2 * np.pi * self.n * 20 * t + self.phase
        road = np.sum(self.size * np.cos(x))
        road_rate = -np.sum(self.size * 2 * np.pi * self.n * 20 * np.sin(x))
        dl = self.length(s, 1)
        speed = dl * w
        pull = (
            -(5000 + 4e4 * (self.designed - self.length(s)))
            + 2000 * speed
            + 2000 * 0.15 * np.tanh(speed / 0.15)
        )
        d = max(0.0, s - 0.07)
        e = 0.34 - (zb + 0.32 + s - road)
        tyre = max(0.0, 2e5 * e - 100 * (v + w - road_rate)) if e > 0 else 0.0
        Qz = tyre - M * g
        Qs = tyre - pull * dl - 1e5 * d - 1e8 * d**3 - g * P
        right = [Qz - self.P(s, 1) * w * w, Qs - self.A(s, 1) * w * w / 2]
        return [v, w, *np.linalg.solve([[M, P], [P, A]], right)]


@pytest.mark.slow
def test_a_corner_on_a_rough_road() -> None:
    """Lagrange's equations of two freedoms in SciPy, with the loop as a spline of 33 points."""
    s = run_example("wishbone_corner", stop=1.0)
    corner = Corner()
    z0 = float(s["left.travel"][0])
    start = (
        [0.0, z0, 0.0, float(s["der(left.travel)"][0])] if "der(left.travel)" in s else [0.0, z0, 0.0, 0.0]
    )
    once = np.diff(s.time, prepend=-1) > 0  # events have two rows
    found = solve_ivp(
        corner.rate, (0, 1), start, "DOP853", rtol=1e-9, atol=1e-11, t_eval=s.time[once], max_step=2e-3
    )
    assert s["guide.position"][once] == pytest.approx(found.y[0], abs=2e-6)
    assert s["left.travel"][once] == pytest.approx(found.y[1], abs=2e-6)


@pytest.mark.slow
def test_a_car_in_a_steady_turn() -> None:
    """Its wheels carry its weight, and about the road below it their moments are those of the centrifugal force and of the spinning wheels."""
    name = "four_wheels"
    text = (ROOT / "examples" / f"{name}.mech").read_text(encoding="utf-8")
    extra = "  output cm = local(car.a, mass_centre()); output o = pos(car.a); output ahead = direction(car.a, {1, 0, 0});"
    extra += " output spin = der(axle[1].angle); output at = pos(car.a);"
    extra += "".join(f" output c{i} = pos(tyre[{i}].contact_point);" for i in (1, 2, 3, 4))
    s = mechc.loads(text.replace("  experiment", extra + "\n  experiment")).simulate(estimate_error=False)
    assert s.outcome.value == "completed", s.message
    weight = (1100 + 4 * 20 + 2 * (3 + 2) + 2 * 3 + 4 * 18) * 9.81
    loads = np.array([s[f"tyre[{i}].Fz"][-1] for i in (1, 2, 3, 4)])
    pushes = np.array([s[f"tyre[{i}].Fy"][-1] for i in (1, 2, 3, 4)])
    assert loads.sum() == pytest.approx(weight, rel=1e-3)
    x, y = s["ahead[1]"][-1], s["ahead[2]"][-1]
    left = np.array([-y, x]) / np.hypot(x, y)
    arms = np.array([[s[f"c{i}[{k}]"][-1] - s[f"at[{k}]"][-1] for k in (1, 2)] @ left for i in (1, 2, 3, 4)])
    cm = [s[f"cm[{k}]"][-1] for k in (1, 2, 3)]
    roll, rate = s["roll"][-1], s["yaw_rate"][-1]
    height = s["at[3]"][-1] + cm[2] * np.cos(roll)
    aside = cm[2] * np.sin(roll)
    gyro = -rate * 4 * s["spin"][-1] * 18 / 2 * (0.3**2 + 0.15**2)
    found = arms @ loads - aside * weight
    assert found == pytest.approx(-height * weight / 9.81 * s["lateral"][-1] + gyro, rel=1e-2)
    assert abs(found) > 2000 and pushes.sum() / (weight / 9.81) == pytest.approx(s["lateral"][-1], rel=0.02)


@pytest.mark.parametrize("side", [1, -1])
def test_an_arm_falls_about_the_line_of_its_bearings(side: int) -> None:
    """Two rods of m/2 from the ball joint, h away from that line: m h^2/3 about it."""
    front, rear, ball = np.array([[0.15, 0.35, 0.2], [-0.2, 0.35, 0.21], [0.01, 0.7, 0.19]]) * [1, side, 1]
    s = mechc.loads(
        f"import mech.spatial.*; import mech.suspension.*; model M gravity {{0, 0, -9.81}} m/s^2;"
        f"Wishbone arm(from = world, side = {side}, m = 3 kg, hinge.angle = 0 rad, der(hinge.angle) = 0 rad/s);"
        "output Length tip[3] = pos(arm.tip); output falls = der(arm.hinge.angle, 2); experiment(stop = 0 s); end M;"
    ).simulate(estimate_error=False)
    line = (rear - front) / np.linalg.norm(rear - front)
    h = np.linalg.norm(np.cross(line, ball - front))
    centre = (front + rear + 2 * ball) / 4 - front
    turning = line @ np.cross(centre, [0, 0, -3 * 9.81]) / (3 * h**2 / 3)
    assert s["tip"][-1] == pytest.approx(ball, abs=1e-12)
    assert s["falls"][-1] == pytest.approx(turning, rel=1e-12)

"""Impacts: bouncing balls, rows of balls, rocking, joint stops, billiards, a slamming door (U133)."""

from __future__ import annotations

import math
from typing import Any

import mpmath
import numpy as np
import pytest
from gallery import Array, load, run, values
from happenings import TIGHT, follow, integrate, times, travel_time
from mpmath import mp
from scipy.spatial.transform import Rotation
from scipy.special import ellipk

import mechc
from mechc.runtime.outcome import Outcome

g = 9.81


# ---------------------------------------------------------------- balls


def test_bouncing_ball_comes_to_rest() -> None:
    """The bounces of the reference, and the end of the infinite sequence."""
    known = values("classical_closed_form_set", "bouncing ball")
    solution = follow("bouncing_ball")
    hits = times(solution, "impact")
    assert hits[0] == pytest.approx(known["t_first"], rel=1e-10)
    assert hits[4] == pytest.approx(known["t_5th"], rel=1e-10)
    assert hits[9] == pytest.approx(known["t_10th"], rel=1e-10)
    assert times(solution, "rest") == pytest.approx([known["t_stop"]], rel=1e-10)
    top = (hits[4] + hits[5]) / 2
    assert solution(top)["h"] == pytest.approx(known["apex_after_5_bounces"], rel=1e-9)
    assert solution["energy.dissipated"][-1] == pytest.approx(0.981, rel=1e-10)
    assert solution["force"][-1] == pytest.approx(0.981, rel=1e-10)
    assert np.min(solution["h"]) > -1e-12


def test_bounces_written_by_hand_are_the_same() -> None:
    by_hand, contact = follow("bouncing_ball", "by_hand"), follow("bouncing_ball")
    hits = times(by_hand, "when")
    assert hits == pytest.approx(times(contact, "impact")[: len(hits)], rel=1e-12)
    assert by_hand["bounces"][-1] == len(hits) == 6
    for event in by_hand.events:  # both sides
        assert event.after["der(h)"] == pytest.approx(-0.8 * event.before["der(h)"], rel=1e-12)


@pytest.mark.parametrize(
    ("n", "together", "speeds"),
    [
        (3, False, [0, 0, 1]),
        (5, False, [0, 0, 0, 0, 1]),
        (3, True, [-1 / 3, 2 / 3, 2 / 3]),
        (5, True, [-3 / 5, 2 / 5, 2 / 5, 2 / 5, 2 / 5]),
    ],
)
def test_balls_that_touch(n: int, together: bool, speeds: list[float]) -> None:
    """Momentum and energy are kept by both laws."""
    solution = follow("touching_balls", set={"n": n, "together": together})
    assert times(solution, "impact")[0] == pytest.approx(1, rel=1e-12)
    found = [float(solution[f"der(x[{i + 1}])"][-1]) for i in range(n)]
    assert found == pytest.approx(speeds, abs=1e-12)


@pytest.mark.parametrize(("experiment", "lifted"), [(None, 1), ("two", 2)])
def test_newtons_cradle(experiment: str | None, lifted: int) -> None:
    """As many balls leave as come, every half period 2 sqrt(l/g) K(sin(a/2)), and rise to the same height."""
    solution = follow("newtons_cradle", experiment)
    half = 2 * math.sqrt(0.5 / g) * ellipk(math.sin(math.radians(15)) ** 2)
    hits = times(solution, "impact")
    assert len({round(t, 6) for t in hits}) == 7
    assert hits == pytest.approx([half * (round(t / half - 0.5) + 0.5) for t in hits], rel=1e-10)
    for k in range(1, 7):
        angles = [solution(half * k)[f"theta[{i}]"] for i in range(1, 6)]
        high = math.radians(30 if k % 2 else -30)
        expected = [0.0] * (5 - lifted) + [high] * lifted if k % 2 else [high] * lifted + [0.0] * (5 - lifted)
        assert angles == pytest.approx(expected, abs=1e-9)


def test_ball_on_a_vibrating_plate() -> None:
    """One hit in each period, at the plate's speed (g T/2)(1 - e)/(1 + e); stable, so it goes on for ever."""
    solution = follow("ball_on_plate", stop=20)
    hits = times(solution, "impact")
    assert hits == pytest.approx([k / 20 for k in range(1, 400 + (hits[-1] > 19.99))], rel=1e-10)
    # the approach speed relative to the plate is g T/(1 + e), all of it at the same phase
    assert np.array([e.value for e in solution.events]) == pytest.approx(g / 20 / 1.5, rel=1e-10)


@pytest.mark.parametrize(("experiment", "spin"), [(None, 200.0), ("slow", 10.0)])
def test_bounce_with_spin(experiment: str | None, spin: float) -> None:
    """The tangential impulse ends the sliding, 2/7 m u, or is mu times the normal one where that is less."""
    m, R, e, mu, v = 0.1, 0.03, 0.8, 0.2, 1.0
    fall = math.sqrt(2 * g)
    kinds, lost = [], 0.0
    for k in range(2):
        normal = (1 + e) * m * fall * e**k
        u = v + R * spin
        impulse = min(mu * normal, 2 / 7 * m * u)
        kinds.append("slides" if impulse == mu * normal else "sticks")
        before = m * v**2 / 2 + m * R**2 * spin**2 / 5
        v, spin = v - impulse / m, spin - impulse * R / (2 / 5 * m * R**2)
        after = m * v**2 / 2 + m * R**2 * spin**2 / 5
        lost += before - after + m * (fall * e**k) ** 2 / 2 * (1 - e**2)
    assert kinds == (["slides", "sticks"] if experiment is None else ["sticks", "sticks"])
    solution = follow("spinning_bounce", experiment)
    flight = math.sqrt(2 / g)
    assert times(solution, "impact") == pytest.approx([flight, flight * (1 + 2 * e)], rel=1e-10)
    assert solution["der(x)"][-1] == pytest.approx(v, rel=1e-10)
    assert solution["der(a)"][-1] == pytest.approx(spin, rel=1e-10)
    assert solution["energy.dissipated"][-1] == pytest.approx(lost, rel=1e-10)


# ---------------------------------------------------------------- bodies and mechanisms


def test_rocking_block() -> None:
    """G. W. Housner (1963): each hit keeps 1 - 3/2 sin(alpha)^2 of the turning rate; quarters by quadrature."""
    b, h, theta = mp.mpf("0.2"), mp.mpf("0.8"), mp.mpf("0.15")
    R, alpha = mpmath.hypot(b, h), mpmath.atan2(b, h)
    kept = 1 - mp.mpf(3) / 2 * mpmath.sin(alpha) ** 2
    rate = 3 * mp.mpf("9.81") / (2 * R)  # 2 m g R over the moment of inertia about a corner

    def squared(top: Any) -> Any:
        return lambda x: rate * (mpmath.cos(alpha - top) - mpmath.cos(alpha - x))

    t = mp.mpf(0)
    exact: list[float] = []
    speeds: list[float] = []
    while len(exact) < 6:
        t += travel_time(squared(theta), theta, 0)
        exact.append(float(t))
        speeds.append(float(mpmath.sqrt(squared(theta)(0))))
        theta = alpha - mpmath.acos(mpmath.cos(alpha) + kept**2 * squared(theta)(0) / rate)
        t += travel_time(squared(theta), 0, theta)
    solution = follow("rocking_block")
    hits = times(solution, "impact")
    assert hits[:6] == pytest.approx(exact, rel=1e-10)
    events = [e for e in solution.events if e.kind == "impact"][:6]
    assert [abs(e.before["der(theta)"]) for e in events] == pytest.approx(speeds, rel=1e-9)
    ratios = np.array([e.after["der(theta)"] / e.before["der(theta)"] for e in events])
    assert ratios == pytest.approx(float(kept), rel=1e-10)
    names = [e.name for e in events]
    assert names == ["on_right", "on_left"] * 3


def test_rocking_ends() -> None:
    """The times between hits shrink geometrically: after their sum the block rests on both corners.

    It rests where the hits are slower than 1e-9 of the fastest; what is left of the sum then is some 1e-6 s.
    """
    b, h, theta = 0.2, 0.8, 0.15
    R, alpha = math.hypot(b, h), math.atan2(b, h)
    kept, rate = 1 - 1.5 * math.sin(alpha) ** 2, 3 * g / R
    s, weights = np.polynomial.legendre.leggauss(40)
    s, weights = (s + 1) / 2, weights / 2

    def quarter(top: float) -> float:
        """Time from the top to the hit; x = top (1 - s^2) takes the root away."""
        squared = rate * np.sin(alpha - top * (1 - s**2 / 2)) * np.sin(top * s**2 / 2)
        return float(np.sum(weights * 2 * top * s / np.sqrt(squared)))

    t = quarter(theta)
    for _ in range(300):
        fallen = kept**2 * math.sin(alpha - theta / 2) * math.sin(theta / 2)
        for _ in range(20):  # the same of the next top
            theta = 2 * math.asin(fallen / math.sin(alpha - theta / 2))
        t += 2 * quarter(theta)
    solution = follow("rocking_block", tolerance=1e-10)
    assert solution.events[-1].time == pytest.approx(t, abs=1e-5)
    assert solution["theta"][-1] == pytest.approx(0, abs=1e-12)
    assert solution["y"][-1] == pytest.approx(h, abs=1e-12)
    assert solution["energy.dissipated"][-1] == pytest.approx(
        g * (math.sin(0.15) * b + math.cos(0.15) * h - h), rel=1e-8
    )


def test_balls_on_a_box() -> None:
    """What is at rest carries the weight, and its moment about the middle of the box; both balls roll in the end."""
    solution = run("balls_on_a_box")
    end = {name: solution[name][-1] for name in solution.columns()}
    assert end["load"] == pytest.approx(4 * g, abs=1e-9)
    for k in (1, 2):
        assert end[f"der(flight[{k}].x)"] == pytest.approx(-0.1 * end[f"der(flight[{k}].angle)"], abs=1e-9)
    turned = (end["under.pressure[3]"] - end["under.pressure[4]"]) * 0.2
    assert abs(turned) == pytest.approx(g * abs(end["flight[1].x"] - end["free.x"]), abs=1e-8)


def test_balls_in_a_box() -> None:
    """In the end both lie on the floor of the box, touching each other and the crate, and the floor carries all."""
    solution = run("balls_in_a_box")
    end = {name: solution[name][-1] for name in solution.columns()}
    assert end["load"] == pytest.approx(3.5 * g, abs=1e-9)
    assert [end[f"flight[{k}].y"] for k in (1, 2)] == pytest.approx([0.1, 0.1], abs=1e-9)
    assert end["flight[2].x"] - end["flight[1].x"] == pytest.approx(0.2, abs=1e-9)
    assert end["lying.x"] - 0.15 - end["flight[2].x"] == pytest.approx(0.1, abs=1e-9)
    assert all(abs(end[name]) < 1e-9 for name in end if name.startswith("der("))


def test_crates() -> None:
    """In the end all rest; the floor carries the weights, and the rear upper corner of the flat crate stands at a face of the tall
    one, within the ball of 0.1 mm that rounds it. What it pushes there, friction on the floor takes up."""
    solution = run("crates")
    end = {name: solution[name][-1] for name in solution.columns()}
    assert end["load"] == pytest.approx(6 * g, abs=1e-9)
    assert all(abs(end[name]) < 1e-9 for name in end if name.startswith("der("))
    assert (end["free[1].y"], end["free[1].angle"]) == pytest.approx((0.1, 0), abs=1e-9)
    a = end["free[2].angle"]
    x, y = end["free[1].x"] - 0.3 - end["free[2].x"], 0.2 - end["free[2].y"]
    along, across = -x * math.sin(a) + y * math.cos(a), x * math.cos(a) + y * math.sin(a)
    assert abs(across) == pytest.approx(0.05, abs=1e-4)
    assert abs(along) < 0.2
    assert end["pulls"] < -1


def test_spinning_coin() -> None:
    """The push of the table and the weight change its momentum; after it has stopped slipping, energy stays."""
    solution = run("spinning_coin", tolerance=1e-11)
    (stick,) = solution.events
    mass = 8000 * math.pi * 0.01**2 * 0.0015
    nodes, weights = np.polynomial.legendre.leggauss(40)
    for start in np.linspace(stick.time, 0.4, 9)[:-1]:
        stop = start + (0.4 - stick.time) / 8
        found = solution(start + (stop - start) * (1 + nodes) / 2)
        first, last = solution(start), solution(stop - 1e-15)
        for k, weight in ((1, 0), (2, 0), (3, mass * g)):
            given = (stop - start) / 2 * weights @ (found[f"push[{k}]"] - weight)
            name = f"der(free.position[{k}])"
            assert mass * (last[name] - first[name]) == pytest.approx(given, abs=1e-9)
    energy = solution["energy.total"][solution.time > stick.time]
    assert np.ptp(energy) < 1e-10 * energy[0]
    assert math.degrees(solution["lean"][-1]) == pytest.approx(26.2, abs=0.05)


def test_falling_box() -> None:
    """First the lowest corner hits; in the end four corners hold the weight, which no longer falls."""
    turn = Rotation.from_euler("x", 0.4) * Rotation.from_euler("y", 0.3)
    corners = [[x, y, z] for x in (-0.2, 0.2) for y in (-0.15, 0.15) for z in (-0.1, 0.1)]
    lowest = 1 + min(turn.apply(corners)[:, 2])
    solution = follow("falling_box", tolerance=1e-10)
    assert times(solution, "impact")[0] == pytest.approx(math.sqrt(2 * lowest / g), rel=1e-10)
    assert solution["free.position[3]"][-1] == pytest.approx(0.1, abs=1e-10)  # on its largest face
    assert solution["push"][-1] == pytest.approx(g, rel=1e-10)
    assert solution["energy.dissipated"][-1] == pytest.approx(g * 0.9, rel=1e-8)
    assert np.min(solution["height"]) > -1e-9
    # the floor is smooth
    assert np.max(np.abs(solution["free.position[1]"])) < 1e-9


def test_double_pendulum_with_stops() -> None:
    """Against the equations of two bars; at a stop the impulse acts on the elbow, through the inverse of M."""
    m1, m2, l1, l2, limit, e = 1.0, 0.7, 0.5, 0.4, math.radians(40), 0.4

    def inertia(y: Array) -> Array:
        c = math.cos(y[1])
        m22 = m2 * l2**2 / 3
        m12 = m22 + m2 * l1 * l2 / 2 * c
        return np.array([[m1 * l1**2 / 3 + m2 * l1**2 + m2 * l1 * l2 * c + m22, m12], [m12, m22]])

    def rhs(t: float, y: Array) -> Array:
        a, b, u, v = y
        k = m2 * l1 * l2 / 2 * math.sin(b)
        gb = m2 * g * l2 / 2 * math.cos(a + b)
        ga = (m1 / 2 + m2) * g * l1 * math.cos(a) + gb
        force = np.array([k * v * (2 * u + v) - ga, -k * u**2 - gb])
        return np.concatenate([y[2:], np.linalg.solve(inertia(y), force)])

    t, y, hits = 0.0, np.zeros(4), []
    while True:
        t, y, met = integrate(rhs, y, t, 4, lambda t, y: limit - abs(y[1]))
        if not met:
            break
        hits.append(t)
        column = np.linalg.inv(inertia(y))[:, 1]
        y[2:] -= (1 + e) * y[3] * column / column[1]
        y[1] = math.copysign(limit, y[1]) * (1 - 1e-15)
    solution = follow("double_pendulum_stops")
    assert len(hits) == 5
    assert times(solution, "impact") == pytest.approx(hits, rel=1e-10)
    names = ["shoulder.angle", "elbow.angle", "der(shoulder.angle)", "der(elbow.angle)"]
    assert [solution[n][-1] for n in names] == pytest.approx(list(y), abs=1e-8)


def test_slider_crank_with_a_stop() -> None:
    """One degree of freedom, constant torque: between hits J(a) a'^2/2 + M a is kept; bounces end in rest."""
    r, l, e, M = mp.mpf("0.1"), mp.mpf("0.3"), mp.mpf("0.6"), mp.mpf(1)
    mc, mr, m = mp.mpf("0.5"), mp.mpf("0.4"), mp.mpf("0.8")
    stop = mp.mpf("0.38")

    def inertia(a: Any) -> Any:
        s, c = mpmath.sin(a), mpmath.cos(a)
        root = mpmath.sqrt(l**2 - r**2 * s**2)
        slide = -r * s * (1 + r * c / root)  # of the piston
        turn = -r * c / root  # of the rod
        middle = ((-r * s + slide) / 2) ** 2 + (r * c / 2) ** 2
        return mc * r**2 / 3 + mr * (middle + l**2 / 12 * turn**2) + m * slide**2

    with mpmath.workdps(30):
        # cosine rule: the crank angle where the piston is at the stop
        hit = mpmath.acos((r**2 + stop**2 - l**2) / (2 * r * stop))
        top, t = mpmath.pi / 2, mp.mpf(0)
        exact: list[float] = []
        for _ in range(8):

            def squared(a: Any, top: Any = top) -> Any:
                return 2 * M * (top - a) / inertia(a)

            quarter = travel_time(squared, top, hit)
            t += quarter if not exact else 2 * quarter
            exact.append(float(t))
            top = hit + e**2 * (top - hit)  # the work of M gives all the energy there is
    solution = follow("slider_crank_stop")
    assert times(solution, "impact")[:8] == pytest.approx(exact, rel=1e-10)
    assert solution["guide.position"][-1] == pytest.approx(0.38, abs=1e-12)
    assert np.max(solution["guide.position"]) < 0.38 + 1e-12
    assert solution["energy.dissipated"][-1] == pytest.approx(float(mpmath.pi / 2 - hit), rel=1e-9)


def test_car_door_slams() -> None:
    """U133: phi'' = 3 a/(2 w) cos(phi), 2.6220576 sqrt(w/(3 a)) long, the integral of 1/sqrt(sin); all the energy m a w/2 is
    lost. I = m w^2/3."""
    lemniscate = math.gamma(0.25) ** 2 / math.sqrt(8 * math.pi)
    assert lemniscate == pytest.approx(2.6220576, abs=5e-8)
    solution = follow("car_door")
    assert times(solution, "impact") == pytest.approx([lemniscate / math.sqrt(3)], rel=1e-10)
    turning = solution.time < 1.5
    phi, rate = (solution[name][turning] for name in ("hinge.angle", "der(hinge.angle)"))
    assert rate**2 == pytest.approx(3 * np.sin(phi - math.pi / 2), abs=1e-8)
    (door,) = load("car_door").inertia().details["bodies"]
    assert np.array(door["tensor_about_point"]) == pytest.approx(np.array([[20 / 3]]), rel=1e-14)
    assert lemniscate / math.sqrt(3) == pytest.approx(1.5138456, abs=5e-8)
    assert times(solution, "rest", "shut") == times(solution, "impact")
    assert solution["hinge.angle"][-1] == pytest.approx(math.pi, rel=1e-12)
    assert solution["energy.dissipated"][-1] == pytest.approx(10, rel=1e-9)


# ---------------------------------------------------------------- billiards


def test_billiard_in_a_circle() -> None:
    """All chords are 2 R cos(a) long; each turns the place by pi - 2 a; the caustic is at R sin(a)."""
    aim = math.radians(40)
    solution = follow("billiard_circle")
    hits = times(solution, "impact")
    assert len(hits) == 19
    assert hits == pytest.approx([2 * math.cos(aim) * k for k in range(1, 20)], rel=1e-10)
    for k, t in enumerate(hits, start=1):
        place = k * (math.pi - 2 * aim)
        assert solution(t)["x"] == pytest.approx(math.cos(place), abs=1e-10)
        assert solution(t)["y"] == pytest.approx(math.sin(place), abs=1e-10)
    spin = solution["x"] * solution["der(y)"] - solution["y"] * solution["der(x)"]
    assert spin == pytest.approx(math.sin(aim), rel=1e-10)


def trace_stadium(end: float) -> list[float]:
    """Times of the hits by geometry, with 40 digits; R = 1, straight length 2."""
    hits: list[float] = []
    with mpmath.workdps(40):
        x, y = mp.mpf("0.1"), mp.mpf("0.2")
        angle = 35 * mp.pi / 180
        u, v, t = mpmath.cos(angle), mpmath.sin(angle), mp.mpf(0)
        while True:
            ways = []
            if v != 0:  # to a straight part
                way = ((1 if v > 0 else -1) - y) / v
                if abs(x + way * u) <= 1:
                    ways.append((way, mp.mpf(0), mp.mpf(1 if v > 0 else -1)))
            for centre in (-1, 1):  # to a half circle
                along, square = (x - centre) * u + y * v, (x - centre) ** 2 + y**2 - 1
                root = mpmath.sqrt(max(0, along**2 - square))
                for way in (-along - root, -along + root):
                    nx, ny = x + way * u - centre, y + way * v
                    if way > mp.mpf(10) ** -20 and nx * centre > 0 and abs(nx**2 + ny**2 - 1) < 1e-20:
                        ways.append((way, nx, ny))
            way, nx, ny = min(w for w in ways if w[0] > mp.mpf(10) ** -20)
            t += way
            if t > end:
                return hits
            hits.append(float(t))
            x, y = x + way * u, y + way * v
            along = u * nx + v * ny
            u, v = u - 2 * along * nx, v - 2 * along * ny


def test_billiard_in_a_stadium() -> None:
    """Against ray tracing; half circles spread the rays, so that errors grow some fivefold at each hit."""
    exact = trace_stadium(30)
    hits = times(follow("billiard_stadium", stop=30), "impact")
    assert len(hits) == len(exact) > 10
    for k, (found, known) in enumerate(zip(hits, exact, strict=True)):
        assert found == pytest.approx(known, abs=1e-15 * 5 ** (k + 1)), k


def test_two_runs_are_alike() -> None:
    """The event times do not depend on the tolerance where the motion between hits is straight."""
    loose = load("billiard_circle").simulate(tolerance=1e-4, estimate_error=False)
    assert isinstance(loose, mechc.Solution)
    tight = run("billiard_circle", tolerance=TIGHT)
    assert times(loose, "impact") == pytest.approx(times(tight, "impact"), rel=1e-12)


SKID = """
model Skid "a bar that slides fast, falls on one end and passes the impact to and fro between both"
  parameter mu = 0.01;
  coordinate Length x = 0 m;
  coordinate Length y = 1 mm;
  coordinate Angle phi = 0.01 deg;
  kinetic 1/2*1 kg*(der(x)^2 + der(y)^2) + 1/2*0.1 kg.m^2*der(phi)^2;
  potential 1 kg*9.81 m/s^2*y;
  contact left: y - 0.5 m*sin(phi) friction mu along der(x)IMPACTS;
  contact right: y + 0.5 m*sin(phi) friction mu along der(x)IMPACTS;
  experiment(stop = 0.1 s);
end Skid;
"""


@pytest.mark.parametrize("impacts", ["", ', impacts = "simultaneous"'])
@pytest.mark.parametrize("speed", [100.0, 1e5])
def test_slow_approaches_end_beside_fast_slips(speed: float, impacts: str) -> None:
    """Each blow on one end drives the other one down, ever more slowly, while both slide: rates that are rounding beside the slip are
    still approaches. All vertical impulses add up to the weight, m g t, so that the slip loses mu g t."""
    model = mechc.loads(SKID.replace("IMPACTS", impacts))
    solution = model.simulate(set={"der(x)": speed}, estimate_error=False)
    assert solution.outcome == Outcome.COMPLETED
    assert solution["der(x)"][-1] == pytest.approx(speed - 0.01 * 9.81 * 0.1, rel=1e-13)
    for name in ("y", "phi", "der(y)", "der(phi)"):
        assert abs(solution[name][-1]) < 1e-11, name

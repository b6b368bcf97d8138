"""Contacts that open, strings that go slack, joints that let go (U51, U77, U127, U135, P7, closed forms)."""

from __future__ import annotations

import math
from typing import Any

import mpmath
import numpy as np
import pytest
from gallery import load, values
from happenings import follow, times, travel_time
from mpmath import cos, mp, sin
from scipy.optimize import brentq

import mechc

g = 9.81


# ---------------------------------------------------------------- domes and ladders


def test_particle_leaves_a_sphere() -> None:
    """From rest at the angle a: where cos(theta) = 2/3 cos(a), at the time of the reference."""
    known = values("classical_closed_form_set", "same sphere R=1")
    solution = follow("particle_on_dome")
    (leaves,) = times(solution, "lift-off")
    assert leaves == pytest.approx(known["time_leave"], rel=1e-10)
    assert solution(leaves)["theta"] == pytest.approx(known["theta_leave"], rel=1e-10)
    assert math.cos(solution(leaves)["theta"]) == pytest.approx(2 / 3 * math.cos(0.1), rel=1e-10)


def test_particle_from_the_very_top() -> None:
    """cos(theta) = 2/3, speed sqrt(2/3 g R): a start at 1e-4 rad changes both by 1e-8."""
    known = values("classical_closed_form_set", "particle slides from rest")
    solution = follow("particle_on_dome", set={"theta0": 1e-4}, stop=4)
    (leaves,) = times(solution, "lift-off")
    at = solution(leaves)
    assert at["theta"] == pytest.approx(known["theta_rad"], rel=2e-8)
    speed = math.hypot(at["der(x)"], at["der(y)"])
    assert speed == pytest.approx(known["speed_over_sqrt_gR"] * math.sqrt(g), rel=2e-8)


@pytest.mark.parametrize(
    ("example", "share", "inertia", "degrees"),
    [("sphere_on_sphere", 10 / 17, 2 / 5, 53.9681), ("cylinder_on_cylinder", 4 / 7, 1 / 2, 55.1501)],
)
def test_roller_leaves_a_roller(example: str, share: float, inertia: float, degrees: float) -> None:
    """U127, U135: cos(theta) = 2/(3 + k) for the moment of inertia k m a^2; from rest at 0.1 rad times its cosine."""
    assert share == pytest.approx(2 / (3 + inertia))
    assert math.degrees(math.acos(share)) == pytest.approx(degrees, abs=5e-5)
    rate = 2 * mp.mpf("9.81") / (mp.mpf("0.25") * (1 + mp.mpf(inertia)))
    first = mp.mpf("0.1")
    left = mpmath.acos(share * cos(first))
    t = travel_time(lambda x: rate * (cos(first) - cos(x)), first, left)
    solution = follow(example)
    assert times(solution, "lift-off", "touch") == pytest.approx([float(t)], rel=1e-10)
    assert times(solution, "release", "roll") == times(solution, "lift-off", "touch")
    assert solution["left_at"][-1] == pytest.approx(float(left), rel=1e-10)
    # in free flight nothing turns it
    flying = solution.time > float(t) + 1e-6
    spin = solution["der(spin)"][flying]
    assert np.ptp(spin) < 1e-9 * spin[0]


def test_ladder_leaves_the_wall() -> None:
    """P7: sin of the angle to the floor at 2/3 of its first value, with the numbers of the reference."""
    known = values("classical_closed_form_set", "uniform ladder length 2 m")
    solution = follow("ladder_leaves_wall")
    assert [e.kind for e in solution.events] == ["when", "lift-off"]
    (leaves,) = times(solution, "lift-off", "wall")
    at = solution(leaves)
    assert leaves == pytest.approx(known["time_leave"], rel=1e-10)
    assert math.pi / 2 - at["theta"] == pytest.approx(known["theta_leave"], rel=1e-10)
    assert at["der(theta)"] == pytest.approx(known["omega_leave"], rel=1e-10)
    assert at["height"] == pytest.approx(known["height_fraction"], rel=1e-10)
    assert solution.final()["leaving"] == pytest.approx(known["height_fraction"], rel=1e-9)
    # then the floor alone pushes: the speed of the middle stays
    assert solution["der(x)"][-1] == pytest.approx(at["der(x)"], rel=1e-10)


# ---------------------------------------------------------------- string and shaken plane


@pytest.mark.parametrize("eps", [0.2, 0.7, 1.0, 1.4])
def test_string_goes_slack_and_taut_again(eps: float) -> None:
    """U77: slack at the height 2/3 eps above the support; v^2 = g h there, so taut after 4 v sin(theta)/g."""
    solution = follow("string_pendulum", set={"eps": eps})
    e = mp.mpf(eps)
    # theta from the lowest place: theta'^2 = 2 g/l (eps + cos(theta)), tension m g (2 eps + 3 cos(theta))
    slack = mpmath.acos(-2 * e / 3)
    t = float(travel_time(lambda x: 2 * mp.mpf("9.81") * (e + cos(x)), 0, slack))
    assert times(solution, "lift-off")[0] == pytest.approx(t, rel=1e-10)
    assert solution(t)["y"] == pytest.approx(2 * eps / 3, rel=1e-9)
    flight = 4 * math.sqrt(2 * eps / 3 / g) * float(sin(slack))
    assert times(solution, "impact")[0] == pytest.approx(t + flight, rel=1e-10)
    before = solution(np.linspace(0, t * (1 - 1e-9), 50))
    theta = np.arctan2(before["x"], -before["y"])
    assert before["tension"] == pytest.approx(g * (2 * eps + 3 * np.cos(theta)), rel=1e-8, abs=1e-8)


def test_string_for_all_energies() -> None:
    """Swings below 0, goes slack between 0 and 3/2, turns over above; the rows of the sweep."""
    sweep = load("string_pendulum").sweep(experiment="energies", tolerance=1e-10, estimate_error=False)
    seen = set()
    for point, solution in zip(sweep.points, sweep.solutions, strict=True):
        eps = point["eps"]
        assert isinstance(eps, float) and isinstance(solution, mechc.Solution)
        if min(abs(eps), abs(eps - 1.5)) < 1e-9:
            continue  # the tension just vanishes
        slack = times(solution, "lift-off")
        assert bool(slack) == (0 < eps < 1.5), eps
        if slack:
            assert solution(slack[0])["y"] == pytest.approx(2 * eps / 3, abs=1e-8)
        seen.add(bool(slack))
    assert seen == {True, False} and len(sweep.solutions) == 30


def test_plane_shaken_gently() -> None:
    """U51: x'' = (g - a w^2 sin(w t)) sin(slope), and the normal force m (g - a w^2 sin(w t)) cos(slope)."""
    a, w, slope = 0.02, 15.0, math.radians(20)
    assert a * w**2 < g
    solution = follow("shaken_incline")
    t = solution.time
    assert not solution.events
    expected = math.sin(slope) * (g * t**2 / 2 + a * np.sin(w * t) - a * w * t)
    assert solution["x"] == pytest.approx(expected, rel=1e-9, abs=1e-9)
    assert solution["normal"] == pytest.approx(math.cos(slope) * (g - a * w**2 * np.sin(w * t)), rel=1e-9)
    for share, rattles in ((0.9999, False), (1.0001, True)):  # of a w^2 = g
        events = follow("shaken_incline", set={"w": math.sqrt(share * g / a)}, stop=0.3).events
        assert any(e.kind == "lift-off" for e in events) is rattles


def test_plane_that_rattles() -> None:
    """Leaves where sin(w t) = g/(a w^2), falls freely, hits; the rebound has a fifth of the approach speed."""
    a, w, slope, e = 0.02, 30.0, math.radians(20), 0.2
    solution = follow("shaken_incline", "rattling")
    leaves = math.asin(g / (a * w**2)) / w
    assert times(solution, "lift-off")[0] == pytest.approx(leaves, rel=1e-10)

    def height(t: float, t0: float, rate: float) -> float:
        """Above the plane, along its normal, after leaving it at t0 with a rate along the normal."""
        plane = a * (math.sin(w * t) - math.sin(w * t0) - w * math.cos(w * t0) * (t - t0))
        return rate * (t - t0) - math.cos(slope) * (g * (t - t0) ** 2 / 2 + plane)

    def approach(t: float, t0: float, rate: float) -> float:
        return rate - math.cos(slope) * (g * (t - t0) + a * w * (math.cos(w * t) - math.cos(w * t0)))

    hits, t, rate = [], leaves, 0.0
    for _ in range(2):
        grid = np.linspace(t + 1e-4, t + 0.5, 20000)
        heights = [height(s, t, rate) for s in grid]
        k = next(k for k in range(len(grid)) if heights[k] > 0 > heights[k + 1])
        hit = brentq(height, grid[k], grid[k + 1], args=(t, rate), xtol=1e-15)
        t, rate = hit, -e * approach(hit, t, rate)
        hits.append(hit)
    assert times(solution, "impact")[:2] == pytest.approx(hits, rel=1e-10)


# ---------------------------------------------------------------- catapult


def test_catapult_lets_go() -> None:
    """Speed at the release from the energies; then a parabola, 2.5 m down; the arm is free of the stone."""
    k, m, ms, l = mp.mpf(400), mp.mpf(3), mp.mpf("0.5"), mp.mpf("1.5")
    first, last = 17 * mp.pi / 18, mp.pi / 2
    inertia, weight = m * l**2 / 3 + ms * l**2, mp.mpf("9.81") * l * (m / 2 + ms)

    def squared(a: Any) -> Any:
        spring = k / 2 * ((first - mp.pi / 3) ** 2 - (a - mp.pi / 3) ** 2)
        return 2 / inertia * (spring + weight * (sin(first) - sin(a)))

    t = float(travel_time(squared, first, last))
    solution = follow("catapult")
    assert times(solution, "release", "cup") == pytest.approx([t], rel=1e-10)
    fall = math.sqrt(2 * 2.5 / g)
    assert solution.outcome.value == "terminated" and solution.message.startswith("landed")
    assert solution.time[-1] == pytest.approx(t + fall, rel=1e-10)
    speed = float(l * mpmath.sqrt(squared(last)))
    assert solution["range"][-1] == pytest.approx(speed * fall, rel=1e-10)
    assert solution["hinge.angle"][-1] == pytest.approx(math.radians(80), abs=1e-12)


def test_drive_lets_go_and_takes_hold_again() -> None:
    """A trolley goes as t^2 for a second and then swings freely with what hangs on it by a spring."""
    model = mechc.loads("""model Trolley
  coordinate Length x;
  coordinate Length y = 0 m;
  discrete release_at = 1 s;
  drive x = 1 m/s^2*time^2;
  kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
  potential 1/2*4 N/m*(y - x)^2;
  output F = reaction(x);
  when time >= release_at then release x; end when;
  experiment(stop = 2 s);
end Trolley;
""")
    solution = model.simulate(tolerance=1e-11)
    held = np.flatnonzero(solution.time < 1)
    w = 2.0  # of y while x is held: y = t^2 - 1/2 + cos(w t)/2
    t = solution.time[held]
    assert solution["x"][held] == pytest.approx(t**2, abs=1e-11)
    assert solution["F"][held] == pytest.approx(2 - 4 * (np.cos(w * t) / 2 - 1 / 2), abs=1e-8)
    # then the centre goes on evenly and the distance swings with twice the square of the frequency
    y, rate = 1 - 1 / 2 + math.cos(w) / 2, 2 - math.sin(w)
    gap, opening, f = y - 1, rate - 2, math.sqrt(8)
    distance = gap * math.cos(f) + opening / f * math.sin(f)
    assert solution["y"][-1] - solution["x"][-1] == pytest.approx(distance, abs=1e-9)
    assert solution["y"][-1] + solution["x"][-1] == pytest.approx(1 + y + 2 + rate, abs=1e-9)
    assert solution["F"][-1] == 0

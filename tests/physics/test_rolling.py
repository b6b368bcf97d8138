"""Rolling without slip: wheels on lines, circles, curves and planes; coins and balls (U95, U122, U126, U132, U141)."""

from __future__ import annotations

import numpy as np
import pytest
from closed_forms import swing, swing_rate
from gallery import Case, check, load, run
from numpy import cos, pi, sin, sqrt, tan

g = 9.81
CLOSED = 1e-9
"""Bound on energy balance over the energies of the run: ten times the tolerance of 1e-10."""


def test_point_of_a_rim_draws_a_cycloid() -> None:
    """U95. The motion is uniform: nothing but rounding."""
    check(
        Case(
            "rolling_cylinder",
            {
                "path[1]": lambda t: 2 * t + 0.3 * sin(2 * t / 0.3),
                "path[2]": lambda t: 0.3 + 0.3 * cos(2 * t / 0.3),
                "v[1]": lambda t: 2 + 2 * cos(2 * t / 0.3),
                "v[2]": lambda t: -2 * sin(2 * t / 0.3),
                "spin": lambda t: -2 / 0.3,
            },
            bound=0.01,
        )
    )


def test_solid_cylinder_beats_the_shell() -> None:
    """U122: w^2 = 4 g h/(3 a^2) against g h/a^2 after a drop h."""
    solution = run("cylinder_and_shell")
    for k, factor in ((1, 4 / 3), (2, 1)):
        expected = sqrt(factor * g * solution[f"drop[{k}]"]) / 0.1
        assert solution[f"spin[{k}]"] == pytest.approx(expected, abs=1e-9 * expected[-1])
        fallen = factor * g * (sin(np.radians(20)) * solution.time) ** 2 / 4
        assert solution[f"drop[{k}]"] == pytest.approx(fallen, abs=1e-9)
    assert solution["drop[1]"][-1] > 1.3 * solution["drop[2]"][-1]  # the solid one wins


def test_friction_of_a_rolling_cylinder() -> None:
    """U126: a = 2/3 g sin, f = m g sin/3, which needs mu >= tan/3."""
    solution = run("rolling_down_incline")
    slope = np.radians(25)
    assert solution["acceleration"] == pytest.approx(2 / 3, rel=1e-12)
    assert solution["friction_force"] == pytest.approx(2 * g * sin(slope) / 3, rel=1e-12)
    assert solution["needed"] == pytest.approx(tan(slope) / 3, rel=1e-12)
    assert solution["guide.position"][-1] == pytest.approx(g * sin(slope) / 3, rel=1e-12)


def test_ball_in_bowl() -> None:
    """U132: theta'' = -5 g/(7 (b - a)) sin(theta) from 40 degrees; small swings last 2 pi sqrt(7 (b - a)/(5 g))."""
    w0 = sqrt(5 * g / (7 * 0.18))
    (mode,) = load("ball_in_bowl").modes().summary()["modes"]
    assert 2 * pi / mode["frequency"] == pytest.approx(2 * pi * sqrt(7 * 0.18 / (5 * g)), rel=1e-12)
    start = np.radians(40)
    check(
        Case(
            "ball_in_bowl",
            {
                "bowl.angle": lambda t: swing(t, start, w0),
                "der(bowl.angle)": lambda t: swing_rate(t, start, w0),
            },
            bound=100,
        )
    )


def test_edge_runner_presses_with_more_than_its_weight() -> None:
    """U141: m g + m R a W^2/(2 D), by the balance of moments about the hinge: the spin a W/R turns with W."""
    for track, hinge in ((1.0, 0.4), (2.5, 0.4), (1.0, 1.0)):
        solution = run("edge_runner", set={"a": track, "D": hinge})
        assert solution["push"] == pytest.approx(50 * (g + 0.4 * track * 3**2 / (2 * hinge)), rel=1e-12)
        assert solution["bearing.angle"][-1] == pytest.approx(-track * 6 / 0.4, rel=1e-12)


def test_coin_in_a_steady_turn() -> None:
    """Six equations of rolling and balance of moments: W^2 = 4 g cot(lean)/(6 R + r cos(lean))."""
    solution = run("rolling_coin")
    lean = np.radians(70)
    rate = sqrt(4 * g / tan(lean) / (6 * 0.5 + 0.2 * cos(lean)))
    t = solution.time
    assert solution["pose.position[1]"] == pytest.approx(0.5 * cos(rate * t), abs=1e-8)
    assert solution["pose.position[2]"] == pytest.approx(0.5 * sin(rate * t), abs=1e-8)
    assert solution["cos_lean"] == pytest.approx(cos(lean), abs=1e-8)
    assert solution["push"] == pytest.approx(0.5 * g, rel=1e-9)
    upset = run("rolling_coin", set={"der(pose.orientation)[1]": -1.0})
    assert np.ptp(upset["cos_lean"]) > 0.05
    balance = upset.accuracy.energy
    assert balance is not None and balance.relative is not None and balance.relative < 1e-8


def test_bicycle_wheel_on_a_hook() -> None:
    """A ring with its axle level precesses steadily with g d/(R^2 w); the hook carries the weight."""
    solution = run("bicycle_wheel")
    rate = g * 0.2 / (0.3**2 * 30)
    t = solution.time
    assert solution["path[1]"] == pytest.approx(0.2 * cos(rate * t), abs=1e-8)
    assert solution["path[2]"] == pytest.approx(0.2 * sin(rate * t), abs=1e-8)
    assert solution["path[3]"] == pytest.approx(0, abs=1e-8)
    assert solution["pull[3]"] == pytest.approx(2 * g, rel=1e-8)
    inwards = np.hypot(solution["pull[1]"], solution["pull[2]"])
    assert inwards == pytest.approx(2 * 0.2 * rate**2, rel=1e-7)
    dropped = run("bicycle_wheel", "dropped")
    depth = 2 * 2 * g * 0.2**2 * 2 * (0.3**2 / 2 + 0.2**2) / (2 * 0.3**2 * 30) ** 2  # of its nod, if small
    assert dropped["path[3]"].min() == pytest.approx(-depth, rel=0.01)
    assert dropped["path[3]"].max() < 1e-8


def test_wheel_in_a_parabolic_valley() -> None:
    """Energy of a disk that rolls, 3/4 m v^2; its angle is the slope less the length of the valley over r."""
    solution = run("wheel_on_curve")
    v2 = solution["der(pose.x)"] ** 2 + solution["der(pose.y)"] ** 2
    height = solution["pose.y"]
    assert 0.75 * v2 + g * (height - height[0]) == pytest.approx(0, abs=g * height[0] * 1e-8)
    assert solution["rolled"] == pytest.approx(solution["rolled"][0], abs=1e-8)
    u, x, y = solution["u"], solution["pose.x"], solution["pose.y"]
    assert x == pytest.approx(u - 0.2 * u / sqrt(1 + u**2), abs=1e-8)
    assert y == pytest.approx(u**2 / 2 + 0.2 / sqrt(1 + u**2), abs=1e-8)
    assert u.min() == pytest.approx(-1, abs=1e-4)  # as high on the other side
    push = np.hypot(solution["normal_force[1]"], solution["normal_force[2]"])
    assert push[0] == pytest.approx(g * cos(pi / 4), rel=1e-12)

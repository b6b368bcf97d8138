"""Accelerated and turning frames (P11, U100-U103); the linear equations solved by the matrix exponential."""

from __future__ import annotations

import numpy as np
import pytest
from gallery import Array, Case, Formula, at, check, run
from numpy import cos, sin, sqrt
from scipy.linalg import expm

import mechc

g, w = 9.81, 7.292e-5


def cabin(i: int) -> Formula:
    """U101 in inertial axes: d'' = -(k/m) d - A from the moving origin; then turned into the cabin."""
    A, k = np.array([0.3, 0, 0.1]), 2.0
    d0, v0 = np.array([1, 0, 0.5]), np.array([0, 0.2 + 0.5, 0])

    def r(t: Array) -> Array:
        W = sqrt(k)
        d = (
            np.multiply.outer(d0 + A / k, cos(W * t))
            + np.multiply.outer(v0 / W, sin(W * t))
            - (A / k)[:, None]
        )
        angle = 0.5 * t + 0.05 * t * t
        turned = [cos(angle) * d[0] + sin(angle) * d[1], -sin(angle) * d[0] + cos(angle) * d[1], d[2]]
        return np.asarray(turned[i])

    return r


CASES = [
    Case(
        "accelerated_frame",
        {
            "r[1]": lambda t: -0.2 + 0.3 * cos(sqrt(10) * t),
            "r[2]": lambda t: 0.2 * cos(sqrt(10) * t) + 0.3 / sqrt(10) * sin(sqrt(10) * t),
        },
        bound=300,
    ),
    Case("moving_frame", {f"r[{i + 1}]": cabin(i) for i in range(3)}, bound=300),
]


@pytest.mark.parametrize("case", CASES, ids=str)
def test_closed_form(case: Case) -> None:
    check(case)


def test_pseudo_forces() -> None:
    """U101, P10: m a + k r - (Coriolis + Euler + centrifugal + inertia) vanishes along the run."""
    solution = run("moving_frame")
    assert max(np.max(np.abs(solution[f"check[{i}]"])) for i in (1, 2, 3)) < 1e-12
    t, r, v = (
        solution.time,
        *(np.array([solution[n.format(i)] for i in (1, 2, 3)]) for n in ("r[{}]", "der(r[{}])")),
    )
    rate, angle = 0.5 + 0.1 * t, 0.5 * t + 0.05 * t * t
    origin = np.array([0.3 * t * cos(angle), -0.3 * t * sin(angle), 0.1 * t])  # A t in the cabin
    p = v + rate * np.array([-r[1], r[0], 0 * t]) + origin
    assert np.array([solution[f"p[{i}]"] for i in (1, 2, 3)]) == pytest.approx(p, abs=1e-12)


def test_lagrangian_of_a_turning_and_accelerated_frame() -> None:
    """U101: L = m/2 (v^2 + 2 v.(w x r) + (w x r)^2) - m A.r - U has p = m v + m w x r, and keeps
    E = m v^2/2 - m/2 (w x r)^2 + m A.r + U. Its motion about the axis is a turn of the one in axes at rest."""
    text = """\
model Turning
  dimensionless;
  parameter m = 2;
  coordinate r[3] = {1, 0, 0.5};
  initial der(r) = {0, 0.2, 0};
  let W = {0, 0, 0.5};
  let across = cross(W, r);
  lagrangian m/2*(dot(der(r), der(r)) + 2*dot(der(r), across) + dot(across, across)) - m*0.1*r[3] - 2*dot(r, r);
  output p = momentum(r);
  experiment(stop = 10, tolerance = 1e-10);
end Turning;
"""
    solution = mechc.loads(text).simulate()
    t, r, v = (
        solution.time,
        *(np.array([solution[n.format(i)] for i in (1, 2, 3)]) for n in ("r[{}]", "der(r[{}])")),
    )
    c, s, W = cos(0.5 * t), sin(0.5 * t), sqrt(2)
    # in axes at rest: d'' = -2 d from (1, 0) with (0, 0.2 + 0.5)
    d = np.array([cos(W * t), 0.7 / W * sin(W * t)])
    assert r[0] == pytest.approx(c * d[0] + s * d[1], abs=300e-10)
    assert r[1] == pytest.approx(-s * d[0] + c * d[1], abs=300e-10)
    assert r[2] == pytest.approx(-0.05 + 0.55 * cos(W * t), abs=300e-10)
    across = 0.5 * np.array([-r[1], r[0], 0 * t])
    assert np.array([solution[f"p[{i}]"] for i in (1, 2, 3)]) == pytest.approx(2 * (v + across), abs=1e-12)
    E = (v**2).sum(0) - (across**2).sum(0) + 0.2 * r[2] + 2 * (r**2).sum(0)
    assert solution["energy.total"] == pytest.approx(E, rel=1e-12)
    assert pytest.approx(E[0], rel=300e-10) == E


def test_sea_level_across_a_channel() -> None:
    """U105: what holds water that flows east with 1.25 m/s at 50 degrees pushes it north, by 0.0683 m over 4800 m:
    the south coast is higher. Rails in the turning frame carry it; gravity is along z."""
    text = """\
model Channel
  parameter w = 7.292e-5 rad/s;
  frame ground = world * rotz(w*time) * roty(40 deg);
  coordinate Length x;
  coordinate Length y;
  coordinate Length z;
  drive x = 0 m;
  drive y = 1.25 m/s*time;
  drive z = 0 m;
  mass 1 kg at ground * {x, y, z};
  potential 1 kg*9.81 m/s^2*z;
  output push = reaction(x) "to the south";
  output lift = reaction(z);
  experiment(stop = 1 s);
end Channel;
"""
    end = mechc.loads(text).simulate(estimate_error=False).final()
    rise = 4800 * end["push"] / end["lift"]  # the surface is across the force: it rises against the push
    assert rise == pytest.approx(-0.0683, abs=5e-5)


def on_the_earth(latitude: float, r0: list[float], v0: list[float], t: float) -> Array:
    """r(t) of r'' = -g z - 2 W x r' - W x (W x r), x south, y east, z up."""
    W = w * np.array([-cos(latitude), 0, sin(latitude)])
    X = np.array([[0, -W[2], W[1]], [W[2], 0, -W[0]], [-W[1], W[0], 0]])
    A = np.zeros((7, 7))
    A[:3, 3:6] = np.eye(3)
    A[3:6, :3], A[3:6, 3:6] = -X @ X, -2 * X
    A[5, 6] = -g
    return np.asarray((expm(A * t) @ np.array([*r0, *v0, 1]))[:3])


# example, experiment, latitude, r0, v0, duration, deflection to the east in first order, its printed digits
FALLS = [
    ("falling_body_east", None, 49, [0, 0, 100], [0, 0, 0], sqrt(200 / g), 0.01440054),
    ("bullet_up", None, 45, [0, 0, 0], [0, 0, 100], 200 / g, -0.7143851),
    ("thrown_and_dropped", None, 49, [0, 0, 0], [0, 0, sqrt(200 * g)], 2 * sqrt(200 / g), -4 * 0.01440054),
    ("thrown_and_dropped", "dropped", 49, [0, 0, 100], [0, 0, 0], sqrt(200 / g), 0.01440054),
]


@pytest.mark.parametrize(("example", "experiment", "latitude", "r0", "v0", "stop", "first_order"), FALLS)
def test_deflection(
    example: str,
    experiment: str | None,
    latitude: float,
    r0: list[float],
    v0: list[float],
    stop: float,
    first_order: float,
) -> None:
    """U102, U103: exact motion to the tolerance; first order in w but for the square of w t = 1.5e-3."""
    solution = run(example, experiment)
    assert solution.time[-1] == pytest.approx(stop, rel=1e-14)
    expected = on_the_earth(np.deg2rad(latitude), r0, v0, stop)
    # nominal length 1 m: a few steps of 1e-10 m, while the height is that of 100 m to rounding
    assert at(solution, stop, ["x", "y", "z"]) == pytest.approx(expected, abs=1e-7)
    assert solution["y"][-1] == pytest.approx(first_order, rel=2e-6)  # (w t)^2, and seven digits
    if "deflection" in solution.final():
        assert solution["deflection"][-1] == pytest.approx(abs(first_order), rel=4e-7)


@pytest.mark.parametrize(("height", "width"), [(670, 0.25), (757, 0.3)])
def test_from_what_height_it_misses(height: float, width: float) -> None:
    """U107: dropped from 670 m at 49 degrees it falls 0.25 m to the east, from 757 m 0.3 m: whoever stands below moves west."""
    solution = run("falling_body_east", set={"h": float(height)})
    # heights are rounded to a metre, and of first order in w
    assert solution["y"][-1] == pytest.approx(width, rel=3e-3)


@pytest.mark.parametrize(("latitude", "side"), [(50.0, 1.0), (-50.0, -1.0)])
def test_horizontal_motion_is_turned_to_the_right_in_the_north(latitude: float, side: float) -> None:
    """U108: 2 m v w sin(latitude) across, whatever the direction; to the left in the south. Over 1 s at 100 m/s."""
    for x, y in ((1.0, 0.0), (0.0, 1.0), (-0.6, 0.8)):
        right = []
        for way in (1, -1):  # it falls meanwhile, which turns it east whichever way it goes
            start = {
                "der(x)": 100 * x * way,
                "der(y)": 100 * y * way,
                "latitude": float(np.deg2rad(latitude)),
            }
            end = run("falling_body_east", set={**start, "h": 0.0}, stop=1.0)
            right.append(float(y * end["x"][-1] - x * end["y"][-1]))  # x is south, y east
        across = (right[0] - right[1]) / 2
        # of second order in w
        assert across == pytest.approx(side * 100 * w * sin(np.deg2rad(abs(latitude))), rel=2e-5)


def test_thrown_and_dropped_deflect_four_to_one() -> None:
    thrown, dropped = run("thrown_and_dropped")["y"][-1], run("thrown_and_dropped", "dropped")["y"][-1]
    assert thrown / dropped == pytest.approx(-4, rel=2e-3)

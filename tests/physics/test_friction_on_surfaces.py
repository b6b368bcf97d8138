"""Dry friction on a surface: it acts against the slip, in two directions at once."""

from __future__ import annotations

import math

import numpy as np
import pytest
from slow_params import slow_but

import mechc
from mechc.runtime.outcome import Outcome
from mechc.solution import Solution

GRAVITY = 9.81

PUCK = """\
parameter mu = 0.3;
parameter slope = 0 deg;
coordinate Length x = 0 m;
coordinate Length y = 0 m;
coordinate Length h = 0 m;
initial der(x) = 3 m/s;
initial der(y) = 4 m/s;
gravity {sin(slope)*(9.81 m/s^2), 0 m/s^2, -cos(slope)*(9.81 m/s^2)};
mass 2 kg at world * {x, y, h};
contact floor: h friction mu along {der(x), der(y)};
"""

BALL = """\
parameter r = 0.1 m;
parameter mu = 0.2;
gravity {0, 0, -9.81} m/s^2;
coordinate Length x = 0 m;
coordinate Length y = 0 m;
coordinate Length z = r;
coordinate Rotation R;
initial der(x) = 3 m/s;
initial der(y) = 1 m/s;
initial der(R) = {20, 15, 7} rad/s;
frame ball = world * trans({x, y, z}) * R;
mass 2 kg at ball;
inertia 0.4*(2 kg)*r^2*diag({1, 1, 1}) on ball;
let slip = vel_at(ball, world * {x, y, z - r});
contact floor: z - r friction mu along {slip[1], slip[2]};
output slip_x = slip[1];
output slip_y = slip[2];
"""

TURNTABLE = """\
parameter rise = 0.5 rad/s^2;
parameter mu = 0.4;
coordinate Length x = 0.5 m;
coordinate Length y = 0 m;
coordinate Length h = 0 m;
gravity {0, 0, -9.81} m/s^2;
mass 1 kg at world * {x, y, h};
let turning = rise*time;
contact table: h friction mu along {der(x) + turning*y, der(y) - turning*x};
"""


def run(text: str, **options: object) -> Solution:
    solution = mechc.loads(text).simulate(**({"estimate_error": False, "tolerance": 1e-10} | options))  # type: ignore[arg-type]
    assert solution.outcome is Outcome.COMPLETED, solution.message
    drift = solution.accuracy.energy
    assert drift is not None and drift.relative is not None and drift.relative < 1e-8
    return solution


def times(solution: Solution, kind: str) -> list[float]:
    return [e.time for e in solution.events if e.kind == kind]


def test_a_puck_slides_straight_until_it_sticks() -> None:
    solution = run(PUCK, stop=3)
    assert times(solution, "stick") == pytest.approx([5 / (0.3 * GRAVITY)], rel=1e-10)
    way = 25 / (2 * 0.3 * GRAVITY)
    assert solution["x"][-1] == pytest.approx(0.6 * way, rel=1e-10)
    assert solution["y"][-1] == pytest.approx(0.8 * way, rel=1e-10)


def test_across_a_slope_as_steep_as_its_friction() -> None:
    """Gravity along the slope equals friction: |v| + v down the slope is constant, and both end at a half of it."""
    slope = math.atan(0.3)
    solution = run(PUCK, stop=20, set={"slope": slope, "der(x)": 0.0})
    speed = np.hypot(solution["der(x)"], solution["der(y)"])
    assert speed + solution["der(x)"] == pytest.approx(4, rel=1e-8)
    assert solution["der(x)"][-1] == pytest.approx(2, rel=1e-3)
    assert not solution.events


def test_a_puck_that_slows_down_across_a_slope_comes_to_rest() -> None:
    """The slip turns down the slope ever faster as it ends; then friction holds."""
    solution = run(PUCK, stop=5, set={"slope": 0.2, "der(x)": 0.0})
    assert len(times(solution, "stick")) == 1
    assert solution["der(x)"][-1] == solution["der(y)"][-1] == 0


def test_a_ball_slides_until_it_rolls() -> None:
    """The slip keeps its direction; it rolls after 2 |s|/(7 mu g), having lost 2/7 of the slip."""
    spin = np.array([20.0, 15.0, 7.0])
    slip = np.array([3.0, 1.0]) + np.cross(spin, [0, 0, -0.1])[:2]
    solution = run(BALL, stop=2)
    (rolls,) = times(solution, "stick")
    assert rolls == pytest.approx(2 * np.linalg.norm(slip) / (7 * 0.2 * GRAVITY), rel=1e-8)
    assert solution["der(x)"][-1] == pytest.approx(3 - 2 / 7 * slip[0], abs=1e-8)
    assert solution["der(y)"][-1] == pytest.approx(1 - 2 / 7 * slip[1], abs=1e-8)
    assert abs(solution["slip_x"][-1]) + abs(solution["slip_y"][-1]) < 1e-10


def test_a_block_leaves_a_turntable_that_turns_faster_and_faster() -> None:
    """It slips where the acceleration, along and across, takes all the friction that there is."""
    solution = run(TURNTABLE, stop=6)
    rise, radius, limit = 0.5, 0.5, 0.4 * GRAVITY
    turning = (math.sqrt(limit**2 - (rise * radius) ** 2) / radius) ** 0.5
    assert times(solution, "slip")[:1] == pytest.approx([turning / rise], rel=1e-9)


@pytest.mark.parametrize("mu", [0.05, 0.8])
def test_an_oblique_impact_of_a_ball(mu: float) -> None:
    """It slides through the impact, or its slip ends: the impulse is 2/7 m |s| or mu m |v|, whichever is less."""
    text = BALL.replace("coordinate Length z = r;", "coordinate Length z = r + 0.2 m;")
    solution = run(text, stop=0.25, set={"mu": mu})
    fall = math.sqrt(2 * GRAVITY * 0.2)
    slip = np.array([3.0, 1.0]) + np.cross([20.0, 15.0, 7.0], [0, 0, -0.1])[:2]
    (impact,) = (e for e in solution.events if e.kind == "impact")
    size = np.linalg.norm(slip)
    lost = min(2 / 7 * size, mu * fall)
    assert impact.after["der(x)"] == pytest.approx(3 - lost * slip[0] / size, rel=1e-9)
    assert impact.after["der(y)"] == pytest.approx(1 - lost * slip[1] / size, rel=1e-9)


@pytest.mark.parametrize("method", ["dop853", "radau5"])
def test_a_slip_begins_in_the_direction_in_which_it_goes_on(method: str) -> None:
    """A force that jumps moves a block with unlike masses along x and y, neither along it nor along the reply to it.

    With s = s d, |d| = 1, and m s' = F - c d in each direction: d = F/(c + s' m), and s' from |d| = 1.
    """
    text = """\
parameter jump = 1 s;
coordinate Length x = 0 m;
coordinate Length y = 0 m;
coordinate Length h = 0 m;
gravity {0, 0, -9.81} m/s^2;
mass 2 kg at world * {x, y, h};
mass 6 kg at world * {x, 0 m, 1 m};
contact floor: h friction 0.3 along {der(x), der(y)};
force if time < jump then 0 N else 7 N on x;
force if time < jump then 0 N else 5 N on y;
"""
    solution = run(text, stop=2, method=method, tolerance=1e-8)
    limit, force, mass = 0.3 * 2 * GRAVITY, np.array([7.0, 5.0]), np.array([8.0, 2.0])
    low, high = 0.0, 10.0
    for _ in range(60):
        gain = (low + high) / 2
        low, high = (gain, high) if np.linalg.norm(force / (limit + gain * mass)) > 1 else (low, gain)
    way = gain * force / (limit + gain * mass) / 2
    assert times(solution, "slip") == [1]
    assert solution["x"][-1] == pytest.approx(way[0], rel=1e-6)
    assert solution["y"][-1] == pytest.approx(way[1], rel=1e-6)


ENDS_ASKEW = {
    "in a corner": (2, 0.9, 0, 0.1, (0, 0), (1.81466, -18.72869, 0)),
    "after many bounces": (2, 0.13051, 0.5, 0.1, (0.13051, 0), (0, 0, 0)),
    "where friction just holds": (-1.5, 0.05, 0, 0.3, (1.0043, 0.05), (4.47123, -3.97417, 1.0043)),
}


@pytest.mark.parametrize("name", ENDS_ASKEW)
@pytest.mark.parametrize(
    "options",
    slow_but([{"method": "dop853"}], [{"method": "dop853"}, {"method": "radau5"}]),
    ids=["dop853", "radau5"],
)
def test_a_slip_that_turns_as_it_ends(name: str, options: dict[str, str]) -> None:
    """Such slips took steps of rounding size, or found no modes that fit."""
    pull, mu, restitution, height, (vx, vy), spin = ENDS_ASKEW[name]
    text = f"""\
gravity {{{pull}, 0, -9.81}} m/s^2;
coordinate Rotation R;
coordinate Length x = 0 m;
coordinate Length y = 0 m;
coordinate Length z = {height} m;
initial der(x) = {vx} m/s;
initial der(y) = {vy} m/s;
initial der(R) = {{{spin[0]}, {spin[1]}, {spin[2]}}} rad/s;
frame ball = world * trans({{x, y, z}}) * R;
mass 1 kg at ball;
inertia diag({{0.0038, 0.004, 0.0037}} kg.m^2) on ball;
let s = vel_at(ball, world * {{x, y, z - 0.1 m}});
let w = vel_at(ball, world * {{x + 0.1 m, y, z}});
contact floor: z - 0.1 m restitution {restitution} friction {mu} along {{s[1], s[2]}};
contact wall: 0.5 m - x - 0.1 m restitution {restitution} friction {mu} along {{w[2], w[3]}};
"""
    solution = mechc.loads(text).simulate(stop=2, tolerance=1e-6, estimate_error=False, **options)  # type: ignore[arg-type]
    assert solution.outcome is Outcome.COMPLETED, solution.message
    assert solution.statistics.steps < 2000
    drift = solution.accuracy.energy
    assert drift is not None and drift.relative is not None and drift.relative < 1e-3


def test_regularized_friction_creeps() -> None:
    text = PUCK.replace(
        "along {der(x), der(y)}", 'along {der(x), der(y)}, law = "regularized", v_stick = 1 mm/s'
    )
    solution = run(text, stop=3, method="radau5")
    assert np.hypot(solution["x"][-1], solution["y"][-1]) == pytest.approx(25 / (0.6 * GRAVITY), rel=1e-3)


@pytest.mark.parametrize("slip", ["{0*der(h), 0*der(h)}", "{0*der(h), der(x)}", "{der(x), 0*der(h)}"])
def test_a_contact_that_cannot_slip_one_way(slip: str) -> None:
    """Rows that are identically zero are dropped with their modes; what is left slides as on a line."""
    model = mechc.loads(PUCK.replace("{der(x), der(y)}", slip))
    run = model.simulate(stop=0.5)
    slides = "der(x)" in slip
    x = 3 * 0.5 - (0.3 * GRAVITY * 0.5**2 / 2 if slides else 0)
    assert run["x"][-1] == pytest.approx(x, abs=1e-9)
    assert run["y"][-1] == pytest.approx(2, abs=1e-9)


BAR = """
coordinate Length x = 0 m;
coordinate Length y = 0 m;
coordinate Length z = 0 m;
coordinate yaw = 0 rad;
coordinate pitch = 0 rad;
kinetic 1/2*1 kg*(der(x)^2 + der(y)^2 + der(z)^2) + 1/2*0.1 kg.m^2*(der(yaw)^2 + der(pitch)^2);
potential 1 kg*9.81 m/s^2*z;
parameter Length foot[2] = {0.5 m, -0.5 m};
for i in 1:2 loop
  contact on[i]: z + foot[i]*pitch friction 0.5 along {der(x), der(y) + foot[i]*der(yaw)};
end for;
force 3*time*1 N/s on x;
force 4*time*1 N/s on y;
experiment(stop = 2 s);
"""


def test_feet_of_one_bar_begin_to_slip_in_one_direction() -> None:
    """Pulled askew by 5 N/s, two feet slip that have only three freedoms: x'' = 5 t - mu g in that direction from 0.981 s on."""
    solution = mechc.loads(BAR).simulate(estimate_error=False)
    assert solution.outcome is Outcome.COMPLETED, solution.message
    begins = 0.5 * GRAVITY / 5
    assert [(e.kind, e.name) for e in solution.events] == [("slip", "on[1]"), ("slip", "on[2]")]
    assert all(abs(e.time - begins) < 1e-7 for e in solution.events)
    way = 5 * (2 - begins) ** 3 / 6
    assert [solution["x"][-1], solution["y"][-1]] == pytest.approx([0.6 * way, 0.8 * way], abs=1e-6)

"""Loads that rigid bodies do not determine are those of the least sum of squares; no leg pulls, no friction leaves its cone.

The judge is NumPy's pseudo-inverse of the equations of equilibrium, and, where legs would pull, the least distance to an intersection
of half-spaces (C. L. Lawson, R. J. Hanson 1974, chapter 23) by SciPy.
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import nnls
from scipy.spatial.transform import Rotation

import mechc

Vector = NDArray[np.float64]

PLATE = """
model Plate
  structural parameter Integer n = %d;
  parameter Length foot[n, 2] = %s;
  parameter m = 2 kg;
  coordinate Length z = 0 m;
  coordinate Angle a = 0 rad;
  coordinate Angle b = 0 rad;
  kinetic 1/2*m*der(z)^2 + 1/2*(0.2 kg.m^2)*der(a)^2 + 1/2*(0.3 kg.m^2)*der(b)^2;
  potential m*9.81 m/s^2*z;
  for i in 1:n loop
    contact leg[i]: z + foot[i, 2]*a - foot[i, 1]*b;
  end for;
  output load[n] = {multiplier(leg[i]) for i in 1:n};
  output closed_legs[n] = {if closed(leg[i]) then 1 else 0 for i in 1:n};
  experiment(stop = 0.05 s);
end Plate;
"""
"""A plate on legs; the mass is at the origin."""

WEIGHT = 2 * 9.81


def plate(feet: Vector, unit: str = "m") -> mechc.Solution:
    scale = {"m": 1.0, "mm": 1e3}[unit]
    rows = ", ".join(f"{{{scale * x!r}, {scale * y!r}}}" for x, y in feet.tolist())
    text = PLATE % (len(feet), f"{{{rows}}} {unit}")
    return mechc.loads(text).simulate(estimate_error=False)


def loads(solution: mechc.Solution, name: str = "load") -> Vector:
    names = [q.name for q in solution.problem.outputs if q.name.startswith(f"{name}[")]
    return np.array([solution[name][-1] for name in names])


def equilibrium(feet: Vector) -> tuple[Vector, Vector]:
    return np.vstack([np.ones(len(feet)), feet.T]), np.array([WEIGHT, 0.0, 0.0])


def least(matrix: Vector, right: Vector) -> Vector:
    """The least x >= 0 with matrix x = right."""
    x = np.linalg.pinv(matrix) @ right
    _, sizes, rows = np.linalg.svd(matrix)
    null = rows[(sizes > 1e-12 * sizes[0]).sum() :].T
    bound = np.vstack([null.T, -x])
    goal = np.zeros(len(bound))
    goal[-1] = 1.0
    factors, _ = nnls(bound, goal)
    left = bound @ factors - goal
    found: Vector = x - null @ (left[:-1] / left[-1])
    return found


def grid(columns: int, rows: int, x: float, y: float) -> Vector:
    return np.array([[0.3 * i + x, 0.2 * j + y] for i in range(columns) for j in range(rows)]) - [
        0.15 * (columns - 1),
        0.1 * (rows - 1),
    ]


TABLES = {
    "four, middle": grid(2, 2, 0.0, 0.0),
    "four": grid(2, 2, 0.04, -0.03),
    "six": grid(3, 2, 0.05, -0.03),
    "nine": grid(3, 3, -0.06, 0.05),
}


@pytest.mark.parametrize("feet", TABLES.values(), ids=TABLES)
def test_a_table_has_the_loads_of_the_pseudo_inverse(feet: Vector) -> None:
    matrix, right = equilibrium(feet)
    expected = np.linalg.pinv(matrix) @ right
    assert expected.min() > 0
    solution = plate(feet)
    assert np.abs(loads(solution) - expected).max() < 1e-9
    assert (loads(solution, "closed_legs") == 1.0).all()


@pytest.mark.parametrize("off", [0.11, 0.149])
def test_no_leg_pulls(off: float) -> None:
    feet = grid(3, 2, off, 0.05)
    matrix, right = equilibrium(feet)
    assert (np.linalg.pinv(matrix) @ right).min() < -0.1
    found = loads(plate(feet))
    assert found.min() >= 0
    assert np.abs(found - least(matrix, right)).max() < 1e-9


def test_loads_do_not_depend_on_the_order_of_the_text_or_on_units() -> None:
    feet = grid(3, 2, 0.11, 0.05)
    found = loads(plate(feet))
    order = np.random.default_rng(3).permutation(len(feet))
    assert np.abs(loads(plate(feet[order])) - found[order]).max() < 1e-12 * WEIGHT
    assert np.abs(loads(plate(feet, "mm")) - found).max() < 1e-12 * WEIGHT


TABLE = """
import mech.spatial.*;
model Table
  structural parameter Integer n = 4;
  parameter m = 2 kg;
  parameter Length foot[n, 3] = {{0.25, 0.15, -0.1}, {-0.2, 0.15, -0.1}, {-0.2, -0.15, -0.1}, {0.25, -0.15, -0.1}} m;
  parameter Real e[3, 3] = %s;
  parameter Real q[4] = %s;
  parameter Real g[3] = %s;
  gravity (9.81 m/s^2)*g;
  coordinate Length x = 0.1 m*e[3, 1];
  coordinate Length y = 0.1 m*e[3, 2];
  coordinate Length z = 0.1 m*e[3, 3];
  coordinate Rotation R = quat(q[1], q[2], q[3], q[4]);
  initial der(x) = 0 m/s;
  frame box = world * trans({x, y, z}) * R;
  mass m at box;
  inertia diag({0.02, 0.03, 0.04} kg.m^2) on box;
  point p[i in 1:n] = box * {foot[i, 1], foot[i, 2], foot[i, 3]};
  for i in 1:n loop
    contact leg[i]: dot({e[3, 1], e[3, 2], e[3, 3]}, pos(p[i])) friction 0.6
      along {dot({e[1, 1], e[1, 2], e[1, 3]}, vel(p[i])), dot({e[2, 1], e[2, 2], e[2, 3]}, vel(p[i]))};
  end for;
  output load[n] = {multiplier(leg[i]) for i in 1:n};
  state Real sum = 0;
  equation der(sum) = multiplier(leg[2])/(1 N.s);
  experiment(stop = 0.5 s);
end Table;
"""


def text_of(values: Vector) -> str:
    if values.ndim == 1:
        return "{" + ", ".join(f"{float(x)!r}" for x in values) + "}"
    return "{" + ", ".join(text_of(row) for row in values) + "}"


FEET = np.array([[0.25, 0.15, -0.1], [-0.2, 0.15, -0.1], [-0.2, -0.15, -0.1], [0.25, -0.15, -0.1]])


def turned(turn: Rotation, down: Vector) -> mechc.Model:
    """The table in a world that is turned; ``down``: the direction of gravity on the table."""
    axes = turn.as_matrix().T
    return mechc.loads(
        TABLE % (text_of(axes), text_of(turn.as_quat(scalar_first=True)), text_of(turn.apply(down)))
    )


def of_legs(down: Vector) -> Vector:
    """Normal loads and frictions of least squares that hold the table."""
    columns = [np.concatenate([axis, np.cross(foot, axis)]) for axis in np.eye(3)[[2, 0, 1]] for foot in FEET]
    found: Vector = np.linalg.pinv(np.array(columns).T) @ np.concatenate([-WEIGHT * down, np.zeros(3)])
    return found.reshape(3, 4)


@pytest.mark.parametrize("slope", [0.0, 0.02])
def test_a_table_on_rough_legs_turned_with_its_world_has_the_same_loads(slope: float) -> None:
    down = np.array([np.sin(slope), 0.0, -np.cos(slope)])
    expected = of_legs(down)
    assert (np.hypot(*expected[1:]) < 0.6 * expected[0]).all()
    for turn in (Rotation.identity(), Rotation.from_rotvec([0.5, -0.8, 0.3])):
        solution = turned(turn, down).simulate(estimate_error=False)
        assert np.abs(loads(solution) - expected[0]).max() < 1e-9
        assert abs(solution["sum"][-1] - 0.5 * expected[0][1]) < 1e-8
        assert not solution.events


LADDER = """
model Ladder
  parameter grip = 0.8;
  coordinate Length x = 1 m;
  coordinate Length y = 1.5 m;
  coordinate Angle a = 0 rad;
  kinetic 1/2*(10 kg)*(der(x)^2 + der(y)^2) + 1/2*(3 kg.m^2)*der(a)^2;
  potential 10 kg*9.81 m/s^2*y;
  contact floor: y - 1.5 m*cos(a) + 1 m*sin(a) friction grip along der(x) - (1 m*sin(a) - 1.5 m*cos(a))*der(a);
  contact wall: x - 1 m*cos(a) - 1.5 m*sin(a) friction grip along der(y) - (1 m*cos(a) + 1.5 m*sin(a))*der(a);
  output load[2] = {multiplier(floor), multiplier(wall)};
  output held = if closed(wall) then 1 else 0;
  experiment(stop = 0.05 s);
end Ladder;
"""


@pytest.mark.parametrize("grip", [0.5, 0.8])
def test_a_ladder_between_rough_floor_and_wall(grip: float) -> None:
    # floor, slip, wall, slip
    rows = np.array([[0.0, 1.0, 1.0], [1.0, 0.0, 1.5], [1.0, 0.0, -1.5], [0.0, 1.0, -1.0]])
    free = np.linalg.pinv(rows.T) @ [0.0, 98.1, 0.0]
    along = np.linalg.svd(rows.T)[2][-1]  # what moves nothing
    limits = np.array(
        [[grip, 1.0, 0.0, 0.0], [grip, -1.0, 0.0, 0.0], [0.0, 0.0, grip, 1.0], [0.0, 0.0, grip, -1.0]]
    )
    parts, slopes = limits @ free, limits @ along
    part = np.clip(
        0.0,
        (-parts / slopes)[slopes > 0].max(initial=-np.inf),
        (-parts / slopes)[slopes < 0].min(initial=np.inf),
    )
    expected = free + part * along
    assert (limits @ expected > -1e-9).all()
    assert part != 0.0  # the least of all would leave the cones
    solution = mechc.loads(LADDER).simulate(set={"grip": grip}, estimate_error=False)
    assert np.abs(loads(solution) - expected[[0, 2]]).max() < 1e-9
    assert solution["held"][-1] == 1.0


CORNER = """
model Corner
  parameter px = 6 N;
  parameter pz = 3.5 N;
  coordinate Length x = 0 m;
  coordinate Length y = 0 m;
  coordinate Length z = 0 m;
  kinetic 1/2*(1 kg)*(der(x)^2 + der(y)^2 + der(z)^2);
  potential 1 kg*9.81 m/s^2*y;
  force -px on x;
  force pz on z;
  contact floor: y friction 0.4 along {%s};
  contact wall: x;
  output load[2] = {multiplier(floor), multiplier(wall)};
  experiment(stop = 0.05 s);
end Corner;
"""


ALONG_CORNERS = [
    "der(x), der(z)",
    "der(z), der(x)",
    "0.6*der(x) + 0.8*der(z), 0.8*der(x) - 0.6*der(z)",
    "0.8*der(x) - 0.6*der(z), 0.6*der(x) + 0.8*der(z)",
]
"""Whichever of two directions holds, a part of its force along the wall is undone by the other one, or by the wall."""


@pytest.mark.parametrize("along", ALONG_CORNERS)
def test_a_friction_along_a_wall_leaves_less_of_its_limit_across(along: str) -> None:
    """Floor and wall share px by halves, as far as the friction, which holds pz, is in its cone."""
    model = mechc.loads(CORNER % along)
    for px, pz in [(6.0, 3.5), (6.0, 0.0), (1.0, 3.9), (3.0, -3.5), (0.1, -3.9)]:
        solution = model.simulate(set={"px": px, "pz": pz}, estimate_error=False)
        friction = min(px / 2, np.sqrt((0.4 * 9.81) ** 2 - pz**2))
        assert loads(solution) == pytest.approx([9.81, px - friction], abs=1e-9)
        assert abs(solution["z"][-1]) < 1e-15


@pytest.mark.parametrize("along", ALONG_CORNERS)
def test_a_friction_along_a_wall_gives_way_when_no_share_holds_it(along: str) -> None:
    """Pushed along by 3.5 N and 10 N/s more, it slips at 3.924 N: neither before nor after."""
    solution = mechc.loads(
        (CORNER % along).replace("force pz on z", "force 3.5 N + 10 N/s*time on z")
    ).simulate(stop=0.1, estimate_error=False)
    assert solution.outcome.value == "completed"
    (slip,) = (e.time for e in solution.events if e.kind == "slip")
    assert slip == pytest.approx(0.0424, rel=1e-9)
    assert solution["z"][-1] == pytest.approx(10 * (0.1 - slip) ** 3 / 6, rel=1e-6)


@pytest.mark.parametrize("along", ALONG_CORNERS)
def test_what_slides_along_a_wall_presses_on_it_with_all_its_push(along: str) -> None:
    model = mechc.loads(CORNER % along)
    for pz in (5.0, -5.0):
        solution = model.simulate(set={"px": 6.0, "pz": pz}, estimate_error=False)
        assert loads(solution) == pytest.approx([9.81, 6.0], abs=1e-9)
        way = 0.5 * (5.0 - 0.4 * 9.81) * 0.05**2
        assert solution["z"][-1] == pytest.approx(np.copysign(way, pz), rel=1e-9)
        assert solution.statistics.steps < 100  # of a coordinate that rounding moves, the size is no rounding


GRASP = """
import mech.spatial.*;
model Grasp
  parameter Real d[3, 3] = %s;
  parameter Real s[3, 3] = %s;
  parameter Real t[3, 3] = %s;
  coordinate Length x[3] = {0, 0, 0} m;
  coordinate Rotation R = rotx(0 deg);
  gravity {0, 0, -9.81} m/s^2;
  frame ball = world * trans(x) * R;
  mass 2 kg at ball;
  inertia diag({0.1, 0.1, 0.1} kg.m^2) on ball;
  for i in 1:3 loop
    contact finger[i]: -(d[i, 1]*x[1] + d[i, 2]*x[2] + d[i, 3]*x[3]) friction 0.8 along {
      dot({s[i, 1], s[i, 2], s[i, 3]}, der(x) + 0.3 m*cross(der(R), {d[i, 1], d[i, 2], d[i, 3]})),
      dot({t[i, 1], t[i, 2], t[i, 3]}, der(x) + 0.3 m*cross(der(R), {d[i, 1], d[i, 2], d[i, 3]}))};
  end for;
  output load[3] = {multiplier(finger[i]) for i in 1:3};
  experiment(stop = 0.1 s);
end Grasp;
"""
"""A ball that lies in three fingers, which touch it in the directions d; s and t are tangents there."""


def test_three_fingers_under_a_ball_push_straight_up() -> None:
    low = np.radians(60.0)
    around = np.radians([10.0, 130.0, 250.0])
    d = np.stack(
        [np.cos(low) * np.cos(around), np.cos(low) * np.sin(around), np.full(3, -np.sin(low))], axis=1
    )
    s = np.stack([-np.sin(around), np.cos(around), np.zeros(3)], axis=1)
    t = np.cross(d, s)
    solution = mechc.loads(GRASP % (text_of(d), text_of(s), text_of(t))).simulate(estimate_error=False)
    # without friction WEIGHT/3/sin(low)
    assert np.abs(loads(solution) - WEIGHT / 3 * np.sin(low)).max() < 1e-9


QUADRUPED = """
import mech.spatial.*;
model Quadruped
  parameter Real side[4] = {1, 1, -1, -1};
  parameter Real fore[4] = {1, -1, -1, 1};
  gravity {0, 0, -9.81} m/s^2;
  coordinate Length x[3] = {0, 0, 0.4*cos(0.6 rad)} m;
  coordinate Rotation R = rotx(0 deg);
  coordinate Angle hip[4];
  coordinate Angle knee[4];
  frame trunk = world * trans(x) * R;
  mass 8 kg at trunk;
  inertia diag({0.1, 0.3, 0.3} kg.m^2) on trunk;
  frame thigh[i in 1:4] = trunk * trans({0.25 m*fore[i], 0.15 m*side[i], 0 m}) * roty(hip[i]);
  frame shank[i in 1:4] = thigh[i] * trans({0 m, 0 m, -0.2 m}) * roty(knee[i]);
  point foot[i in 1:4] = shank[i] * {0 m, 0 m, -0.2 m};
  for i in 1:4 loop
    drive hip[i] = 0.6 rad*fore[i];
    drive knee[i] = -1.2 rad*fore[i];
    mass 1 kg at shank[i];
    contact c[i]: pos(foot[i])[3] friction 0.7 along {vel(foot[i])[1], vel(foot[i])[2]};
  end for;
  output load[4] = {multiplier(c[i]) for i in 1:4};
  output lift[4] = {reaction(knee[i]) for i in 1:4};
  experiment(stop = 0.2 s);
end Quadruped;
"""


def test_a_quadruped_that_stands_carries_a_quarter_on_each_foot() -> None:
    """12 kg; the drive of a knee holds what its foot carries, 0.2 m*sin(0.6) away."""
    solution = mechc.loads(QUADRUPED).simulate(estimate_error=False)
    assert np.abs(loads(solution) - 29.43).max() < 1e-9
    moment = 0.2 * np.sin(0.6) * 29.43 * np.array([1.0, -1.0, -1.0, 1.0])
    assert np.abs(np.abs(loads(solution, "lift")) - np.abs(moment)).max() < 1e-9


SPUN = """
model Spun
  parameter w0 = 0 rad/s;
  parameter m = 2 kg;
  parameter Length foot[4, 2] = {{0.34, 0.2}, {-0.26, 0.2}, {-0.26, -0.2}, {0.34, -0.2}} m;
  coordinate Length x = 0 m;
  coordinate Length y = 0 m;
  coordinate Length z = 0 m;
  coordinate Angle a = 0 rad;
  coordinate Angle b = 0 rad;
  coordinate Angle c = 0 rad;
  initial der(x) = 1 m/s;
  initial der(c) = w0;
  kinetic 1/2*m*(der(x)^2 + der(y)^2 + der(z)^2) + 1/2*(0.05 kg.m^2)*(der(a)^2 + der(b)^2 + der(c)^2);
  potential m*9.81 m/s^2*z;
  for i in 1:4 loop
    contact leg[i]: z + foot[i, 2]*a - foot[i, 1]*b friction 0.2
      along {der(x) - (foot[i, 1]*sin(c) + foot[i, 2]*cos(c))*der(c), der(y) + (foot[i, 1]*cos(c) - foot[i, 2]*sin(c))*der(c)};
  end for;
  output load[4] = {multiplier(leg[i]) for i in 1:4};
  experiment(stop = 0.05 s);
end Spun;
"""


def test_a_table_that_slides_straight_shares_and_one_that_turns_has_the_loads_of_its_motion() -> None:
    model = mechc.loads(SPUN)
    feet = np.array([[0.34, 0.2], [-0.26, 0.2], [-0.26, -0.2], [0.34, -0.2]])
    rows = np.stack([np.ones(4), feet[:, 1], -feet[:, 0]])
    straight = model.simulate(estimate_error=False)
    found = loads(straight)
    # the tolerance turns the slip
    assert np.abs(found - np.linalg.pinv(rows) @ [WEIGHT, 0.0, 0.0]).max() < 1e-8
    assert abs(straight["x"][-1] - (0.05 - 0.2 * 9.81 * 0.05**2 / 2)) < 1e-9
    told = [remark for remark in straight.remarks if "rigid bodies" in remark]
    assert len(told) == 1
    assert "the least sum of squares is told" in told[0]
    assert "motion depends" not in told[0]
    closed = "output shut[4] = {if closed(leg[i]) then 0.5 else 0 for i in 1:4};\n  experiment"
    # what only asks whether it stands, tells no share
    model = mechc.loads(SPUN.replace("experiment", closed))
    assert "the least sum of squares is told" in model.simulate(estimate_error=False).remarks[0]
    turning = model.simulate(set={"w0": 3.0}, estimate_error=False)
    told = [remark for remark in turning.remarks if "rigid bodies" in remark]
    assert len(told) == 1
    assert told[0].endswith("the motion depends on this choice")
    assert "those that stand first" in told[0]


FELT = """
model Felt
  coordinate Length z = 0 m;
  coordinate Angle a = 0 rad;
  kinetic 1/2*(2 kg)*der(z)^2 + 1/2*(1 kg.m^2)*der(a)^2;
  potential 2 kg*9.81 m/s^2*z;
  contact left: z - 1 m*sin(a);
  contact middle: z;
  contact right: z + 1 m*sin(a);
  state Real felt = 0;
  equation der(felt) = multiplier(middle)/(1 N.s) - rate*felt;
  parameter rate = 1 s^-1;
  experiment(stop = 0.02 s);
end Felt;
"""
"""A state that follows a load which numbers find: neither an implicit method nor Taylor series has derivatives of that."""


def test_auto_does_without_a_jacobian_that_the_model_cannot_have() -> None:
    model = mechc.loads(FELT)
    for rate in (1.0, 3e5):  # not stiff, and stiff
        for chosen in (None, "auto"):
            found = model.simulate(set={"rate": rate}, estimate_error=False, method=chosen)
            assert found.statistics.method == "dop853"
            middle = 2 * 9.81 / 3
            expected = middle / rate * (1 - np.exp(-rate * 0.02))
            assert found["felt"][-1] == pytest.approx(expected, rel=1e-7)


def test_what_is_recommended_in_place_of_series_runs() -> None:
    with pytest.raises(mechc.SimulationError) as raised:
        mechc.loads(FELT).simulate(method="taylor")
    assert "radau5" not in (raised.value.help or "") and "'auto'" in (raised.value.help or "")

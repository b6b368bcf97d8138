"""Loads that rigid bodies do not determine: a note says which contacts share them, and which results are a choice.

The judge is a linear program over the equations of equilibrium: the least and the largest load of each leg.
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import linprog

import mechc

SAID = "rigid bodies do not determine"

PLATE = """
model Plate
  structural parameter Integer n = %d;
  parameter Length foot[n, 2] = %s m;
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
  experiment(stop = 0.05 s);
end Plate;
"""
"""A plate on legs; the mass is at the origin."""

FEET = {
    "three": [[0.2, 0.2], [-0.2, 0.2], [0.0, -0.2]],
    "four": [[0.25, 0.2], [-0.15, 0.2], [-0.15, -0.2], [0.25, -0.2]],
    "above a leg": [[-0.4, 0.0], [0.0, 0.0], [-0.4, -0.4], [0.0, -0.4]],
    "above an edge": [[0.2, 0.0], [-0.2, 0.0], [-0.2, 0.4], [0.2, 0.4]],
    "one leg alone": [[0.3, 0.0], [-0.3, 0.0], [-0.1, 0.0], [0.0, 0.5], [0.0, 0.6]],
    "six": [[x + 0.05, y - 0.03] for x in (-0.3, 0.0, 0.3) for y in (-0.2, 0.2)],
}


def plate(feet: list[list[float]]) -> mechc.Solution:
    rows = ", ".join(f"{{{x:g}, {y:g}}}" for x, y in feet)
    return mechc.loads(PLATE % (len(feet), f"{{{rows}}}")).simulate()


def undetermined(feet: list[list[float]]) -> list[int]:
    """Number the legs whose load the equations of equilibrium leave open, no load being negative."""
    places = np.array(feet).T
    equations, right = np.vstack([np.ones(len(feet)), places]), np.array([2 * 9.81, 0.0, 0.0])

    def end(k: int, sign: float) -> float:
        goal = sign * np.eye(len(feet))[k]
        return sign * float(linprog(goal, A_eq=equations, b_eq=right, bounds=(0, None)).fun)

    return [k + 1 for k in range(len(feet)) if end(k, -1.0) - end(k, 1.0) > 1e-6]


@pytest.mark.parametrize("feet", FEET.values(), ids=FEET)
def test_the_note_names_the_legs_whose_load_equilibrium_leaves_open(feet: list[list[float]]) -> None:
    solution = plate(feet)
    loads: NDArray[np.float64] = np.array([solution[f"load[{k + 1}]"][-1] for k in range(len(feet))])
    assert np.allclose([loads.sum(), *(np.array(feet).T @ loads)], [19.62, 0.0, 0.0], atol=1e-9)
    notes = [remark for remark in solution.remarks if SAID in remark]
    open_ = undetermined(feet)
    assert len(notes) == bool(open_)
    for k in range(1, len(feet) + 1):
        for note in notes:
            assert (f"'leg[{k}]'" in note) == (k in open_)
            assert (f"'load[{k}]'" in note) == (k in open_)
            assert "motion depends" not in note


def test_no_note_where_no_result_asks_for_the_shares() -> None:
    text = (PLATE % (4, "{{0.2, 0.2}, {-0.2, 0.2}, {-0.2, -0.2}, {0.2, -0.2}}")).splitlines()
    text = [line for line in text if "output" not in line]
    assert not any(SAID in remark for remark in mechc.loads("\n".join(text)).simulate().remarks)


SPUN = """
model Spun
  parameter w0 = 0 rad/s;
  parameter m = 2 kg;
  parameter Length foot[4, 2] = {{0.3, 0.2}, {-0.2, 0.2}, {-0.2, -0.2}, {0.3, -0.2}} m;
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
  experiment(stop = 0.05 s);
end Spun;
"""
"""A plate that slides on the floor: friction at each leg has the direction of its slip, and the size of its load."""


@pytest.mark.parametrize(("turns", "depends"), [(0.0, False), (3.0, True)])
def test_the_motion_depends_on_the_shares_where_a_table_slides_and_turns(turns: float, depends: bool) -> None:
    solution = mechc.loads(SPUN).simulate(set={"w0": turns})
    assert [
        remark.endswith("the motion depends on this choice") for remark in solution.remarks if SAID in remark
    ] == [True] * depends
    feet = np.array([[0.3, 0.2], [-0.2, 0.2], [-0.2, -0.2], [0.3, -0.2]])
    slips = np.array([1.0, 0.0]) + turns * np.stack([-feet[:, 1], feet[:, 0]], axis=1)
    friction = -slips / np.linalg.norm(slips, axis=1)[:, None]
    along = friction.T @ np.array([1.0, -1.0, 1.0, -1.0])  # what shares may differ by
    assert bool(np.abs(along).max() > 1e-6) is depends


def test_two_brakes_of_one_shaft_share_by_choice() -> None:
    solution = mechc.loads("""
model Brakes
  coordinate Angle q = 0 rad;
  kinetic 1/2*(2 kg.m^2)*der(q)^2;
  potential -3 N.m*q;
  friction first: 5 N.m on der(q);
  friction second: 5 N.m on der(q);
  output one = multiplier(first);
  output both = multiplier(first) + multiplier(second);
  experiment(stop = 0.1 s);
end Brakes;
""").simulate()
    (note,) = [remark for remark in solution.remarks if SAID in remark]
    assert "'first' and 'second'" in note
    assert "'one'" in note
    assert "'both'" not in note
    assert abs(abs(solution["both"][-1]) - 3.0) < 1e-9


def test_two_stops_of_one_door_share_by_choice_and_their_moment_is_none() -> None:
    solution = mechc.loads("""
model Door
  coordinate Angle q = 0 rad;
  kinetic 1/2*(2 kg.m^2)*der(q)^2;
  potential 3 N.m*q;
  contact inner: q*1 m;
  contact outer: q*2 m;
  output force = multiplier(inner);
  output touches = if closed(outer) then 1 else 0;
  output moment = multiplier(inner)*1 m + multiplier(outer)*2 m;
  experiment(stop = 0.1 s);
end Door;
""").simulate()
    (note,) = [remark for remark in solution.remarks if SAID in remark]
    assert "'inner' and 'outer' share" in note
    assert "'force' is one choice" in note
    assert "'moment'" not in note
    assert solution["touches"][-1] == 1.0  # both touch, whichever holds
    # springs of equal stiffness: as far as they are from the hinge
    assert abs(solution["force"][-1] - 0.6) < 1e-9
    assert abs(solution["moment"][-1] - 3.0) < 1e-9


LADDER = """
model Ladder
  parameter grip = 0.8;
  coordinate Length x = 1 m;
  coordinate Length y = 1.5 m;
  coordinate Angle a = 0 rad;
  kinetic 1/2*(10 kg)*(der(x)^2 + der(y)^2) + 1/2*(3 kg.m^2)*der(a)^2;
  potential 10 kg*9.81 m/s^2*y;
  contact floor: y - 1.5 m*cos(a) + 1 m*sin(a) friction 0.8 along der(x) - (1 m*sin(a) - 1.5 m*cos(a))*der(a);
  contact wall: x - 1 m*cos(a) - 1.5 m*sin(a) %s;
  output press = multiplier(wall);
  experiment(stop = 0.05 s);
end Ladder;
"""


@pytest.mark.parametrize(
    ("wall", "open_"),
    [("friction grip along der(y) - (1 m*cos(a) + 1.5 m*sin(a))*der(a)", True), ("", False)],
)
def test_a_ladder_is_a_choice_where_the_wall_is_rough_too(wall: str, open_: bool) -> None:
    solution = mechc.loads(LADDER % wall).simulate()
    press, weight = solution["press"][-1], 98.1
    # moments about the foot: the weight at 1 m, the wall's force at 3 m, its friction (within its cone) at 2 m
    least = weight / (3.0 + 2.0 * 0.8)
    assert (least - 1e-9 <= press <= weight / 3.0 + 1e-9) if open_ else abs(press - weight / 3.0) < 1e-9
    notes = [remark for remark in solution.remarks if SAID in remark]
    assert len(notes) == open_
    assert all("'floor' and 'wall' share" in note and "'press' is one choice" in note for note in notes)


def test_frictions_that_carry_nothing_share_nothing() -> None:
    solution = mechc.loads("""
model Block
  coordinate Length x = 0 m;
  coordinate Length y = 1.02 m;
  coordinate Angle a = 0.01 rad;
  kinetic 1/2*(2 kg)*(der(x)^2 + der(y)^2) + 1/2*(3 kg.m^2)*der(a)^2;
  potential 2 kg*9.81 m/s^2*y;
  initial der(y) = -0.2 m/s;
  contact left: y - 1 m*cos(a) - 1 m*sin(a) friction 10 along der(x) + (1 m*cos(a) + 1 m*sin(a))*der(a);
  contact right: y - 1 m*cos(a) + 1 m*sin(a) friction 10 along der(x) + (1 m*cos(a) - 1 m*sin(a))*der(a);
  output press = multiplier(left);
  experiment(stop = 4 s);
end Block;
""").simulate(estimate_error=False)
    assert abs(solution["press"][-1] - 9.81) < 1e-6
    assert not any(SAID in remark for remark in solution.remarks)


TABLE = """
import mech.spatial.*;
model Table
  parameter m = 2 kg;
  parameter Length foot[4, 3] = {{0.2, 0.15, -0.1}, {-0.2, 0.15, -0.1}, {-0.2, -0.15, -0.1}, {0.2, -0.15, -0.1}} m;
  gravity {0, 0, -9.81} m/s^2;
  coordinate Length x = 0 m;
  coordinate Length y = 0 m;
  coordinate Length z = 0.1 m;
  coordinate Rotation R = rotx(0 deg)*roty(0 deg);
  initial der(x) = 0 m/s;
  frame box = world * trans({x, y, z}) * R;
  mass m at box;
  inertia diag({0.02, 0.03, 0.04} kg.m^2) on box;
  for i in 1:4 loop
    contact leg[i]: pos(box * {foot[i, 1], foot[i, 2], foot[i, 3]})[3] friction 0.6
      along {vel(box * {foot[i, 1], foot[i, 2], foot[i, 3]})[1], vel(box * {foot[i, 1], foot[i, 2], foot[i, 3]})[2]};
  end for;
  output load[4] = {multiplier(leg[i]) for i in 1:4};
  experiment(stop = 4 s);
end Table;
"""


def test_nothing_happens_to_a_table_that_rests_on_rough_legs() -> None:
    """One component of a friction held alone, the other one followed from it: its rounding was taken for the end of sticking."""
    solution = mechc.loads(TABLE).simulate(estimate_error=False)
    assert [event.kind for event in solution.events] == []
    assert abs(sum(solution[f"load[{i}]"][-1] for i in range(1, 5)) - 19.62) < 1e-9
    assert max(abs(solution[name]).max() for name in ("x", "y", "der(x)", "der(y)", "der(z)")) < 1e-12
    assert any(
        "'leg[1]', 'leg[2]', 'leg[3]' and 'leg[4]' share their load" in note for note in solution.remarks
    )


HINGED = """
gravity {0, -9.81} m/s^2;
coordinate Length x = 0.5 m;
coordinate Length y = 0 m;
coordinate Angle a = 0 deg;
frame bar = world * trans({x, y}) * rot(a);
mass 2 kg at bar;
inertia 0.2 kg.m^2 on bar;
constraint hinge: bar * {-0.5, 0} m = {0, 0} m;
point tip = bar * {0.5, 0} m;
contact floor: tip[2] + 0.3 m friction 0.4 along vel(tip)[1];
output H = multiplier(hinge);
output F = {multiplier(floor.friction), multiplier(floor)};
experiment(stop = 1 s);
"""


@pytest.mark.parametrize("method", ["dop853", "moreau"])
def test_what_a_hinge_is_told_to_carry_balances_the_share_of_the_floor(method: str) -> None:
    """Before, the hinge was told to carry what it does in the modes, where the friction carries nothing: 0.9 N were missing."""
    step = 1e-4 if method == "moreau" else None
    solution = mechc.loads(HINGED).simulate(method=method, step=step, estimate_error=False)
    hinge, floor = (np.array([solution[f"{c}[{k}]"][-1] for k in (1, 2)]) for c in "HF")
    assert abs(floor[0]) > 1
    assert hinge + floor == pytest.approx([0, 2 * 9.81], abs=1e-9)
    angle = solution["a"][-1]
    moment = np.cos(angle) * (floor[1] - 2 * 9.81 / 2) - np.sin(angle) * floor[0]
    assert moment == pytest.approx(0, abs=1e-9)

"""Small motions of what sticks, is closed or engaged: the systems with that held, against formulas by hand."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechc
from mechc.runtime.outcome import SimulationError
from mechc.runtime.studies.kinds.equilibria import FoundEquilibria
from mechc.runtime.studies.kinds.linearize import Linearization
from mechc.runtime.studies.kinds.modes import FoundModes

CLUTCH = """
model Clutch
  parameter F = 50 N.m;
  coordinate Angle p1 = 0 rad;
  coordinate Angle p2 = 0 rad;
  coordinate Angle p3 = 0 rad;
  kinetic 1/2*(1 kg.m^2)*(der(p1)^2 + der(p2)^2 + 10*der(p3)^2);
  potential 1/2*(1000 N.m)*(p3 - p2)^2;
  friction F on p2 - p1;
  experiment(stop = 2 s);
end Clutch;
"""


def linear(text: str, **settings: Any) -> Linearization:
    found = mechc.loads(text).study("linearize", **settings)
    assert isinstance(found, Linearization)
    return found


def modes(text: str, **settings: Any) -> FoundModes:
    found = mechc.loads(text).study("modes", **settings)
    assert isinstance(found, FoundModes)
    return found


def moving(found: FoundModes) -> list[float]:
    return [float(w) for w in found.frequencies if w > 1e-5]


def held(found: Linearization | FoundModes) -> str:
    return next(remark for remark in found.remarks if remark.startswith("held here"))


def test_a_clutch_that_sticks() -> None:
    """sqrt(k (1/(J1 + J2) + 1/J3)) = sqrt(600), as one shaft; the friction is named."""
    found = modes(CLUTCH)
    assert moving(found) == pytest.approx([np.sqrt(600)], rel=1e-13)
    shape = found.shapes[:, -1] / found.shapes[0, -1]
    np.testing.assert_allclose(shape, [1, 1, -0.2], atol=1e-12)
    assert "'friction[1]' sticks" in held(found)
    system = linear(CLUTCH)
    assert len(system.states) == 4 and "'friction[1]' sticks" in held(system)
    assert np.sort(abs(system.poles))[-2:] == pytest.approx([np.sqrt(600)] * 2, rel=1e-12)
    assert len(linear(CLUTCH, at="equilibrium").states) == 4


def test_a_clutch_that_turns_as_a_whole() -> None:
    turning = linear(CLUTCH, at="der(p1) = 3, der(p2) = 3, der(p3) = 3")
    assert len(turning.states) == 4
    assert np.sort(abs(turning.poles))[-2:] == pytest.approx([np.sqrt(600)] * 2, rel=1e-12)


def test_at_its_limit_friction_holds_on_one_side_only() -> None:
    """The springs ask for 100 N.m (1 + 1/1)^-1 each: 50 N.m of the friction between p1 and p2, which is all of it."""
    with pytest.raises(SimulationError, match=r"'friction\[1\]' (sticks at its limit|begins to slide)"):
        linear(CLUTCH, at="p3 = 0.1", set={"F": "50 N.m"})


def test_a_mass_that_is_pressed_against_a_wall() -> None:
    """The first mass presses, the second swings on its spring: sqrt(k/m2)."""
    text = """
    coordinate Length a = 0 m;
    coordinate Length b = {b} m;
    kinetic 1/2*(2 kg)*der(a)^2 + 1/2*(3 kg)*der(b)^2;
    potential 1/2*(75 N/m)*(b - a - 1 m)^2;
    force -{push} N on b;
    force -{push} N on a;
    contact wall: a;
    """
    found = modes(text.format(b=1 - 15 / 75, push=15))
    assert moving(found) == pytest.approx([5], rel=1e-12)
    assert "the contact 'wall' is closed" in held(found)
    with pytest.raises(SimulationError, match="nothing presses it"):
        modes(text.format(b=1, push=0))


def test_a_constraint_that_is_engaged() -> None:
    """Held at the start, released later: m1 + m2 on the spring together."""
    text = """
    coordinate Length a = 0 m;
    coordinate Length b = 0.5 m;
    kinetic 1/2*(2 kg)*der(a)^2 + 1/2*(3 kg)*der(b)^2;
    potential 1/2*(125 N/m)*a^2;
    constraint latch: b - a = 0.5 m;
    when time > 1 s then release latch; end when;
    experiment(stop = 2 s);
    """
    found = modes(text)
    assert moving(found) == pytest.approx([5], rel=1e-12)
    assert "'latch' holds" in held(found)


@pytest.mark.parametrize("law", ["20 N on x;\n friction 20 N on y", "20 N along {der(x), der(y)}"])
def test_a_block_that_sticks_with_a_pendulum_on_it(law: str) -> None:
    """A block in two directions that friction holds, a bob on a rod below it: sqrt(g/l)."""
    text = f"""
    coordinate Length x = 0 m;
    coordinate Length y = 0 m;
    coordinate Angle a = 0 rad;
    kinetic 1/2*(5 kg)*(der(x)^2 + der(y)^2)
      + 1/2*(1 kg)*(der(y)^2 + (der(x) + 2 m*cos(a)*der(a))^2 + (2 m*sin(a)*der(a))^2);
    potential -(9.81 N)*(2 m)*cos(a);
    friction {law if "on x" in law else ""};
    """
    if "along" in law:
        text = text.replace("friction ;", "").replace(
            "potential", "coordinate Length z = 0 m; kinetic 1/2*(1 kg)*der(z)^2; force -50 N on z;"
            "contact floor: z friction 0.4 along {der(x), der(y)}; potential",
        )  # fmt: skip
    found = modes(text)
    assert moving(found) == pytest.approx([np.sqrt(9.81 / 2)], rel=1e-12)
    assert "sticks" in held(found)
    assert len(linear(text).states) == 2


def test_a_wheel_that_rolls_on_its_contact() -> None:
    """Pressed on the ground by its weight, it rolls where friction sticks: sqrt(k/(m + J/r^2))."""
    text = """
    coordinate Length s = 0 m;
    coordinate Length h = 0.5 m;
    coordinate Angle a = 0 rad;
    kinetic 1/2*(2 kg)*(der(s)^2 + der(h)^2) + 1/2*(0.25 kg.m^2)*der(a)^2;
    potential (2 kg)*(9.81 m/s^2)*h + 1/2*(75 N/m)*s^2;
    contact floor: h - 0.5 m friction 0.5 along der(s) + (0.5 m)*der(a);
    """
    found = modes(text)
    assert moving(found) == pytest.approx([5], rel=1e-12)
    np.testing.assert_allclose(found.shapes[:, -1] / found.shapes[0, -1], [1, 0, -2], atol=1e-12)
    assert "'floor' is closed" in held(found) and "'floor' sticks" in held(found)


def test_bearings_with_friction_in_a_chain() -> None:
    """Of two hinges one sticks: a rigid body that swings on the spring of the other; friction given twice is held once."""
    text = """
    import mech.planar.*;
    Bar upper(m = 1 kg, l = 1 m);
    Bar lower(m = 1 kg, l = 1 m);
    Revolute first(world -> upper.a, angle = 0 rad);
    Revolute second(upper.b -> lower.a, angle = 0 rad);
    potential 1/2*(24 N.m)*first.angle^2;
    friction 5 N.m on second.angle;
    friction 3 N.m on second.angle;
    """
    found = modes(text)
    assert moving(found) == pytest.approx([3], rel=1e-12)  # 24/(2^2 * 2/3)


def test_what_sticks_to_a_driven_belt_moves_with_it() -> None:
    """x = b + const: one to one, and the force on the belt m s^2."""
    text = """
    input Length y(interpolation = "spline") = 0 m;
    coordinate Length b; drive b = y;
    coordinate Length x = 0 m;
    kinetic 1/2*(2 kg)*der(x)^2 + 1/2*(1 kg)*der(b)^2;
    friction 5 N on x - b;
    output place = x;
    output push = reaction(b);
    """
    found = linear(text)
    assert not found.states
    np.testing.assert_allclose(
        [found.D[:, 0], found.D1[:, 0], found.D2[:, 0]], [[1, 0], [0, 0], [0, 3]], atol=1e-13
    )


def test_equilibria_beside_a_closed_contact() -> None:
    """A rod on a hinge, beside a mass that lies on the ground: eigenvalues are those of the rod."""
    found = mechc.loads("""
    coordinate Length h(min = -1 m, max = 1 m) = 0 m;
    coordinate Angle a = 0.1 rad;
    kinetic 1/2*(1 kg)*der(h)^2 + 1/2*(1 kg.m^2)*der(a)^2;
    potential (1 kg)*(9.81 m/s^2)*h - (4 N.m)*cos(a);
    contact ground: h;
    """).study("equilibria", guesses=8)
    assert isinstance(found, FoundEquilibria)
    told = {round(e["values"]["a"], 6): e for e in found.equilibria}
    assert told[0.0]["stable"] and np.sort(np.abs(told[0.0]["eigenvalues"]).sum(axis=1)) == pytest.approx(
        [2, 2]
    )
    assert told[round(np.pi, 6)]["stable"] is False
    assert any("'ground' is closed" in remark for remark in found.remarks)


def test_a_box_on_two_feet_with_a_pendulum() -> None:
    """More holds than the box has freedoms; what is left is the bar on its pin: sqrt(3 g/(2 l))."""
    found = modes("""
    import mech.planar.*;
    gravity {0, -9.81} m/s^2;
    Body box(m = 2 kg, J = 0.1 kg.m^2);
    Free j(world -> box.a, x = 0 m, y = 0.2 m);
    point left = box.a * {-0.3 m, -0.2 m};
    point right = box.a * {0.3 m, -0.2 m};
    contact l: pos(left)[2] friction 0.5 along vel(left)[1];
    contact r: pos(right)[2] friction 0.5 along vel(right)[1];
    Bar b(m = 1 kg, l = 1 m);
    Revolute pin(box.a -> b.a, angle = -90 deg);
    """)
    assert moving(found) == pytest.approx([np.sqrt(1.5 * 9.81)], rel=1e-12)
    assert "'l' is closed" in held(found) and "'r' is closed" in held(found)


def test_friction_that_holds_beside_states_of_first_order() -> None:
    """The velocities that are independent are chosen among velocities alone; before, states were counted with them."""
    model = mechc.load(Path(__file__).parents[2] / "examples" / "drive_train.mech")
    with pytest.raises(SimulationError, match="holds 'DriveTrain' at rest"):
        model.study("linearize", at="equilibrium")

"""Models as people compose them: names of names, and parts with a root and a tip, in loops."""

from __future__ import annotations

import numpy as np
import pytest

import mechc

PARTS = """
model Strut "two bodies and a slider between them that holds its length"
  frame from;
  frame to;
  Body barrel(m = 1 kg, J = 0.1 kg.m^2);
  Body rod(m = 1 kg, J = 0.1 kg.m^2);
  Revolute foot(from -> barrel.a, angle ~ 90 deg);
  Prismatic slide(barrel.a -> rod.a, position ~ 1 m);
  Revolute eye(rod.a -> to);
  drive slide.position = 1 m;
end Strut;

model Arm
  Bar bar(m = 10 kg, l = 2 m);
  frame root = bar.a;
  frame middle = bar.c;
  frame places[2] = {bar.b, bar.c};
end Arm;

model Whole
  Arm arm;
  frame base = arm.root;
  frame grip = arm.middle;
end Whole;
"""

SITE = """
  gravity {0, -9.81} m/s^2;
  Whole p;
  Revolute A(world -> p.base);
  frame near = p.grip;
  frame far = near;
  frame farther = far;
  frame ground = world * trans({1, -1} m);
"""


def solved(text: str) -> mechc.Solution:
    solution = mechc.loads(text).simulate(estimate_error=False, target="python")
    assert isinstance(solution, mechc.Solution)
    assert solution.outcome.value == "completed", solution.message
    return solution


def propped(statements: str) -> str:
    return f"import mech.planar.*; {PARTS} model Propped {SITE} {statements} experiment(stop = 1 s); end Propped;"


@pytest.mark.parametrize(
    "end", ["p.arm.bar.c", "p.arm.places[2]", "p.arm.middle", "p.grip", "near", "farther"]
)
def test_a_prop_carries_a_bar_whatever_its_end_is_called(end: str) -> None:
    """A bar on a hinge, propped under its middle: all its weight is on the prop."""
    solution = solved(
        propped(f"Strut s(from = ground, to = {end}); output e = reaction(s.eye); output h = reaction(A);")
    )
    assert [solution["e[1]"][-1], solution["e[2]"][-1]] == pytest.approx([0, 98.1], abs=1e-12)
    assert [solution["h[1]"][-1], solution["h[2]"][-1]] == pytest.approx([0, 0], abs=1e-12)


def test_friction_follows_the_force_in_a_joint_that_leads_to_a_name_of_a_name() -> None:
    """The prop's bearing force N brakes a wheel: w = w0 - r N t/J. Of one run, and of several at once."""
    model = mechc.loads(
        propped(
            "Strut s(ground -> farther); Body wheel(m = 1 kg, J = 0.2 kg.m^2); Revolute axle(world -> wheel.a, der(angle) = 10 rad/s); "
            "parameter r = 4 mm; friction brake: r*norm(reaction(s.eye)) on axle.angle; output w = der(axle.angle);"
        )
    )
    solution = model.simulate(estimate_error=False)
    assert isinstance(solution, mechc.Solution)
    assert solution["w"][-1] == pytest.approx(10 - 4e-3 * 98.1 / 0.2, rel=1e-9)
    runs = model.ensemble({"r": [0.0, 0.004, 0.01]}, "final(w)", errors="none")
    assert runs["final(w)"] == pytest.approx(10 - np.array([0.0, 0.004, 0.01]) * 98.1 / 0.2, rel=1e-9)

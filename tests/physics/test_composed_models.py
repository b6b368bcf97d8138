"""Models as people compose them: names of names, parts with a root and a tip, connections by value, all in loops."""

from __future__ import annotations

import numpy as np
import pytest
from composed_loops import composed_loop, forces_at_rest, unbalanced

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
    solution = mechc.loads(text).simulate(estimate_error=False)
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


@pytest.mark.parametrize(
    ("size", "seed"),
    [
        *((2, seed) for seed in range(4)),
        (3, 3),
        *(pytest.param(2, seed, marks=pytest.mark.slow) for seed in range(4, 60)),
        *(pytest.param(3, seed, marks=pytest.mark.slow) for seed in range(6, 20)),
    ],
)
def test_random_loops_obey_newton_and_euler(size: int, seed: int) -> None:
    """Force and moment in each joint, from the laws of all bodies with all forces as unknowns.

    Systems whose condition is below 1e4 lose less than four of sixteen digits.
    """
    loop = composed_loop(seed, size)
    expected, condition = forces_at_rest(loop)
    assert condition < 1e4
    solution = solved(loop.text)
    for j, wrench in enumerate(expected):
        force = [solution[f"F{j}[{k + 1}]"][0] for k in range(size)]
        moment = [solution[f"M{j}"][0]] if size == 2 else [solution[f"M{j}[{k + 1}]"][0] for k in range(3)]
        wanted = np.hstack([wrench[:size], wrench[5:] if size == 2 else wrench[3:]])
        assert np.hstack([force, moment]) == pytest.approx(wanted, rel=1e-10, abs=1e-10), f"joint {j}"


@pytest.mark.parametrize(
    ("size", "seed"),
    [
        *((2, seed) for seed in (0, 1)),
        *(pytest.param(2, seed, marks=pytest.mark.slow) for seed in (3, *range(5, 20))),
        *(pytest.param(3, seed, marks=pytest.mark.slow) for seed in range(10)),
    ],
)
def test_random_loops_in_motion_are_balanced(size: int, seed: int) -> None:
    """Of each body at all times: mass times acceleration, and the rate of its spin, are the forces in its joints and its
    weight. What is left is rounding, of loops that come near dead centres some thousand times that of one operation."""
    loop = composed_loop(seed, size, stop=0.2)
    assert unbalanced(loop, solved(loop.text)) < 1e-11


# ---------------------------------------------------------------- connections by value


def test_a_connection_by_value_holds_in_a_loop() -> None:
    """Two bars, connected into one, between two hinges: nothing moves, each hinge carries half the weight."""
    solution = solved(
        "import mech.planar.*; model Held gravity {0, -9.81} m/s^2; Bar p(m = 1 kg, l = 0.5 m); "
        "Bar q(m = 1 kg, l = 0.5 m, a = p.b); Revolute hp(world -> p.a); Revolute hq(world * trans({1, 0} m) -> q.b); "
        "output gap = pos(q.a) - pos(p.b); output f = reaction(hp)[2]; output g = reaction(hq)[2]; experiment(stop = 1 s); end Held;"
    )
    assert [solution["gap[1]"][-1], solution["gap[2]"][-1]] == pytest.approx([0, 0], abs=1e-12)
    assert [solution["f"][-1], solution["g"][-1]] == pytest.approx([9.81, 9.81], rel=1e-9)


def test_a_part_with_its_own_root_stands_in_a_loop() -> None:
    """Two bars that lean on each other: the force at the top from the moments about both feet."""
    solution = solved(
        "import mech.planar.*; model Trestle gravity {0, -9.81} m/s^2; frame root; Bar bar(m = 10 kg, l = 2 m, a = root); "
        "Revolute A(world -> root, angle ~ 30 deg); Bar c(m = 1 kg, l = 2 m); Revolute K(world * trans({2 m, 0 m}) -> c.a, angle ~ 150 deg); "
        "Revolute t(bar.b -> c.b); output f = reaction(A); experiment(stop = 1 s); end Trestle;"
    )
    g, top, other = 9.81, np.array([1, 3**0.5]), np.array([-1, 3**0.5])
    # of the bar: top x F = 10 g/2; of the other one, on which -F acts: other x -F = -1 g/2
    F = np.linalg.solve([[-top[1], top[0]], [other[1], -other[0]]], [10 * g / 2, -g / 2])
    assert [solution["f[1]"][-1], solution["f[2]"][-1]] == pytest.approx([-F[0], 10 * g - F[1]], rel=1e-10)


CONNECTED = (
    "import mech.{space}.*; model Ring gravity {{{down}}} m/s^2; Bar p(m = 1 kg, l = 1 m, a = q.b * {turn}(180 deg)); "
    "Bar q(m = 1 kg, l = 1 m, a = p.b * {turn}({angle})); Revolute h(world -> p.a{axis}, angle = 10 deg); "
    "experiment(stop = 1 s, tolerance = 1e-10); end Ring;"
)
SPACES = {
    "planar": {"space": "planar", "down": "0, -9.81", "turn": "rot", "axis": ""},
    "spatial": {"space": "spatial", "down": "0, -9.81, 0", "turn": "rotz", "axis": ", axis = {0, 0, 1}"},
}


@pytest.mark.parametrize("space", SPACES)
def test_connections_that_form_a_loop_among_themselves(space: str) -> None:
    """Two bars, each connected to the other's end: what fits repeats itself, what does not is refused."""
    model = mechc.loads(CONNECTED.format(**SPACES[space], angle="180 deg"))
    assert [d.code for d in model.diagnostics] == ["W0513"]
    swing = model.simulate(estimate_error=False)
    # p and q lie on each other: m l^2/12 + m l^2/4 each, so l_eff = 2/3 m
    assert isinstance(swing, mechc.Solution)
    w2 = 2 * 9.81 / (2 / 3) * (np.sin(np.radians(10)) - np.sin(swing["h.angle"]))
    assert swing["der(h.angle)"] ** 2 == pytest.approx(w2, abs=1e-7)
    for angle, words in (("170 deg", "is off by|do not reach"), ("0 deg", "half a turn apart")):
        with pytest.raises(mechc.CompileError, match=words):
            mechc.loads(CONNECTED.format(**SPACES[space], angle=angle)).simulate()


HINGE = "model Hinge frame from; frame to; coordinate Angle angle ~ 0 rad; place to = from * rot(angle); {closure} end Hinge;"


@pytest.mark.parametrize("closure", ["", "closure angle = heading(to) - heading(from);"])
def test_a_joint_that_holds_nothing_in_a_loop_is_refused(closure: str) -> None:
    with pytest.raises(mechc.CompileError, match="does not say what holds there"):
        mechc.loads(
            f"import mech.planar.*; {HINGE.format(closure=closure)} model M gravity {{0, -9.81}} m/s^2; Bar bar; Hinge A(world -> bar.a); "
            "Hinge B(world * trans({1, 0} m) -> bar.b); experiment(stop = 1 s); end M;"
        )

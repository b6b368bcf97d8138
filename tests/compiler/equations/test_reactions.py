"""Reactions of tree joints, however the joint reaches what it carries."""

from __future__ import annotations

import numpy as np
import pytest

import mechc

PLANE = "import mech.planar.*;\ngravity {1, -9} m/s^2;\nBody body(m = 2 kg, J = 0.3 kg.m^2, com = {0.4, -0.1} m);\n"
SPACE = (
    "import mech.spatial.*;\ngravity {1, -9, 4} m/s^2;\n"
    "Body body(m = 2 kg, J = diag({0.3, 0.4, 0.5} kg.m^2), com = {0.4, -0.1, 0.2} m);\n"
)
ASKED = "output F = reaction(hinge);\noutput M = moment(hinge);\n"


def outputs(text: str) -> np.ndarray:
    """The last values of force and moment, after half a second from rest."""
    solution = mechc.loads(text).simulate(stop=0.5, tolerance=1e-11, estimate_error=False)
    assert isinstance(solution, mechc.Solution)
    names = [n for n in solution if n.split("[")[0] in ("F", "M")]
    return np.array([solution[n][-1] for n in sorted(names)])


@pytest.mark.parametrize(
    ("bodies", "pose", "inverse"),
    [
        (PLANE, "trans({0.1, 0.2} m) * rot(30 deg)", "rot(-30 deg) * trans({-0.1, -0.2} m)"),
        (SPACE, "trans({0.1, 0.2, 0.3} m) * rotx(30 deg)", "rotx(-30 deg) * trans({-0.1, -0.2, -0.3} m)"),
    ],
)
def test_reaction_at_a_derived_frame(bodies: str, pose: str, inverse: str) -> None:
    """The hinge sits at a place of the body, or the body's frame is given from the place of the hinge."""
    derived = outputs(f"{bodies}Revolute hinge(world -> body.a * {pose});\n{ASKED}")
    seat = f"frame seat;\nRevolute hinge(world -> seat);\n{ASKED}"
    plain = outputs(bodies.replace("Body body(", f"Body body(a = seat * {inverse}, ") + seat)
    assert np.max(np.abs(plain)) > 1
    assert derived == pytest.approx(plain, abs=1e-9)


@pytest.mark.parametrize("bodies", [PLANE, SPACE])
def test_reaction_of_a_joint_declared_the_other_way_round(bodies: str) -> None:
    """From the body to the world: the force on the world is minus the one on the body."""
    forwards = outputs(f"{bodies}Revolute hinge(world -> body.a);\n{ASKED}")
    backwards = outputs(f"{bodies}Revolute hinge(body.a -> world);\n{ASKED}")
    assert np.max(np.abs(forwards)) > 1
    assert backwards == pytest.approx(-forwards, abs=1e-9)


FORMULAS = """
let tip = body.a*ARM;
let reach = norm(pos(tip) - PLACE);
potential 1/2*7 N/m*reach^2;
dissipation 1/2*0.5 N.s/m*der(reach)^2;
kinetic 1/2*0.3 kg*(1 + (pos(tip)[1]/(2 m))^2)*der(reach)^2;
lagrangian 0.2 N.s/m*pos(tip)[2]*vel(tip)[1];
damping 0.3 N.s/m on pos(tip)[2];
Spring line(world*trans(PLACE) -> body.a*trans(ARM), k = 5 N/m, rest = 1 m);
Damper oil(world*trans(PLACE) -> body.a*trans(ARM), c = 0.4 N.s/m);
"""


@pytest.mark.parametrize(
    ("bodies", "joint"),
    [
        *((PLANE, joint) for joint in ("Revolute", "Prismatic", "PinSlot", "Weld")),
        *((SPACE, joint) for joint in ("Revolute", "Prismatic", "Cylindrical", "Universal", "Spherical")),
    ],
)
def test_reaction_under_energies_written_as_formulas(bodies: str, joint: str) -> None:
    """The joint closes a loop with one that is free, so that its own multipliers are the reaction."""
    arm, place = ("{0.3, 0.2}", "{3, 4}") if bodies is PLANE else ("{0.3, 0.2, -0.5}", "{3, 4, 1}")
    text = bodies + FORMULAS.replace("ARM", f"{arm} m").replace("PLACE", f"{place} m") + ASKED
    moving = "" if joint != "Weld" else "coordinate Length k = 1 m; kinetic 1/2*1 kg*der(k)^2;\n"
    in_the_tree = outputs(f"{text}{moving}{joint} hinge(world -> body.a);\n")
    of_a_loop = outputs(f"{text}{moving}Free free(world -> body.a);\n{joint} hinge(world -> body.a);\n")
    assert np.max(np.abs(of_a_loop)) > 1
    # the loop is held to some 1e-11, and drifts within that
    assert in_the_tree == pytest.approx(of_a_loop, abs=1e-8)


LOADED = {
    "force": "force 3 FORCE on hinge.Q;",
    "law": "force -4 FORCE*sin(hinge.Q/(1 STEP) + 1) on hinge.Q;",
    "damping": "damping 0.7 DAMPING on hinge.Q;",
    "dissipation": "dissipation 1/2*0.7 DAMPING*der(hinge.Q)^2;",
    "potential": "potential 1/2*5 STIFFNESS*(hinge.Q - 1 STEP)^2;",
    "kinetic": "kinetic 1/2*0.4 INERTIA*(1 + (hinge.Q/(1 STEP))^2)*der(hinge.Q)^2;",
    "lagrangian": "lagrangian 0.2 DAMPING*hinge.Q*der(hinge.Q)*cos(time/(1 s)) + 3 FORCE*hinge.Q;",
    "friction": "friction 0.2 FORCE on hinge.Q;",
    "regularized": 'friction 0.2 FORCE on hinge.Q, law = "regularized", v_stick = 0.1 STEP/s;',
    "coupling": "coordinate Real z = 0; kinetic 1/2*2 kg.m^2*der(z)^2; constraint hinge.Q = z*1 STEP;",
    "drive": "MOVE hinge.Q = 1 STEP*sin(time/(1 s));",
}
UNITS = {
    "Revolute": {
        "Q": "angle",
        "FORCE": "N.m",
        "STEP": "rad",
        "STIFFNESS": "N.m/rad",
        "DAMPING": "N.m.s/rad",
        "INERTIA": "kg.m^2",
    },
    "Prismatic": {
        "Q": "position",
        "FORCE": "N",
        "STEP": "m",
        "STIFFNESS": "N/m",
        "DAMPING": "N.s/m",
        "INERTIA": "kg",
    },
}


@pytest.mark.parametrize("load", LOADED)
@pytest.mark.parametrize("joint", UNITS)
@pytest.mark.parametrize("bodies", [PLANE, SPACE], ids=["plane", "space"])
def test_what_acts_on_the_coordinate_of_a_joint_is_part_of_its_load(
    bodies: str, joint: str, load: str
) -> None:
    """In the tree the load is the inertia of what the joint carries, in a loop it is a sum of forces."""
    text = f"{bodies}{LOADED[load]}\n{ASKED}"
    for word, unit in UNITS[joint].items():
        text = text.replace(word, unit)
    in_the_tree = outputs(f"{text.replace('MOVE', 'drive')}{joint} hinge(world -> body.a);\n")
    free = f"Free free(world -> body.a);\ncut {joint} hinge(world -> body.a);\n"
    of_a_loop = outputs(f"{text.replace('MOVE', 'constraint')}{free}")
    assert np.max(np.abs(of_a_loop)) > 1
    # the loop is held to some 1e-11, and drifts within that
    assert in_the_tree == pytest.approx(of_a_loop, abs=1e-8)


@pytest.mark.parametrize(("sides", "sign"), [("world -> fore.a", 1), ("fore.a -> world", -1)])
@pytest.mark.parametrize("cut", ["", "Planar free(world -> fore.a); cut "])
def test_moment_of_a_hinge_that_a_torque_turns(cut: str, sides: str, sign: int) -> None:
    """Nothing but the torque turns the bar about its hinge: 3 N.m on the bar, minus that on the world."""
    text = (
        f"Bar fore(m = 0.5 kg, l = 0.7 m); {cut}Revolute hinge({sides}); force {sign}*3 N.m on hinge.angle;\n"
    )
    solution = mechc.loads(f"import mech.planar.*;\n{text}output N = moment(hinge);").simulate(
        stop=0.1, estimate_error=False
    )
    assert isinstance(solution, mechc.Solution)
    assert solution["N"] == pytest.approx(np.full(len(solution["N"]), sign * 3.0), abs=1e-7)


def test_an_array_of_which_some_elements_are_driven_is_told_apart() -> None:
    with pytest.raises(mechc.CompileError, match=r"of 'x' only x\[2\] is driven, .* a coordinate of its own"):
        mechc.loads(
            "coordinate Length x[2]; drive x[2] = 1 m*sin(1 rad/s*time); kinetic 1/2*1 kg*(der(x[1])^2 + der(x[2])^2);"
            "output r = reaction(x[2]);"
        ).simulate(stop=1)

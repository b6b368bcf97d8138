"""Every joint of the library twice: as an edge of the tree and as the closure of a loop. A new one needs nothing here."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest
from library_joints import Joint, joints
from slow_params import slow_but

import mechc

JOINTS = joints()
CASES = [(joint, settings) for joint in JOINTS for settings in joint.settings]
EVERY = pytest.mark.parametrize(
    ("joint", "settings"),
    [
        pytest.param(
            j,
            s,
            id=f"{j.library}-{j.name}-{j.settings.index(s)}",
            marks=() if s == j.settings[-1] else pytest.mark.slow,
        )
        for j, s in CASES
    ],
)
"""In each run of the tests the last settings of each joint, which differ most from its defaults."""

BODY = {
    "planar": "gravity {1, -9} m/s^2;\nBody body(m = 2 kg, J = 0.3 kg.m^2, com = {0.4, -0.1} m);\ntorque 2 N.m on body.a;\n",
    "spatial": (
        "gravity {1, -9, 4} m/s^2;\n"
        "Body body(m = 2 kg, J = diag({0.3, 0.4, 0.5} kg.m^2), com = {0.4, -0.1, 0.2} m);\n"
        "torque {2, -1, 3} N.m on body.a;\n"
    ),
}
SEAT = {
    "planar": "frame seat = post * trans({1, 2} m) * rot(0.5 rad);\n",
    "spatial": "frame seat = post * trans({1, 2, 3} m) * rotx(0.5 rad);\n",
}
RAIL = "frame post;\nPrismatic rail(world -> post);\nmass 3 kg at post;\n"


def model(library: str, text: str) -> mechc.Model:
    return mechc.loads(f"import mech.{library}.*;\n{BODY[library]}{RAIL}{SEAT[library]}{text}")


def declaration(joint: Joint, settings: str) -> str:
    return f"{joint.name} joint(seat -> body.a{f', {settings}' if settings else ''});\n"


@cache
def freedoms(joint: Joint, settings: str) -> int:
    """Count the freedoms as an edge of the tree, beside that of the rail."""
    return model(joint.library, declaration(joint, settings)).compilation.equations.nv - 1


def test_joints_stand_in_the_two_libraries_of_joints() -> None:
    """Of which BODY and SEAT here know the space."""
    assert {joint.library for joint in JOINTS} == set(BODY)
    assert len(JOINTS) >= 18


@EVERY
def test_closure_equations_are_independent(joint: Joint, settings: str) -> None:
    """A free body that the joint holds too keeps the freedoms of the joint: no equation is dropped."""
    count = freedoms(joint, settings)
    assert joint.stated in (None, count), (
        f"{joint.name} in {joint.file} says {joint.stated} freedoms, it has {count}"
    )
    held = model(joint.library, f"Free hold(seat -> body.a);\ncut {declaration(joint, settings)}")
    rows = sum(len(c.residuals) for c in held.compilation.system.constraints)
    left = held.compilation.equations.nv - 1 - rows
    assert left == count, (
        f"{joint.name} in {joint.file}: {count} freedoms in a tree, {left} where it closes a loop"
    )
    assert not held.diagnostics, f"the closure equations of {joint.name} in {joint.file} repeat each other"


@cache
def both(joint: Joint, settings: str) -> list[mechc.Solution]:
    """Run the joint as an edge of the tree, and as the closure of a free body, from rest."""
    edge = declaration(joint, settings)
    outputs = "output p = pos(body.a);\noutput c = pos(body.a * trans(body.com));\n"
    outputs += "output F = reaction(joint);\noutput M = moment(joint);\n"
    outputs += "".join(f"output o{i} = joint.{name};\n" for i, name in enumerate(joint.coordinates))
    solutions = []
    for text in (edge, f"Free hold(seat -> body.a);\ncut {edge}"):
        try:
            compiled = model(joint.library, text + outputs)
        except mechc.CompileError as error:
            pytest.fail(
                f"{joint.name} in {joint.file} needs a closure for each of {joint.coordinates}: {error}"
            )
        solution = compiled.simulate(stop=0.4, tolerance=1e-10)
        assert isinstance(solution, mechc.Solution)
        assert solution.outcome.value == "completed", solution.message
        solutions.append(solution)
    return solutions


def vector(name: str, library: str) -> list[str]:
    return [f"{name}[{i + 1}]" for i in range(2 if library == "planar" else 3)]


@EVERY
def test_same_motion(joint: Joint, settings: str) -> None:
    """The closures drift by what the steps add up to: a thousand times the tolerance."""
    tree, loop = both(joint, settings)
    names = {name: name for name in (*vector("p", joint.library), *vector("c", joint.library))}
    names |= {f"o{i}": f"the coordinate {name}" for i, name in enumerate(joint.coordinates)}
    for name, words in names.items():
        same = loop[name] == pytest.approx(tree[name], abs=1e-7)
        assert same, f"{words} of {joint.name}({settings}) differs: 'place' or 'closure' in {joint.file}"
    moved = max(np.ptp(tree[name]) for name in vector("c", joint.library))
    assert freedoms(joint, settings) == 0 or moved > 1e-3


@EVERY
def test_same_reaction(joint: Joint, settings: str) -> None:
    tree, loop = both(joint, settings)
    names = [
        *vector("F", joint.library),
        *(["M"] if joint.library == "planar" else vector("M", joint.library)),
    ]
    for name in names:
        same = loop[name] == pytest.approx(tree[name], abs=1e-6)
        assert same, f"{name} of {joint.name}({settings}) differs: 'place' or 'closure' in {joint.file}"
    held = freedoms(joint, settings) < (3 if joint.library == "planar" else 6)
    assert held == (max(np.max(np.abs(tree[name])) for name in names) > 0.1)


@pytest.mark.parametrize("angle", slow_but([120], [30, 90, 120, 170]))
def test_a_weld_that_closes_a_loop_is_not_put_on_back_to_front(angle: int) -> None:
    """Of the positions in which the axes of both sides are parallel only one is meant, however far the guess is."""
    planar = f"""
    import mech.planar.*;
    Body b(m = 2 kg, J = 1 kg.m^2);
    Planar free(world -> b.a);
    cut Weld weld(world * rot({angle} deg) -> b.a);
    output axis = direction(b.a, {{1, 0}});
    """
    spatial = f"""
    import mech.spatial.*;
    Body b(m = 2 kg, J = identity(3)*1 kg.m^2);
    Free free(world -> b.a);
    cut Weld weld(world * rotz({angle} deg) -> b.a);
    output axis = direction(b.a, {{1, 0, 0}});
    """
    for text in (planar, spatial):
        s = mechc.loads(text).simulate(stop=1e-3, estimate_error=False)
        assert s["axis[1]"][0] == pytest.approx(math.cos(math.radians(angle)), abs=1e-9)
        assert s["axis[2]"][0] == pytest.approx(math.sin(math.radians(angle)), abs=1e-9)


@pytest.mark.parametrize("angle", slow_but([100], [30, 100, 150]))
@pytest.mark.parametrize("joint", ["Revolute", "Cylindrical", "Planar", "Prismatic", "Translation"])
def test_axes_of_a_joint_that_closes_a_loop_point_the_same_way(joint: str, angle: int) -> None:
    text = f"""
    import mech.spatial.*;
    Body b(m = 2 kg, J = identity(3)*1 kg.m^2);
    Free free(world -> b.a);
    cut {joint} closing(world * rotx({angle} deg) -> b.a);
    output axis = direction(b.a, {{0, 0, 1}});
    """
    s = mechc.loads(text).simulate(stop=1e-3, estimate_error=False)
    assert s["axis[2]"][0] == pytest.approx(-math.sin(math.radians(angle)), abs=1e-9)
    assert s["axis[3]"][0] == pytest.approx(math.cos(math.radians(angle)), abs=1e-9)


@pytest.mark.parametrize("angle", [60, -100, 160, 200])
def test_a_screw_that_closes_a_loop_is_not_half_a_turn_off_its_thread(angle: int) -> None:
    """From a guess that is turned and not advanced, the nut goes to the nearer thread: it is turned as far as it says."""
    text = f"""
    import mech.spatial.*;
    Body nut(m = 2 kg, J = identity(3)*1 kg.m^2);
    Free free(world -> nut.a, orientation ~ rotz({angle} deg));
    cut Screw thread(world -> nut.a, pitch = 1 m);
    output axis = direction(nut.a, {{1, 0, 0}});
    output turned = thread.angle;
    """
    s = mechc.loads(text).simulate(stop=1e-3, estimate_error=False)
    assert s["axis[1]"][0] == pytest.approx(math.cos(s["turned"][0]), abs=1e-9)
    assert s["axis[2]"][0] == pytest.approx(math.sin(s["turned"][0]), abs=1e-9)
    assert abs(math.remainder(s["turned"][0] - math.radians(angle), 2 * math.pi)) < math.pi / 2

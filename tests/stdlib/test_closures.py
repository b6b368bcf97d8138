"""Every joint twice: as an edge of the tree and as the closure of a loop."""

from __future__ import annotations

import math

import numpy as np
import pytest

import mechc

# joint, settings that both forms share, its freedoms, coordinates that the closure computes
PLANAR = [
    ("Revolute", "", 1, ["angle"]),
    ("Prismatic", "axis = {3, 4}", 1, ["position"]),
    ("Translation", "", 2, ["position[1]", "position[2]"]),
    ("Planar", "", 3, ["x", "y", "angle"]),
    ("Weld", "", 0, []),
    ("PinSlot", "axis = {3, 4}", 2, ["position", "angle"]),
    ("Rolling", "r = 0.4 m", 1, ["position"]),
    ("RollingOnCircle", "track = 0.5 m, r = 0.2 m", 1, ["angle"]),
    ("RollingOnCircle", "track = 0.5 m, r = -0.2 m", 1, ["angle"]),
]
SPATIAL = [
    ("Revolute", "", 1, ["angle"]),
    ("Revolute", "axis = {1, 2, 2}", 1, ["angle"]),
    ("Prismatic", "axis = {1, 2, 2}", 1, ["position"]),
    ("Cylindrical", "axis = {1, 2, 2}", 2, ["position", "angle"]),
    ("Screw", "axis = {1, 2, 2}, pitch = 0.5 m", 1, ["angle"]),
    ("Universal", "", 2, ["angle[1]", "angle[2]"]),
    ("Universal", "first = {0, 0, 2}, second = {1, 2, 2}", 2, ["angle[1]", "angle[2]"]),
    ("Spherical", "", 3, []),
    ("Planar", "", 3, ["x", "y", "angle"]),
    ("Translation", "", 3, [f"position[{i}]" for i in (1, 2, 3)]),
    ("Weld", "", 0, []),
]
CASES = [("planar", *case) for case in PLANAR] + [("spatial", *case) for case in SPATIAL]

BODY = {
    "planar": "gravity {1, -9} m/s^2;\nBody body(m = 2 kg, J = 0.3 kg.m^2, com = {0.4, -0.1} m);\n",
    "spatial": (
        "gravity {1, -9, 4} m/s^2;\n"
        "Body body(m = 2 kg, J = diag({0.3, 0.4, 0.5} kg.m^2), com = {0.4, -0.1, 0.2} m);\n"
    ),
}
SEAT = {
    "planar": "frame seat = post * trans({1, 2} m) * rot(0.5 rad);\n",
    "spatial": "frame seat = post * trans({1, 2, 3} m) * rotx(0.5 rad);\n",
}
RAIL = "frame post;\nPrismatic rail(world -> post);\nmass 3 kg at post;\n"


def model(library: str, text: str) -> mechc.Model:
    return mechc.loads(f"import mech.{library}.*;\n{BODY[library]}{RAIL}{SEAT[library]}{text}")


def arguments(settings: str) -> str:
    return f", {settings}" if settings else ""


@pytest.mark.parametrize(("library", "joint", "settings", "freedoms", "computed"), CASES)
def test_closure_equations_are_independent(
    library: str, joint: str, settings: str, freedoms: int, computed: list[str]
) -> None:
    """A free body that the joint holds too keeps the freedoms of the joint: no equation is dropped."""
    held = model(
        library, f"Free hold(seat -> body.a);\ncut {joint} joint(seat -> body.a{arguments(settings)});\n"
    )
    rows = sum(len(c.residuals) for c in held.compilation.system.constraints)
    assert held.compilation.equations.nv - 1 - rows == freedoms
    assert not held.diagnostics


def outputs(computed: list[str]) -> str:
    lines = [f"output o{i} = joint.{name};\n" for i, name in enumerate(computed)]
    return "output p = pos(body.a);\noutput c = pos(body.a * trans(body.com));\n" + "".join(lines)


def both(library: str, joint: str, settings: str, outputs: str) -> list[mechc.Solution]:
    """Run the joint as an edge of the tree, and as the closure of a free body, from rest in gravity."""
    edge = f"{joint} joint(seat -> body.a{arguments(settings)});\n"
    solutions = []
    for text in (edge, f"Free hold(seat -> body.a);\ncut {edge}"):
        solution = model(library, text + outputs).simulate(stop=0.4, tolerance=1e-10, target="python")
        assert isinstance(solution, mechc.Solution)
        assert solution.outcome.value == "completed", solution.message
        solutions.append(solution)
    return solutions


def vector(name: str, library: str) -> list[str]:
    return [f"{name}[{i + 1}]" for i in range(2 if library == "planar" else 3)]


@pytest.mark.parametrize(("library", "joint", "settings", "freedoms", "computed"), CASES)
def test_same_motion(library: str, joint: str, settings: str, freedoms: int, computed: list[str]) -> None:
    """The closures drift by what the steps add up to: a thousand times the tolerance."""
    tree, loop = both(library, joint, settings, outputs(computed))
    for name in [*vector("p", library), *vector("c", library), *(f"o{i}" for i in range(len(computed)))]:
        assert loop[name] == pytest.approx(tree[name], abs=1e-7), name
    assert freedoms == 0 or max(np.ptp(tree[name]) for name in vector("c", library)) > 1e-3


@pytest.mark.parametrize(("library", "joint", "settings", "freedoms", "computed"), CASES)
def test_same_reaction(library: str, joint: str, settings: str, freedoms: int, computed: list[str]) -> None:
    tree, loop = both(library, joint, settings, "output F = reaction(joint);\noutput M = moment(joint);\n")
    moments = ["M"] if library == "planar" else vector("M", library)
    for name in [*vector("F", library), *moments]:
        assert loop[name] == pytest.approx(tree[name], abs=1e-6), name
    if (library, joint) not in {("planar", "Planar"), ("planar", "Translation"), ("spatial", "Translation")}:
        assert max(np.max(np.abs(tree[name])) for name in vector("F", library)) > 1


@pytest.mark.parametrize("angle", [30, 90, 120, 170])
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
        s = mechc.loads(text).simulate(stop=1e-3, target="python", estimate_error=False)
        assert s["axis[1]"][0] == pytest.approx(math.cos(math.radians(angle)), abs=1e-9)
        assert s["axis[2]"][0] == pytest.approx(math.sin(math.radians(angle)), abs=1e-9)


@pytest.mark.parametrize("angle", [30, 100, 150])
@pytest.mark.parametrize("joint", ["Revolute", "Cylindrical", "Planar", "Prismatic", "Translation"])
def test_axes_of_a_joint_that_closes_a_loop_point_the_same_way(joint: str, angle: int) -> None:
    text = f"""
    import mech.spatial.*;
    Body b(m = 2 kg, J = identity(3)*1 kg.m^2);
    Free free(world -> b.a);
    cut {joint} closing(world * rotx({angle} deg) -> b.a);
    output axis = direction(b.a, {{0, 0, 1}});
    """
    s = mechc.loads(text).simulate(stop=1e-3, target="python", estimate_error=False)
    assert s["axis[2]"][0] == pytest.approx(-math.sin(math.radians(angle)), abs=1e-9)
    assert s["axis[3]"][0] == pytest.approx(math.cos(math.radians(angle)), abs=1e-9)

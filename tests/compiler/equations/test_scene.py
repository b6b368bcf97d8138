"""What is drawn: numbers against closed forms, what is wrong with it in words, and that it changes nothing else."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from differentiable_modules import plain_text

import mechc
from mechc.compiler.compilation import Compilation
from mechc.compiler.flat.names import files
from mechc.compiler.pipeline import compile_source, program_with
from mechc.compiler.targets.c import emit_c
from mechc.compiler.targets.fmu.export import start_of, write_program
from mechc.lang import ast
from mechc.lang.diagnostics import CompileError, Reporter
from mechc.lang.parser import parse
from mechc.lang.read import read_source
from mechc.lang.source import SourceFile
from mechc.presentation.panels import Scenery, TimePanel, panels_of
from mechc.runtime.interface import Scene
from mechc.runtime.problem import Array

EXAMPLES = sorted((Path(__file__).resolve().parents[3] / "examples").glob("*.mech"))

DRAWN = re.compile(r"mech\.(planar|spatial)|^ *draw ", re.MULTILINE)
"""What draws itself, or says what is drawn."""

PLANE = """
import mech.planar.*;
gravity {0, -9.81} m/s^2;
Bar bar(m = 1 kg, l = 80 cm);
Revolute hinge(world -> bar.a, angle = 0.3 rad);
output R = reaction(hinge);
draw trail(bar.b);
draw arrow(R/(10 N/m)) at bar.b, colour = "red";
draw polygon({{0, 0}, {2, 0}, {0, 1}} cm) on bar.a, colour = "#A0b1c2";
draw curve({s, s^2/(1 m)}, s in -1 m:1 m) on bar.b;
draw surface(x*y/(1 m), x in 0 m:1 m, y in 0 m:2 m);
draw spring(world, bar.b, turns = 5);
for k in 1:2 loop draw sphere(k*1 cm) at {k*1 m, time*(1 m/s)}; end for;
experiment(stop = 1 s);
"""


def numbers(text: str, times: Array) -> tuple[Scene, list[Array], mechc.Solution]:
    """Return the scene of a model, the numbers [n, k] of each shape at times [n], and the motion."""
    solution = mechc.loads(text, keep={"scene"}).simulate(tolerance=1e-10)
    scene, pictured = solution.problem.scene, solution.motion.pictured
    assert scene is not None and pictured is not None
    rows = pictured(times)
    return scene, [rows[:, list(shape.numbers)] for shape in scene.shapes], solution


def test_shapes_of_the_plane_stand_where_closed_forms_say() -> None:
    times = np.array([0.0, 0.4, 1.0])
    scene, found, solution = numbers(PLANE, times)
    shapes = dict(zip((f"{s.name} {s.kind}" for s in scene.shapes), found, strict=True))
    assert scene.size == 3  # the surface leaves the plane
    assert not scene.by_rule
    at = solution(times)
    angle = at["hinge.angle"]
    axes = np.array([np.cos(angle), np.sin(angle), 0 * angle]).T
    tip = 0.8 * axes
    assert np.allclose(shapes["bar box"][:, :3], tip / 2, rtol=0, atol=1e-15)
    assert np.allclose(shapes["bar box"][:, 3:6], axes, rtol=0, atol=1e-15)
    assert np.allclose(shapes["bar box"][:, 6:9], axes[:, [1, 0, 2]] * [-1, 1, 0], rtol=0, atol=1e-15)
    assert np.allclose(shapes["bar box"][:, 12:], [0.8, 0.05, 0], rtol=0, atol=1e-15)
    assert np.allclose(shapes[" trail"], tip, rtol=0, atol=1e-15)
    arrow = np.array([at["R[1]"], at["R[2]"], 0 * angle]).T / 10
    assert np.allclose(shapes[" arrow"], np.hstack([tip, arrow]), rtol=0, atol=1e-14)
    assert np.allclose(shapes[" polygon"][0, 12:], np.array([0, 0, 0, 2, 0, 0, 0, 1, 0]) / 100)
    s = np.linspace(-1, 1, 97)
    curve = shapes[" curve"][1, 12:].reshape(97, 3)
    assert np.allclose(curve, np.array([s, s**2, 0 * s]).T, rtol=0, atol=1e-15)
    x, y = np.meshgrid(np.linspace(0, 1, 25), np.linspace(0, 2, 25), indexing="ij")
    surface = shapes[" surface"][2, 12:].reshape(25, 25, 3)
    assert np.allclose(surface, np.stack([x, y, x * y], axis=-1), rtol=0, atol=1e-15)
    assert np.allclose(shapes[" spring"], np.hstack([0 * tip, tip, np.full((3, 1), 1), np.full((3, 1), 5)]))
    assert np.allclose(shapes[" sphere"][:, :3], np.array([0 * times + 2, times, 0 * times]).T)
    colours = {shape.kind: shape.colour for shape in scene.shapes if not shape.name}
    assert (colours["polygon"], colours["arrow"], colours["trail"]) == ("#a0b1c2", "#d1493f", "")
    assert next(shape for shape in scene.shapes if shape.kind == "spring").relative


def test_axes_in_space_are_those_of_the_quaternion() -> None:
    text = """
import mech.spatial.*;
Body top(m = 1 kg, J = diag({1, 2, 3})*1 kg.m^2);
Free free(world -> top.a, der(orientation) = {1, 2, 3} rad/s);
draw none;
draw box({1, 2, 3} m) on top.a;
experiment(stop = 1 s);
"""
    times = np.array([0.0, 0.7])
    scene, (box,), solution = numbers(text, times)
    assert len(scene.shapes) == 1, "'draw none' silences the parts"
    at = solution(times)
    w, x, y, z = (at[f"free.orientation[{k}]"] for k in range(1, 5))
    first = np.array([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)]).T
    third = np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)]).T
    assert np.allclose(box[:, 3:6], first, rtol=0, atol=1e-14)
    assert np.allclose(box[:, 9:12], third, rtol=0, atol=1e-14)


def test_a_model_that_says_nothing_gets_its_masses_and_paths() -> None:
    text = """
coordinate Length x = 1 m;
coordinate Angle a = 0.1 rad;
frame F = world * trans({x, 0}) * rot(a);
mass 8 kg at F * {2 m, 0};
output tip = F * {3 m, 0};
experiment(stop = 1 s);
"""
    scene, (mass, trail), _ = numbers(text, np.array([0.0]))
    assert scene.by_rule and [s.kind for s in scene.shapes] == ["mass", "trail"]
    assert np.allclose(mass[0], [1 + 2 * np.cos(0.1), 2 * np.sin(0.1), 0, 8])
    assert np.allclose(trail[0], [1 + 3 * np.cos(0.1), 3 * np.sin(0.1), 0])
    scene, (_, trail), _ = numbers(text.replace("output tip = F * {3 m, 0};", ""), np.array([0.0]))
    assert [s.kind for s in scene.shapes] == ["mass", "trail"]
    assert np.allclose(trail[0], [1 + 2 * np.cos(0.1), 2 * np.sin(0.1), 0]), (
        "that of the mass, where there is no other"
    )


def test_three_lengths_are_no_place_in_the_plane() -> None:
    """As those of three cylinders: the picture stays flat, and shows the curves of the lengths instead of a path."""
    text = "Bar bar(l = 80 cm); Revolute hinge(world -> bar.a, angle = 0.3 rad, der(angle) = 1 rad/s); experiment(stop = 1 s);"
    lengths = "output reach[3] = {1, 2, 3}*norm(pos(bar.b) - {1, 1} m);"
    scene, _, solution = numbers(f"import mech.planar.*;\n{text}{lengths}", np.linspace(0, 1, 3))
    assert scene.size == 2 and "trail" not in {shape.kind for shape in scene.shapes}
    panels = panels_of(solution)
    assert [p.names for p in panels if isinstance(p, Scenery)] == [()]
    assert [p.names for p in panels if isinstance(p, TimePanel) and p.title == "outputs"] == [
        ("reach[1]", "reach[2]", "reach[3]")
    ]


@pytest.mark.parametrize(("said", "kinds"), [("", ["disk", "mass"]), ("draw none;", [])])
def test_draw_none_of_a_component_leaves_its_masses_out(said: str, kinds: list[str]) -> None:
    """Those of components inside it, too, and not what else is there."""
    text = f"""
import mech.planar.*;
model Inner frame a; mass 1 kg at a; inertia 1 kg.m^2 on a; end Inner;
model Chain frame a; Inner inner; Revolute hinge(a -> inner.a); {said} end Chain;
model M Chain chain(a = world); coordinate x = 1 m; mass 1 kg at world * {{x, 0 m}}; experiment(stop = 1 s); end M;
"""
    scene, _, _ = numbers(text, np.linspace(0, 1, 2))
    drawn = [s.kind for s in scene.shapes if s.name.startswith("chain.") and s.kind in ("disk", "mass")]
    assert drawn == kinds
    assert "mass" in {s.kind for s in scene.shapes if not s.name}


def test_coordinates_called_x_and_y_are_a_place() -> None:
    text = "coordinate x = 1 m;\ncoordinate y = 2 m;\nkinetic 1/2*1 kg*(der(x)^2 + der(y)^2);\nexperiment(stop = 1 s);\n"
    scene, (trail, ball), _ = numbers(text, np.array([0.0]))
    assert [s.kind for s in scene.shapes] == ["trail", "sphere"] and scene.size == 2
    assert np.array_equal(trail[0], [1, 2, 0]) and np.array_equal(ball[0, :3], [1, 2, 0])


def test_rows_of_a_matrix_are_points_and_states_called_x_and_y_a_place() -> None:
    text = "dimensionless; coordinate r[2, 2] = {{1, 2}, {3, 4}}; kinetic sum(1/2*dot(der(r[i]), der(r[i])) for i in 1:2);"
    scene, found, _ = numbers(text + "experiment(stop = 1);", np.array([0.0]))
    assert [f"{s.name} {s.kind}" for s in scene.shapes] == [
        "r[1] trail",
        "r[1] sphere",
        "r[2] trail",
        "r[2] sphere",
    ]
    assert np.array_equal(found[2][0], [3, 4, 0]) and scene.by_rule
    text = "dimensionless; state x = 1; state y = 2; state z = 3; equation der(x) = y; equation der(y) = z; equation der(z) = x;"
    scene, (trail, _), _ = numbers(text + "experiment(stop = 1);", np.array([0.0]))
    assert scene.size == 3 and np.array_equal(trail[0], [1, 2, 3])


def test_a_frame_that_turns_is_three_axes() -> None:
    text = """
coordinate Rotation R;
initial der(R) = {0, 0, 2} rad/s;
frame body = world * R;
inertia diag({1, 2, 3})*1 kg.m^2 on body;
experiment(stop = 1 s);
"""
    scene, (axes,), _ = numbers(text, np.array([0.5]))
    assert [(s.kind, s.name, s.relative) for s in scene.shapes] == [("frame", "body", False)]
    assert np.allclose(axes[0, 3:6], [np.cos(1), np.sin(1), 0], rtol=0, atol=1e-7)


def test_what_has_no_place_is_a_bead_or_a_dial() -> None:
    text = "coordinate a = 0.5 rad; coordinate s = 3 m; kinetic 1/2*1 kg.m^2*der(a)^2 + 1/2*1 kg*der(s)^2; experiment(stop = 1 s);"
    scene, found, _ = numbers(text, np.array([0.0]))
    assert [(s.kind, s.text) for s in scene.shapes] == [("dial", "a"), ("bead", "s")]
    assert [values[0, 0] for values in found] == [0.5, 3]
    alone = "input Force u = 2 N; output double = {2*u, 3*u}; experiment(stop = 1 s);"
    scene, found, _ = numbers(alone, np.array([0.0]))
    assert [s.text for s in scene.shapes] == ["double[1]", "double[2]"] and found[1][0, 0] == 6
    assert not numbers(text + "draw none;", np.array([0.0]))[0].shapes


HEAD = "parameter m = 1 kg;\ncoordinate Length x = 0.2 m;\nkinetic 1/2*m*der(x)^2;\ninput Force u = 0 N;\nforce pull: u on x;\n"

WRONG = {
    "shape": ("draw cube(1 m) at {x, 0};", "E1001", "there is no shape 'cube'"),
    "mass": ("draw sphere(m) at {x, 0};", "E1002", "'radius' of 'sphere' is a length"),
    "too many": ("draw sphere(1 m, 2 m) at {x, 0};", "E1002", "'sphere' has radius"),
    "unknown": ("draw sphere(size = 1 m) at {x, 0};", "E1002", "'sphere' has no argument 'size'"),
    "missing": ("draw box() at {x, 0};", "E1002", "'box' needs its size"),
    "points": ("draw line({x, 0});", "E1002", "'line' goes through at least 2 points"),
    "variable": ("draw curve({x, x});", "E1002", "'curve' has one variable"),
    "range": ("draw curve({s, s}, s in 0 m:1 s);", "E1002", "both ends of a range"),
    "turns": ("draw spring({0, 0}, {x, 0}, turns = 1.5);", "E1002", "'turns' of 'spring' is a whole number"),
    "negative": ("draw box({1, -2} m) at {x, 0};", "E1003", "'size' of 'box' is a size, and negative"),
    "file": ('draw mesh("none.stl", scale = 1 mm) at {x, 0};', "E1004", "there is no file 'none.stl'"),
    "kind of file": (
        'draw mesh("a.ply", scale = 1 mm) at {x, 0};',
        "E1004",
        "not an STL, OBJ, DAE or GLB file",
    ),
    "nowhere": ("draw sphere(1 m);", "E1005", "stands 'on' a frame or 'at' a point"),
    "twice": ("draw sphere(1 m) on world at {x, 0};", "E1005", "stands 'on' a frame or 'at' a point"),
    "line on": ("draw line({0, 0}, {x, 0}) on world;", "E1005", "'line' has no 'on' or 'at'"),
    "trail of a number": ("draw trail(x);", "E1005", "drawn through a frame, a point or a vector"),
    "colour": ('draw sphere() at {x, 0}, colour = "#12";', "E1006", "there is no colour '#12'"),
    "option": ("draw sphere() at {x, 0}, width = 3;", "E0415", "a shape has no option 'width'"),
    "question": ("draw sphere() at {power(pull)/(1 W)*1 m, 0};", "E1007", "'power'"),
    "integral": ("draw sphere() at {integral(x)/(1 s), 0};", "E1007", "it would change the model"),
    "clock": ("draw sphere(if sample(1 s) then 1 m else 2 m) at {x, 0};", "E1007", "'sample'"),
    "rate of an input": (
        "draw sphere() at {der(u)/(1 N/s)*1 m, 0};",
        "E1007",
        "which nothing determines",
    ),
    "order": ("draw sphere(radius = 1 m, 2 m) at {x, 0};", "E0110", "follows a named one"),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_is_wrong_is_said(name: str) -> None:
    text, code, words = WRONG[name]
    with pytest.raises(CompileError) as caught:
        compile_source(SourceFile("wrong.mech", HEAD + text + "\n"), parts={"scene"})
    assert code in [d.code for d in caught.value.diagnostics], caught.value.diagnostics
    assert words in " ".join(d.message for d in caught.value.diagnostics)


def without_draws(node: ast.Node) -> ast.Node:
    """Return a file, or a statement, in which nothing is drawn."""
    from msgspec.structs import replace

    changed: dict[str, object] = {}
    for name in ("items", "body", "branches", "otherwise"):
        inner = getattr(node, name, None)
        if isinstance(inner, tuple):
            changed[name] = tuple(without_draws(s) for s in inner if not isinstance(s, ast.Draw))
    return replace(node, **changed) if changed else node


def texts(compilation: Compilation, path: Path) -> list[str]:
    """Return the C code with and without Jacobian, the Python module and the code of an FMU."""
    problem = mechc.load(path).problem(quick=True)
    python = plain_text(compilation.program)
    implicit = emit_c(program_with(compilation, {"jacobian"}))
    fmu = write_program(compilation.equations, start_of(problem)).code
    return [emit_c(compilation.program), implicit, python, fmu]


def compare_without(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    source = read_source(path)
    drawn = compile_source(source, search=(path.parent,))
    assert "draw" in source.text or drawn.flat.draws, "nothing is compared"
    whole = texts(drawn, path)

    def stripped(source: SourceFile, reporter: Reporter, piece: tuple[int, int] | None = None) -> ast.File:
        found = without_draws(parse(source, reporter, piece))
        assert isinstance(found, ast.File)
        return found

    monkeypatch.setattr("mechc.compiler.flat.flatten.parse", stripped)
    monkeypatch.setattr(files, "parse", stripped)
    monkeypatch.setattr(files, "_parsed", {})
    bare = compile_source(source, search=(path.parent,))
    assert not bare.flat.draws
    assert texts(bare, path) == whole


def test_the_same_bytes_with_and_without(monkeypatch: pytest.MonkeyPatch) -> None:
    compare_without(next(p for p in EXAMPLES if p.stem == "double_pendulum"), monkeypatch)


@pytest.mark.slow
@pytest.mark.parametrize("path", [p for p in EXAMPLES if DRAWN.search(p.read_text())], ids=lambda p: p.stem)
def test_the_same_bytes_for_others(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    compare_without(path, monkeypatch)

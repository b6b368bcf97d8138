"""A diagram of each part of the library, made from the part itself: ``python docs/diagrams.py FOLDER``; ``make docs`` puts them beside library.md.

A part with frames is drawn as its scene, at its default parameters, with the axes and names of its frames; a part without is a block with its
flanges (squares), inputs and outputs.
"""

from __future__ import annotations

import io
import re
import sys
import tempfile
from collections.abc import Collection, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import cache
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from msgspec import Struct

import mechc
from mechc.lang import ast
from mechc.lang.diagnostics import Reporter
from mechc.lang.parser import parse
from mechc.lang.printing.printer import print_expression
from mechc.lang.read import read_source
from mechc.lang.units import NAMED_TYPES
from mechc.presentation.painting import Painter, blank_axes

LIBRARY = Path(__file__).resolve().parent.parent / "stdlib"

SETTINGS = {
    "contact.BallOnPlane": "r = 0.4 m",
    "contact.CapsuleOnPlane": "r = 0.2 m",
    "contact.BoxOnPlane": "r = 0 m",
    "contact.BallOnBall": "r_from = 0.4 m, r_to = 0.3 m",
    "contact.BallOnCapsule": "r_from = 0.2 m, r_to = 0.3 m",
    "contact.BallOnBox": "r_to = 0.3 m",
    "contact.CapsuleOnCapsule": "r_from = 0.2 m, r_to = 0.15 m",
    "contact.PolyhedronOnPlane": "corners = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}} m",
    "contact.BallOnCylinder": "r = 0.3 m, r_to = 0.3 m",
    "contact.BoxOnBox": "edges_from = {1, 0.8, 0.4} m, edges_to = {0.6, 0.5, 0.4} m",
    "contact.BallOnTerrain": "r_to = 0.2 m, x = {-1, 0, 1} m, y = {-1, 1} m, z = {{0.4, 0.2}, {0, 0.1}, {0.2, 0.3}} m",
    "contact.RayToPlane": "reach = 2 m",
    "contact.RayToBall": "r = 0.3 m, reach = 2 m",
    "contact.RayToBox": "edges = {0.4, 0.3, 0.2} m, reach = 2 m",
    "shapes.Plane": "width = 2 m",
    "shapes.Polyhedron": "corners = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}} m",
    "shapes.Terrain": "x = {-1, 0, 1} m, y = {-1, 1} m, z = {{0.4, 0.2}, {0, 0.1}, {0.2, 0.3}} m",
    "spatial.Screw": "pitch = 5 m",
    "spatial.Solid": 'file = "solid.obj", scale = 1 m',
    "suspension.Wishbone": "m = 1 kg",
    "space.GravityGradient": "to = world * trans({7000 km, 0 m, 0 m})",
    "space.MagneticTorquer": "to = world * trans({7000 km, 0 m, 0 m})",
    "space.Thruster": "throttle = 1, thrust = 40 N",
}
"""Values where those of the part leave nothing to be seen, or where it has none."""

SOLID = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
"""The file of a Solid."""

ENDS = ("from", "over", "to", "a")
"""Frames that a user binds; parts place the others."""

POSES = {
    2: ("world * trans({1, 0.4} m) * rot(0.3 rad)", "world * trans({0.5, 0.8} m)"),
    3: (
        "world * trans({0.8, 0.6, 0.3} m) * rotz(0.4 rad) * rotx(0.3 rad)",
        "world * trans({0.4, 0.3, 0.8} m)",
    ),
}
"""Where the second and the third end of a part begin."""

MOVED = {
    "Angle": (("0.8", "-0.6", "0.5"), "rad"),
    "Length": (("0.8", "0.5", "0.3"), "m"),
    "Real": (("0.5", "0.3"), ""),
    "Rotation": (("rotz(0.8 rad) * roty(-0.4 rad)",), ""),
}
"""Coordinates of a joint in its diagram, so that it can be seen how it moves."""


ARM, BALL, PALE = 0.22, 0.02, 0.6
"""Of the whole diagram: the axes of a frame, and what has no size of its own, such as the ball of a hinge; how opaque the part is."""

SMALLEST = 1e-6
"""Metres: below it a part is a point."""


class Part(Struct, frozen=True):
    """A part with the statements of its bases before its own."""

    package: str
    model: ast.Model
    body: tuple[ast.Statement, ...]

    @property
    def name(self) -> str:
        return f"{self.package}.{self.model.name}"

    def all(self, *kinds: type) -> list[Any]:
        return [s for s in everything(self.body) if isinstance(s, kinds)]


@cache
def parts() -> dict[str, Part]:
    """Return the parts that a model can have, by ``package.Name``."""
    files = {p.stem: parse(read_source(p), Reporter()) for p in sorted(LIBRARY.glob("*.mech"))}
    models = {
        f"{package}.{item.name}": item
        for package, file in files.items()
        for item in file.items
        if isinstance(item, ast.Model)
    }
    found = {}
    for name, model in models.items():
        package = name.partition(".")[0]
        if not model.partial and not any(isinstance(s, ast.Shape) for s in model.body):
            found[name] = Part(package, model, tuple(_inherited(package, model, models)))
    return found


def _inherited(package: str, model: ast.Model, models: dict[str, ast.Model]) -> Iterator[ast.Statement]:
    for s in model.body:
        if isinstance(s, ast.Extends):
            yield from _inherited(package, models[f"{package}.{s.base}"], models)
        else:
            yield s


def everything(body: Sequence[ast.Statement]) -> Iterator[ast.Statement]:
    """Yield statements with those in loops, and without those under conditions, which are not there by default."""
    for s in body:
        yield s
        if isinstance(s, ast.For):
            yield from everything(s.body)


def diagram(part: Part) -> str:
    """Return the diagram of a part as SVG."""
    return scene(part) if part.all(ast.Frame) else block(part)


# ---------------------------------------------------------------- parts with frames


def scene(part: Part) -> str:
    """Draw a part and its frames where it is."""
    frames = [f.name for f in part.all(ast.Frame) if not f.dimensions]
    mistakes = []
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "solid.obj").write_text(SOLID, encoding="utf-8")
        for size in (3, 2) if part.package == "spatial" else (2, 3):
            path = Path(folder, "diagram.mech")
            path.write_text(text(part, frames, size), encoding="utf-8")
            try:
                model = mechc.load(path, keep={"scene"})
            except mechc.CompileError as error:  # the part is one of the other space
                mistakes.append(str(error))
                continue
            return painted(model, frames)
    raise AssertionError(f"{part.name}: {mistakes}")


def text(part: Part, frames: Sequence[str], size: int) -> str:
    """Write the model that has one part, in the plane or in space, with its ends where they can be told apart."""
    space = ("planar", "spatial")[size - 2]
    lines = [f"import P = mech.{part.package};", f"import S = mech.{space};", "model Diagram"]
    lines.append(f"  gravity {{{', '.join('0' * size)}}} m/s^2;")
    placed = {s.target.parts[0].name for s in part.all(ast.Place)}
    ends = [f for f in ENDS if f in frames]
    held = "from" in ends or not part.all(ast.Constraint, ast.Contact)
    bound = {ends[0]: "world"} if held else {}
    given = [SETTINGS[part.name]] if part.name in SETTINGS else []
    inertia = "1 kg.m^2" if size == 2 else "identity(3)*(1 kg.m^2)"
    free = [end for end in ends if end not in bound]
    bound = {end: pose for end, pose in bound.items() if not re.search(rf"\b{end} = ", "".join(given))}
    joint = "Free" if part.all(ast.Constraint) else "Translation"  # only a constraint may turn an end
    for end, pose in zip(free, POSES[size], strict=False):
        lines += [f"  frame at_{end};", f"  mass 1 kg at at_{end};", f"  inertia {inertia} on at_{end};"]
        if end not in placed:
            lines.append(f"  S.{joint} held_{end}({pose} -> at_{end});")
        bound[end] = f"at_{end}"
    if part.model.shape:
        lines.insert(1, f"import mech.{part.package}.*;")
        lines.append(f"  shape part: {part.model.name}({', '.join(given)}) on world;")
    else:
        given += [f"{s.name} ~ {moved(s)}" for s in part.all(ast.Coordinate) if placed]
        for s in part.all(ast.Input):
            if s.value is None and s.type in ("Angle", "Length"):
                unit = "kg.m^2" if s.type == "Angle" else "kg"
                lines.append(f"  coordinate {s.type} q_{s.name} ~ 0;")
                lines.append(f"  kinetic 1/2*(1 {unit})*der(q_{s.name})^2;")
                given.append(f"{s.name} = q_{s.name}")
            elif s.value is None:
                given.append(f"{s.name} = 1 {NAMED_TYPES[s.type].unit}")
        ends = [f"{end} = {pose}" for end, pose in bound.items()]
        lines.append(f"  P.{part.model.name} part({', '.join([*ends, *given])});")
    lines += [f"  draw frame(part.{f}, size = 0 m);" for f in frames]
    return "\n".join([*lines, "end Diagram;", ""])


def moved(coordinate: ast.Coordinate) -> str:
    """Return where a coordinate of a joint is in its diagram."""
    values, unit = MOVED[coordinate.type]
    if not coordinate.dimensions:
        return f"{values[0]} {unit}".rstrip()
    count = int(print_expression(coordinate.dimensions[0].size))
    return f"{{{', '.join(values[:count])}}} {unit}".rstrip()


def painted(model: mechc.Model, frames: Sequence[str]) -> str:
    """Return the picture of a scene without its scales, each frame named at the tip of its x axis."""
    now = np.array([0.0])
    solution = model.simulate(stop=1e-9, estimate_error=False)
    staged = solution.staged()
    assert staged is not None, "the model was loaded with its scene"
    axes = blank_axes((3.2, 2.4), (0.02, 0.02, 0.96, 0.96), staged[0].size == 2)
    found = Painter(solution, now, axes)
    extent = float(np.linalg.norm(found.high - found.low))
    arm = ARM * extent if extent > SMALLEST else 1.0
    shown = [s for s in found.scene.shapes if s.kind == "frame"][-len(frames) :]
    frames_at = [found.rows[0, list(shape.numbers)][:12] for shape in shown]
    places: dict[tuple[float, ...], list[str]] = {}
    for name, v in zip(frames, frames_at, strict=True):
        places.setdefault(tuple(np.round(v[:6], 6)), []).append(name)
    room = [np.array([v[:3] - arm, v[:3] + arm, v[:3] + 1.8 * arm * v[3:6]]) for v in frames_at]
    painter = Painter(solution, now, axes, room, small=BALL)
    painter.paint(0, opacity=PALE)
    axes.set_axis_off()
    axes.set_title("", loc="right")
    if not painter.flat:
        axes.computed_zorder = False  # axes within solids are seen
        axes.set_box_aspect(np.maximum(painter.high - painter.low, 0.2 * painter.size), zoom=1.3)
    for v in frames_at:
        painter.frame(v, arm)
    for (*origin, x, y, z), names in places.items():
        tip = np.array(origin) + 1.1 * arm * np.array([x, y, z])
        side = "left" if x >= 0 else "right"
        at = tip[:2] if painter.flat else tip
        axes.text(*at, ", ".join(names), fontsize=9, ha=side, va="center", zorder=9)
    buffer = io.StringIO()
    with rc_context({"svg.fonttype": "none", "svg.hashsalt": "mechc"}):
        axes.figure.savefig(buffer, format="svg", metadata={"Date": None}, transparent=True)
    return slim(buffer.getvalue())


def slim(svg: str) -> str:
    """Return the same picture with a tenth of a point as the finest step."""
    svg = re.sub(
        r"-?\d+\.\d{2,}", lambda m: f"{float(m[0]):.1f}".removesuffix(".0"), svg[svg.index("<svg") :]
    )
    return re.sub(r" *\n *", "\n", svg)


# ---------------------------------------------------------------- parts without frames

WIDTH, ROW, TOP = 320, 18, 44
"""Of a block, and the heights of a row and of its head, in points."""


def block(part: Part) -> str:
    """Draw a part as a block: its flanges, where it pushes or turns what is outside, as squares; inputs left, outputs right."""
    pushed = flanges(part)
    inputs = [(s.name, unit(s), s.name in pushed) for s in part.all(ast.Input)]
    outputs = [
        (s.name, unit(s), isinstance(s, ast.Coordinate))
        for s in part.all(ast.Coordinate, ast.State, ast.Output, ast.Discrete)
        if not isinstance(s, ast.Discrete) or s.name == "y"
    ]
    height = TOP + ROW * max(len(inputs), len(outputs), 1)
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{height}" viewBox="0 0 {WIDTH} {height}" '
        'font-family="sans-serif" font-size="11">',
        f'<rect x="60" y="6" width="200" height="{height - 12}" rx="4" fill="#3572b0" fill-opacity="0.12" stroke="#3572b0"/>',
        f'<text x="160" y="24" text-anchor="middle" font-weight="bold" fill="#3572b0">{part.model.name}</text>',
    ]
    for (x, inwards), entries in zip(((60, 1), (260, -1)), (inputs, outputs), strict=True):
        inner, outer = ("start", "end")[::inwards]
        for k, (name, of, mechanical) in enumerate(entries):
            y = TOP + ROW * k
            if mechanical:
                lines.append(f'<rect x="{x - 5}" y="{y - 5}" width="10" height="10" fill="#c8553d"/>')
            else:
                lines.append(f'<path d="M{min(x, x - 8 * inwards)} {y - 5}l8 5l-8 5z" fill="#3f8f5f"/>')
            for at, anchor, colour, word in (
                (x + 10 * inwards, inner, "#1f2937", name),
                (x - 12 * inwards, outer, "#8a6fb0", of),
            ):
                lines.append(
                    f'<text x="{at}" y="{y + 4}" text-anchor="{anchor}" fill="{colour}">{escape(word)}</text>'
                )
    return "\n".join([*lines, "</svg>", ""])


def unit(s: ast.Declaration) -> str:
    """Return the unit of an input or output where its type says it; what has no type takes that of its value."""
    return NAMED_TYPES[s.type].unit if s.type in NAMED_TYPES else ""


def flanges(part: Part) -> set[str]:
    """Return the inputs on which the part acts: whose rates take part in its power."""
    lets = {s.name: s.value for s in part.all(ast.Let)}
    acted: list[object] = [s.on for s in part.all(ast.Load, ast.Damping, ast.Friction)]
    acted += [s.value for s in part.all(ast.Energy)]
    acted += [(s.left, s.right) for s in part.all(ast.Constraint)]
    acted += [s.gap for s in part.all(ast.Contact)]
    names: set[str] = set()
    while acted:
        for found in references(acted.pop()):
            name = found.parts[0].name
            if name not in names:
                names.add(name)
                acted += [lets[name]] if name in lets else []
    return names


def references(value: object) -> Iterator[ast.Reference]:
    """Yield the names in an expression."""
    if isinstance(value, ast.Reference):
        yield value
    inside = value if isinstance(value, tuple) else ()
    if isinstance(value, ast.Node):
        inside = tuple(getattr(value, field) for field in value.__struct_fields__ if field != "span")
    for part in inside:
        yield from references(part)


# ---------------------------------------------------------------- the page


def illustrated(page: str, names: Collection[str], folder: str) -> str:
    """Return library.md with the diagram of each of these parts under what it is."""
    package, lines = "", []
    for block in re.split(r"(?m)^(?=#{2,3} )", page):
        package = block[8:].partition("\n")[0] if block.startswith("## mech.") else package
        head, said, rest = (*block.split("\n\n", 2), "", "")[:3]
        name = f"{package}.{head.rpartition(' ')[2]}"
        if head.startswith("### ") and name in names:
            block = f"{head}\n\n{said}\n\n![{name}]({folder}/{name}.svg)\n\n{rest}"
        lines.append(block)
    return "".join(lines)


def drawn(name: str) -> str:
    """Return the diagram of a part by its name."""
    return diagram(parts()[name])


if __name__ == "__main__":
    from own_installation import require_own_installation

    require_own_installation()
    folder, *asked = sys.argv[1:]
    Path(folder).mkdir(parents=True, exist_ok=True)
    chosen = asked or [*parts()]
    with ProcessPoolExecutor() as pool:
        for name, svg in zip(chosen, pool.map(drawn, chosen), strict=True):
            Path(folder, f"{name}.svg").write_text(svg, encoding="utf-8", newline="\n")

"""Make docs/library.md, the reference of the standard library, from its doc strings: ``python docs/library.py``."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from functools import cache
from itertools import takewhile
from pathlib import Path

from mechc.lang import ast
from mechc.lang.diagnostics import Reporter
from mechc.lang.parser import parse
from mechc.lang.printing.printer import print_expression
from mechc.lang.read import read_source

HERE = Path(__file__).resolve().parent
LIBRARY = HERE.parent / "stdlib"
PACKAGES = (
    "planar",
    "spatial",
    "contact",
    "shapes",
    "elements",
    "rotational",
    "translational",
    "control",
    "vehicle",
    "tyres",
    "rails",
    "suspension",
    "space",
    "machines",
    "couplings",
    "fields",
    "constants",
)

HEAD = """# The standard library

Seventeen packages, all written in the language itself (`stdlib/*.mech`): read them, copy them, extend them. Import with
`import mech.planar.*;`, or by name, `import mech.fields.{Gravitation};`. `A -> B` in a component binds its first two
frames, or its inputs `from` and `to`: `Revolute hinge(world -> bar.a, angle = 30 deg);`. Many joints take settings: `Revolute hinge(world -> bar.a, damping = 0.1 N.m.s,
limits = {-90, 90} deg);`; those that are not set are left out (`TurningSettings`, `SlidingSettings` and the like). Below its table, each part lists its statements: masses, energies,
forces, the equations that close a loop, and assertions that limit its validity; then [its names in other programs](how_to/parts_by_other_names.md), and examples that have one.

On the site, and in the folder that `python docs/diagrams.py FOLDER` writes, each part has a diagram: the picture of the part at its default parameters, with the
axes x (red), y (green) and z (blue) of its frames, and the coordinates of a joint away from zero; or a block with its flanges (squares), inputs and outputs (triangles)
and their units. Made from the library by `python docs/library.py`.
"""

EXAMPLES = {
    path: path.read_text(encoding="utf-8") for path in sorted((HERE.parent / "examples").rglob("*.mech"))
}
MOST_EXAMPLES = 3
NAMES = HERE / "how_to" / "parts_by_other_names.md"

KINDS = {
    ast.Parameter: "parameter",
    ast.Coordinate: "coordinate",
    ast.Input: "input",
    ast.Frame: "frame",
}


def page() -> str:
    """Return the text of library.md: a section for each package, a table for each model."""
    return HEAD + "".join(_package(name) for name in PACKAGES)


def _package(name: str) -> str:
    file = parse(read_source(LIBRARY / f"{name}.mech"), Reporter())
    lines = [f"\n## mech.{name}\n", _introduction((LIBRARY / f"{name}.mech").read_text(encoding="utf-8"))]
    functions = [item for item in file.items if isinstance(item, ast.Function)]
    if functions:
        lines += ["\n| function | value | |\n|---|---|---|\n"]
        lines += [
            f"| `{f.name}({', '.join(a.name for a in f.arguments)})` | {_value(f)} | {_cell(f.doc)} |\n"
            for f in functions
        ]
    for item in file.items:
        if isinstance(item, ast.Model):
            kind = "shape " if item.shape else ""
            lines.append(f"\n### {kind}{item.name}\n\n{_sentence(item.doc)}\n\n")
            lines.append(_table(item))
            lines.append(_formulas(item))
            lines.append(_elsewhere(name, item))
            lines.append(_used_in(name, item))
    return "".join(lines)


def _introduction(text: str) -> str:
    """Return what the comment at the head of a package says of its parts, after the line without words."""
    head = list(takewhile(lambda line: line.startswith("//"), text.splitlines()))
    said = head[head.index("//") + 1 :] if "//" in head else []
    return "".join(f"{line[2:].strip()}\n" for line in ("//", *said)) if said else ""


def _value(function: ast.Function) -> str:
    value = function.value
    return "" if function.arguments or value is None else f"`{print_expression(value)}`"


def _table(model: ast.Model) -> str:
    rows = []
    for item in _all(model.body):
        match item:
            case ast.Extends():
                rows.append(f"| extends | `{item.base}` | | |\n")
            case ast.Parameter() | ast.Coordinate() | ast.Input() | ast.Frame():
                rows.append(_row(item))
            case _:
                pass  # energies, closures and abbreviations are the model's own business
    return "".join(["| | name | default | |\n|---|---|---|---|\n", *rows])


def _all(body: Iterable[ast.Statement]) -> Iterator[ast.Statement]:
    """Return statements, those under conditions too."""
    for item in body:
        if isinstance(item, ast.If):
            for branch in item.branches:
                yield from _all(branch.body)
        else:
            yield item


def _formulas(model: ast.Model) -> str:
    """Show what a part states: its masses, energies and forces, where its joint places what it carries, and its limits; of a shape, how it
    is drawn."""
    shown = [
        " ".join(f"{condition}{item.span.text}".split())
        for condition, item in _conditioned(model.body)
        if not isinstance(item, (ast.Extends, ast.Experiment, *KINDS))
        and (model.shape or not isinstance(item, ast.Draw))
    ]
    return "".join(["\n```modelica\n", *(f"{line}\n" for line in shown), "```\n"]) if shown else ""


def _conditioned(body: Iterable[ast.Statement]) -> Iterator[tuple[str, ast.Statement]]:
    """Return statements with the words of their condition, as ``if given(damping): ``."""
    for item in body:
        if isinstance(item, ast.If):
            for branch in item.branches:
                yield from ((f"if {print_expression(branch.condition)}: ", inner) for inner in branch.body)
        else:
            yield "", item


@cache
def other_names() -> dict[str, list[str]]:
    """Return what each part is called in other programs, by the rows of the how-to: ``Modelica: IdealGear``."""
    found: dict[str, list[str]] = {}
    programs: list[str] = []
    for line in NAMES.read_text(encoding="utf-8").splitlines():
        here, *others = (cell.strip() for cell in line.strip("| ").split(" | "))
        if here == "here" or not line:
            programs = others
        if here == "here" or not programs or line.startswith("|-"):
            continue
        names = [f"{re.sub('`', '', p)}: {c}" for p, c in zip(programs, others, strict=True) if c != "—"]
        package = re.search(r"of `mech\.(\w+)`", here)
        for part in re.findall(r"`([A-Z]\w+)`", here if here.startswith("`") else ""):
            found.setdefault(f"{package[1]}.{part}" if package else part, []).extend(names)
    return found


def _elsewhere(package: str, model: ast.Model) -> str:
    """Say what a part is called elsewhere, so that a search for that finds it."""
    names = other_names().get(f"{package}.{model.name}") or other_names().get(model.name)
    return f"\n[Elsewhere]({NAMES.relative_to(HERE)}): {'; '.join(names)}.\n" if names else ""


def _used_in(package: str, model: ast.Model) -> str:
    """Name the shortest examples that have a part of this kind."""
    part = re.compile(rf"^ +(?:\w+\.)*{model.name} \w+", re.MULTILINE)
    if model.shape:
        part = re.compile(rf"^ +shape (?:\w+: )?{model.name}\b", re.MULTILINE)
    found = [
        (len(text), path)
        for path, text in EXAMPLES.items()
        if f"mech.{package}" in text and part.search(text)
    ]
    links = [
        f"[{p.stem.replace('_', ' ')}]({Path('..') / p.relative_to(HERE.parent)})" for _, p in sorted(found)
    ]
    return f"\nIn {', '.join(links[:MOST_EXAMPLES])}.\n" if links else ""


def _row(item: ast.Parameter | ast.Coordinate | ast.Input | ast.Frame) -> str:
    default = (
        item.start.value if isinstance(item, ast.Coordinate) and item.start else getattr(item, "value", None)
    )
    sizes = ", ".join(print_expression(d.size) for d in item.dimensions)
    name = f"{item.name}[{sizes}]" if sizes else item.name
    structural = isinstance(item, ast.Parameter) and item.structural
    kind = "structural parameter" if structural else KINDS[type(item)]
    sign = "~ " if isinstance(item, ast.Coordinate) and item.start and item.start.guess else ""
    shown = f"`{sign}{print_expression(default)}`" if default is not None else ""
    return f"| {kind} | `{name}` | {shown} | {_cell(item.doc)} |\n"


def _cell(text: str) -> str:
    """Return a text as a cell of a table, where a bar would end it."""
    return text.replace("|", "\\|")


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:] + "."


if __name__ == "__main__":
    from own_installation import require_own_installation

    require_own_installation()
    (HERE / "library.md").write_text(page(), encoding="utf-8")

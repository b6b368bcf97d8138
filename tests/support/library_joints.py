"""The joints of the library, taken out of its files: what places a frame ``to`` at a frame ``from``."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from msgspec import Struct

from mechc.lang import ast
from mechc.lang.diagnostics import Reporter
from mechc.lang.parser import parse
from mechc.lang.read import read_source

STDLIB = Path(__file__).resolve().parents[2] / "stdlib"

AXES = {2: ("{3, 4}", "{-4, 3}"), 3: ("{1, 2, 2}", "{2, -1, 0}")}
"""Directions beside the defaults, of no unit length; the second is across the first."""
LENGTHS = ("0.5 m", "0.2 m", "0.3 m")
"""Lengths beside the defaults."""
FURTHER = {
    ("planar", "RollingOnCircle"): ("track = 0.5 m, r = -0.2 m",),
    ("planar", "Rolling"): ("r = -0.4 m",),
}
"""Settings with a meaning of their own."""


class Joint(Struct, frozen=True):
    """``coordinates``: its single numbers, all but rotations; ``stated``: freedoms that its doc string tells."""

    library: str
    name: str
    coordinates: tuple[str, ...]
    settings: tuple[str, ...]
    stated: int | None

    @property
    def file(self) -> str:
        return f"stdlib/{self.library}.mech"


def joints() -> list[Joint]:
    """Return every joint of every file of the library."""
    return [joint for path in sorted(STDLIB.glob("*.mech")) for joint in _joints_of(path)]


def _joints_of(path: Path) -> Iterator[Joint]:
    file = parse(read_source(path), Reporter())
    models = {item.name: item for item in file.items if isinstance(item, ast.Model)}
    for model in models.values():
        body = _body(model, models)
        frames = {s.name for s in body if isinstance(s, ast.Frame)}
        if {"from", "to"} <= frames and any(isinstance(s, ast.Place) for s in body):
            yield Joint(
                path.stem,
                model.name,
                tuple(name for s in body if isinstance(s, ast.Coordinate) for name in _numbers(s)),
                tuple(dict.fromkeys(["", _settings(body), *FURTHER.get((path.stem, model.name), ())])),
                _stated(model.doc),
            )


def _body(model: ast.Model, models: dict[str, ast.Model]) -> list[ast.Statement]:
    """Return the statements of a model and of what it extends."""
    found: list[ast.Statement] = []
    for statement in model.body:
        base = models.get(statement.base) if isinstance(statement, ast.Extends) else None
        found += _body(base, models) if base is not None else [statement]
    return found


def _numbers(coordinate: ast.Coordinate) -> list[str]:
    if coordinate.type == "Rotation":
        return []
    if not coordinate.dimensions:
        return [coordinate.name]
    return [f"{coordinate.name}[{i + 1}]" for i in range(_size(coordinate))]


def _settings(body: list[ast.Statement]) -> str:
    """Return other values for the parameters than their defaults."""
    parameters = [s for s in body if isinstance(s, ast.Parameter)]
    directions = [p for p in parameters if p.type == "Real" and p.dimensions]
    lengths = [p for p in parameters if p.type == "Length" and not p.dimensions]
    unknown = [p.name for p in parameters if p not in directions and p not in lengths]
    assert not unknown, f"tests/support/library_joints.py knows no other values of {unknown}"
    given = [f"{p.name} = {AXES[_size(p)][i]}" for i, p in enumerate(directions)]
    given += [f"{p.name} = {LENGTHS[i]}" for i, p in enumerate(lengths)]
    return ", ".join(given)


def _size(vector: ast.Declaration) -> int:
    (dimension,) = vector.dimensions
    return int(dimension.size.span.text)


def _stated(doc: str) -> int | None:
    """Return the freedoms that a doc string tells: ``1 degree of freedom``, ``all 3 degrees of freedom``, ``no degree of freedom``."""
    found = re.search(r"(\d+|no) degrees? of freedom", doc)
    return None if found is None else 0 if found[1] == "no" else int(found[1])

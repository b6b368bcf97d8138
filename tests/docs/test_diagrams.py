"""Diagrams of parts: made from the part, with all its frames, or its flanges, inputs and outputs."""

from __future__ import annotations

import re
import sys
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

import pytest

from mechc.compiler.flat.names.space import nodes
from mechc.lang import ast

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "docs"))

import diagrams  # noqa: E402
from diagrams import parts  # noqa: E402

SHAPELESS = (
    "planar.Free",
    "planar.Planar",
    "planar.Translation",
    "planar.Weld",
    "planar.TorsionSpring",
    "planar.TorsionDamper",
    "planar.UniformMagneticField",
    "spatial.Free",
    "spatial.Planar",
    "spatial.Translation",
    "spatial.Weld",
    "spatial.Orientation",
    "spatial.UniformMagneticField",
    "elements.ConstantAngle",
    "fields.Gravitation",
    "fields.Coulomb",
    "fields.LinearDrag",
    "fields.QuadraticDrag",
    "space.GravityGradient",
    "space.SunPressure",
    "space.MagneticTorquer",
    "vehicle.Driver",
)
"""Parts with frames that have no shape of their own: what they relate has one."""


@cache
def words(name: str) -> dict[str, tuple[float, float]]:
    """Return the texts of a diagram and where they begin."""
    svg = ElementTree.fromstring(diagrams.drawn(name))
    found = {}
    for text in svg.iter("{http://www.w3.org/2000/svg}text"):
        moved = re.search(r"translate\(([-\d.]+) ([-\d.]+)\)", text.get("transform", ""))
        x, y = moved.groups() if moved else (text.get("x", "nan"), text.get("y", "nan"))
        for word in (text.text or "").split(", "):
            found[word] = (float(x), float(y))
    return found


def test_frames_are_where_the_part_has_them() -> None:
    at = words("planar.Bar")
    assert at["a"][0] < at["c"][0] < at["b"][0]
    # of numbers with one digit
    assert at["c"][0] - at["a"][0] == pytest.approx(at["b"][0] - at["c"][0], abs=0.2)
    assert at["a"][1] == at["b"][1] == at["c"][1]
    hinge = words("planar.Revolute")
    assert hinge["to"][1] < hinge["from"][1] and hinge["to"][0] < hinge["from"][0], "turned by 0.8 rad"


@pytest.mark.parametrize(
    ("name", "flanges"),
    [
        ("rotational.Servo", {"from", "to"}),
        ("rotational.Clutch", {"from", "to"}),
        ("rotational.SpeedSource", {"from", "to"}),
        ("rotational.Gear", {"from", "to", "support"}),
        ("translational.Cylinder", {"from", "to"}),
        ("elements.Muscle", {"length"}),
        ("vehicle.RoadVehicle", {"s"}),
        ("control.PID", set()),
        ("translational.Valve", set()),
    ],
)
def test_flanges_are_what_a_part_acts_on(name: str, flanges: set[str]) -> None:
    part = parts()[name]
    inputs = {s.name for s in part.all(ast.Input)}
    assert diagrams.flanges(part) & inputs == flanges
    assert diagrams.drawn(name).count("<rect") == 1 + len(flanges)
    assert inputs <= {*words(name)}


def test_a_block_has_units() -> None:
    assert {"DCMotor", "voltage", "V", "rad", "i", "A", "torque", "N.m"} <= {*words("rotational.DCMotor")}


@pytest.mark.slow
@pytest.mark.parametrize("name", parts())
def test_every_part_has_a_diagram(name: str) -> None:
    part = parts()[name]
    named = {f.name for f in part.all(ast.Frame) if not f.dimensions}
    named |= set() if named else {s.name for s in part.all(ast.Input, ast.Output)}
    assert named <= {*words(name)}
    assert len(diagrams.drawn(name)) < 100_000


def test_every_part_with_frames_draws_itself() -> None:
    """What has no shape is listed, so that a body without one is noticed."""
    without = [
        name
        for name, part in parts().items()
        if part.all(ast.Frame)
        and not any(isinstance(n, ast.Draw) and n.shape != "none" for s in part.body for n in nodes(s))
        and not part.all(ast.Component)
        and not part.model.shape
    ]
    assert sorted(without) == sorted(SHAPELESS)


def test_the_page_shows_the_diagrams_that_there_are() -> None:
    page = (ROOT / "docs" / "library.md").read_text(encoding="utf-8")
    shown = diagrams.illustrated(page, {"rotational.Gear", "couplings.Gear", "shapes.Sphere"}, "d")
    assert sorted(re.findall(r"!\[[^]]+\]\(d/(.+)\.svg\)", shown)) == [
        "couplings.Gear",
        "rotational.Gear",
        "shapes.Sphere",
    ]
    assert re.sub(r"!\[[^]]+\]\(d/.+\.svg\)\n\n", "", shown) == page
    assert len(re.findall(r"!\[", diagrams.illustrated(page, parts(), "d"))) == len(parts())

"""Names of parts in the tables for those who come from other programs: each is one of the library, with the parameters that are said."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import pytest

import mechc
from mechc.lang import ast
from mechc.lang.builtins import BUILTINS
from mechc.lang.diagnostics import Reporter
from mechc.lang.grammar.keywords import KEYWORDS
from mechc.lang.parser import parse
from mechc.lang.read import read_source

ROOT = Path(mechc.__file__).parents[1]
HOW_TO = ROOT / "docs" / "how_to"


@cache
def library() -> tuple[dict[str, set[str]], set[str]]:
    """Return the names that each part lets others set, of all parts of one name, and the functions."""
    parts: dict[str, set[str]] = {}
    functions: set[str] = set()
    for path in sorted((ROOT / "stdlib").glob("*.mech")):
        for item in parse(read_source(path), Reporter()).items:
            if isinstance(item, ast.Function):
                functions.add(item.name)
            elif isinstance(item, ast.Model):
                known = parts.setdefault(item.name, set())
                for s in item.body:
                    if isinstance(s, ast.Extends):
                        known |= parts.get(s.base, set())
                    elif isinstance(s, (ast.Parameter, ast.Input, ast.Frame, ast.Coordinate)):
                        known.add(s.name)
    return parts, functions


def rows(page: str) -> list[list[str]]:
    """Return the rows of the tables of a page as their cells, without their heads."""
    text = (HOW_TO / page).read_text(encoding="utf-8")
    lines = [line for line in text.splitlines() if line.startswith("| ") and not line.startswith("| here")]
    return [line.strip("| ").split(" | ") for line in lines]


def cells(page: str, column: int) -> list[str]:
    """Return what stands between backticks in a column of the tables of a page."""
    return [cell for row in rows(page) if len(row) > column for cell in re.findall(r"`([^`]+)`", row[column])]


def test_parts_by_other_names() -> None:
    parts, functions = library()
    settings = set().union(*(names for part, names in parts.items() if part.endswith("Settings")))
    known = {*parts, *functions, *settings, *KEYWORDS, *BUILTINS, "to", "world"}
    first = [row[0] for row in rows("parts_by_other_names.md") if row[0].startswith("`")]
    names = [n for cell in first for n in re.findall(r"`(\w\w+)`", cell)]
    assert len(names) > 180
    assert [n for n in names if n not in known] == []


def test_every_part_of_the_library_is_named() -> None:
    named = set(cells("parts_by_other_names.md", 0))
    for path in sorted((ROOT / "stdlib").glob("*.mech")):
        for item in parse(read_source(path), Reporter()).items:
            if isinstance(item, ast.Model) and not item.partial and "Meets" not in item.name:
                assert item.name in named, f"{path.stem}.{item.name}"


@pytest.mark.parametrize(("column", "program"), [(1, "modelica"), (2, "simscape"), (3, "adams")])
def test_every_name_elsewhere_has_an_answer(column: int, program: str) -> None:
    """Parts of Modelica.Mechanics and Modelica.Blocks (4.1), of Simscape Foundation, Driveline and Multibody, joints and forces of Adams."""
    said = ", ".join(row[column] for row in rows("parts_by_other_names.md") if len(row) == 4)
    asked = (Path(__file__).parent / "names_elsewhere" / f"{program}.txt").read_text(encoding="utf-8")
    names = [name for line in asked.splitlines() if not line.startswith("#") for name in line.split(", ")]
    assert len(names) > 30
    assert [
        n for n in names if not re.search(rf"(?<![\w.]){re.escape(n)}(?![\w])|\.{re.escape(n)}`", said)
    ] == []


def test_the_library_says_what_parts_are_called_elsewhere() -> None:
    """So that the search of the site finds a part by its name in another program."""
    page = (ROOT / "docs" / "library.md").read_text(encoding="utf-8")
    sections = re.split(r"(?m)^### ", page)
    for part, name in (
        ("Rack", "IdealGearR2T"),
        ("SpringDamper", "Torsional Spring-Damper"),
        ("Screw", "Lead Screw Joint"),
        ("Differential", "Sun-Planet Bevel"),
        ("ConstantVelocity", "constant velocity joint"),
        ("Hysteresis", "OnOffController"),
    ):
        assert any(
            text.startswith(f"{part}\n") and name in text.partition("[Elsewhere](")[2] for text in sections
        ), part


def test_parts_for_those_who_know_modelica() -> None:
    """``Name(a -> b, k, c)``: the part has ``k`` and ``c``; ``a -> b`` are its ends."""
    parts, _ = library()
    written = [re.match(r"([A-Z]\w+)(?: \w+)?(?:\((.*)\))?;?$", c) for c in cells("from_modelica.md", 1)]
    found = [(m[1], m[2] or "") for m in written if m and m[1] != "Joint"]  # it stands for any
    assert len(found) > 25
    for name, given in found:
        assert name in parts, name
        said = [
            re.match(r"(?:der\()?(\w+)", a.strip()) for a in given.split(",") if a.strip() and "->" not in a
        ]
        assert {m[1] for m in said if m} <= parts[name], name


@pytest.mark.parametrize("page", ["parts_by_other_names.md", "from_modelica.md"])
def test_rows_are_whole(page: str) -> None:
    """Every row has as many columns as the head above it."""
    columns = 0
    for line in (HOW_TO / page).read_text(encoding="utf-8").splitlines():
        count = line.count(" | ") if line.startswith("| ") else 0
        assert not columns or not count or count == columns, line
        columns = count


def test_machines_of_parts_are_as_short_as_the_page_says() -> None:
    """Lines of the examples without comments and blank lines, in the canonical layout that all examples have; none above 60 % of the same by hand."""
    page = (HOW_TO / "parts_by_other_names.md").read_text(encoding="utf-8")
    jobs = re.findall(r"(?m)^\| [^|]+ \| (\d+) \| (\d+) \| (\d+) % \| \[(\w+)\]", page)
    assert len(jobs) == 9
    for by_hand, of_parts, share, name in jobs:
        text = (ROOT / "examples" / f"{name}.mech").read_text(encoding="utf-8")
        lines = [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("//")]
        assert len(lines) == int(of_parts), name
        assert round(100 * len(lines) / int(by_hand)) == int(share) <= 60, name

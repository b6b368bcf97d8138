"""Names of parts in the tables for those who come from other programs: each is one of the library, with the parameters that are said."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import pytest

import mechc
from mechc.lang import ast
from mechc.lang.diagnostics import Reporter
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


def cells(page: str, column: int) -> list[str]:
    """Return what stands between backticks in a column of the tables of a page, without their heads."""
    text = (HOW_TO / page).read_text(encoding="utf-8")
    rows = [line.split(" | ") for line in text.splitlines() if line.startswith("| `")]
    return [cell for row in rows for cell in re.findall(r"`([^`]+)`", row[column])]


def test_parts_by_other_names() -> None:
    parts, functions = library()
    settings = set().union(*(names for part, names in parts.items() if part.endswith("Settings")))
    names = [n for n in cells("parts_by_other_names.md", 0) if re.fullmatch(r"\w+", n)]
    assert len(names) > 90
    assert [n for n in names if n not in parts and n not in functions and n not in settings] == []


def test_parts_for_those_who_know_modelica() -> None:
    """``Name(a -> b, k, c)``: the part has ``k`` and ``c``; ``a -> b`` are its ends."""
    parts, _ = library()
    written = [re.match(r"([A-Z]\w+)(?: \w+)?(?:\((.*)\))?;?$", c) for c in cells("from_modelica.md", 1)]
    found = [(m[1], m[2] or "") for m in written if m and m[1] != "Joint"]  # it stands for any
    assert len(found) > 25
    for name, given in found:
        assert name in parts, name
        said = [re.match(r"\w+", a.strip()) for a in given.split(",") if a.strip() and "->" not in a]
        assert {m[0] for m in said if m} <= parts[name], name


@pytest.mark.parametrize("page", ["parts_by_other_names.md", "from_modelica.md"])
def test_rows_are_whole(page: str) -> None:
    """Every row has as many columns as the head above it."""
    columns = 0
    for line in (HOW_TO / page).read_text(encoding="utf-8").splitlines():
        count = line.count(" | ") if line.startswith("| ") else 0
        assert not columns or not count or count == columns, line
        columns = count

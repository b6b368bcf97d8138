"""The library tells what everything in it is, and its page in the documentation says the same."""

from __future__ import annotations

import importlib.util
import re
import sys
from pathlib import Path

import pytest
from gallery import ROOT

from mechc.lang import ast
from mechc.lang.diagnostics import Reporter
from mechc.lang.parser import parse
from mechc.lang.printing.printer import format_file
from mechc.lang.read import read_source

FILES = sorted((ROOT / "stdlib").glob("*.mech"))


@pytest.mark.parametrize("path", FILES, ids=lambda p: p.stem)
def test_every_declaration_has_a_doc_string(path: Path) -> None:
    file = parse(read_source(path), Reporter())
    for item in file.items:
        assert item.doc or isinstance(item, ast.Import), item
        if isinstance(item, ast.Model):
            for inner in item.body:
                assert not isinstance(inner, ast.Declaration) or inner.doc, f"{item.name}.{inner.name}"


@pytest.mark.parametrize("path", FILES, ids=lambda p: p.stem)
def test_canonical_layout(path: Path) -> None:
    source = read_source(path)
    assert format_file(parse(source, Reporter())) == source.text


def test_every_part_shows_what_it_states() -> None:
    """Its masses, energies, forces or equations stand on the page, or the part from which it has them is named there."""
    page = (ROOT / "docs" / "library.md").read_text(encoding="utf-8")
    parts = re.split(r"^### ", page, flags=re.MULTILINE)[1:]
    assert len(parts) > 60
    silent = [
        part.partition("\n")[0]
        for part in parts
        if "```modelica" not in part and "| extends |" not in part and "| coordinate |" not in part
    ]
    assert silent == []
    assert sum("\nIn [" in part for part in parts) > len(parts) / 3


def test_every_part_is_tested_here() -> None:
    """A test of this folder names it, or an example that has it. What contacts of shapes are has a table of its own, in test_contacts_of_shapes.py."""
    tests = "\n".join(path.read_text(encoding="utf-8") for path in Path(__file__).parent.glob("*.py"))
    words = set(re.findall(r"\w+", tests))
    for path in (ROOT / "examples").glob("*.mech"):
        if f'"{path.stem}"' in tests:
            words |= set(re.findall(r"\w+", path.read_text(encoding="utf-8")))
    parts = [
        item.name
        for path in FILES
        for item in parse(read_source(path), Reporter()).items
        if isinstance(item, ast.Model) and not item.partial and "Meets" not in item.name
    ]
    assert len(parts) > 150
    assert [name for name in parts if name not in words] == []


def test_page_is_up_to_date() -> None:
    """docs/library.md is what ``python docs/library.py`` writes."""
    spec = importlib.util.spec_from_file_location("library", ROOT / "docs" / "library.py")
    assert spec is not None and spec.loader is not None
    library = importlib.util.module_from_spec(spec)
    sys.modules["library"] = library
    spec.loader.exec_module(library)
    assert (ROOT / "docs" / "library.md").read_text(encoding="utf-8") == library.page()

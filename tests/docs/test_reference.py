"""The reference names all that there is: parts, studies, messages, units, types, shapes. Other tests of this folder look at
commands, options, statements and functions."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

import pytest
from error_pages import INDEX, codes_with_a_page

from mechc.compiler.flat.statements.shapes import SHAPES
from mechc.lang.units import NAMED_TYPES, PREFIXES
from mechc.runtime.studies.table import STUDIES

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
PARTS = [
    name
    for path in sorted((ROOT / "stdlib").rglob("*.mech"))
    for name in re.findall(r"^model (\w+)", path.read_text(encoding="utf-8"), re.MULTILINE)
]
ALL = {
    "library.md": [*PARTS],
    "studies.md": [*STUDIES],
    "errors.md": [*codes_with_a_page()],
    "units.md": [*PREFIXES, *NAMED_TYPES],
    "language.md": [*SHAPES],
}


@pytest.mark.parametrize("page", ALL)
def test_every_name_stands_on_its_page(page: str) -> None:
    text = (DOCS / page).read_text(encoding="utf-8")
    assert len(ALL[page]) > 15
    assert [
        name for name in ALL[page] if not re.search(rf"[`\[(]{re.escape(name)}[`\](]|\b{name}\b", text)
    ] == []


def test_units_are_those_of_the_tables() -> None:
    spec = importlib.util.spec_from_file_location("units_page", DOCS / "units.py")
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert module.page() == (DOCS / "units.md").read_text(encoding="utf-8"), (
        "python docs/units.py writes it again"
    )


def test_the_index_of_messages_is_whole() -> None:
    rows = re.findall(r"^\| \[(\w+)\]", INDEX.read_text(encoding="utf-8"), re.MULTILINE)
    assert sorted(rows) == sorted(codes_with_a_page())

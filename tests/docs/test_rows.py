"""The table of all rows of the sources: each has a question, an answer, a file to run and a test that names it."""

from __future__ import annotations

import importlib.util
import re
import sys
from pathlib import Path
from types import ModuleType

ROOT = Path(__file__).resolve().parents[2]


def module(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, ROOT / "docs" / f"{name}.py")
    assert spec is not None and spec.loader is not None
    found = importlib.util.module_from_spec(spec)
    sys.modules[name] = found
    spec.loader.exec_module(found)
    return found


rows, figures = module("rows"), module("figures")
ROWS = rows.read()


def test_the_table_is_whole() -> None:
    """216 rows in their order, none without a question, an answer, a file and a test; the page is made from them."""
    assert [row.name for row in ROWS] == rows.ids() and len(ROWS) == 216
    for row in ROWS:
        assert row.asked and row.answered and row.examples and row.tests, row.name
        for example in row.examples:
            assert (ROOT / "examples" / f"{example}.mech").is_file(), (row.name, example)
    assert (ROOT / "docs" / "sources.md").read_text(encoding="utf-8") == rows.page(), "python docs/rows.py"


def test_the_gallery_tells_the_same_rows() -> None:
    """An example of the gallery that names a row is a file of that row."""
    named = {(row, r.example) for r in figures.ROWS for row in re.findall(r"\b[UKTVP]\d+\b", r.rows)}
    listed = {(row.name, example) for row in ROWS for example in row.examples}
    assert named <= listed
    # but for curves, which the gallery does not draw, and the kinds of constraints
    assert all(example.startswith("curves/") or row == "U41" for row, example in listed - named)


def test_tests_are_there_and_name_their_rows() -> None:
    """By the row, or by a file of the row, in the test, in the table of cases that it goes through, or at the head of its module."""
    for row in ROWS:
        for test in row.tests:
            file, _, function = test.partition("::")
            text = (ROOT / "tests" / file).read_text(encoding="utf-8")
            body = re.search(
                rf"((?:^@[^\n]*\n(?:[ )\]][^\n]*\n)*)*)^def {function}\(.*?(?=^(?:def |@|class |[A-Z_]+)|\Z)",
                text,
                re.S | re.M,
            )
            assert body is not None, test
            used = [text.partition("from __future__")[0], body.group(0)]
            used += [
                cases[0]
                for cases in re.finditer(r"^([A-Z_]+)(?:: [^\n=]*)? = .*?(?=^\S)", text, re.S | re.M)
                if re.search(rf"\b{cases[1]}\b", body.group(0))
            ]
            names = [row.name, *(f'"{example.rpartition("/")[2]}"' for example in row.examples)]
            assert any(
                re.search(rf"(?<!\w){re.escape(name)}(?!\w)", part) for name in names for part in used
            ), f"{row.name} in {test}"


def test_links_of_the_gallery_lead_somewhere() -> None:
    page = (ROOT / "docs" / "gallery.md").read_text(encoding="utf-8")
    for target in set(re.findall(r"\]\(\.\./([^)]+)\)", page)):
        assert (ROOT / target).exists(), target

"""The table of all rows of the sources: each has a model and a test that names it, or says why not."""

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
EXAMPLES = rows.of_examples((r.rows, r.example, r.test) for r in figures.ROWS)


def test_the_table_is_whole() -> None:
    """216 rows; none twice, none without an answer, none that does not exist."""
    ids = rows.ids()
    assert len(ids) == 216
    assert set(EXAMPLES) <= set(ids) and set(rows.OTHERS) <= set(ids) and set(rows.SAID) <= set(ids)
    assert not set(EXAMPLES) & set(rows.OTHERS), "a row with an example needs no other"
    assert set(ids) == set(EXAMPLES) | set(rows.OTHERS)
    page = (ROOT / "docs" / "gallery.md").read_text(encoding="utf-8")
    lines = [line for line in page.splitlines() if re.match(r"\| [UKTVP]\d+ \| ", line)]
    for name in ids:
        assert any(
            (line.startswith(f"| {name} | ") and "](" in line) or name in rows.OTHERS for line in lines
        ), name


def test_rows_without_an_example_have_tests_that_name_them() -> None:
    for name, row in rows.OTHERS.items():
        assert bool(row.tests) != bool(row.said), name
        for test in row.tests:
            file, _, function = test.partition("::")
            text = (ROOT / "tests" / file).read_text(encoding="utf-8")
            body = re.search(rf"def {function}\(.*?(?=\n(?:def |@|\Z))", text, re.DOTALL)
            assert body is not None, test
            assert re.search(rf"\b{name}\b", body.group(0) + _module_doc(text)), f"{name} in {test}"
        if row.curve:
            assert (ROOT / "examples" / "curves" / f"{row.curve}.mech").is_file()


def _module_doc(text: str) -> str:
    return text.partition("from __future__")[0]


def test_links_lead_somewhere() -> None:
    page = (ROOT / "docs" / "gallery.md").read_text(encoding="utf-8")
    for target in set(re.findall(r"\]\(\.\./([^)]+)\)", page)):
        assert (ROOT / target).exists(), target

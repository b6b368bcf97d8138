"""Rows of tables have as many cells as their heads: what stands beyond them is not shown."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


def _bars(row: str) -> int:
    return row.replace("\\|", "").count("|")


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.stem)
def test_rows_have_the_cells_of_their_head(path: Path) -> None:
    text = re.sub(r"^```.*?^```$", "", path.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    for table in re.findall(r"(?:^\|.*\n)+", text, re.MULTILINE):
        head, *rows = table.splitlines()
        for row in rows:
            assert _bars(row) == _bars(head), row

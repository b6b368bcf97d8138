"""The first page of the measurements, which is kept while the pages that it sums up are made again."""

from __future__ import annotations

from pathlib import Path

import pytest

from bench import index

ROOT = Path(__file__).resolve().parents[2]

PAGE = """# Speed

How fast it is.

| a | b |
|---|---|
| 1 | 2 |

| picture |
|---|
| ![x](x.png) |

Measured on: 2026-11-21; a machine; Python 3.11.7.

Made in 90 s.
"""


def long(rows: int) -> str:
    return "| a |\n|---|\n" + "| 1 |\n" * rows


def test_a_section_has_the_title_the_first_words_and_the_short_tables() -> None:
    text = PAGE.replace("Measured", f"{long(index.SHORT + 1)}\nMeasured")
    assert index.section("speed.md", text) == (
        "## Speed\n\nHow fast it is.\n\n| a | b |\n|---|---|\n| 1 | 2 |\n\n"
        "In `speed.md`. 2026-11-21; a machine; Python 3.11.7. Made in 90 s."
    )
    assert long(index.SHORT).strip() in index.section("speed.md", f"# T\n\nWords.\n\n{long(index.SHORT)}")


def test_pages_that_are_not_made_again_keep_their_sections(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(index, "REPORT", tmp_path)
    (tmp_path / "speed.md").write_text(PAGE, encoding="utf-8")
    index.main()
    (tmp_path / "speed.md").unlink()
    (tmp_path / "ease.md").write_text(PAGE.replace("Speed", "Ease").replace("90", "30"), encoding="utf-8")
    index.main()
    first = (tmp_path / "README.md").read_text(encoding="utf-8")
    assert list(index.sections(first)) == ["ease.md", "speed.md"]
    assert first.endswith("All pages together took 2 minutes.\n")


def test_the_page_that_is_kept_is_one_of_these() -> None:
    kept = (ROOT / "bench" / "report" / "README.md").read_text(encoding="utf-8")
    assert index.index(index.sections(kept)) == kept

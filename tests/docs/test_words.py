"""The index of the field's words: made from the pages, without a dead link, and with an exercise where a course begins."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "words.md"

spec = importlib.util.spec_from_file_location("words", ROOT / "docs" / "words.py")
assert spec is not None and spec.loader is not None
words = importlib.util.module_from_spec(spec)
spec.loader.exec_module(words)


def rows() -> dict[str, list[str]]:
    lines = PAGE.read_text(encoding="utf-8").splitlines()
    cells = [
        [cell.strip() for cell in line.strip("|").split("|")] for line in lines if line.startswith("| ")
    ][1:]
    return {row[0]: row[1:] for row in cells}


def test_the_index_is_what_the_pages_say() -> None:
    assert PAGE.read_text(encoding="utf-8") == words.page(), "python docs/words.py"


def test_links_lead_somewhere() -> None:
    for target in set(re.findall(r"\]\(([^)]+)\)", PAGE.read_text(encoding="utf-8"))):
        path, _, anchor = target.partition("#")
        file = (PAGE.parent / path).resolve()
        assert file.is_file(), target
        if anchor:
            assert f"#{anchor}" in {a for _, a, _ in words.sections(file)}, target


def test_every_word_leads_to_an_example_or_a_page() -> None:
    for word, (examples, studies, _, _) in rows().items():
        assert examples or studies, word


def test_subjects_of_a_course_have_an_exercise() -> None:
    """Each with an example and a study beside it."""
    found = rows()
    for word in (
        "period doubling",
        "Poincaré section",
        "gyroscope",
        "stick-slip",
        "bifurcation",
        "inverse dynamics",
    ):
        examples, _, _, exercises = found[word]
        assert exercises, word
        assert examples or word == "inverse dynamics", word

"""The page of studies: every kind has a section with a worked example, and its commands print what the page shows."""

from __future__ import annotations

import math
import re
import shlex
from pathlib import Path

import pytest
from page_blocks import NUMBER, blocks

from mechc.cli.main import run
from mechc.runtime.studies.table import STUDIES

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "studies.md").read_text(encoding="utf-8")
SECTIONS = {part.partition("\n")[0]: part for part in re.split(r"^## ", PAGE, flags=re.MULTILINE)[1:]}
ELSEWHERE = {
    "fit": "its measured data are in no file of the repository; tests/runtime/test_fit.py repeats such a search"
}
CLOSE = 1e-3
CHAOTIC = {"lyapunov": 3e-2}
"""Kinds whose figures follow from a chaotic motion, which no two builds share: as close as their stated errors, twice."""


def example(name: str) -> tuple[str, str]:
    """Give the first command of a kind's section that names it, and the first line of the answer that the page shows."""
    texts = [block.text for block in blocks(SECTIONS.get(name, ""))]
    lines = [line for text in texts for line in text.splitlines()]
    commands = [line for line in lines if re.match(rf"mechc (study )?{name} ", line)]
    answers = [
        line
        for line in lines
        if re.match(rf"\w+, {name}: ", line)
        or (
            name in ("simulate", "sweep", "ensemble")
            and re.match(r"[A-Z]\w+(, \w+)?( of| ensemble|:).*\d", line)
        )
    ]
    assert commands and answers, f"the section '{name}' of docs/studies.md shows no worked example"
    return commands[0].partition("#")[0], answers[0]


@pytest.mark.parametrize("name", STUDIES)
def test_every_kind_has_a_worked_example(name: str) -> None:
    example(name)


def alike(line: str, shown: str, close: float = CLOSE) -> bool:
    """Whether two lines have the same words, and the same numbers but for what rounding changes."""
    if NUMBER.sub("#", line) != NUMBER.sub("#", shown):
        return False
    pairs = zip(NUMBER.findall(line), NUMBER.findall(shown), strict=True)
    return all(
        math.isclose(float(a.replace(" ", "")), float(b.replace(" ", "")), rel_tol=close, abs_tol=1e-12)
        for a, b in pairs
    )


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in STUDIES if name not in ELSEWHERE])
def test_the_example_prints_what_the_page_shows(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    command, shown = example(name)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    models = [block.text for block in blocks(SECTIONS[name]) if block.language == "mech"]
    words = shlex.split(command)[1:]
    for word in words:
        if word.endswith(".mech") and "/" not in word:
            (tmp_path / word).write_text(models[0], encoding="utf-8")
    assert run(words) == 0
    printed = capsys.readouterr().out
    assert any(alike(line, shown, CHAOTIC.get(name, CLOSE)) for line in printed.splitlines()), printed

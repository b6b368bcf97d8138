"""The how-tos and the explanations do what they say: all files, commands, printed lines and programs, in order."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest
from page_blocks import blocks, follow, steps, unlike
from slow_params import slow_among

from mechc.runtime.ensembles.device import find_device
from mechc.runtime.outcome import SimulationError

ROOT = Path(__file__).resolve().parents[2]
EXPLANATIONS = sorted(
    path for path in (ROOT / "docs" / "explanation").glob("*.md") if path.name != "README.md"
)
HOW_TO = sorted(path for path in (ROOT / "docs" / "how_to").glob("*.md") if path.name != "README.md")
LONG = {
    "fmu_in_co_simulation",
    "c_for_embedded_use",
    "cluster",
    "device",
    "batches_of_gradients",
    "learning",
    "long_results",
    "basins",
    "controller_that_knows_the_model",
    "forces_of_measured_motion",
    "predictive_control",
    "reproducible_runs",
    "pictures_for_print",
    "measured_motion",
    "how_equations_are_formed",
}
"""Pages that build libraries or pages, begin processes, or run for long."""


@pytest.mark.parametrize(
    "page",
    [
        pytest.param(path, id=path.stem, marks=[pytest.mark.slow] if path.stem in LONG else [])
        for path in HOW_TO
    ],
)
def test_how_to(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    for library in ("casadi", "jax"):
        if f"--target {library}" in page.read_text(encoding="utf-8"):
            pytest.importorskip(library, reason=f"needs {library}: pip install 'mechc[{library}]'")
    if ".gym(" in page.read_text(encoding="utf-8"):
        pytest.importorskip("gymnasium", reason="needs Gymnasium: pip install 'mechc[gym]'")
    if "--workers" in page.read_text(encoding="utf-8"):
        pytest.importorskip("distributed", reason="needs Dask: pip install 'mechc[cluster]'")
    if "--device" in page.read_text(encoding="utf-8"):
        try:
            find_device("opencl")
        except SimulationError as missing:
            pytest.skip(missing.message)
    if "\n$ cc " in page.read_text(encoding="utf-8") and shutil.which("cc") is None:
        pytest.skip("needs a C compiler by the name of cc")
    assert follow(page.read_text(encoding="utf-8")) > 0


@pytest.mark.parametrize(
    "page",
    slow_among([p for p in EXPLANATIONS if p.stem in LONG], EXPLANATIONS),
    ids=lambda path: path.stem,
)
def test_explanation(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    text = page.read_text(encoding="utf-8")
    assert follow(text) > 0
    assert "\n## Sources\n" in text


@pytest.mark.parametrize("pages", [HOW_TO, EXPLANATIONS], ids=["how_to", "explanation"])
def test_every_page_is_listed(pages: list[Path]) -> None:
    listed = (pages[0].parent / "README.md").read_text(encoding="utf-8")
    assert set(re.findall(r"\]\((\w+\.md)\)", listed)) == {path.name for path in pages}


def test_links() -> None:
    indices = (pages[0].parent / "README.md" for pages in (HOW_TO, EXPLANATIONS))
    for path in (*HOW_TO, *EXPLANATIONS, *indices):
        text = re.sub(r"^```.*?^```$", "", path.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
        text = re.sub(r"`[^`\n]*`", "", text)
        targets = re.findall(r"\]\((?!https?:)([^)#]+)[^)]*\)", text)
        assert [target for target in targets if not (path.parent / target).exists()] == [], path.name


def test_what_is_not_printed_is_found() -> None:
    printed = "one 1.234567 m\n\ntwo\nsteps 7\nthree\n"
    assert unlike(("one 1.234568 m", "two", "steps 8"), printed) is None
    assert unlike(("one 1.234567 m", "...", "three"), printed) is None
    assert unlike(("one 1.235 m",), printed) == "one 1.235 m"
    assert unlike(("one 1.234567 m", "three"), printed) == "one 1.234567 m\nthree"
    assert unlike(("three", "...", "two"), printed) == "two"


def test_what_prints_an_error_has_to_fail() -> None:
    text = "$ mechc check a.mech\nerror[E0301]: no\n$ mechc fit a.mech\n...\n  errors: half\n$ mechc run a.mech\n...\nerror: no\n"
    assert [step.code for step in steps(text)] == [1, 0, 1]


def test_blocks() -> None:
    page = "```mech file=a.mech\nx\n```\ntext\n```console\n$ mechc run a.mech\n```\n```\nplain\n```\n"
    assert [(b.language, b.file, b.text) for b in blocks(page)] == [
        ("mech", "a.mech", "x\n"),
        ("console", "", "$ mechc run a.mech\n"),
        ("", "", "plain\n"),
    ]

"""The language page is complete, and its examples are right."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from mechc.api import loads
from mechc.compiler.pipeline import compile_source
from mechc.lang.builtins import BUILTINS, Category
from mechc.lang.grammar.keywords import DEFINITIONS, STATEMENTS
from mechc.lang.source import SourceFile

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "language.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```mech\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
LATER = {Category.EVENT}


@pytest.mark.parametrize("number", range(len(BLOCKS)))
def test_examples_compile_without_a_warning(number: int) -> None:
    assert compile_source(SourceFile(f"example {number}", BLOCKS[number])).diagnostics == ()


@pytest.mark.parametrize("number", [i for i, block in enumerate(BLOCKS) if "experiment(" in block])
def test_examples_with_an_experiment_run(number: int) -> None:
    assert loads(BLOCKS[number]).simulate().outcome.value in ("completed", "terminated")


def test_an_heir_of_the_chain_weighs_what_it_says() -> None:
    """The page's own words: link.m = 5 kg goes before the M/n within the chain."""
    (chain,) = (block for block in BLOCKS if "model Chain" in block)
    heir = "model Heir\n  extends Chain(link.m = 5 kg);\n  output whole = sum(link[i].m for i in 1:n);\nend Heir;\n"
    for model, whole in (("Heir", 20), ("Chain", 2)):
        text = chain.replace("end Chain", "  output whole = sum(link[i].m for i in 1:n);\nend Chain")
        made = loads(chain + heir if model == "Heir" else text, model=model)
        assert made.simulate(stop=1e-3, estimate_error=False)["whole"][0] == pytest.approx(whole)


def test_every_function_is_described() -> None:
    missing = [b.name for b in BUILTINS.values() if b.category not in LATER and f"`{b.name}" not in PAGE]
    # 'origin' stands for 'pos', 'at' belongs to what comes later.
    assert set(missing) <= {"origin", "at"}


def test_every_statement_is_described() -> None:
    words = {*STATEMENTS, *DEFINITIONS} - {"place", "closure"}
    missing = [
        word
        for word in sorted(words)
        if not re.search(rf"`[^`\n]*\b{word}\b|^\s*{word}\b", PAGE, re.MULTILINE)
    ]
    assert not missing, f"docs/language.md tells nothing of {missing}"


@pytest.mark.parametrize("page", ["language", "events"])
def test_links_between_sections(page: str) -> None:
    text = (ROOT / "docs" / f"{page}.md").read_text(encoding="utf-8")
    anchors = {
        re.sub(r"[^a-z0-9 -]", "", title.lower()).replace(" ", "-")
        for title in re.findall(r"^## (.*)$", text, re.MULTILINE)
    }
    assert set(re.findall(r"\(#([^)]+)\)", text)) == anchors

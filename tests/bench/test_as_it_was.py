"""Runs of mechc before any was doubtful, as they were kept: today's rule doubts those whose balance was off."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest
from msgspec.structs import replace

from bench.planted import as_it_was
from bench.planted.fault import ROOT
from mechc.runtime.results import contradictions as rule

KEPT = {one.text: one for one in as_it_was.kept()}


def test_every_model_was_run() -> None:
    assert list(KEPT) == list(as_it_was.models())
    assert all(KEPT[text].point == point for text, (point, _) in as_it_was.models().items())


@pytest.mark.parametrize("text", [one.text for one in KEPT.values() if one.wrong])
def test_what_was_off_is_doubtful_by_the_rule_of_today(text: str) -> None:
    one = KEPT[text]
    assert one.outcome == "completed" and one.doubtful
    assert not replace(one, own=one.balance).doubtful or one.stated < one.balance / rule.FACTOR, (
        "an error of the integration"
    )


def test_the_rule_decides(monkeypatch: pytest.MonkeyPatch) -> None:
    wrong = [one for one in KEPT.values() if one.wrong]
    assert len(wrong) >= 10 and any(not one.doubtful for one in KEPT.values())
    most = max(one.ratio for one in wrong)
    monkeypatch.setattr(rule, "FACTOR", 2 * most)
    assert not any(one.doubtful for one in wrong)


def test_the_page_of_accuracy_states_what_was_found() -> None:
    page = " ".join((ROOT / "docs" / "accuracy.md").read_text(encoding="utf-8").split())
    wrong = [one.ratio for one in KEPT.values() if one.wrong]
    assert f"of {len(KEPT)} models the balance of {len(wrong)} was off" in page
    assert f"off by {_short(min(wrong))} to {_short(max(wrong))} times" in page
    assert as_it_was.COMMIT[:8] in page


def _short(x: float) -> str:
    return f"{x:.1e}".replace("e+0", "e").replace("e+", "e")


@pytest.mark.slow
def test_the_old_mechc_still_says_so(tmp_path: Path) -> None:
    there = subprocess.run(["git", "cat-file", "-e", as_it_was.COMMIT], cwd=ROOT, check=False).returncode
    if there:
        pytest.skip("the history of the repository is not here")
    as_it_was.lay_out(tmp_path)
    text = next(iter(KEPT))
    with as_it_was.started(tmp_path) as old:
        again = old.run(text, *as_it_was.models()[text])
    assert again.wrong and again.doubtful
    assert again.off == pytest.approx(KEPT[text].off, rel=1e-3)

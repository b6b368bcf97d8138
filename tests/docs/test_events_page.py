"""The models of the page about events compile without a warning, run, and close their energy balance."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import mechc
from mechc.runtime.native.kernel import EVENT_KINDS

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "events.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```mech\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)


NAMES = [re.findall(r"model (\w+)", block)[0] for block in BLOCKS]
LONG = {"Balls"}


@pytest.mark.parametrize(
    "text",
    [
        pytest.param(block, id=name, marks=pytest.mark.slow if name in LONG else ())
        for block, name in zip(BLOCKS, NAMES, strict=True)
    ],
)
def test_models_run(text: str) -> None:
    model = mechc.loads(text)
    assert not model.diagnostics
    solution = model.simulate(estimate_error=False)
    assert isinstance(solution, mechc.Solution)
    assert solution.outcome.value in ("completed", "terminated"), solution.message
    assert solution.events
    balance = solution.accuracy.energy
    assert balance is not None and balance.relative is not None
    assert balance.relative < 100 * 1e-8


def test_every_kind_of_event_is_named() -> None:
    assert [kind for kind in EVENT_KINDS if f"`{kind}`" not in PAGE] == []

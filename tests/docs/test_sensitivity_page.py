"""The page about derivatives of motions: its programs run, and its figures are those of the model."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import mechc

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "sensitivity.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```python\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)


def test_programs_run(monkeypatch: pytest.MonkeyPatch) -> None:
    """The monodromy in two halves is that of the whole."""
    monkeypatch.chdir(ROOT)
    names: dict[str, object] = {}
    for block in BLOCKS:
        exec(block, names)
    rest, whole = names["rest"], names["whole"]
    np.testing.assert_allclose(
        rest.tangents[-1],  # type: ignore[attr-defined]
        whole.tangents[-1][:, :2],  # type: ignore[attr-defined]
        atol=1e-5 * np.abs(whole.tangents[-1]).max(),  # type: ignore[attr-defined]
    )


def test_figures_are_those_of_the_model() -> None:
    model = mechc.load(ROOT / "examples" / "bouncing_ball.mech")
    solution = model.simulate(stop="2 s", sensitivity="e,h")
    shown = re.findall(r"^  d\((\S+)\)/d\((\w)\) +(\S+)", PAGE, re.MULTILINE)
    assert len(shown) == 4
    for of, to, value in shown:
        assert solution.sensitivity(of, to).values[-1] == pytest.approx(float(value), rel=1e-6)
    assert not any("derivatives grow" in remark for remark in solution.remarks)

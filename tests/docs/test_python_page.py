"""The examples of the page on the Python interface run, one after another."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from mechc.cli.main import run

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "python-api.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```python\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)


def test_examples(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["new", "pendulum"]) == 0
    names: dict[str, object] = {}
    for block in BLOCKS:
        exec(block, names)
    model, motion, solutions = names["model"], names["motion"], names["solutions"]
    end = model.simulate(set={"l": 0.8})["theta"][-1]  # type: ignore[attr-defined]
    assert motion.y[0, -1] == pytest.approx(end, abs=1e-6)  # type: ignore[attr-defined]
    assert [s.parameters["l"] for s in solutions] == list(np.linspace(0.5, 2, 16))  # type: ignore[attr-defined]
    assert (tmp_path / "motion.png").exists()

"""Pages, messages and docstrings are spelt right, by codespell with the words of the field that pyproject.toml lists."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("codespell_lib", reason="needs codespell: pip install -e '.[dev]'")

ROOT = Path(__file__).resolve().parents[2]


def _misspelt(*what: str) -> list[str]:
    done = subprocess.run(
        [sys.executable, "-m", "codespell_lib", *what], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert not done.stderr.strip(), done.stderr
    return done.stdout.splitlines()


def test_everything_is_spelt_right() -> None:
    spelt = re.search(r"^SPELT +:= (.*)$", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
    assert spelt
    folders = spelt[1].split()
    assert {"docs", "mechc", "compiler", "lang", "runtime", "stdlib", "examples"} <= {*folders}
    assert _misspelt(*folders) == []


def test_a_slip_is_found(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("The angle precesses about an equilibrum.\n", encoding="utf-8")
    assert [line.partition(": ")[2] for line in _misspelt(str(page))] == ["equilibrum ==> equilibrium"]

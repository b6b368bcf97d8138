"""``mechc init``: wanted, got, moved by."""

from __future__ import annotations

from pathlib import Path

import pytest

from mechc.cli.main import run

TEXT = """\
coordinate x = 0.6 m;
coordinate y ~ -1 m;
kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
constraint rod: sqrt(x^2 + y^2) = 1 m;
initial der(x) = 2 m/s;
experiment(start = 1 s, stop = 2 s);
experiment wide(x = 0.8 m, stop = 2 s);
"""


def said(tmp_path: Path, capsys: pytest.CaptureFixture[str], *options: str) -> list[list[str]]:
    path = tmp_path / "model.mech"
    path.write_text(TEXT, encoding="utf-8")
    assert run(["init", str(path), *options]) == 0
    return [line.split() for line in capsys.readouterr().out.splitlines()]


def test_state_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = said(tmp_path, capsys)
    assert ["y", "-0.8", "m"] in rows
    assert ["der(y)", "1.5", "m/s"] in rows
    assert ["y", "-0.6", "m"] in said(tmp_path, capsys, "--experiment", "wide")


def test_explained(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = said(tmp_path, capsys, "--explain")
    assert ["x", "=", "0.6", "0.6", "-", "m"] in rows
    assert ["y", "~", "-1", "-0.8", "2.00e-01", "m"] in rows
    assert ["rod", "1.66e-01", "m"] in rows
    assert ["rate", "of", "rod", "1.03e+00", "m/s"] in rows


def test_tree_has_nothing_to_assemble(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "model.mech"
    path.write_text("coordinate x = 1 m;kinetic 1/2*1 kg*der(x)^2;", encoding="utf-8")
    assert run(["init", str(path), "--explain"]) == 0
    assert "nothing constrains it" in capsys.readouterr().out

"""``mechc check`` assembles a model where its runs begin."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import mechc
from mechc.cli.main import run
from mechc.start_check import impossible_starts

CIRCLE = (
    "coordinate x = 0.6 m;\ncoordinate y {y} m;\nkinetic 1/2*1 kg*(der(x)^2 + der(y)^2);\n"
    "parameter l = 1 m;\nconstraint rod: sqrt(x^2 + y^2) = l;\n"
)


def test_a_start_that_fits_and_one_that_does_not() -> None:
    assert impossible_starts(mechc.loads(CIRCLE.format(y="~ 0.9"))) == []
    (error,) = impossible_starts(mechc.loads(CIRCLE.format(y="= 0.9")))
    assert error.code == "E0604"


def test_every_experiment_is_assembled_with_its_own_values() -> None:
    text = CIRCLE.format(y="~ 0.9")
    fine = "experiment(stop = 1 s);\nexperiment longer(l = 2 m, stop = 1 s);\n"
    assert impossible_starts(mechc.loads(text + fine)) == []
    short = "experiment short(l = 0.5 m, stop = 1 s);\n"
    (error,) = impossible_starts(mechc.loads(text + fine + short))
    assert error.code == "E0604"


def test_what_only_a_run_can_know_is_no_matter_of_a_check() -> None:
    text = CIRCLE.format(y="~ 0.9").replace("parameter l = 1 m", "parameter Length l")
    assert impossible_starts(mechc.loads(text)) == []


def test_check_says_what_is_off(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("circle.mech").write_text(CIRCLE.format(y="= 0.9"), encoding="utf-8")
    assert run(["check", "circle.mech"]) == 1
    shown = capsys.readouterr()
    assert shown.out == "" and shown.err.startswith("error[E0604]: the initial positions")
    assert "'rod' is off by 0.08167 m (circle.mech:5)" in shown.err
    assert run(["check", "--json", "circle.mech"]) == 1
    (found,) = json.loads(capsys.readouterr().out)
    assert found["code"] == "E0604" and found["place"]["line"] == 5
    assert "'rod' is off by 0.08167 m (circle.mech:5)" in [label["text"] for label in found["labels"]]

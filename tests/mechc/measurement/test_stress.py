"""Extremes of a model: which are made, how they are judged, and what the exit code says."""

from __future__ import annotations

import json
import shutil
from importlib import import_module
from pathlib import Path

import pytest
from msgspec.structs import replace

from mechc.cli.main import run
from mechc.measurement.extremes import Extreme, extremes
from mechc.measurement.stress import Subject, adaptive_methods, worker
from mechc.requests.request import asked
from mechc.runtime.results.accuracy import ErrorEstimate
from mechc.runtime.studies.kinds.motion import Simulate
from mechc.session import plan

PENDULUM = Path(__file__).parents[3] / "examples" / "pendulum.mech"
SUBJECT = Subject(str(PENDULUM), None, {}, None, 0.5)


def test_extremes_of_a_pendulum() -> None:
    made = extremes(plan(SUBJECT.load(), asked(Simulate, {})), adaptive_methods(), full=False)
    texts = [e.text for e in made.runs]
    assert {"m = 1000 kg", "l = 0.001 m", "g = 0 m/s^2", "radau5 at 1e-06", "everything zero"} <= set(texts)
    assert len({(e.group, e.text) for e in made.runs}) == len(texts)
    assert not made.left_out
    full = extremes(plan(SUBJECT.load(), asked(Simulate, {})), adaptive_methods(), full=True)
    assert set(texts) - {f"{method} at 1e-06" for method in adaptive_methods()} < {e.text for e in full.runs}


def test_a_quick_run_names_what_it_leaves_out(tmp_path: Path) -> None:
    names = [f"k{i}" for i in range(12)]
    text = "".join(f"parameter {n} = 1 N/m;\n" for n in names)
    text += f"coordinate x = 1 m;\nkinetic 1/2*1 kg*der(x)^2;\npotential 1/2*({' + '.join(names)})*x^2;\n"
    file = tmp_path / "many.mech"
    file.write_text(text + "experiment(stop = 1 s);\n", encoding="utf-8")
    made = extremes(plan(Subject(str(file), None, {}, None, 5).load(), asked(Simulate, {})), [], full=False)
    (words,) = made.left_out
    varied = {name for e in made.runs if e.group == "parameter" for name in e.values}
    assert len(varied) == 8 and all(n in varied or n in words for n in names)


@pytest.mark.slow
def test_runs_are_judged_by_a_reference(monkeypatch: pytest.MonkeyPatch) -> None:
    judge = worker(SUBJECT)
    short = Extreme("parameter", "l = 1 mm", {"l": 1e-3}, {"stop": 1.0})
    row = judge(short)
    assert (row.kind == "right" and "float128" in row.against) or "double" in row.against
    assert row.error is not None and row.claim is not None and row.error < 100 * row.claim
    massless = judge(Extreme("parameter", "m = 0", {"m": 0.0}))
    assert massless.kind == "refused" and "inertia" in massless.reason
    long = judge(Extreme("length", "very long", {}, {"stop": 1e9}))
    assert long.kind in ("long", "refused")
    companion = import_module("mechc.runtime.studies.runs.companion")
    make = companion.compare

    def understated(*given: object) -> object:
        made: ErrorEstimate = make(*given)
        return replace(made, by_state=dict.fromkeys(made.by_state, 1e-16))

    def large(*given: object) -> object:
        made: ErrorEstimate = make(*given)
        return replace(made, largest=0.7, by_state=dict.fromkeys(made.by_state, 0.7))

    monkeypatch.setattr(companion, "compare", large)
    assert judge(short).kind == "rough"  # an estimate of 70 % makes no run right
    monkeypatch.setattr(companion, "compare", understated)
    assert judge(short).kind == "doubtful"  # the run says itself that its balance contradicts its estimate
    monkeypatch.setattr(companion, "contradictions", lambda *given, **more: ())
    assert judge(short).kind == "wrong"


@pytest.mark.slow
def test_the_command_writes_its_table(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "stress.json"
    assert run(["stress", str(PENDULUM), "--seconds", "3", "--json", str(file)]) == 0
    shown = capsys.readouterr().out
    assert "m = 0 kg" in shown and "right within its claim" in shown
    rows = json.loads(file.read_text(encoding="utf-8"))["rows"]
    assert {row["kind"] for row in rows} <= {
        "right",
        "rough",
        "refused",
        "long",
        "open",
        "doubtful",
        "same",
        "none",
    }
    assert sum(row["kind"] == "right" for row in rows) > 15


def test_an_output_that_is_no_number_is_told(tmp_path: Path) -> None:
    file = tmp_path / "share.mech"
    file.write_text(
        "parameter g = 1 N;\ncoordinate x = 0 m;\nkinetic 1/2*1 kg*der(x)^2;\nforce g on x;\n"
        "output share = x*(1 N/m)/g;\nexperiment(stop = 1 s);\n",
        encoding="utf-8",
    )
    subject = Subject(str(file), None, {}, None, 5)
    asked_for = subject.load()
    assert not any("share" in remark for remark in asked_for.simulate().remarks)
    remarks = asked_for.simulate(set={"g": 0}).remarks
    assert "no number at the end, from t = 0 s on: 'share'" in remarks
    assert worker(subject)(Extreme("parameter", "g = 0", {"g": 0.0})).kind == "right"


def test_runs_with_events_have_references() -> None:
    """They had none, though mechc bench made one."""
    subject = Subject(str(PENDULUM.parent / "bouncing_ball.mech"), None, {}, None, 5.0)
    row = worker(subject)(Extreme("as stated", "nothing changed", {}, {"stop": 1.0}))
    assert row.kind == "right" and row.against in ("__float128", "long double")


def test_a_coarse_partner_proves_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """An error of 9e-7 beside a run at 1e-10 was called right within a claim of 5e-9."""
    module = import_module("mechc.measurement.stress")

    def none(*_: object) -> object:
        raise module.ReferenceFailed("none was made")

    monkeypatch.setattr(module, "true_errors", none)
    tight = worker(SUBJECT)(Extreme("tolerance", "1e-14", {}, {"tolerance": 1e-14, "stop": 1.0}))
    assert tight.kind == "open" and "claims" in tight.reason
    loose = worker(SUBJECT)(Extreme("tolerance", "1e-5", {}, {"tolerance": 1e-5, "stop": 1.0}))
    assert loose.kind == "right"


def test_another_outcome_in_other_sizes_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    """A mechanism that is refused with 1e-7 of its mass, and completes as stated, is told."""
    module = import_module("mechc.measurement.stress")
    made = extremes(plan(SUBJECT.load(), asked(Simulate, {})), [], full=False)
    (sizes,) = (e for e in made.runs if e.group == "sizes")
    judge = module._judged

    def refused(model: object, subject: object, extreme: Extreme) -> object:
        row = judge(model, subject, extreme)
        return replace(row, kind="refused", reason="planted") if extreme.group == "sizes" else row

    assert worker(SUBJECT)(sizes).kind == "right"
    monkeypatch.setattr(module, "_judged", refused)
    row = worker(SUBJECT)(sizes)
    assert row.kind == "unlike" and "planted" in row.reason


@pytest.mark.parametrize("target", ["python", "ensemble"])
def test_what_targets_answer_is_compared_with_the_run(target: str, monkeypatch: pytest.MonkeyPatch) -> None:
    module = import_module("mechc.measurement.stress")
    asked_of = Extreme("target", f"{target}: as stated")
    assert worker(SUBJECT)(asked_of).kind == "right"
    answer = module.answer_of

    def off(*given: object) -> dict[str, float]:
        return {name: value * (1 + 1e-3) for name, value in answer(*given).items()}

    monkeypatch.setattr(module, "answer_of", off)
    row = worker(SUBJECT)(asked_of)
    assert row.kind == "wrong" and "in the run" in row.reason


@pytest.mark.slow  # each is compiled
@pytest.mark.parametrize("target", ["c", "fmu"])
def test_what_compiled_targets_answer(target: str) -> None:
    assert worker(SUBJECT)(Extreme("target", f"{target}: as stated")).kind == "right"


@pytest.mark.slow  # it waits
def test_what_is_built_slowly_does_not_hang(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """gcc takes longer on a busy machine than the runs may: the row was called hung."""
    slow = tmp_path / "slow-cc"
    slow.write_text(
        f'#!/bin/sh\nfor given; do case "$given" in */program) sleep 5;; esac; done\nexec {shutil.which("cc")} "$@"\n'
    )
    slow.chmod(0o755)
    monkeypatch.setenv("CC", str(slow))
    module = import_module("mechc.measurement.stress")
    monkeypatch.setattr(module, "MARGIN", 2.0)
    made = module.stress(replace(SUBJECT, targets=("c",)), only=("target",))
    assert [row.kind for row in made.rows] == ["right", "right"], made.rows

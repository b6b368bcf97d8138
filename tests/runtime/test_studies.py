"""Studies: each row of the table, and what their answers promise."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from slow_params import slow_among
from studied_models import WELL, model_of, settings_of_kind, write_measured
from syntax import parse_text

import mechc
from mechc.cli.main import run as run_command
from mechc.lang import ast
from mechc.runtime.case import SimulationOptions
from mechc.runtime.outcome import Outcome, SimulationError
from mechc.runtime.settings import KINDS, settings_of
from mechc.runtime.studies.findings import Findings
from mechc.runtime.studies.study import Study
from mechc.runtime.studies.table import STUDIES

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "studies.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", slow_among(["curves", "portrait"], STUDIES))
def test_a_study_is_whole(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Its settings, its page, its command, its method and its JSON object go through the table."""
    kind = STUDIES[name]
    question = kind.question()
    assert issubclass(question, Study) and question.__doc__
    assert all(
        setting.kind in KINDS and setting.description.endswith(".") for setting in settings_of(question)
    )
    assert f"| `{name}` | {kind.asks} |" in PAGE, f"a row of {name} in docs/studies.md"
    file, data = tmp_path / "well.mech", write_measured(tmp_path)
    given: dict[str, Any] = settings_of_kind(name, question.unused)
    if name == "fit":
        given["data"] = str(data)
    extra = [str(data)] if name == "fit" else []
    for setting, value in given.items():
        extra += [] if setting == "data" else [f"--{setting}", str(value)]
    file.write_text(model_of(name), encoding="utf-8")
    picture = tmp_path / "picture.png"
    command = ["study", name, str(file), *extra, "--json"]
    drawn = name not in (
        "sweep",
        "scattering",
        "dimensions",
        "task",
    )  # one particle, exponents: nothing to draw
    if drawn:
        command += ["--plot", str(picture)]
    assert run_command(command) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["study"] == name
    answers = found["runs"] if name == "sweep" else [found]
    assert all({"model", "outcome", "accuracy"} <= set(one) for one in answers)
    assert picture.exists() is drawn
    answer = getattr(mechc.load(file), name)(**given)
    assert answer.outcome is Outcome.COMPLETED
    assert all(run.outcome is Outcome.COMPLETED for run in answer.runs)


def test_questions_are_frozen_and_ask_for_no_parts_that_nobody_has() -> None:
    from mechc.compiler.equations.needs import PARTS

    for kind in STUDIES.values():
        assert kind.question().needs <= set(PARTS)
        with pytest.raises(AttributeError):
            kind.question()().stop = 1.0  # type: ignore[misc]


@pytest.mark.parametrize(
    ("potential", "degree"), [("1/2*x^2", 2), ("x^4", 4), ("x^6/6", 6)], ids=["harmonic", "quartic", "sextic"]
)
def test_virial_theorem(potential: str, degree: int) -> None:
    """2 <T> = n <V> in a potential of degree n, and the stated error holds."""
    found = mechc.loads(WELL.format(potential=potential)).virial()
    assert isinstance(found, Findings)
    (ratio,) = (value for value in found.values if value.name == "2 <T>/<V>")
    assert ratio.error is not None and ratio.error < 1e-5
    assert abs(ratio.value - degree) <= ratio.error


def test_averages_of_named_quantities() -> None:
    """<x^2> = 1/2 for x = cos t; <T> = -E for gravitation."""
    found = mechc.loads(WELL.format(potential="1/2*x^2")).virial(of="square")
    square = next(value for value in found.values if value.name == "square")
    assert square.error is not None and abs(square.value - 0.5) <= square.error < 1e-6
    kepler = mechc.load(ROOT / "examples" / "kepler.mech").virial(stop=200)
    energy = kepler.runs[0]["energy.total"][0]
    assert kepler["energy.kinetic"] == pytest.approx(-energy, abs=1e-6)


def test_an_average_of_a_chaotic_motion_says_how_bad_it_is() -> None:
    found = mechc.load(ROOT / "examples" / "double_pendulum.mech").virial(stop="100 s")
    errors = [value.error for value in found.values if value.error is not None]
    assert max(errors) > 0.05


def test_mistakes() -> None:
    model = mechc.loads(WELL.format(potential="1/2*x^2"))
    with pytest.raises(mechc.UsageMistake, match="there is no study 'viral'; did you mean 'virial'"):
        model.study("viral")
    with pytest.raises(
        mechc.UsageMistake, match=re.escape("no option 'stopp' of the study 'virial'; did you mean 'stop'?")
    ):
        model.virial(stopp=3)
    with pytest.raises(mechc.UsageMistake, match="'sqare'; did you mean 'square'"):
        model.virial(of="sqare")
    with pytest.raises(AttributeError, match="'vrial'"):
        _ = model.vrial


def test_a_run_that_fails_gives_no_averages() -> None:
    text = WELL.format(potential="1/2*x^2").replace("experiment", 'assert x > 0.5, "too far in"; experiment')
    found = mechc.loads(text).virial(stop=10)
    assert found.outcome is Outcome.FAILED and found.values == ()
    assert np.isfinite(found.runs[0]["x"]).all()


SWEPT = """\
model Swept
  dimensionless;
  parameter c = 2;
  coordinate x = 1;
  kinetic 1/2*der(x)^2;
  potential 1/2*c*x^2;
  output place = {x, 0};
  experiment(c in {2, 4}, stop = 3);
end Swept;
"""

CURVE = """\
model Straight
  dimensionless;
  independent x from 0 to 1;
  coordinate y ~ x;
  initial y = 0;
  final y = 1;
  stationary integral(sqrt(1 + der(y)^2));
end Straight;
"""

NEEDED: dict[str, dict[str, Any]] = {
    "fit": {"data": {"time": [0.0, 1.0, 2.0], "x": [1.0, 0.5, -0.4]}, "vary": "x"},
    "optimum": {"vary": "x = 0.5 .. 2", "goal": "-(x - 1)^2"},
    "hysteresis": {"over": "c = 1 .. 2, 3", "hold": 1},
    "diagram": {"over": "c = 1 .. 2, 3", "hold": 1},
    "threshold": {"over": "x = 1 .. 2, 3", "reaches": "x = -1"},
}
"""Settings without which some studies are not asked."""


OF_MOTIONS = [name for name, kind in STUDIES.items() if not kind.question().of_curves]


@pytest.mark.parametrize("name", OF_MOTIONS)
def test_an_experiment_that_sweeps_is_answered_for_each_value_or_refused(name: str) -> None:
    model = mechc.loads(SWEPT)
    given = NEEDED.get(name, {})
    if STUDIES[name].question().sweeps:
        found = model.study(name, **given).summary()
        assert [one["sweep"]["c"] for one in found["runs"]] == [2, 4] if name == "sweep" else found
        return
    with pytest.raises(SimulationError, match="the experiment sweeps c: it is several runs"):
        model.study(name, **given)


def test_a_swept_value_that_is_given_is_no_sweep() -> None:
    frequency = [mechc.loads(SWEPT).modes(set={"c": c}).summary()["modes"][0]["frequency"] for c in (2, 8)]
    assert frequency[1] == pytest.approx(2 * frequency[0], rel=1e-12)


def test_a_swept_structural_value_is_refused_too() -> None:
    text = SWEPT.replace("parameter c", "structural parameter Integer c")
    with pytest.raises(SimulationError, match="the experiment sweeps c: it is several runs"):
        mechc.loads(text).modes()


@pytest.mark.parametrize("name", STUDIES)
def test_settings_of_a_run_that_change_nothing_are_refused(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """In Python, as options and in files alike; what a study takes, its command offers."""
    unused = STUDIES[name].question().unused
    names = {setting.name for setting in settings_of(STUDIES[name].question())}
    assert not unused & names and unused <= {s.name for s in settings_of(SimulationOptions)}
    model = WELL.format(potential="1/2*x^2")
    file = tmp_path / "well.mech"
    for setting in sorted(unused):
        said = (
            f"'{setting}' is a setting of a run, and would change nothing in the answer of the study '{name}'"
        )
        given: dict[str, Any] = {setting: 3}
        with pytest.raises(mechc.UsageMistake, match=re.escape(said)):
            mechc.loads(model).study(name, **given)
        file.write_text(model, encoding="utf-8")
        option = ["--no-estimate-error"] if setting == "estimate_error" else [f"--{setting}", "3"]
        assert run_command(["study", name, str(file), *option]) == 2
        assert said in " ".join(capsys.readouterr().err.split())
        with pytest.raises(mechc.CompileError, match=re.escape(said)):
            mechc.loads(model.replace("experiment", f"study asked = {name}({setting} = 3); experiment"))


def test_studies_of_a_state_take_no_settings_of_a_run() -> None:
    states = (
        "linearize",
        "response",
        "modes",
        "equilibria",
        "inertia",
        "hamilton",
        "brackets",
        "field",
        "energy",
    )
    for name in (*states, "period"):
        assert {"stop", "start", "every", "step", "tolerance", "method"} <= STUDIES[name].question().unused


@pytest.mark.parametrize("name", OF_MOTIONS)
def test_no_other_study_is_asked_about_a_curve(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(mechc.UsageMistake, match="'Straight' is a curve and does not move"):
        mechc.loads(CURVE).study(name, **NEEDED.get(name, {}))
    file, data = tmp_path / "straight.mech", tmp_path / "data.csv"
    file.write_text(CURVE, encoding="utf-8")
    data.write_text("time,y\n0,0\n1,1\n", encoding="utf-8")
    extra = {"fit": [str(data), "--vary", "y"], "optimum": ["--vary", "y", "--goal", "y"]}.get(name, [])
    assert run_command(["study", name, str(file), *extra]) == 2
    assert "'Straight' is a curve and does not move" in " ".join(capsys.readouterr().err.split())


def test_a_setting_that_does_not_exist_is_told_with_the_name_of_the_study() -> None:
    for name in ("modes", "equilibria", "inertia"):
        with pytest.raises(mechc.UsageMistake, match=f"no option 'foo' of the study '{name}'"):
            mechc.loads(SWEPT).study(name, foo=1)


@pytest.mark.parametrize(
    ("text", "options", "said"),
    [
        (CURVE, ["--sensitivity", "y"], "--sensitivity belongs to a motion"),
        (CURVE, ["--sensitivity", ""], "--sensitivity belongs to a motion"),
        (SWEPT, ["--all"], "--all looks for further curves, and 'Swept' is a motion"),
        (SWEPT, ["--sensitivity", ""], "'' names nothing"),
    ],
    ids=["curve", "curve-nothing", "motion", "nothing"],
)
def test_options_of_a_run_that_mean_nothing_are_refused(
    text: str, options: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "model.mech"
    file.write_text(text, encoding="utf-8")
    assert run_command(["run", str(file), *options]) == 2
    assert said in " ".join(capsys.readouterr().err.split())


@pytest.mark.slow
def test_actions_are_within_their_errors_which_hold_those_of_the_run() -> None:
    """q = A cos(w t) with m = 1: S and W in closed form, I = E/w; at a tolerance that is anything but tight."""
    text = (
        "model Swing dimensionless; coordinate q = 1.5; kinetic 1/2*der(q)^2; potential 2*q^2; "
        "experiment(stop = 20); end Swing;"
    )
    for tolerance in (1e-5, 1e-8):
        found = mechc.loads(text).action(tolerance=tolerance)
        exact = {
            "S": -(1.5**2) * math.sin(80) / 2,
            "W": 1.5**2 * (40 - math.sin(80) / 2),
            "I": 1.5**2,
            "period": math.pi,
        }
        assert {value.name for value in found.values} == set(exact)
        for value in found.values:
            assert value.error is not None
            assert abs(value.value - exact[value.name]) <= value.error < 1e3 * tolerance, value.name


def test_divergence_and_curl_at_the_start() -> None:
    """F = (a x y z, c y x^2, z^3): div = a y z + c x^2 + 3 z^2, curl = (0, a x y, 2 c x y - a x z), within the errors."""
    found = mechc.load(ROOT / "examples" / "curl_of_two.mech").field(set={"y": 0.7})
    exact = {
        "divergence at the start": 0.7 * 0.4 + 2 + 3 * 0.16,
        "curl at the start, x to y": 2 * 2 * 0.7 - 0.4,
        "curl at the start, x to z": -0.7,
        "curl at the start, y to z": 0.0,
    }
    for value in found.values:
        if value.name in exact:
            assert value.error is not None and value.error < 1e-9
            assert abs(value.value - exact.pop(value.name)) <= value.error, value.name
    assert not exact


@pytest.mark.parametrize("name", slow_among(["curves"], STUDIES))
def test_a_file_states_it(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """``study asked = KIND(settings);`` and ``mechc study FILE --json``, from the folder of the file."""
    monkeypatch.chdir(tmp_path)
    write_measured(tmp_path)
    given = settings_of_kind(name, STUDIES[name].question().unused)
    words = ", ".join(f'{n} = "{v}"' if isinstance(v, str) else f"{n} = {v}" for n, v in given.items())
    before, end, after = model_of(name).rpartition("end ")
    text = f"{before}  study asked = {name}({words});\n{end}{after}"
    Path("model.mech").write_text(text, encoding="utf-8")
    assert run_command(["study", "model.mech", "asked", "--json"]) == 0
    (found,) = json.loads(capsys.readouterr().out)["studies"].values()
    assert found["study"] == name
    answers = found["runs"] if name == "sweep" else [found]
    assert answers and all({"model", "outcome", "accuracy"} <= set(one) for one in answers)
    assert all(one["outcome"] == "completed" for one in answers)


@pytest.mark.parametrize("kind", STUDIES)
def test_every_setting_can_be_written_in_a_file(kind: str) -> None:
    """Also those whose names are words of the language, as the time of a long motion is."""
    for setting in settings_of(STUDIES[kind].question()):
        text = f"model M\n  study s = {kind}({setting.name} = 1);\nend M;\n"
        (model,) = parse_text(text).items
        assert isinstance(model, ast.Model)
        (study,) = model.body
        assert isinstance(study, ast.Study) and study.settings[0].name == setting.name

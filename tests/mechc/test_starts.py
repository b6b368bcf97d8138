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


MASS = "coordinate y = 1 m; initial der(y) = -1 m/s; kinetic 1/2*1 kg*der(y)^2;"
SWITCHING = (
    ("parameter e = 1.5; contact c: y restitution e;", "the restitution of 'c' is 1.5"),
    ("parameter f = -1 N; friction f on y;", "has a negative coefficient or limit"),
    ("contact c: y - 2 m;", "contact 'c' is penetrated"),
    (
        "parameter T = 0 s; discrete Integer n = 0; when sample(T) then n := n + 1; end when;",
        "a period is positive",
    ),
)
REFUSED = (
    ("force 1 N*sqrt(-y/1 m) on y;", "the acceleration of 'y' is not a number"),
    ("force 1 N.m/(y - 1 m) on y;", "the acceleration of 'y' is infinite"),
    ('assert y > 2 m, "low";', "assertion failed at t = 0 s: low"),
    ("parameter l(min = 2 m) = 1 m; output o = l;", "below its minimum 2 m"),
)
SETTINGS = (
    ("every = 1e-9 s", "an output spacing of 1e-09 s gives"),
    ("tolerance = 2", "the tolerance lies between"),
    ("stop = -3 s", "lies before the start"),
    ('method = "foo"', "there is no method 'foo'"),
    ('method = "gauss4"', "takes steps of one size"),
    ("step = 1 ms", "chooses its steps itself"),
)


def refused(text: str) -> list[str]:
    return [error.message for error in impossible_starts(mechc.loads(text))]


@pytest.mark.parametrize(("text", "message"), [*REFUSED, *SWITCHING])
def test_what_a_run_refuses_at_its_first_instant_is_told(text: str, message: str) -> None:
    """The message is that of the run itself."""
    text = MASS + text + "experiment(stop = 1 s);"
    (said,) = refused(text)
    assert message in said
    try:
        ran = mechc.loads(text).simulate().message
    except mechc.SimulationError as error:
        ran = error.message
    assert ran == said


@pytest.mark.parametrize(("settings", "message"), SETTINGS)
def test_experiments_that_a_run_would_refuse_are_told(settings: str, message: str) -> None:
    stop = "" if "stop" in settings else "stop = 1 s, "
    (said,) = refused(MASS + f"experiment good(stop = 1 s); experiment bad({stop}{settings});")
    assert message in said


@pytest.mark.parametrize(
    "text",
    [
        "",
        "experiment(stop = 1 s, start = -1 s);",
        'experiment(stop = 1 s, method = "radau5"); experiment b(stop = 1 s, method = "gauss4", step = 1 ms);',
        'experiment(stop = 1 s, method = "verlet", step = 1 ms);',
        "parameter e = 0.5; contact c: y restitution e; experiment(stop = 1 s);",
        "experiment(y in {1, 2} m, stop = 1 s);",
        "parameter Length l; output o = l; experiment(stop = 1 s);",
    ],
)
def test_starts_that_are_right(text: str) -> None:
    assert refused(MASS + text) == []


def test_without_a_compiler_no_start_is_looked_at(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("CC", str(tmp_path / "none"))
    assert refused(MASS + REFUSED[0][0] + "experiment(stop = 1 s);") == []


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

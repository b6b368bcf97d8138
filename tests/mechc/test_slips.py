"""Slips of first readers: each is made in a model of the tutorial, and told with what to write."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from click.testing import CliRunner

import mechc
from mechc.cli.main import mechc as program
from mechc.cli.main import run
from mechc.lang.diagnostics import CompileError
from mechc.presentation.report import report
from mechc.requests.parse_values import UsageMistake
from mechc.runtime.integrate import solver
from mechc.runtime.outcome import SimulationError

PENDULUM = """
model Pendulum
  parameter m = 1 kg;
  parameter l = 0.5 m;
  parameter k = 3 N.m/rad;
  coordinate theta = 60 deg;
  kinetic 1/2*m*l^2*der(theta)^2;
  potential -m*(9.81 m/s^2)*l*cos(theta);
  potential 1/2*k*theta^2;
  experiment(stop = 5 s);
end Pendulum;
"""
STOP = """
import mech.planar.*;
model Swing
  parameter speed = 10 rad/s;
  gravity {0, -9.81} m/s^2;
  Bar bar(m = 1 kg, l = 20 cm);
  Revolute pin(world -> bar.a, angle = 60 deg);
  contact buffer: 120 deg - pin.angle;
  friction bearing: 0.2 N.m on pin.angle;
  output tip = pos(bar.b);
  output push = norm(reaction(pin));
  experiment(stop = 2*3.2/speed);
end Swing;
"""
SLIPS = [
    (PENDULUM, "3 N.m/rad", "3 N m/rad", "a unit is written in one piece: '3 N.m/rad'"),
    (PENDULUM, "3 N.m/rad", "3 N*m/rad", "one piece, with '.' for products: '3 N.m/rad'"),
    (PENDULUM, "3 N.m/rad", "3 N / m / rad", "a unit has no blanks inside: '3 N/m/rad'"),
    (PENDULUM, "3 N.m/rad", "3 Nms", "did you mean 'N.m.s'?"),
    (PENDULUM, "l = 0.5 m", "l = 0.5 s", "'l' is a time (s); it would fit as a length (m)"),
    (PENDULUM, "l = 0.5 m", "l = 0.5 kg", "'l' is a mass (kg); it would fit as a length (m)"),
    (PENDULUM, "deg;", "deg, der(theta) = 1 rad/s;", "'initial der(..) = ..;'"),
    (STOP, "10 rad/s", "10", "multiply by a second: '(2*3.2/speed)*(1 s)'"),
    (STOP, "2*3.2/speed", "2", "write '2 s'"),
    (STOP, "on pin.angle", "on pin", "as in 'pin.angle'"),
    (STOP, "on pin.angle", "on bar", "as in 'bar.a'"),
    (STOP, "buffer:", "buffer", "a name is followed by ':', as in 'contact buffer: ..'"),
    (STOP, "pos(", "position(", "did you mean 'pos'?"),
    (STOP, "world -> bar.a", "carrier = world, moved = bar.a", "it has from, to, angle"),
    (STOP, "Bar bar", "Stick bar", "there are Particle, Body, Bar"),
    (STOP, "world -> bar.a", "world, bar.a", "'world -> other.a'"),
    (STOP, "world ->", "world + trans({1, 2} m) ->", "is multiplied: 'world * trans({1, 2} m)'"),
    (STOP, "world ->", "world + {1, 2} m ->", "is multiplied: 'world * {1, 2} m'"),
    (STOP, "-9.81}", "-9,81}", "'9.81' is one number"),
    (
        STOP,
        "norm(reaction(pin))",
        "reaction(bearing)",
        "ask for 'multiplier(bearing)'",
    ),
    (STOP, "norm(reaction(pin))", "reaction(buffer)", "ask for 'multiplier(buffer)'"),
    (STOP, "norm(reaction(pin))", "power(buffer)", "ask for 'multiplier(buffer)'"),
    (STOP, "norm(reaction(pin))", "bearing", "ask for 'multiplier(bearing)'"),
    (STOP, "norm(reaction(pin))", "reaction(pin.angle)", "'reaction(pin)' is the force in the joint"),
]


@pytest.mark.parametrize(("text", "right", "slip", "told"), SLIPS, ids=[slip for _, _, slip, _ in SLIPS])
def test_a_slip_is_told_with_what_to_write(text: str, right: str, slip: str, told: str) -> None:
    assert text.count(right) >= 1
    with pytest.raises(CompileError) as caught:
        mechc.loads(text.replace(right, slip, 1)).compilation.program  # noqa: B018
    said = [d.help for d in caught.value.diagnostics]
    said += [label.text for d in caught.value.diagnostics for label in d.labels]
    assert any(told in words for words in said), said


def test_the_model_without_a_slip_is_right() -> None:
    for text in (PENDULUM, STOP):
        assert not mechc.loads(text).diagnostics


@pytest.mark.parametrize(
    ("right", "slip", "number"),
    [
        ("120 deg - pin.angle", "120 - pin.angle", "120"),
        ("120 deg - pin.angle", "-pin.angle + 120", "120"),
        ("experiment", 'when pin.angle > 90 then terminate("there"); end when; experiment', "90"),
        ("speed = 10 rad/s;", "speed = 10 rad/s; parameter most = 100;", None),
        ("120 deg - pin.angle", "2*pi - pin.angle", None),
        ("120 deg - pin.angle", "2.1 - pin.angle", None),
    ],
)
def test_a_bare_number_beside_an_angle(right: str, slip: str, number: str | None) -> None:
    """Beyond a full turn it is hardly meant as radians; in W0303's words, each time it is written."""
    found = [d for d in mechc.loads(STOP.replace(right, slip, 1)).diagnostics if d.code == "W0303"]
    assert [d.span.text for d in found if d.span] == ([number] if number else [])


def test_a_bare_parameter_beside_an_angle() -> None:
    text = STOP.replace("contact", "parameter most = 100; contact").replace("120 deg -", "most -")
    found = mechc.loads(text).diagnostics
    assert [(d.code, d.span.text) for d in found if d.span] == [("W0303", "100")]


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["run", "--set", "l=0,25 m"], "a decimal point is written '.': 0.25 m"),
        (["run", "--set", "theta=0.1°"], "write '0.1 deg'"),
        (["run", "--outputs", "theta'"], "a rate is written 'der(theta)'"),
        (["fit", "--vary", "m,", "l"], "without blanks or in quotes: --vary A,B"),
        (["run", "--set", "l=80", "cm"], "a value with blanks stands in quotes"),
        (["run", "--set", "l=80 kg"], "error: 'l' is given in kg; it has the unit m"),
        (["run", "--set", "m=2 oz"], "unknown unit 'oz'\n"),
        (["run", "--set", "k=0"], "'stop' of the experiment is inf at the values of this run"),
        (["run", "--set", "k=0"], '--stop "10 s"'),
        (["compile", "-o", "p.html"], "whose file ends in .py; add --target web"),
        (["compile", "-o", "p.txt"], "whose file ends in .py; as in -o p.py"),
        (["compile", "--target", "html"], "Did you mean 'web'?"),
        (["run", "--output", "theta"], "names of quantities go to --outputs"),
        (["study", "period", "--display", "deg"], "a study is told in SI, angles in rad; leave it out"),
        (["study", "period", "--set", "theta=0 deg"], 'begin away from rest: --set theta="..."'),
        (["fit", "--vary", "m", "l"], "several names are one text, with commas"),
        (["fit", "--vary", "m l"], "names are separated by commas; m, l"),
        (["fit", "--vary", "m", "--vary", "l"], "write all in one text, --vary A,B"),
    ],
)
def test_a_slip_in_a_command(
    arguments: list[str],
    told: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    text = PENDULUM.replace("stop = 5 s", "stop = 5 s/(k/(3 N.m/rad))") if "k=0" in arguments else PENDULUM
    Path("p.mech").write_text(text, encoding="utf-8")
    words = [*arguments, "p.mech"] if arguments[0] != "fit" else ["fit", "p.mech", *arguments[1:]]
    Path("t.csv").write_text("t,theta\n0,1\n1,0.5\n", encoding="utf-8")
    if arguments[-1] == "m l":
        Path("d.csv").write_text("time,theta\n0,1\n1,0.5\n", encoding="utf-8")
        words.insert(2, "d.csv")
    assert run(words) in (1, 2)
    assert told in capsys.readouterr().err


@pytest.mark.parametrize("value", ["2 N", "-2.5", ".5 kN", "{1, 2} N"])
def test_a_value_is_no_table(value: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = "input Force push;\ncoordinate Length x = 0 m;\nkinetic 1/2*1 kg*der(x)^2;\nforce push on x;\n"
    path = tmp_path / "push.mech"
    path.write_text(text + "experiment(stop = 1 s);\n", encoding="utf-8")
    assert run(["run", str(path), "--input", f"push={value}"]) == 1
    assert f'a value is not a table: --set NAME="{value}"' in capsys.readouterr().err


@pytest.mark.parametrize("code", ["E0301", "e301", "E301"])
def test_codes_as_people_type_them(code: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["explain", code]) == 0
    assert capsys.readouterr().out.startswith("E0301: ")


def test_a_code_without_its_letter(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["explain", "301"]) == 2
    assert "E0301 is an error, W0301 a warning" in capsys.readouterr().err


def test_structure_tells_what_nobody_stated(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "swing.mech"
    path.write_text(
        STOP.replace("gravity {0, -9.81} m/s^2;", "").replace(", l = 20 cm", ""), encoding="utf-8"
    )
    assert run(["check", "--structure", str(path)]) == 0
    rows = {line[2:].partition("  ")[0]: line.split()[-4:] for line in capsys.readouterr().out.splitlines()}
    assert rows["gravity"][-1] == "none"
    assert rows["by default"] == ["bar.l", "=", "1", "m"]


def test_what_a_part_of_the_same_file_is_given_is_no_default(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of two arms one mass each is stated, as an element of an array, and their length is left to the part."""
    text = (
        "import mech.planar.*;\nmodel Arm\n  parameter Mass m = 1 kg;\n  parameter Length l = 50 cm;\n  frame a;\n"
        "  mass m at a * {0, -l};\nend Arm;\nmodel Two\n  Arm arm[2](m = {1, 1.5} kg);\n"
        "  Revolute pin[i in 1:2](world -> arm[i].a);\n  gravity {0, -9.81} m/s^2;\nend Two;\n"
    )
    path = tmp_path / "two.mech"
    path.write_text(text, encoding="utf-8")
    assert run(["check", "--structure", str(path)]) == 0
    (row,) = (line for line in capsys.readouterr().out.splitlines() if "by default" in line)
    assert row.split("by default")[1].strip() == "arm[1].l = 50 cm, arm[2].l = 50 cm"


def test_a_run_that_does_not_begin_has_no_report(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "swing.mech"
    path.write_text(STOP.replace("120 deg -", "30 deg -"), encoding="utf-8")
    assert run(["run", str(path)]) == 1
    out, err = capsys.readouterr()
    assert out == "Swing: failed at time = 0 s\n"
    assert "a gap is positive where things are apart" in err


FOUR = """
import mech.planar.*;
model Four
  Bar a(m = 1 kg, l = 20 cm);
  Bar b(m = 1 kg, l = 50 cm);
  Bar c(m = 1 kg, l = 40 cm);
  Revolute shoulder(world -> a.a, angle = 60 deg);
  Revolute elbow(a.b -> b.a, angle ~ 0 deg);
  Revolute wrist(b.b -> c.a, angle ~ -90 deg);
  Revolute foot(c.b -> world * trans({50, 0} cm));
  experiment(stop = 1 s);
end Four;
"""


@pytest.mark.parametrize(
    ("right", "slip", "settings", "told"),
    [
        ("", "", {"elbow": "30 deg"}, "did you mean 'elbow.angle'?"),
        (", angle = 60 deg", "", {"shoulder.angle": "30 deg"}, "is prescribed by 'drive' (line 12)"),
    ],
)
def test_a_name_that_cannot_be_set(right: str, slip: str, settings: dict[str, str], told: str) -> None:
    text = FOUR.replace(right, slip)
    if right:
        text = text.replace("end Four", "  drive shoulder.angle = 60 deg + (1 rad/s)*time;\nend Four")
    with pytest.raises(UsageMistake, match=re.escape(told)):
        mechc.loads(text).simulate(set=settings)


def test_a_value_that_contradicts_another() -> None:
    """What is set for a run is not a guess, and cannot be made one there; angles are told as they are typed."""
    with pytest.raises(SimulationError) as caught:
        mechc.loads(FOUR).simulate(set={"elbow.angle": "110 deg"})
    assert caught.value.code == "E0604"
    assert "leave out one of them" in caught.value.help
    assert any("(110 deg) is given for this run" in note for note in caught.value.notes)
    with pytest.raises(SimulationError) as caught:
        mechc.loads(FOUR.replace("angle ~ 0 deg", "angle = 110 deg")).simulate()
    assert "replace '=' by '~'" in caught.value.help


def test_the_reason_of_a_failed_run_stands_before_its_report(tmp_path: Path) -> None:
    path = tmp_path / "p.mech"
    path.write_text(
        PENDULUM.replace("experiment", 'assert theta > 30 deg, "too low"; experiment'), encoding="utf-8"
    )
    shown = CliRunner().invoke(program, ["run", str(path), "--no-error-estimate"]).output
    assert 0 <= shown.index("too low") < shown.index("steps")
    assert shown.count("assertion failed") == 1


def test_a_study_tells_what_it_wrote(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, picture, answer = tmp_path / "p.mech", tmp_path / "p.png", tmp_path / "p.json"
    path.write_text(PENDULUM, encoding="utf-8")
    assert run(["study", "modes", str(path), "--plot", str(picture), "-o", str(answer)]) == 0
    assert picture.exists() and answer.exists()
    assert capsys.readouterr().err.splitlines() == [f"wrote {answer}", f"wrote {picture}"]


def test_a_speed_at_rest_is_told_as_zero(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fused products leave a rest of it; where it is above its error or above rounding, its digits stay."""
    monkeypatch.setattr(solver, "LITTLE", 0)
    solution = mechc.loads(STOP).simulate(stop=20.0)
    assert 0 < abs(solution["der(pin.angle)"][-1]) < 1e-30
    assert re.search(r"der\(pin\.angle\) +0 rad/s ", report(solution))
    moving = mechc.loads(STOP).simulate(stop=0.3)
    assert re.search(r"der\(pin\.angle\) +-?[0-9.]{6,} rad/s ", report(moving))

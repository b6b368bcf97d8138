"""What somebody who is new writes first, and the help that leads on."""

from __future__ import annotations

from pathlib import Path

import pytest
from refusals import refused

import mechc
from mechc.lang.diagnostics import CompileError
from mechc.lang.read import read_source

BODY = "coordinate x = 1 m; kinetic 1/2*1 kg*der(x)^2;\n"
CIRCUIT = "state i = 0 A; parameter L = 1 mH; parameter R = 2 Ohm;\n"


@pytest.mark.parametrize(
    ("text", "code", "words"),
    [
        (
            "parameter k = 3 N/m; coordinate x = 1 m;\nequation 1 kg*der(der(x)) = -k*x;",
            "E0421",
            ["'kinetic 1/2*m*der(x)^2;'", "'force -k*x on x;'"],
        ),
        ("coordinate x = 1 m;\nequation der(x, 2) = -4 s^-2*x;", "E0421", ["'force -4 s^-2*x on x;'"]),
        (
            "parameter m = 0 kg; coordinate x = 1 m;\nkinetic 1/2*m*der(x)^2; potential 1/2*1 N/m*x^2;",
            "E0603",
            ["'x ~ ...' is a guess"],
        ),
        (BODY + "parameter k = 0.8 1/m;", "E0110", ["'0.8 m^-1'"]),
        (BODY + "parameter k = 2 1;", "E0110", ["'2*1'"]),
        (BODY + "force -4 N/m*delayed(x, 0.1 s) on x;", "E0209", ["delay(x, T)"]),
        (BODY + "force interp1(x, 1) on x;", "E0209", ["'table("]),
        (BODY + "force rand(1)*1 N on x;", "E0209", ["ensemble"]),
        (BODY + "force sat(x, 1 m)*1 N/m on x;", "E0209", ["'clamp(..)'"]),
        (BODY + "force lookup2d(x, x) on x;", "E0209", ["'table("]),
        (BODY + "force noEvent(x)*1 N/m on x;", "E0209", ["leave it out"]),
        (BODY + "force pid(x) on x;", "E0209", ["states"]),
        (BODY + "[t, y] = ode45(f, [0 10], x);", "E0125", ["'experiment(stop = 10 s);'"]),
        (BODY + "[t, y] = f(x);", "E0125", ["one value"]),
        (BODY + "1 kg*x'' = -3 N/m*x;", "E0121", ["'der(x, 2)'"]),
        (BODY + "let v = x';", "E0121", ["'der(x)'"]),
        (BODY + "m*der(der(x)) = -3*x;", "E0125", ["'kinetic 1/2*m*der(x)^2;'"]),
        (BODY + "equation x = 1 m*sin(time/1 s);", "E0421", ["'drive x = ..;'", "by force on"]),
        (CIRCUIT + "L*der(i) = 5 V - R*i;", "E0125", ["'equation der(i) = ..;'"]),
        (CIRCUIT + "equation L*der(i) = 5 V - R*i;", "E0421", ["'equation der(i) = (5 V - R*i)/L;'"]),
        (CIRCUIT + "equation 5 V = R*i + L*der(i);", "E0421", ["'equation der(i) = ..;'"]),
        (CIRCUIT + "equation 5 V/L = der(i);", "E0421", ["'equation der(i) = 5 V/L;'"]),
        (BODY + "parameter w = 5 in;", "E0112", ["'5 inch'"]),
        (BODY + "parameter b = 3; parameter a = 5 % b;", "E0110", ["'mod(5, b)'"]),
        (BODY + "parameter b = 3; parameter a = b % 2;", "E0105", ["'mod(x, y)'"]),
        (BODY + "parameter a = 5%;", "E0113", ["'5 %'"]),
        (BODY + "parameter l = 3; parameter a = 2l;", "E0113", ["'2*l'"]),
        ("import mech.rotational.*;\nInertia wheel(J = 1 kg.m^2);", "E0203", ["there are Rotor, Node"]),
    ],
)
def test_help_says_what_to_write(text: str, code: str, words: list[str]) -> None:
    found = next(d for d in refused(text) if d.code == code)
    assert all(word in found.help for word in words), found.help


def test_a_model_is_no_suggestion_for_a_function() -> None:
    text = "model Lookop\n coordinate x = 1 m; kinetic 1/2*1 kg*der(x)^2; force lookop(x) on x;\nend Lookop;"
    assert "Lookop" not in refused(text)[0].help


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("arm.urdf", '<?xml version="1.0"?>\n<!-- <sdf/> -->\n<robot name="arm"/>', "a robot in URDF"),
        ("arm.xml", '<mujoco model="arm"/>', "a robot in MJCF"),
        ("world.sdf", '<?xml version="1.0"?><sdf version="1.9"/>', "a robot in SDF"),
        ("a.xml", "<html></html>", "an XML file"),
        ("P.mo", "model P\n  Real x;\nend P;\n", "a Modelica file"),
    ],
)
def test_files_of_other_programs_are_recognised(tmp_path: Path, name: str, text: str, words: str) -> None:
    file = tmp_path / name
    file.write_text(text, encoding="utf-8")
    with pytest.raises(CompileError) as caught:
        read_source(file)
    assert f"is {words}, not a model" in caught.value.diagnostics[0].message


def test_a_part_of_the_library_is_named_with_its_import() -> None:
    with pytest.raises(mechc.CompileError) as caught:
        mechc.loads("import mech.vehicle.*;\nTyre62 tyre;\n")
    assert "'import mech.tyres.*;' brings Tyre62" in str(caught.value)


@pytest.mark.parametrize(
    ("statement", "help"),
    [
        ("DiskFrictionClutch plates(a.angle -> b.angle);", "did you mean 'Clutch'?"),
        (
            "Planetary gear(a.angle -> b.angle);",
            "Planetary takes its sides as inputs: 'sun = .., ring = .., carrier = ..'",
        ),
        ("Rotor c(J = 2 kg.m^2, w = 100 rad/s);", "its rate at the start is 'der(angle) = ..'"),
        ("output heat = energy.dissipated;", "equation der(lost) = -power(law);"),
        ("output heat = dissipated(a);", "equation der(lost) = -power(law);"),
    ],
)
def test_words_of_other_programs(statement: str, help: str) -> None:
    with pytest.raises(CompileError) as caught:
        mechc.loads(
            "import mech.rotational.*;\nRotor a(J = 1 kg.m^2, angle = 0 rad);\nRotor b(J = 1 kg.m^2, angle = 0 rad);\n"
            + statement
        )
    assert help in str(caught.value)

"""Starts that are moved by tiny amounts: motions that they determine, and those that they do not."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from mechc.cli.main import run
from mechc.measurement.extremes import Extreme
from mechc.measurement.stress import Subject, worker
from mechc.measurement.stress_table import Stress, StressRow, report

POINT = "coordinate Length x = {x} m; kinetic 1/2*1 kg*der(x)^2; {rest} experiment(stop = {stop} s);"
PLANE = (
    "coordinate Length x = 0 m; coordinate Length y = 0 m; kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);"
    "potential 9.81 N*y; contact floor: y{options}; {rest} experiment(stop = 1 s);"
)


def point(rest: str, x: float = 0.0, stop: float = 20.0) -> str:
    return POINT.format(x=x, rest=rest, stop=stop)


CASES = {
    "swings": ("same", point("potential 1/2*1 N/m*x^2;", 1.0)),
    "stays at rest": ("same", point("potential 1/2*1 N/m*x^2;")),
    "on a ridge": ("rough", point("force 1 N/m*x - 1 N/m^3*x^3 on x;", stop=30.0)),
    "on the top of Norton's dome": ("parted", point("force 1 N*sqrt(abs(x)/(1 m)) on x;", stop=30.0)),
    "on an edge": ("parted", point("force if x > 0 m then 1 N else -1 N on x;", stop=3.0)),
    "on an edge, beside a clock": (
        "parted",
        point(
            "discrete Real n = 0; when sample(0.01 s) then n := n + 1; end when;"
            "force if x > 0 m then 1 N else -1 N on x;",
            stop=3.0,
        ),
    ),
    "grazes a step of its force": (
        "same",
        point("initial der(x) = 1 m/s; force if x > 0.5 m then 1 N else -1 N on x;", stop=0.9),
    ),
    "lies": ("same", PLANE.format(options="", rest="")),
    "slides and sticks": (
        "same",
        PLANE.format(options=" friction 0.3 along der(x)", rest="initial der(x) = 1 m/s;"),
    ),
    "is let go by what holds it": (
        "parted",
        PLANE.format(options="", rest="force if closed(floor) then 0 N else 20 N on y;"),
    ),
    "three at once": (
        "tied",
        "coordinate Length x[3] = {0, 1, 2} m; initial der(x[1]) = 1 m/s; initial der(x[3]) = -1 m/s;"
        "kinetic 1/2*1 kg*(der(x[1])^2 + 0.3*der(x[2])^2 + 2*der(x[3])^2);"
        "contact a: x[2] - x[1] - 0.5 m restitution 0.5; contact b: x[3] - x[2] - 0.5 m restitution 0.5;"
        "experiment(stop = 1 s);",
    ),
}
"""What is said of a start that is shaken: grazing is a root of the shake, the other ones are what they are called."""


def shaken(text: str, folder: Path) -> StressRow:
    file = folder / "model.mech"
    file.write_text(text, encoding="utf-8")
    return worker(Subject(str(file), None, {}, None, 5))(Extreme("twin", "start perturbed"))


@pytest.mark.parametrize("name", CASES)
def test_what_a_start_determines(name: str, tmp_path: Path) -> None:
    kind, text = CASES[name]
    row = shaken(text, tmp_path)
    assert row.kind == kind, row
    if kind != "same":
        assert "x" in row.reason or "y" in row.reason
        assert row.error is not None and row.error > 1e-3


def test_the_exit_code_tells_that_a_start_determines_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "edge.mech"
    file.write_text(CASES["on an edge"][1], encoding="utf-8")
    assert run(["stress", str(file), "--only", "as stated", "--json", "-"]) == 0
    assert json.loads(capsys.readouterr().out)["rows"][0]["kind"] == "right"
    row = shaken(CASES["on an edge"][1], tmp_path)
    made = Stress("edge", "", (row,), ())
    assert made.doubtful and not made.silent
    assert "one of several: x comes to be" in report(made).splitlines()[-1]
    assert not Stress("ridge", "", (shaken(CASES["on a ridge"][1], tmp_path),), ()).doubtful

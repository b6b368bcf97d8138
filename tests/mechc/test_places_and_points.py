"""States and points that a study is asked about, as they are typed: units, bare numbers, and lists for programs."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from mechc.cli.main import mechc as program

TEXT = """
import mech.planar.*;
model P
  gravity {0, -9.81} m/s^2;
  Bar bar(m = 3 kg, l = 2 m);
  Revolute hinge(world -> bar.a, angle = 0 deg);
  study small = modes(at = equilibrium) "near rest";
  experiment(stop = 1 s);
end P;
"""


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> str:
    file: Path = tmp_path_factory.mktemp("p") / "p.mech"
    file.write_text(TEXT)
    return str(file)


def output(*words: str) -> tuple[str, str]:
    done = CliRunner().invoke(program, list(words))
    assert done.exit_code == 0, done.output
    return done.stdout, done.stderr


@pytest.mark.parametrize("point", ["150 cm, 0", "{150, 0} cm", "1.5, 0 m", "3/2 m, 0 cm"])
def test_points_have_units(path: str, point: str) -> None:
    """About 1.5 m from the hinge: m l^2/12 + m (1/2 m)^2."""
    found = json.loads(output("study", "inertia", path, "--about", point, "--json")[0])
    assert found["bodies"][0]["tensor_about_point"][0][0] == pytest.approx(3 * 4 / 12 + 3 * 0.25)


@pytest.mark.parametrize(("point", "words"), [("1 kg, 0", "'about' is given in kg"), ("1 m", "2 numbers")])
def test_points_that_are_none(path: str, point: str, words: str) -> None:
    done = CliRunner().invoke(program, ["study", "inertia", path, "--about", point])
    assert done.exit_code != 0
    assert words in done.output + str(done.exception)


def test_bare_angles_in_places_are_remarked(path: str) -> None:
    said = output("study", "linearize", path, "--at", "hinge.angle = 30")[1]
    assert "hinge.angle=30 has no unit, so it is 30 rad" in said
    for silent in ("hinge.angle = 30 deg", "hinge.angle = pi/6", "hinge.angle = 0"):
        assert "has no unit" not in output("study", "linearize", path, "--at", silent)[1]


def test_lists_of_studies_are_json_too(path: str) -> None:
    found = json.loads(output("study", path, "--list", "--json")[0])
    assert found["model"] == "P"
    assert found["studies"]["small"]["study"] == "modes"
    assert list(found["studies"]["small"]["settings"]) == ["at"]


def test_formulas_are_shown_as_they_were_asked_for(path: str) -> None:
    words = ["study", "optimum", path, "--goal", "hinge.angel", "--vary", "hinge.angle = 0 .. 1"]
    said = str(CliRunner().invoke(program, words).exception)
    assert "--> goal:1:" in said
    assert "asked_" not in said

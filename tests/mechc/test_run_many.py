"""``mechc run --vary``: one report, one file, one picture."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from mechc.cli.main import run as run_command
from mechc.runtime.ensembles.files import read_ensemble

MODEL = """\
model Spring
  parameter k = 1 N/m;
  coordinate x = 1 m;
  kinetic 1/2*1 kg*der(x)^2;
  potential 1/2*k*x^2;
  experiment(stop = 1 s);
end Spring;
"""


@pytest.fixture
def file(tmp_path: Path) -> str:
    path = tmp_path / "spring.mech"
    path.write_text(MODEL, encoding="utf-8")
    return str(path)


def test_one_file_and_one_picture(file: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out, picture = tmp_path / "many.npz", tmp_path / "many.png"
    vary = [
        "--vary",
        "k = 1 N/m .. 9 N/m, 12; x = 1 m .. 2 m, 5",
        "--keep",
        "final(x), x",
        "--every",
        "0.5 s",
    ]
    assert run_command(["run", file, *vary, "-o", str(out), "--plot", str(picture), "--threads", "2"]) == 0
    said = capsys.readouterr().out
    assert (
        "ensemble of 60 members: 60 completed" in said and "k (12) x x (5)" in said and "final(x) [m]" in said
    )
    runs = read_ensemble(out)
    np.testing.assert_allclose(runs["final(x)"], runs["x"][..., 0] * np.cos(np.sqrt(runs["k"])), atol=1e-6)
    assert picture.stat().st_size > 10_000
    assert {p.name for p in tmp_path.iterdir()} == {"spring.mech", "many.npz", "many.png"}


def test_random_values_and_json(file: str, capsys: pytest.CaptureFixture[str]) -> None:
    drawn = ["--vary", "k ~ normal(4 N/m, 1 mN/m)", "--samples", "50", "--seed", "3", "--errors", "all"]
    assert run_command(["run", file, *drawn, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["members"] == {"completed": 50} and found["accuracy"]["estimated"] == 50
    assert found["kept"][0]["mean"] == pytest.approx(np.cos(2.0), abs=1e-3)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--vary", "k = 1 N/m .. 2 N/m, 3", "--snapshot", "1"], "is of one run"),
        (["--vary", "k = 1 N/m .. 2 N/m, 3", "--experiment", "all"], "of one experiment"),
        (["--vary", "k = 1 N/m .. 2 N/m, 3", "--resume"], "name it, -o"),
        (["--vary", "k = 1 N/m .. 2 N/m"], "number of values"),
        (["--keep", "x"], "nothing varies"),
        (["-o", "one.nc"], "is for many runs"),
    ],
)
def test_what_does_not_fit_is_told(
    file: str, options: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_command(["run", file, *options]) != 0
    assert said in capsys.readouterr().err

"""``mechc run`` from the text of a model to reports, files and pictures."""

from __future__ import annotations

import csv
import json
import math
import os
import re
import signal
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import mechc
from mechc.cli.main import run
from mechc.presentation.progress import Progress
from mechc.runtime.results.files import read_results

OSCILLATOR = """\
model Oscillator "mass on a spring"
  parameter m = 2 kg;
  parameter k = 8 N/m;
  parameter c(min = 0 N.s/m) = 0 N.s/m;
  coordinate Length x = 10 cm;
  input Force push = 0;
  kinetic 1/2*m*der(x)^2;
  potential 1/2*k*x^2;
  damping c on x;
  force push on x;
  output doubled = 2*x;
  assert x < 1 m, "the spring is overstretched";
  experiment(stop = 1 s, tolerance = 1e-10);
  experiment moved(x = 20 cm, stop = 2 s, display = "mm");
  experiment stiffer(k in {8, 32} N/m, stop = 1 s);
end Oscillator;
"""
OMEGA = 2.0  # sqrt(k/m)


@pytest.fixture(autouse=True)
def own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("oscillator.mech").write_text(OSCILLATOR, encoding="utf-8")
    return tmp_path


def call(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    code = run(["run", "oscillator.mech", *arguments])
    captured = capsys.readouterr()
    return code, captured.out, captured.err


def final(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[str, float]:
    code, out, err = call(capsys, "--json", *arguments)
    assert (code, err) == (0, "")
    values = json.loads(out)["final"]
    assert isinstance(values, dict)
    return values


def test_json_is_the_whole_report_and_nothing_else(capsys: pytest.CaptureFixture[str]) -> None:
    code, out, err = call(capsys, "--json")
    assert (code, err) == (0, "")
    report = json.loads(out)
    assert report["model"] == "Oscillator" and report["outcome"] == "completed"
    assert report["time"] == 1.0 and report["events"] == []
    assert report["final"]["x"] == pytest.approx(0.1 * math.cos(OMEGA), abs=1e-10)
    assert report["final"]["der(x)"] == pytest.approx(-0.1 * OMEGA * math.sin(OMEGA), abs=1e-10)
    assert report["final"]["doubled"] == pytest.approx(2 * report["final"]["x"], rel=1e-15)
    assert {"steps", "rejected", "evaluations", "run_time"} <= set(report["statistics"])
    assert 0 < report["accuracy"]["estimated_error"] < 1e-7
    assert abs(report["accuracy"]["energy_drift"]) < 1e-8


def test_the_report_for_people(capsys: pytest.CaptureFixture[str]) -> None:
    code, out, err = call(capsys)
    assert (code, err) == (0, "")
    assert out.startswith("Oscillator: completed at time = 1 s\n")
    assert re.search(r"^  x +-4\.161468 cm +\d", out, re.MULTILINE), "shown in the unit of the declaration"
    assert "energy balance" in out


def test_settings_with_units(capsys: pytest.CaptureFixture[str]) -> None:
    x = final(capsys, "--set", "k=72 N/m", "--set", "x=50 mm", "--stop", "500 ms")["x"]
    assert x == pytest.approx(0.05 * math.cos(6 * 0.5), abs=1e-9)
    assert final(capsys, "--set", "x=0.05")["x"] == pytest.approx(0.05 * math.cos(2), abs=1e-9)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--set", "kk=1"], "no parameter or initial value 'kk'; it has: c, der(x), k, m, push, x"),
        (["--set", "k=1 kg"], "'k' is given in kg"),
        (["--set", "k=1 N/mm"], None),
        (["--experiment", "mooved"], "the model has no experiment 'mooved'; did you mean 'moved'?"),
        (["--outputs", "y"], "the model has no coordinate, state, output, input or discrete variable 'y'"),
        (["--display", "furlong"], "unknown unit 'furlong'"),
        (["--stop", "1 kg"], "'stop' is given in kg"),
        (["--input", "pussh=x.csv"], "the model has no input 'pussh'; did you mean 'push'?"),
        (["--tolerance", "small"], "'small' is not a valid float"),
    ],
)
def test_wrong_usage(arguments: list[str], words: str | None, capsys: pytest.CaptureFixture[str]) -> None:
    code, out, err = call(capsys, *arguments)
    if words is None:
        assert code == 0
        return
    assert (code, out) == (2, "")
    assert words in " ".join(err.split())


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--method", "euler"], "euler"),
        (["--tolerance", "2"], "tolerance"),
        (["--stop", "-1"], "stop"),
        (["--set", "c=-1"], "below its minimum"),
        (["--input", "push=nothere.csv"], "nothere.csv"),
        (["--method", "rk4"], "step"),
    ],
)
def test_runs_that_cannot_begin(arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]) -> None:
    code, out, err = call(capsys, *arguments)
    assert (code, out) == (1, "")
    assert err.startswith("error: ") and words in err and "Traceback" not in err


def test_all_experiments(capsys: pytest.CaptureFixture[str]) -> None:
    code, out, err = call(capsys, "--experiment", "all", "-o", "motion.csv")
    assert code == 0
    assert "Oscillator: completed" in out and "Oscillator, moved: completed" in out
    assert re.search(r"^  x +[-\d.]+ mm", out, re.MULTILINE), "the experiment's own units"
    assert "Oscillator, stiffer: 2 runs" in out
    names = ["motion-default.csv", "motion-moved.csv", "motion-stiffer-1.csv", "motion-stiffer-2.csv"]
    assert sorted(path.name for path in Path().glob("*.csv")) == names
    assert [f"wrote {name}" for name in names] == err.splitlines()


def test_a_sweep_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    code, out, _ = call(capsys, "--experiment", "stiffer", "--json")
    assert code == 0
    soft, stiff = json.loads(out)
    assert (soft["sweep"], stiff["sweep"]) == ({"k": 8.0}, {"k": 32.0})
    assert soft["final"]["x"] == pytest.approx(0.1 * math.cos(2), abs=1e-7)
    assert stiff["final"]["x"] == pytest.approx(0.1 * math.cos(4), abs=1e-7)


def test_files_of_a_sweep_hold_the_swept_value(capsys: pytest.CaptureFixture[str]) -> None:
    code, _, _ = call(capsys, "-q", "--experiment", "stiffer", "-o", "motion.csv", "--outputs", "x")
    assert code == 0
    for number, k in ((1, 8.0), (2, 32.0)):
        results = read_results(f"motion-{number}.csv")
        assert list(results) == ["x", "k"] and results.unit("k") == "N/m"
        assert set(results["k"]) == {k}


@pytest.mark.parametrize("ending", ["csv", "npz", "json"])
def test_results_in_files(ending: str, capsys: pytest.CaptureFixture[str]) -> None:
    code, _, _ = call(capsys, "-q", "-o", f"motion.{ending}", "--every", "0.25")
    assert code == 0
    results = read_results(f"motion.{ending}")
    np.testing.assert_allclose(results.time, [0, 0.25, 0.5, 0.75, 1.0], rtol=1e-15)
    assert results.unit("x") == "m", "files are in SI"
    np.testing.assert_allclose(results["x"], 0.1 * np.cos(OMEGA * results.time), atol=1e-9)


def test_outputs_chosen_by_the_names_of_components(
    own_folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (own_folder / "grid.mech").write_text(
        "model Cell  coordinate x = 1 m; kinetic 1/2*1 kg*der(x)^2; end Cell;"
        "model Grid  Cell c[2, 2]; experiment(stop = 1 s); end Grid;"
    )
    for wanted, expected in (
        ("c.x", ["c[1,1].x", "c[1,2].x", "c[2,1].x", "c[2,2].x"]),
        ("c[2, 1].x,c[1,2].x", ["c[2,1].x", "c[1,2].x"]),
        ("c[1,2], der(c.x)", ["c[1,2].x", *(f"der(c[{i},{j}].x)" for i in (1, 2) for j in (1, 2))]),
    ):
        assert run(["run", "grid.mech", "-q", "-o", "grid.csv", "--outputs", wanted]) == 0, (
            capsys.readouterr()
        )
        assert list(read_results("grid.csv")) == expected


def test_the_json_report_has_the_last_values_of_discrete_variables(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """x = t: of ten ticks and the one at 0; what it was at the last of them, 1 s; whether it has passed 0.5 m."""
    Path("oscillator.mech").write_text(
        "coordinate x = 0 m; initial der(x) = 1 m/s; kinetic 1/2*1 kg*der(x)^2; input Force push = 0 N; force push on x;"
        "discrete Integer n = 0; discrete Length seen = 0 m; discrete Boolean passed = false; discrete Force idle = 3 N;"
        "when sample(0.1 s) then n := n + 1; seen := x; end when; when x > 0.5 m then passed := true; end when;"
        "experiment(stop = 1.05 s);"
    )
    values = final(capsys)
    assert list(values)[:2] == ["x", "der(x)"] and "push" not in values
    assert [values[name] for name in ("n", "passed", "idle")] == [11, 1, 3]
    assert values["seen"] == pytest.approx(1, rel=1e-12)


def test_units_of_energies_leave_torques_alone(own_folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (own_folder / "turn.mech").write_text(
        "parameter M = 2 N.m; coordinate a = 0 rad; kinetic 1/2*1 kg.m^2*der(a)^2; torque M on world*rot(a);"
        "output y = 2*M; output E = kinetic_energy(); experiment(stop = 1 s);"
    )
    for unit, y, energy in (
        ("mJ", "y [N.m]", "E [mJ]"),
        ("N.mm", "y [N.mm]", "E [J]"),
        ("kJ,N.cm", "y [N.cm]", "E [kJ]"),
    ):
        assert run(["run", "turn.mech", "-q", "-o", "t.csv", "--outputs", "y,E", "--display", unit]) == 0, (
            capsys.readouterr()
        )
        with Path("t.csv").open(newline="") as file:
            assert next(csv.reader(file)) == ["time [s]", y, energy]


def test_chosen_outputs_and_units_in_a_table(capsys: pytest.CaptureFixture[str]) -> None:
    call(capsys, "-q", "-o", "motion.csv", "--outputs", "doubled,x", "--display", "mm")
    with Path("motion.csv").open(newline="") as file:
        header, first, *_ = csv.reader(file)
    assert header == ["time [s]", "doubled [mm]", "x [mm]"]
    assert [float(cell) for cell in first] == pytest.approx([0, 200, 100])


def test_inputs_and_discrete_variables_in_a_table_with_both_sides_of_an_event(
    capsys: pytest.CaptureFixture[str],
) -> None:
    text = OSCILLATOR.replace(
        "  assert x", "  discrete Integer n = 0;\n  when x < 0 m then n := n + 1; end when;\n  assert x"
    )
    Path("oscillator.mech").write_text(text, encoding="utf-8")
    call(capsys, "-q", "-o", "motion.csv", "--outputs", "push,n")
    with Path("motion.csv").open(newline="") as file:
        header, *rows = csv.reader(file)
    assert header == ["time [s]", "push [N]", "n"]
    changes = [(a, b) for a, b in pairwise(rows) if a[2] != b[2]]
    assert [(a[2], b[2]) for a, b in changes] == [("0.0", "1.0")]
    assert float(changes[0][0][0]) == pytest.approx(math.pi / 2 / OMEGA)
    assert all(a[0] == b[0] for a, b in changes), "both rows have the time of the event"


def test_an_input_from_a_table(capsys: pytest.CaptureFixture[str]) -> None:
    Path("push.csv").write_text("time [ms],push [kN]\n0,0.008\n1000,0.008\n")
    x = final(capsys, "--input", "push=push.csv", "--set", "x=0 m", "--set", "k=8 N/m", "--stop", "0.3")["x"]
    assert x == pytest.approx(1 - math.cos(OMEGA * 0.3), abs=1e-9)


def test_every_name_stands_for_its_own_numbers() -> None:
    """Also after energy.supplied and energy.dissipated, which are states and outputs by one name."""
    Path("push.csv").write_text("time [s],push [N]\n0,3\n1,3\n")
    solution = mechc.load("oscillator.mech", set={"c": 0.5}).simulate(inputs={"push": "push.csv"})
    np.testing.assert_array_equal(solution["push"], 3.0)
    np.testing.assert_allclose(solution["doubled"], 2 * solution["x"], rtol=1e-15)
    np.testing.assert_allclose(solution["energy.supplied"], 3 * (solution["x"] - 0.1), atol=1e-9)
    between = solution(0.123)
    assert between["push"] == 3.0
    assert between["energy.supplied"] == pytest.approx(3 * (between["x"] - 0.1), abs=1e-8)


def test_a_failed_run_keeps_what_it_computed(capsys: pytest.CaptureFixture[str]) -> None:
    code, out, err = call(capsys, "--set", "der(x)=5 m/s", "-o", "motion.csv")
    assert code == 1
    assert "Oscillator: failed at time = " in out
    assert "the spring is overstretched" in err
    assert "--> oscillator.mech:12:3" in err and "assert x < 1 m" in err
    assert read_results("motion.csv").time[-1] == pytest.approx(math.asin(1 / 2.5 * 0.99) / 2, abs=0.05)
    report = json.loads(call(capsys, "--set", "der(x)=5 m/s", "--json")[1])
    assert report["outcome"] == "failed" and "overstretched" in report["message"]


def test_a_picture(capsys: pytest.CaptureFixture[str]) -> None:
    code, _, err = call(capsys, "--plot")
    assert (code, err) == (0, "wrote oscillator.png\n")
    assert Path("oscillator.png").read_bytes().startswith(b"\x89PNG")


def test_the_true_error_where_the_model_states_a_closed_solution(capsys: pytest.CaptureFixture[str]) -> None:
    exact = "exact x = 10 cm*cos(sqrt(k/m)*time);\n  experiment(stop"
    Path("oscillator.mech").write_text(OSCILLATOR.replace("experiment(stop", exact))
    code, out, _ = call(capsys)
    assert code == 0
    row = re.search(r"error against the closed solution .*\n  x +(\S+) cm +(\S+)$", out, re.MULTILINE)
    assert row is not None and 0 < float(row[1]) < 1e-7  # 10 times the tolerance, as the model shows lengths
    report = json.loads(call(capsys, "--json")[1])
    assert report["accuracy"]["true_error"]["x"]["largest"] == pytest.approx(1e-2 * float(row[1]), rel=0.06)
    assert not any("exact" in name for name in report["final"])
    for changed in (["--set", "x=5 cm"], ["--experiment", "moved"]):
        out = call(capsys, *changed)[1]
        assert "error against the closed" not in out, "it holds for the default experiment only"
        assert "not compared with the closed solution, which the model states for its own values" in out


def test_files_of_many_runs_sort_as_the_runs_do(capsys: pytest.CaptureFixture[str]) -> None:
    Path("oscillator.mech").write_text(OSCILLATOR.replace("{8, 32} N/m", "linspace(1 N/m, 10 N/m, 10)"))
    assert call(capsys, "--experiment", "stiffer", "-q", "--no-error-estimate", "-o", "k.csv")[0] == 0
    assert [path.name for path in sorted(Path().glob("k-*.csv"))] == [f"k-{i:02}.csv" for i in range(1, 11)]


def test_bare_angles_are_told_to_be_radians(capsys: pytest.CaptureFixture[str]) -> None:
    text = "coordinate Angle a = 0; kinetic 1/2*1 kg.m^2*der(a)^2; experiment(stop = 1 s);"
    Path("oscillator.mech").write_text(text)
    _, _, err = call(capsys, "--set", "a=30")
    assert err.startswith("note: a=30 has no unit, so it is 30 rad\n")
    assert call(capsys, "--set", "a=30 deg")[2] == call(capsys, "--set", "a=pi/6")[2] == ""


def test_quiet(capsys: pytest.CaptureFixture[str]) -> None:
    assert call(capsys, "-q") == (0, "", "")


def test_no_error_estimate(capsys: pytest.CaptureFixture[str]) -> None:
    _, out, _ = call(capsys, "--no-error-estimate", "--json")
    assert json.loads(out)["accuracy"]["estimated_error"] is None


def test_without_any_compiler_the_run_says_where_to_get_one(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CC", str(Path("nowhere").resolve()))
    code, out, err = call(capsys)
    assert (code, out) == (1, "")
    assert "which cannot be run" in err and "pip install ziglang" in err


def test_a_model_without_stop_time(capsys: pytest.CaptureFixture[str]) -> None:
    text = re.sub(r"  experiment.*\n", "", OSCILLATOR)
    Path("oscillator.mech").write_text(text)
    code, _, err = call(capsys)
    assert code == 1 and "stop" in err
    assert call(capsys, "--stop", "1", "-q")[0] == 0


def test_an_interrupted_run_keeps_what_it_computed(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupt(self: Progress, fraction: float) -> None:
        signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(Progress, "__call__", interrupt)
    long = ["--stop", "1e6", "--every", "1e3", "-o", "motion.csv"]
    code, out, err = call(capsys, *long)
    assert code == 130
    assert out.startswith("Oscillator: interrupted at time = ") and "Traceback" not in err
    assert 0 < read_results("motion.csv").time[-1] < 1e6


def test_the_model_may_come_with_a_byte_order_mark_and_other_line_ends(
    capsys: pytest.CaptureFixture[str],
) -> None:
    text = "\ufeff" + OSCILLATOR.replace("\n", "\r\n").replace("  ", "\t")
    Path("oscillator.mech").write_bytes(text.encode("utf-8"))
    assert call(capsys, "-q") == (0, "", "")


def test_a_compiler_that_fails_is_quoted_and_the_sources_are_kept(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    compiler = tmp_path / "failing-cc"
    compiler.write_text(
        '#!/bin/sh\n[ "$1" = --version ] && echo failing 1.0 && exit 0\necho no luck >&2\nexit 1\n'
    )
    compiler.chmod(0o755)
    monkeypatch.setenv("CC", str(compiler))
    monkeypatch.setenv("MECHC_CACHE", str(tmp_path / "cache"))
    code, out, err = call(capsys)
    assert (code, out) == (1, "")
    assert err.startswith("error: the C compiler failed: ") and "no luck" in err and "Traceback" not in err
    kept = re.search(r"the sources are kept in (\S+)", err)
    assert kept is not None and list(Path(kept[1]).glob("*.c"))


@pytest.mark.parametrize("method", ["radau5", "auto", "gauss4 --step 1ms", "rk4 --step 1ms"])
def test_methods_by_name(method: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Each needs its own functions of the model, which are there when it is asked for."""
    x = final(capsys, "--method", *method.split(), "--tolerance", "1e-8")["x"]
    assert x == pytest.approx(0.1 * math.cos(OMEGA), abs=1e-6)


def test_the_method_of_an_experiment(capsys: pytest.CaptureFixture[str]) -> None:
    Path("oscillator.mech").write_text(OSCILLATOR.replace("tolerance = 1e-10", 'method = "radau5"'))
    assert "  method     radau5, compiled C" in call(capsys)[1]


STIFF = """\
model Stiff
  parameter k = 1e8 N/m;
  parameter c = 1e5 N.s/m;
  coordinate x = 1 m;
  coordinate y = 1 m;
  kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
  potential 1/2*1 N/m*x^2 + 1/2*k*(y - x)^2;
  dissipation 1/2*c*(der(y) - der(x))^2;
  experiment(stop = 20 s);
  experiment calm(k = 0, c = 0, stop = 20 s);
end Stiff;
"""


def test_a_stiff_model_gets_an_implicit_method_without_asking(capsys: pytest.CaptureFixture[str]) -> None:
    """Two masses hold together by a spring 1e8 times stiffer than the other: x = cos(t/sqrt(2))."""
    Path("oscillator.mech").write_text(STIFF)
    code, out, _ = call(capsys, "--json")
    report = json.loads(out)
    assert code == 0 and report["outcome"] == "completed"
    assert report["statistics"]["steps"] < 2000, "an explicit method takes 600 000"
    assert report["final"]["x"] == pytest.approx(math.cos(20 / math.sqrt(2)), abs=1e-6)
    calm = json.loads(call(capsys, "--json", "--experiment", "calm")[1])
    assert calm["statistics"]["method"] == "dop853"


def test_a_long_run_that_is_not_stiff_goes_on(capsys: pytest.CaptureFixture[str]) -> None:
    code, out, _ = call(capsys, "--json", "--stop", "10 h", "--every", "1 h", "--no-error-estimate")
    report = json.loads(out)
    assert code == 0 and report["time"] == 36000.0
    assert report["statistics"]["steps"] > 20_000 and report["statistics"]["method"] == "dop853"


def test_results_are_written_where_nobody_reads_the_report() -> None:
    read, write = os.pipe()
    os.close(read)
    command = [sys.executable, "-m", "mechc", "run", "oscillator.mech", "-o", "motion.csv"]
    done = subprocess.run(command, stdout=write, stderr=subprocess.PIPE, text=True, check=True)
    os.close(write)
    assert done.stderr == "wrote motion.csv\n" and Path("motion.csv").exists()

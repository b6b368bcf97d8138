"""Runs that are ended from outside, and streams, devices and chains that nobody expects: words, never a traceback."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from refusals import refused
from slow_params import slow_but

import mechc
from mechc.cli.main import run as command_line
from mechc.runtime.native.build import find_compiler

COMPILED = pytest.mark.skipif(find_compiler() is None, reason="needs a C compiler")
posix = pytest.mark.skipif(os.name == "nt", reason="signals and devices of POSIX")

OSCILLATOR = """model Oscillator
  parameter k = 1 N/m;
  coordinate x = 1 m;
  kinetic 1/2*1 kg*der(x)^2;
  potential 1/2*k*x^2;
  experiment(stop = 1e9 s, tolerance = 1e-10);
end Oscillator;
"""
SWEPT = OSCILLATOR.replace("tolerance = 1e-10", "k in {1, 2, 3} N/m").replace("1e9 s", "1 s")
COMMAND = [sys.executable, "-m", "mechc"]


# a shell may have started the tests in the background, where Ctrl-C is ignored
LONG = """import pathlib, runpy, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
def heard(event, given):
    if event == "ctypes.dlopen" and "mechc-compiled" in str(given):
        pathlib.Path("begun").touch()
sys.addaudithook(heard)
sys.argv[0] = "mechc"
runpy.run_module("mechc", run_name="__main__", alter_sys=True)
"""


@posix
@COMPILED
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_run_that_is_ended_keeps_what_it_computed(number: signal.Signals, tmp_path: Path) -> None:
    (tmp_path / "m.mech").write_text(OSCILLATOR)
    command = [sys.executable, "-c", LONG, "run", "m.mech", "-o", "m.csv", "--no-error-estimate"]
    run = subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    waited = time.monotonic() + 60
    while not (tmp_path / "begun").exists():  # until the first library is loaded
        assert time.monotonic() < waited and run.poll() is None, run
        time.sleep(0.05)
    time.sleep(0.5)  # a loaded machine has not begun even now: then it ends before the run, as the next test
    run.send_signal(number)
    out, err = run.communicate(timeout=60)
    assert run.returncode == 130 and "Traceback" not in err, err
    if "interrupted at time = " in out:
        assert (tmp_path / "m.csv").exists()
    else:
        assert err.strip() == "interrupted"


@posix
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("seconds", [0.05, 0.15, 0.3, 0.6])
def test_an_early_end_shows_no_traceback(number: signal.Signals, seconds: float, tmp_path: Path) -> None:
    """Imports and compiling; before Python has read the first line of mechc, its own words cannot be helped."""
    (tmp_path / "m.mech").write_text(OSCILLATOR)
    script = (
        "import os, signal, sys, threading, time\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "from mechc.cli import main\n"
        "def end():\n"
        "    os.kill(os.getpid(), number)\n"
        "    time.sleep(10)  # a callback of Python's own imports may have met it and gone on\n"
        "    os.kill(os.getpid(), number)\n"
        f"number = {int(number)}\n"
        f"timer = threading.Timer({seconds}, end)\n"
        "timer.daemon = True\n"
        "timer.start()\n"
        "main(sys.argv[1:])\n"
    )
    command = [sys.executable, "-c", script, "run", str(tmp_path / "m.mech")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert done.returncode == 130 and "Traceback" not in done.stderr, done
    # Python's own libraries may warn where their import was broken off and is made once more
    lines = [line for line in done.stderr.splitlines() if line and "warning: mpd_setminalloc" not in line]
    assert lines == ["interrupted"] or "interrupted at time = " in done.stdout


@pytest.mark.parametrize("before", [1, 2])
def test_an_interrupted_sweep_keeps_the_runs_it_has(before: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C between two runs."""
    from mechc.runtime.studies.runs import simulate

    begun: list[int] = []
    plan = simulate.plan_run

    def interrupted(*given: object) -> object:
        begun.append(1)
        if len(begun) > before:
            raise KeyboardInterrupt
        return plan(*given)  # type: ignore[arg-type]

    monkeypatch.setattr(simulate, "plan_run", interrupted)
    sweep = mechc.loads(SWEPT).sweep()
    assert len(sweep.solutions) == len(sweep.points) == before and not sweep.complete
    assert [point["k"] for point in sweep.points] == [1.0, 2.0][:before]


def test_the_first_run_of_a_sweep_has_nothing_to_keep(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("mechc.runtime.studies.runs.simulate.plan_run", interrupted)
    with pytest.raises(KeyboardInterrupt):
        mechc.loads(SWEPT).sweep()


def test_a_sweep_over_structures_keeps_the_runs_it_has(monkeypatch: pytest.MonkeyPatch) -> None:
    text = SWEPT.replace("parameter k = 1 N/m", "parameter k = 1 N/m;\n  structural parameter Integer n = 1")
    text = text.replace("k in {1, 2, 3} N/m", "n in {1, 2, 3}").replace("1/2*k", "n*k")
    assert len(mechc.loads(text).sweep().solutions) == 3
    begun: list[int] = []
    problem = mechc.Model.problem

    def interrupted(self: mechc.Model, *given: object, **more: object) -> object:
        begun.append(1)
        if len(begun) > 2:
            raise KeyboardInterrupt
        return problem(self, *given, **more)  # type: ignore[arg-type]

    monkeypatch.setattr(mechc.Model, "problem", interrupted)
    sweep = mechc.loads(text).sweep()
    assert len(sweep.solutions) == 2 and not sweep.complete


def test_the_command_writes_the_runs_of_an_interrupted_sweep(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from mechc.runtime.studies.runs import simulate

    begun: list[int] = []
    plan = simulate.plan_run

    def interrupted(*given: object) -> object:
        begun.append(1)
        if len(begun) > 2:
            raise KeyboardInterrupt
        return plan(*given)  # type: ignore[arg-type]

    monkeypatch.setattr(simulate, "plan_run", interrupted)
    monkeypatch.chdir(tmp_path)
    Path("m.mech").write_text(SWEPT)
    assert command_line(["run", "m.mech", "-o", "m.csv", "--json"]) == 130
    said = capsys.readouterr()
    assert len(json.loads(said.out)) == 2
    assert "interrupted after 2 runs; the others were not made" in said.err
    assert sorted(path.name for path in tmp_path.glob("*.csv")) == ["m-1.csv", "m-2.csv"]


@posix
@pytest.mark.parametrize("closed", slow_but(["0<&- 1>&- 2>&-"], ["1>&-", "2>&-", "0<&-", "0<&- 1>&- 2>&-"]))
def test_closed_streams_are_taken_as_nobody(closed: str, tmp_path: Path) -> None:
    (tmp_path / "m.mech").write_text(OSCILLATOR.replace("1e9 s", "1 s"))
    line = f'"{sys.executable}" -m mechc run m.mech -o m.csv {closed}'
    done = subprocess.run(["sh", "-c", line], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0 and "bug" not in done.stderr, done
    first = (tmp_path / "m.csv").read_text().splitlines()[0]
    assert first.startswith("time [s],x [m]"), "nothing was printed into it"


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no devices")
def test_a_full_disk_is_told_once(tmp_path: Path) -> None:
    with open("/dev/full", "w") as full:
        done = subprocess.run([*COMMAND, "doctor"], stdout=full, stderr=subprocess.PIPE, text=True)
    assert (done.returncode, done.stderr) == (1, "error: No space left on device\n")


def test_results_are_not_written_over_a_table_that_is_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("m.mech").write_text(
        OSCILLATOR.replace("  experiment", "  input Force F = 0 N;\n  force F on x;\n  experiment")
    )
    table = "time,F\n0,1\n1,2\n"
    Path("force.csv").write_text(table)
    Path("same.csv").symlink_to("force.csv")
    for output in ("force.csv", "same.csv", "./force.csv"):
        assert command_line(["run", "m.mech", "--input", "F=force.csv", "--stop", "1", "-o", output]) == 2
        assert "would be written over 'force.csv', which holds the input 'F'" in capsys.readouterr().err
    assert Path("force.csv").read_text() == table


def chain_of_heirs(n: int) -> str:
    heirs = "".join(f"model M{k}\n  extends M{k - 1};\nend M{k};\n" for k in range(1, n))
    first = "model M0\n  coordinate x = 1 m;\n  kinetic 1/2*1 kg*der(x)^2;\nend M0;\n"
    return f"{first}{heirs}model Z\n  extends M{n - 1};\n  experiment(stop = 1 s);\nend Z;\n"


def chain_of_names(n: int) -> str:
    lets = "".join(f"let a{k} = sin(a{k - 1});\n" for k in range(1, n))
    return (
        f"coordinate x = 1 m;\nkinetic 1/2*1 kg*der(x)^2;\nlet a0 = x/(1 m);\n{lets}potential 1 J*a{n - 1};\n"
    )


def nested(begin: str, end: str) -> Callable[[int], str]:
    head = "coordinate x = 1 m;\nkinetic 1/2*1 kg*der(x)^2;\n"
    return lambda n: f"{head}potential 1 J*{begin * n}x/(1 m){end * n};\n"


@pytest.mark.parametrize(
    ("text", "n", "code"),
    [
        (chain_of_heirs, 1000, 0),
        (chain_of_names, 1000, 0),
        pytest.param(chain_of_heirs, 30_000, 1, marks=pytest.mark.slow),
        pytest.param(chain_of_names, 30_000, 1, marks=pytest.mark.slow),
        (nested("(", ")"), 30_000, 1),
        pytest.param(nested("-", ""), 30_000, 1, marks=pytest.mark.slow),
        pytest.param(nested("sin(", ")"), 30_000, 1, marks=pytest.mark.slow),
    ],
    ids=["heirs", "names", "many heirs", "many names", "parentheses", "signs", "calls"],
)
def test_long_chains_and_deep_nesting(text: Callable[[int], str], n: int, code: int, tmp_path: Path) -> None:
    """In a process of its own, where a signal would be seen."""
    (tmp_path / "m.mech").write_text(text(n))
    done = subprocess.run([*COMMAND, "check", "m.mech"], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == code, done
    assert "bug in mechc" not in done.stderr
    if code:
        assert done.stderr.startswith(
            ("error[E0207]: definitions in ", "error[E0207]: ", "error[E0124]: ")
        ), done


@pytest.mark.parametrize(
    "character", "\u061c\u200e\u200f\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069"
)
@pytest.mark.parametrize("place", ["// a{}b\n{{}}", '{{}} "a{}b";', "/* {} */{{}}", "let y{} = 1;{{}}"])
def test_characters_that_reorder_a_text_stand_nowhere(character: str, place: str) -> None:
    caught = refused(place.format(character).replace("{}", "let x = 1 m"))
    (problem,) = caught
    assert problem.code == "E0131" and f"U+{ord(character):04X}" in problem.message
    assert not set(mechc.render(caught)) & set("\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069")


def test_letters_from_right_to_left_may_stand_in_comments() -> None:
    mechc.loads("// \u05de\u05d8\u05d5\u05d8\u05dc\u05ea\ncoordinate x = 0 m;\nkinetic 1/2*1 kg*der(x)^2;\n")

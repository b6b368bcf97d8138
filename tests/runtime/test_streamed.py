"""Results that are written while their run goes on: the same file, whatever ends it, without its points in memory."""

from __future__ import annotations

import errno
import os
import signal
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechc
from mechc.cli.main import run
from mechc.runtime.results.files import read_results
from mechc.runtime.rows import Scratch, output_times

SLICED = (
    "rows",
    "integrate.kernel_run",
    "results.evaluate",
    "results.solution",
    "results.extents",
    "results.streamed",
)

TICKS = """model Ticks
  input Force push = 0.3 N*sin(2*time/(1 s));
  parameter m = 0.7 kg;
  coordinate Length x = 0.2 m;
  coordinate Length y = 1 m;
  discrete Real n = 1;
  initial der(x) = 1.5 m/s;
  kinetic 1/2*m*(der(x)^2 + der(y)^2);
  potential m*9.81 m/s^2*y;
  force push on x;
  parameter c = 0.03 N.s/m;
  damping c*n on x;
  contact floor: y restitution 0.8;
  when sample(0.1 s) then n := n + 0.1; end when;
  output Length both[2] = {x, y};
  FURTHER
  experiment(stop = 2.5 s);
end Ticks;
"""

MODELS = {
    "ticks": TICKS.replace("FURTHER", ""),
    "is ended": TICKS.replace("FURTHER", 'when x > 1.7 m then terminate("far"); end when;'),
    "fails": TICKS.replace("FURTHER", 'assert x < 1.7 m, "too far";'),
    "begins unseen": """model Unseen
  coordinate Length x = 0 m;
  kinetic 1/2*1 kg*der(x)^2;
  force if time > 4 s and time < 4.001 s then 1000 N else 0 N on x;
  experiment(stop = 10 s);
end Unseen;
""",
    "is pushed unseen": """model Pushed
  coordinate Length x = 0 m;
  kinetic 1/2*1 kg*der(x)^2;
  force 1000 N*exp(-((time - 4 s)/(0.001 s))^2) on x;
  experiment(stop = 10 s);
end Pushed;
""",
}


@pytest.fixture(scope="module", params=MODELS)
def model(request: pytest.FixtureRequest) -> mechc.Model:
    return mechc.loads(MODELS[request.param])


@pytest.fixture(scope="module")
def ticks() -> mechc.Model:
    return mechc.loads(MODELS["ticks"])


@pytest.fixture
def sliced(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in SLICED:
        monkeypatch.setattr(f"mechc.runtime.{name}.AT_ONCE", 7)


def report(of: Mapping[str, Any] | None) -> Mapping[str, Any]:
    assert of is not None
    return {**of, "statistics": {n: v for n, v in of["statistics"].items() if n != "run_time"}}


def test_the_file_is_that_of_a_run_in_memory(
    model: mechc.Model, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    expected = model.simulate(every=0.02)
    for ending in ("csv", "npz", "json"):
        expected.save(tmp_path / f"expected.{ending}")
    with monkeypatch.context() as patch:
        for name in SLICED:
            patch.setattr(f"mechc.runtime.{name}.AT_ONCE", 7)
        for ending in ("csv", "npz", "json"):
            streamed = model.simulate(every=0.02, to=tmp_path / f"streamed.{ending}")
            assert report(streamed.report) == report(expected.report)
    assert (tmp_path / "streamed.csv").read_bytes() == (tmp_path / "expected.csv").read_bytes()
    for ending in ("npz", "json"):
        ours, theirs = (read_results(tmp_path / f"{name}.{ending}") for name in ("streamed", "expected"))
        assert list(ours) == list(theirs) and report(ours.report) == report(theirs.report)
        assert all(np.array_equal(ours[name], theirs[name], equal_nan=True) for name in ("time", *ours))
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted(
        f"{name}.{ending}" for name in ("expected", "streamed") for ending in ("csv", "npz", "json")
    )


def test_the_file_grows_with_the_run(
    ticks: mechc.Model, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("mechc.runtime.integrate.kernel_run.FIRST_SLICE", 2)
    file, lines = tmp_path / "motion.csv", []

    def look(fraction: float) -> None:
        lines.append(len(file.read_text(encoding="utf-8").splitlines()))

    solution = ticks.simulate(every=0.001, stop=20, estimate_error=False, to=file, progress=look)
    assert 1 < lines[0] < lines[-1] <= len(solution.time) + 1
    assert len(file.read_text(encoding="utf-8").splitlines()) == len(solution.time) + 1


def test_an_interrupted_run_keeps_what_it_wrote(ticks: mechc.Model, tmp_path: Path) -> None:
    def press(fraction: float) -> None:
        signal.raise_signal(signal.SIGINT)

    file = tmp_path / "motion.csv"
    solution = ticks.simulate(every=0.001, stop=20, to=file, progress=press)
    assert solution.outcome.value == "interrupted" and 1 < len(solution.time) < 20_000
    solution.save(tmp_path / "same.csv")
    assert file.read_bytes() == (tmp_path / "same.csv").read_bytes()


def test_times_are_the_same_wherever_they_lie(tmp_path: Path, sliced: None) -> None:
    for start, stop, every, points in (
        (0, 1, None, 333),
        (-0.3, 2, None, 2),
        (0.1, 1, 0.03, 0),
        (0, 0.7, 0.1, 0),
    ):
        lain = output_times(start, stop, every, points, Scratch(tmp_path))
        assert np.array_equal(lain, output_times(start, stop, every, points))
        if every is None:
            assert np.array_equal(lain, np.linspace(start, stop, points))


def test_a_full_disk_is_told(ticks: mechc.Model, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    full = tmp_path / "full.csv"
    full.symlink_to("/dev/full")
    with pytest.raises(OSError, match=r"No space left on device: '.*full\.csv'"):
        ticks.simulate(every=0.001, to=full)

    def refuse(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "posix_fallocate", refuse)
    with pytest.raises(OSError, match=r"No space left on device: '.* \(room for .* GB of states\)'"):
        ticks.simulate(every=0.001, to=tmp_path / "motion.csv")
    assert not (tmp_path / "motion.csv").exists()


def test_what_does_not_grow_with_a_run_is_refused(ticks: mechc.Model, tmp_path: Path) -> None:
    with pytest.raises(mechc.UsageMistake, match="derivatives of a motion are known at its end only"):
        ticks.simulate(to=tmp_path / "motion.csv", sensitivity="m")
    with pytest.raises(mechc.UsageMistake, match="no points that it could write"):
        ticks.study("equilibria", to=tmp_path / "motion.csv")
    swept = mechc.loads(MODELS["ticks"].replace("(stop = 2.5 s)", "(stop = 1 s, m in {1 kg, 2 kg})"))
    with pytest.raises(mechc.SimulationError, match="sweeps m: it is 2 runs"):
        swept.sweep(to=tmp_path / "motion.csv")
    assert not any(tmp_path.iterdir())


def test_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = tmp_path / "ticks.mech"
    model.write_text(MODELS["ticks"], encoding="utf-8")
    chosen = ["--every", "0.01", "--outputs", "both,x", "--display", "mm", "--quiet"]
    whole, streamed = tmp_path / "whole.csv", tmp_path / "streamed.csv"
    assert run(["run", str(model), "-o", str(whole), *chosen]) == 0
    assert run(["run", str(model), "-o", str(streamed), "--streamed", *chosen]) == 0
    assert streamed.read_bytes() == whole.read_bytes()
    assert streamed.read_text(encoding="utf-8").startswith("time [s],both[1] [mm],both[2] [mm],x [mm]\n")
    assert run(["run", str(model), "--streamed"]) == 2
    assert "nothing says into which file" in capsys.readouterr().err
    assert run(["run", str(model), "-o", str(streamed), "--streamed", "--vary", "m = 1 kg .. 2 kg, 3"]) == 2
    assert "the points of one motion" in capsys.readouterr().err


PEAK = """
import resource, sys
import mechc
model = mechc.loads(sys.argv[1])
model.simulate(stop=1, to=sys.argv[2])
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
model.simulate(every=2.5/float(sys.argv[3]), to=sys.argv[2])
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)
"""


@pytest.mark.slow
@pytest.mark.parametrize("ending", ["csv", "npz", "json"])
def test_the_memory_does_not_grow_with_the_points(ending: str, tmp_path: Path) -> None:
    file = tmp_path / f"motion.{ending}"
    added = [
        int(
            subprocess.run(
                [
                    sys.executable,
                    "-c",
                    PEAK,
                    MODELS["ticks"].replace(
                        "input Force push = 0.3 N*sin(2*time/(1 s));", "parameter push = 0.3 N;"
                    ),
                    str(file),
                    str(points),
                ],
                check=True,
                capture_output=True,
                text=True,
            ).stdout
        )
        for points in (100_000, 1_000_000)
    ]
    assert added[1] - added[0] < 20_000

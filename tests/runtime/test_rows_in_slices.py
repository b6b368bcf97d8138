"""Runs of many points: what is looked at in slices, and computed where somebody asks, is the same."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechc

SLICED = ("rows", "integrate.kernel_run", "results.evaluate", "results.solution", "results.extents")
"""Modules that know how many rows are looked at together."""

THROWN = """model Thrown
  parameter m = 0.7 kg;
  coordinate Length x = 0.2 m;
  coordinate Length y = 1 m;
  initial der(x) = 1.5 m/s;
  kinetic 1/2*m*(der(x)^2 + der(y)^2);
  potential m*9.81 m/s^2*y;
  damping 0.03 N.s/m on x;
  contact floor: y restitution 0.8;
  output Real logarithm = log(2 - x/(1 m));
  END
  experiment(stop = 2.5 s);
end Thrown;
"""

PENDULUM = """model Pendulum
  coordinate theta = 1 rad;
  kinetic 1/2*1 kg.m^2*der(theta)^2;
  potential -9.81 J*cos(theta);
  output Real sine = sin(theta);
  experiment(stop = 3 s);
end Pendulum;
"""

MODELS = {
    "bounces": THROWN.replace("END", ""),
    "is ended": THROWN.replace("END", 'when x > 1.7 m then terminate("far"); end when;'),
    "swings": PENDULUM,
    "rests": PENDULUM.replace("1 rad", "0 rad"),
}


@pytest.fixture(scope="module", params=MODELS)
def model(request: pytest.FixtureRequest) -> mechc.Model:
    return mechc.loads(MODELS[request.param])


def report(solution: mechc.Solution) -> Mapping[str, Any]:
    """Give the report without what no two runs share."""
    summary = solution.summary()
    return summary | {"statistics": {n: v for n, v in summary["statistics"].items() if n != "run_time"}}


def numbers(solution: mechc.Solution) -> dict[str, bytes]:
    return {name: np.ascontiguousarray(solution[name]).tobytes() for name in ("time", *solution)}


@pytest.mark.parametrize("at_once", [2, 7])
def test_reports_and_numbers_are_the_same_in_slices(
    model: mechc.Model, at_once: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = model.simulate(every=0.02)
    for name in SLICED:
        monkeypatch.setattr(f"mechc.runtime.{name}.AT_ONCE", at_once)
    sliced = model.simulate(every=0.02)
    assert report(sliced) == report(whole)
    assert "outputs" not in vars(sliced.motion.columns)  # nobody has asked for one
    assert numbers(sliced) == numbers(whole)
    assert list(sliced) == list(whole) and "energy.total" in sliced


PEAK = """
import resource, sys
import mechc
model = mechc.loads(sys.argv[1])
model.simulate(stop=1)
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
solution = model.simulate(every=1e-6, stop=1)
print(1024 * (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / len(solution.time))
"""


def test_a_point_costs_the_numbers_of_its_states() -> None:
    """Time, two states, and the energy of the companion; nothing of a million points is there twice."""
    done = subprocess.run([sys.executable, "-c", PEAK, PENDULUM], check=True, capture_output=True, text=True)
    assert float(done.stdout) < 1.25 * 8 * 4


TAKEN = """
import sys
from pathlib import Path
import numpy as np
from mechc.runtime.rows import Scratch, passed, taken
rows = Scratch(Path(sys.argv[1])).empty(1_000_000, 16)
rows[:] = np.arange(1_000_000.0)[:, None]
passed(rows)
of = np.arange(0, 1_000_000, 20_000)
def resident():
    with open("/proc/self/statm") as file:
        return 4096 * int(file.read().split()[1])
before = resident()
found, none = taken(of, rows, None)
assert none is None and np.array_equal(found, np.repeat(of[:, None], 16, axis=1))
print(resident() - before)
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the system tells it elsewhere")
def test_rows_that_are_taken_from_a_file_leave_the_memory(tmp_path: Path) -> None:
    command = [sys.executable, "-c", TAKEN, str(tmp_path)]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    assert int(done.stdout) < 4_000_000  # of 128 MB

"""Crowds of contacts in C programs and FMUs: the bits of a reproducible run; Model Exchange and modules are refused in words."""

from __future__ import annotations

import csv
import subprocess
from pathlib import Path

import numpy as np
import pytest

import mechc
from mechc.fmu.export import FmuOptions, export_fmu
from mechc.fmu.guard import check_fmu
from mechc.requests.parse_values import UsageMistake
from mechc.runtime.native.build import find_compiler

HEAP = """
model Heap
  structural parameter Integer n = 13;
  parameter r = 2 cm;
  coordinate Length x[n] = {4.5 cm*(0.5 + mod(i - 1, 4)) + 2 mm*sin(7*i) for i in 1:n};
  coordinate Length y[n] = {4.5 cm*(0.5 + floor((i - 1)/4)) + 2 mm*sin(5*i) for i in 1:n};
  for i in 1:n loop
    initial der(y[i]) = -1 m/s;
    kinetic 1/2*0.1 kg*(der(x[i])^2 + der(y[i])^2);
    potential 0.1 kg*9.81 m/s^2*y[i];
    contact floor[i]: y[i] - r restitution 0.5 friction 0.3 along der(x[i]);
    for j in i+1:n loop
      contact hit[i,j]: norm({x[i] - x[j], y[i] - y[j]}) - 2*r restitution 0.5;
    end for;
  end for;
  output height = sum(y)/n;
  EXPERIMENT
end Heap;
"""
STEPS = 'experiment(stop = 0.2 s, method = "moreau", step = 1 ms, every = 1 ms);'
EVENTS = "experiment(stop = 0.1 s, every = 1 ms);"


@pytest.mark.slow
@pytest.mark.parametrize("experiment", [STEPS, EVENTS], ids=["steps", "events"])
def test_a_program_prints_the_bits_of_a_run(experiment: str, tmp_path: Path) -> None:
    compiler = find_compiler()
    if compiler is None or compiler.in_process:
        pytest.skip("no compiler of programs")
    model = mechc.loads(HEAP.replace("EXPERIMENT", experiment))
    model.compile("c", tmp_path)
    program = tmp_path / "heap_program"
    sources = sorted(map(str, tmp_path.glob("*.c")))
    subprocess.run([*compiler.command, "-std=c11", "-O1", "-o", program, *sources, "-lm"], check=True)
    head, *rows = csv.reader(
        subprocess.run([program], capture_output=True, text=True, check=True).stdout.splitlines()
    )
    run = model.simulate(estimate_error=False, reproducible=True)
    told = {name.rpartition(" [")[0] or name: k for k, name in enumerate(head)}
    numbers = np.array(rows, dtype=float)
    assert numbers[-1, told["time"]] == run.time[-1]
    for name in ("x[1]", "y[7]", "der(y[13])", "energy.dissipated", "height"):
        assert numbers[-1, told[name]] == run[name][-1], name
    assert run["energy.dissipated"][-1] > 0.1


@pytest.mark.slow
def test_an_fmu_steps_as_a_run_does(tmp_path: Path) -> None:
    """The check before writing compares each bit of the states; that of the file then compares with the reference results."""
    pytest.importorskip("fmpy")
    export_fmu(mechc.loads(HEAP.replace("EXPERIMENT", STEPS)), tmp_path / "heap.fmu", FmuOptions(kind="cs"))
    report = check_fmu(tmp_path / "heap.fmu")
    assert report.passed, report
    assert "CoSimulation reference" in str(report)


def test_model_exchange_and_modules_are_refused_in_words(tmp_path: Path) -> None:
    model = mechc.loads(HEAP.replace("EXPERIMENT", EVENTS))
    with pytest.raises(UsageMistake, match=r"91 contacts of 'Heap'.*Model Exchange"):
        export_fmu(model, tmp_path / "heap.fmu", FmuOptions(kind="both"))
    with pytest.raises(mechc.CompileError, match="module of functions"):
        model.compile("python", tmp_path / "heap.py")

"""A proof mass that swings by a nanometre in a model of the Earth's orbit: every target gives its motion, not zeros or noise.

The tide that the Sun exerts on it belongs to the orbit, so that the equations of both are one system; the orbit alone would take
ten steps a revolution. The closed form is u = 1 nm cos(W t).
"""

from __future__ import annotations

import csv
import math
import subprocess
from pathlib import Path

import numpy as np
import pytest
import true_motions
from c_programs import build
from slow_params import slow_but

import mechc
from mechc.compiler.pipeline import program_with
from mechc.compiler.targets.fmu.export import start_of
from mechc.exporting import exported_run, with_own_sizes
from mechc.fmu.export import FmuOptions, fmu_packages
from mechc.runtime.native.build import find_compiler
from mechc.runtime.nominal import sizes_of

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="needs a C compiler")

GM, RADIUS, STOP = 1.32712440018e20, 1.5e11, 3e7
TIDE = """\
model Tide
  parameter GM = 1.32712440018e20 m^3/s^2; parameter r0 = 1.5e11 m; parameter mu = 1 kg; parameter w = {} rad/s;
  coordinate x = r0; coordinate Length y = 0 m; initial der(y) = sqrt(GM/r0);
  coordinate u = 1 nm;
  let r = sqrt(x^2 + y^2);
  kinetic 1/2*mu*(der(x)^2 + der(y)^2);
  potential -GM*mu/r;
  kinetic 1/2*1e-9 kg*der(u)^2;
  potential 1/2*1e-9 kg*w^2*u^2;
  force -1e-9 kg*GM/r^3*u on u;
  experiment(stop = 3e7 s);
end Tide;
"""
RATES = (2e-6, 2e-5)
"""The second one swings a hundred times in the run: steps that follow the orbit alone drive it to 145 m, or damp it to nothing."""
ALLOWED = 2e-5
"""Share of the swing: 0.1 rad of the hundred swings of 2 pi would be 2e-4, and tolerances of 1e-8 give less than 5e-6."""


def exact(rate: float) -> float:
    return 1e-9 * math.cos(math.sqrt(rate**2 + GM / RADIUS**3) * STOP)


@pytest.fixture(scope="module", params=slow_but(RATES[1:], RATES))
def rate(request: pytest.FixtureRequest) -> float:
    return float(request.param)


@pytest.fixture(scope="module")
def model(rate: float) -> mechc.Model:
    return mechc.loads(TIDE.format(rate))


def test_a_run(model: mechc.Model, rate: float) -> None:
    """The second rate gave -3.8e-16 m and claimed an error of 2.4e-15."""
    run = model.simulate()
    error = run.accuracy.error
    assert error is not None
    true = abs(float(run["u"][-1]) - exact(rate)) / (error.nominal["u"] + abs(exact(rate)))
    assert error.nominal["u"] == pytest.approx(1e-9, rel=0.5)
    assert true < ALLOWED and true < 10 * error.by_state["u"]


def test_a_c_program(model: mechc.Model, rate: float, tmp_path: Path) -> None:
    """It printed -3.99e-10 m for -8.23e-10 m."""
    model.compile("c", tmp_path)
    done = subprocess.run([build(tmp_path, tmp_path)], capture_output=True, text=True, check=True)
    head, *rows = csv.reader(done.stdout.splitlines())
    assert abs(float(rows[-1][head.index("u [m]")]) - exact(rate)) < ALLOWED * 1e-9


def test_a_python_module(model: mechc.Model, rate: float, tmp_path: Path) -> None:
    (file,) = model.compile("python", tmp_path / "tide.py")
    module: dict[str, object] = {"__name__": "tide"}
    exec(file.read_text(encoding="utf-8"), module)
    found = module["simulate"](points=3)  # type: ignore[operator]
    assert abs(found["u"][-1] - exact(rate)) < ALLOWED * 1e-9


def test_members_of_an_ensemble(model: mechc.Model, rate: float) -> None:
    """They gave -5.4e-14 m with an error of 5.5e-14 m."""
    found = model.ensemble({"mu": [1.0, 2.0]}, keep=["final(u)"], errors="all")
    assert abs(found["final(u)"] - exact(rate)).max() < ALLOWED * 1e-9


def test_an_fmu_and_a_page_declare_the_size(model: mechc.Model) -> None:
    """Nobody repeats a run of theirs."""
    made = fmu_packages(model, FmuOptions(sources_only=True))[0]
    assert made.start.nominal[2] == pytest.approx(1e-9, rel=0.5)
    assert start_of(model.problem()).nominal[2] > 1e10
    _, run = exported_run(model, None, None)
    program = program_with(model.compilation, {"scene"})
    sizes = sizes_of(with_own_sizes(program, run))  # what pages are written with
    assert sizes.nominal[2] == run.motion.own_sizes["u"]


def test_a_model_of_one_size_declares_nothing() -> None:
    """Its program is the same to the byte."""
    one = mechc.loads(TIDE.format(2e-6).replace("u = 1 nm", "u = 1e11 m"))
    _, run = exported_run(one, None, None)
    assert not run.motion.own_sizes
    assert with_own_sizes(one.compilation.program, run) is one.compilation.program


STIFF = """\
model Sensor
  parameter M = 1000 kg; parameter m = 1 g; parameter K = 40 kN/m; parameter k = 1e9 N/m; parameter c = 2e3 N.s/m;
  coordinate x = 10 mm; coordinate y = 11 mm;
  kinetic 1/2*M*der(x)^2 + 1/2*m*der(y)^2;
  potential 1/2*K*x^2 + 1/2*k*(y - x)^2;
  dissipation 1/2*c*(der(y) - der(x))^2;
  experiment(stop = 10 s);
end Sensor;
"""


def test_a_c_program_of_a_stiff_model_carries_the_implicit_method(tmp_path: Path) -> None:
    files = {path.name for path in mechc.loads(STIFF).compile("c", tmp_path)}
    assert {"radau5.c", "dop853.c"} <= files


@pytest.mark.slow  # compiles fifty files
def test_a_c_program_of_a_stiff_model(tmp_path: Path) -> None:
    """Explicit steps are 1e-6 s long at most, ten million of them."""
    values = {"M": 1e3, "m": 1e-3, "K": 4e4, "C": 0, "k": 1e9, "c": 2e3, "x": 0.01, "y": 0.011}
    (end,) = true_motions.sensor(values, np.array([10.0]), 0.0)["x"]
    mechc.loads(STIFF).compile("c", tmp_path)
    done = subprocess.run([build(tmp_path, tmp_path)], capture_output=True, text=True, check=True, timeout=20)
    last = [float(cell) for cell in done.stdout.splitlines()[-1].split(",")]
    assert abs(last[1] - end) < 1e-6 * 0.01

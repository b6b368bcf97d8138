"""Tables that drive inputs of FMUs: between their rows as the model states, and beside tables with other times."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import fmpy
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

import mechc
from mechc.fmu.export import FmuOptions, export_fmu
from mechc.fmu.run import input_signals, run_fmu

TIMES, VALUES = np.array([0, 0.3, 0.5, 0.9, 1.4, 2]), np.array([0, 2, -1, 0.5, 3, 0.0])
TEXT = """\
model Pushed
  input Force u(interpolation = "KIND") = 1 N "a push";
  input Force steady = 0 N;
  coordinate Length x = 0 m;
  kinetic 1/2*2 kg*der(x)^2;
  potential 1/2*20 N/m*x^2;
  damping 0.4 N.s/m on x;
  force u + steady on x;
  experiment(stop = 2 s);
end Pushed;
"""


def motion(kind: str) -> float:
    """Where the mass is at the end, by SciPy from row to row."""
    spline = CubicSpline(TIMES, VALUES, bc_type="natural")
    y = [0.0, 0.0]
    for k, (a, b) in enumerate(pairwise(TIMES)):
        push = {
            "linear": lambda t: np.interp(t, TIMES, VALUES),
            "step": lambda t, k=k: VALUES[k],
            "spline": spline,
        }[kind]
        y = solve_ivp(
            lambda t, y, push=push: [y[1], (push(t) - 20 * y[0] - 0.4 * y[1]) / 2],
            (a, b), y, rtol=1e-11, atol=1e-13,
        ).y[:, -1]  # fmt: skip
    return float(y[0])


@pytest.mark.parametrize("kind", ["linear", "step", "spline"])
@pytest.mark.parametrize("fmi", ["2", "3"])
def test_a_table_is_read_as_the_model_says(kind: str, fmi: str, tmp_path: Path) -> None:
    """fmpy holds values over a communication step, so that the error is of its size."""
    file, table = tmp_path / "pushed.fmu", tmp_path / "u.csv"
    export_fmu(mechc.loads(TEXT.replace("KIND", kind)), file, FmuOptions(fmi=fmi, check=False))
    rows = "".join(f"{t},{v}\n" for t, v in zip(TIMES, VALUES, strict=True))
    table.write_text("time [s],u [N]\n" + rows)
    described = fmpy.read_model_description(str(file))
    u = next(v for v in described.modelVariables if v.name == "u")
    assert u.description == "a push" + ("" if kind == "linear" else f" (between rows of a table: {kind})")
    signals = input_signals(described, {"u": str(table)})
    if kind == "step":  # each later row is a jump
        assert np.array_equal(signals["time"][1:5], [0.3, 0.3, 0.5, 0.5])
        assert np.array_equal(signals["u"][:6], [0, 0, 2, 2, -1, -1])
    for one in ("me", "cs"):
        found = run_fmu(file, kind=one, every=0.001, stop=2.0, inputs={"u": str(table)})
        assert found["x"][-1] == pytest.approx(motion(kind), abs=3e-4)


def test_a_jump_stands_beside_a_table_with_other_times(tmp_path: Path) -> None:
    file, table, beside = tmp_path / "pushed.fmu", tmp_path / "u.csv", tmp_path / "steady.csv"
    export_fmu(mechc.loads(TEXT.replace("KIND", "step")), file, FmuOptions(check=False))
    table.write_text("time [s],u [N]\n0,1\n0.5,2\n")
    beside.write_text("time [s],steady [N]\n0,0\n0.4,4\n0.4,8\n1,8\n")
    signals = input_signals(fmpy.read_model_description(str(file)), {"u": str(table), "steady": str(beside)})
    assert signals["time"].tolist() == [0, 0.4, 0.4, 0.5, 0.5, 1]
    assert signals["u"].tolist() == [1, 1, 1, 1, 2, 2]
    assert signals["steady"].tolist() == [0, 4, 8, 8, 8, 8]

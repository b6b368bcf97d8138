"""A motion whose force is a function with a body, by every target, against the same written in Python for SciPy."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from differentiable_modules import module, wanted
from scipy.integrate import solve_ivp

import mechc
from mechc.fmu.export import FmuOptions, export_fmu
from mechc.runtime.native.build import find_compiler

MODEL = """
function pulls(Length x[n], Stiffness k[n, n], Real c[:]) -> (Force F[n], Energy stored)
  var u[n] = x;
  var F[n] = 0;
  var sum_of = 0;
  for i in 1:size(c, 1) loop
    F := F - c[i]*k*u;
    sum_of := sum_of + c[i]*dot(u, k*u)/(2*i);
    u := {u[j]*x[j]^2 / 1 m^2 for j in 1:n};
  end for;
  return (F, sum_of);
end pulls;

model Two
  parameter K[2, 2] = {{5, -1}, {-1, 3}} N/m;
  parameter Real c[3] = {1, 0.3, 0.1};
  coordinate Length x[2] = {0.8, -0.5} m;
  kinetic 1/2*2 kg*dot(der(x), der(x));
  let (F, U) = pulls(x, K, c);
  force F[1] on x[1];
  force F[2] on x[2];
  output y = U;
  output s = solve(K + 1 N*diag({1, 1})/(1 m + norm(x)), F)[1];
  experiment(stop = 2 s, tolerance = 1e-10);
end Two;
"""
K = np.array([[5.0, -1], [-1, 3]])


def pulls(x: Any) -> tuple[Any, Any]:
    u, force, stored = x, 0, 0
    for i, c in enumerate((1, 0.3, 0.1), 1):
        force = force - c * K @ u
        stored += c * u @ K @ u / (2 * i)
        u = u * x**2
    return force, stored


def rates(_: float, y: Any) -> Any:
    return [*y[2:], *(pulls(y[:2])[0] / 2)]


def outputs(y: Any) -> Any:
    force, stored = pulls(y[:2])
    return [stored, np.linalg.solve(K + np.eye(2) / (1 + np.linalg.norm(y[:2])), force)[0]]


def by_scipy(times: Any) -> Any:
    start = [0.8, -0.5, 0, 0]
    return solve_ivp(rates, (0, 2), start, "DOP853", rtol=1e-12, atol=1e-13, dense_output=True).sol(times)


def test_motions() -> None:
    solution: Any = mechc.loads(MODEL).simulate()
    wanted = by_scipy(solution.time)
    for k in range(2):
        assert np.abs(solution[f"x[{k + 1}]"] - wanted[k]).max() < 1e-8
    shown = np.transpose([outputs(y) for y in wanted.T])
    assert np.abs(solution["y"] - shown[0]).max() < 1e-8
    assert np.abs(solution["s"] - shown[1]).max() < 1e-8


@pytest.mark.parametrize("library", ["casadi", "jax"])
def test_differentiable_modules(library: str, tmp_path: Path) -> None:
    wanted(library)
    model: Any = mechc.loads(MODEL)
    (path,) = model.compile(library, tmp_path / f"two_{library}.py")
    made = module(path)
    names = [entry.name for entry in model.compilation.equations.outputs]
    shown = [names.index("y"), names.index("s")]
    independent = {name: k for k, (name, _) in enumerate(made.PARAMETERS)}
    p = made.all_parameters()
    for y in np.random.default_rng(3).uniform(-1, 1, (4, 4)):
        state = [*y, 0.0]
        for name, expected in (("rhs", rates(0, y)), ("outputs", outputs(y))):
            if library == "casadi":
                given = [p[independent[n]] for n in made.INDEPENDENT]
                found = np.array(made.functions()[name](0.0, state, [], given)).ravel()
            else:
                found = np.array(getattr(made, name)(0.0, np.array(state), np.zeros(0), p))
            found = found[shown] if name == "outputs" else found[:4]  # then work of forces
            assert np.abs(found - expected).max() < 1e-12


@pytest.mark.skipif(find_compiler() is None, reason="needs a C compiler")
def test_an_fmu(tmp_path: Path) -> None:
    fmpy = pytest.importorskip("fmpy")
    path = tmp_path / "two.fmu"
    export_fmu(mechc.loads(MODEL), path, FmuOptions("2", "me", None, False, False, ("host",), False))
    found = fmpy.simulate_fmu(
        str(path), fmi_type="ModelExchange", stop_time=2.0, relative_tolerance=1e-9, output=["x[1]", "y"]
    )
    expected = by_scipy(found["time"])
    assert np.abs(found["x[1]"] - expected[0]).max() < 1e-5
    assert np.abs(found["y"] - [outputs(y)[0] for y in expected.T]).max() < 1e-4

"""What flows keep, and derivatives by each general method: symplectic forms, volumes, stiff motions with closed derivatives."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad

import mechc
from mechc.runtime.case import SimulationOptions
from mechc.runtime.problem import Array
from mechc.runtime.studies.runs.simulate import plan_run
from mechc.runtime.tangent.flow import TangentFlow, tangent_flow

EXAMPLES = Path(__file__).parents[2] / "examples"


def flow_of(model: mechc.Model, *names: str, initial: Array | None = None, **options: object) -> TangentFlow:
    method = str(options.get("method", ""))
    problem = model.problem(method=method)
    plan = plan_run(problem, SimulationOptions(values=model.settings, **options))  # type: ignore[arg-type]
    return tangent_flow(plan.case, plan.method, plan.nominal, names, initial=initial, estimate_error=False)


FORM = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.eye(2), np.zeros((2, 2))]])


@pytest.mark.parametrize("method", ["gauss2", "gauss4", "gauss6", "gauss8"])
def test_symplectic_methods_keep_the_form_to_rounding(method: str) -> None:
    """W^T J W is a quadratic first integral of (y, W), which Gauss' methods keep whatever their step is (Hairer, Lubich,
    Wanner, ch. IV.2); unit masses, so that p = v. rk4, of the same order as gauss4, does not by far."""
    model = mechc.load(EXAMPLES / "henon_heiles.mech")
    flow = flow_of(model, initial=np.eye(4), method=method, step=0.25, stop=20.0, points=9)
    forms = [w.T @ FORM @ w for w in flow.tangents[:, :4]]
    size = np.abs(flow.tangents).max()
    assert size > 1.9
    assert max(np.abs(f - FORM).max() for f in forms) < 1e-13 * size**2 * 80  # 80 steps, rounding in each
    if method == "gauss4":
        flow = flow_of(model, initial=np.eye(4), method="rk4", step=0.25, stop=20.0, points=9)
        assert np.abs(flow.tangents[-1, :4].T @ FORM @ flow.tangents[-1, :4] - FORM).max() > 1e-5


@pytest.mark.parametrize("method", ["dop853", "radau5", "auto"])
def test_volumes_shrink_by_the_integral_of_the_divergence(method: str) -> None:
    """Liouville: det W = exp of the integral of div f along the motion, mu (1 - x^2) of van der Pol's oscillator, which
    changes its sign on the way; constant, -(sigma + 1 + b), of Lorenz's equations."""
    model = mechc.load(EXAMPLES / "van_der_pol.mech").with_values({"mu": 1.5})
    times = {"stop": 5.0, "points": 6, "tolerance": 1e-10, "method": method}
    flow = flow_of(model, initial=np.eye(2), **times)
    motion = model.simulate(stop=5.0, tolerance=1e-12)
    for t, w in zip(flow.time[1:], flow.tangents[1:], strict=True):
        divergence = quad(
            lambda s: 1.5 * (1 - motion(s)["x"] ** 2), 0, t, epsabs=1e-11, epsrel=1e-11, limit=400
        )[0]
        assert math.log(np.linalg.det(w)) == pytest.approx(divergence, abs=1e-7)
    flow = flow_of(
        mechc.load(EXAMPLES / "lorenz.mech"),
        initial=np.eye(3),
        stop=1.0,
        points=3,
        tolerance=1e-10,
        method=method,
    )
    assert math.log(np.linalg.det(flow.tangents[-1])) == pytest.approx(-(10 + 1 + 8 / 3), abs=1e-5)


STIFF = """
model Stiff
  dimensionless;
  parameter k = 1e6;
  parameter a = 2;
  state x = 3;
  state y = 1;
  equation der(x) = -k*(x - a*y);
  equation der(y) = -y^2/2;
  experiment(stop = 2, tolerance = 1e-10);
end Stiff;
"""


def test_stiff_motions_have_the_derivatives_of_their_closed_solution() -> None:
    """y = y0/(1 + y0 t/2), and x follows a y with the lag y'/k: dx/da = y to 1/k, dx/dx0 gone, dx/dy0 = a dy/dy0,
    dx/dk = -y'-terms of 1/k^2; by radau5, which reuses its factorisation for the derivatives."""
    flow = flow_of(mechc.loads(STIFF), "a", "x", "y", "k", method="radau5")
    t = 2.0
    y, dy = 1 / (1 + t / 2), 1 / (1 + t / 2) ** 2
    rate = -(y**2) / 2
    lagging = 2 * (y - rate / 1e6)  # a (y - y'/k + ...)
    np.testing.assert_allclose(flow.states[-1], [lagging, y], rtol=1e-9)
    lag = [y - rate / 1e6, 0, 2 * (dy + y * dy / 1e6), 2 * rate / 1e12]
    np.testing.assert_allclose(flow.tangents[-1][1], [0, 0, dy, 0], atol=1e-8)
    np.testing.assert_allclose(flow.tangents[-1][0][:3], lag[:3], atol=1e-8)
    assert flow.tangents[-1][0][3] == pytest.approx(lag[3], abs=1e-13)
    assert flow.statistics.steps < 1000  # an explicit method takes a million

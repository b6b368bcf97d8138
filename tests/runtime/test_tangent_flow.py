"""Derivatives of smooth motions against closed forms, differences of precise runs, and what flows keep."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from derivatives import differences

import mechc
from mechc.runtime.case import SimulationOptions
from mechc.runtime.outcome import SimulationError
from mechc.runtime.problem import Array, Problem
from mechc.runtime.studies.runs.simulate import Plan, plan_run
from mechc.runtime.tangent.flow import TangentFlow, Tangents, tangent_flow

EXAMPLES = Path(__file__).parents[2] / "examples"

OSCILLATOR = """
model Oscillator
  parameter m = 2 kg;
  parameter k = 8 N/m;
  parameter c = 0 N.s/m;
  input F = 0.5 N;
  coordinate x = 0.3 m;
  kinetic 1/2*m*der(x)^2;
  potential 1/2*k*x^2;
  force F - c*der(x) on x;
  output twice = 2*x + m/(1 kg)*(1 m);
  experiment(stop = 3 s, tolerance = 1e-12);
end Oscillator;
"""


def planned(problem: Problem, **options: object) -> Plan:
    return plan_run(problem, SimulationOptions(**options))  # type: ignore[arg-type]


def flowing(plan: Plan, names: Sequence[str], initial: Array | None = None) -> TangentFlow:
    return tangent_flow(plan.case, plan.method, plan.nominal, names, initial=initial)


def test_an_oscillator_has_the_derivatives_of_its_closed_solution() -> None:
    """x = F/k + (x0 - F/k) cos(wt) + v0/w sin(wt), w = sqrt(k/m); bound: tolerance 1e-12 times 100 for its growth."""
    problem = mechc.loads(OSCILLATOR).problem()
    flow = flowing(planned(problem), ["k", "x", "F", "m", "der(x)"])
    t, (m, k, x0, force) = flow.time, (2.0, 8.0, 0.3, 0.5)
    w, away = np.sqrt(k / m), x0 - force / k
    cos, sin = np.cos(w * t), np.sin(w * t)
    expected = np.column_stack(
        [
            -force / k**2 + force / k**2 * cos - away * sin * t / (2 * w * m),
            cos,
            (1 - cos) / k,
            away * sin * t * w / (2 * m),
            sin / w,
        ]
    )
    np.testing.assert_allclose(flow.tangents[:, 0], expected, atol=1e-10)
    twice = [q.name for q in problem.outputs].index("twice")
    expected = 2 * expected + np.array([0, 0, 0, 1, 0])
    np.testing.assert_allclose(flow.output_tangents[:, twice], expected, atol=1e-10)
    assert [d.unit for d in flow.directions] == ["N/m", "m", "N", "kg", "m/s"]
    assert flow.errors is not None and 0 < flow.errors.max() < 1e-9


SMOOTH = [
    ("double_pendulum", ("elbow.angle", "der(elbow.angle)", "lower.m", "upper.l"), 5.0),
    ("four_bar", ("speed", "crank.l"), 1.0),
    ("heavy_top_rotation", ("m",), 1.0),
]


@pytest.mark.parametrize(("name", "directions", "stop"), SMOOTH, ids=[row[0] for row in SMOOTH])
def test_derivatives_agree_with_differences(name: str, directions: tuple[str, ...], stop: float) -> None:
    """Differences of runs are good to about 1e-9 of the largest derivative; 1e-8 is what is promised."""
    problem = mechc.load(EXAMPLES / f"{name}.mech").problem()
    options = SimulationOptions(tolerance=1e-12, points=6, stop=stop)
    flow = flowing(plan_run(problem, options), directions)
    for k, direction in enumerate(directions):
        expected = differences(problem, options, direction)
        sizes = np.abs(expected).max(axis=0)
        seen = sizes > 1e-9 * sizes.max()
        assert seen.any()
        error = np.abs(flow.tangents[:, :, k] - expected)[:, seen] / sizes[seen]
        assert error.max() < 1e-8, (direction, error.max())


def test_the_flow_of_a_conservative_model_is_symplectic() -> None:
    """W^T J W is constant in canonical variables: here p = M(q) v of a double pendulum, by its momenta's own formula.

    Bound: tolerance 1e-12 times the growth of W, about 100."""
    text = """
model Two
  coordinate a = 40 deg;
  coordinate b = 60 deg;
  kinetic der(a)^2*(1 J.s^2) + 1/2*der(b)^2*(1 J.s^2) + cos(a - b)*der(a)*der(b)*(1 J.s^2);
  potential -(9.81 J)*(2*cos(a) + cos(b));
  experiment(stop = 4 s, tolerance = 1e-12);
end Two;
"""
    plan = planned(mechc.loads(text).problem())
    flow = flowing(plan, [], np.eye(4))

    def canonical(y: Array) -> Array:
        """d(q, p)/d(q, v)"""
        a, b, va, vb = y
        c, s = np.cos(a - b), np.sin(a - b)
        change = np.eye(4)
        change[2:, 2:] = [[2, c], [c, 1]]
        change[2:, :2] = [[-s * vb, s * vb], [-s * va, s * va]]
        return change

    form = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.eye(2), np.zeros((2, 2))]])
    first = canonical(flow.states[0])
    for y, w in zip(flow.states, flow.tangents, strict=True):
        there = canonical(y) @ w
        assert np.abs(there.T @ form @ there - first.T @ form @ first).max() < 1e-9
    assert np.abs(flow.tangents[-1] - np.eye(4)).max() > 1


def test_derivatives_stay_tangent_to_constraints_and_rotations() -> None:
    """A vector of changes in velocity space is put onto the constraints, and stays there."""
    problem = mechc.load(EXAMPLES / "four_bar.mech").problem()
    plan = planned(problem, tolerance=1e-11, points=5)
    flow = flowing(plan, [], np.ones((2 * problem.nv + problem.nx, 1)))
    case = plan.case
    for t, y, w in zip(flow.time, flow.states, flow.tangents[:, :, 0], strict=True):
        h = 1e-5
        sides = [case.functions.project_velocity(t, y + s * w, np.empty(0), case.z, case.p) for s in (h, -h)]  # type: ignore[misc]
        change = np.abs(sides[0] - sides[1])[problem.nv :] / (2 * h)
        assert change.max() < 1e-8 * np.abs(w).max()


def test_a_flow_can_be_taken_on_from_any_state() -> None:
    """Two halves with W begun again as the unit matrix multiply to the whole (the chain rule)."""
    plan = planned(mechc.loads(OSCILLATOR).problem())
    case = plan.case
    flow = Tangents(case, plan.method, plan.nominal, states=2)
    unit = flow.start(np.eye(3)[:, :2]) if case.problem.nx else flow.start(np.eye(2))
    first = flow.flow(0.0, case.y0, unit, np.array([1.0]))
    second = flow.flow(1.0, first.states[-1], unit, np.array([2.5]))
    whole = flow.flow(0.0, case.y0, unit, np.array([2.5]))
    np.testing.assert_allclose(
        second.tangents[-1][:2] @ first.tangents[-1][:2], whole.tangents[-1][:2], atol=1e-10
    )


REFUSED = {
    "nonsense": "no parameter, state or input 'nonsense'",
    "twice": "is an output",
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_no_direction_is_refused(name: str) -> None:
    with pytest.raises(SimulationError, match=REFUSED[name]):
        flowing(planned(mechc.loads(OSCILLATOR).problem()), [name])

"""The methods of the kernel: coefficients, order, dense output, agreement with scipy."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from msgspec.structs import replace
from scipy.integrate import solve_ivp
from written_problems import (
    compiled_kepler,
    compiled_pendulum,
    compiled_rigid_body,
    compiled_van_der_pol,
    kepler,
    kepler_position,
    pendulum,
    rigid_body,
    stiff_van_der_pol,
    van_der_pol,
)

from mechc.runtime.case import SimulationOptions, prepare
from mechc.runtime.functions import load_functions
from mechc.runtime.integrate.solver import Solver
from mechc.runtime.integrate.trajectory import DenseOutput
from mechc.runtime.native.kernel import load_kernel
from mechc.runtime.native.status import Status
from mechc.runtime.problem import Array, Problem
from mechc.runtime.studies.kinds.motion import simulate


def run_fixed(problem: Problem, method: str, step: float, stop: float) -> tuple[Array, DenseOutput]:
    """The state at ``stop`` and the dense output, all steps of one size, no error control."""
    functions = load_functions(problem)
    options = SimulationOptions(stop=stop, max_step=step)
    case = prepare(problem, functions, options)
    with Solver(load_kernel(), case, method, 1e30, np.full(problem.ny, 1e30), step) as solver:
        solver.start_record(int(stop / step) + 10)
        assert solver.advance(stop, 10**9) == Status.REACHED
        report, y = solver.report()
        assert report.steps == round(stop / step)
        rows = solver.recorded(report.n_record).copy()
    return y, DenseOutput(rows, problem.ny)


@pytest.mark.parametrize(
    ("method", "order", "steps"), [("rk4", 4, (0.04, 0.02, 0.01)), ("dop853", 8, (0.4, 0.25, 0.2, 0.125))]
)
def test_order_of_convergence(method: str, order: int, steps: tuple[float, ...]) -> None:
    """On a circular orbit: 4.00 and 7.94 to 7.96 were measured; steps below 0.1 reach rounding."""
    exact = kepler_position(np.array([4.0]), 1.0, 1.0, 0.0)[0]
    problem = compiled_kepler((1.0, 1.0, 0.0))
    errors = [np.abs(run_fixed(problem, method, step, 4.0)[0][:2] - exact).max() for step in steps]
    slopes = np.diff(np.log(errors)) / np.diff(np.log(steps))
    assert np.abs(slopes - order).max() < 0.1


@pytest.mark.parametrize(("method", "order", "steps"), [("rk4", 3, (0.1, 0.05)), ("dop853", 7, (0.2, 0.1))])
def test_order_of_the_dense_output(method: str, order: int, steps: tuple[float, ...]) -> None:
    """Within one step the error of the polynomial falls with one power more: 4.01 and 7.99 measured."""
    problem = compiled_kepler((1.0, 1.0, 0.0))
    errors = []
    for step in steps:
        inside = np.linspace(0, step, 50)
        _, dense = run_fixed(problem, method, step, step)
        errors.append(np.abs(dense(inside)[:, :2] - kepler_position(inside, 1.0, 1.0, 0.0)).max())
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order + 1, abs=0.1)


def test_dense_output_joins_the_steps_smoothly() -> None:
    _, dense = run_fixed(compiled_pendulum(), "dop853", 0.1, 1.0)
    ends = dense.begin[1:]
    before = np.nextafter(ends, 0)
    assert np.abs(dense(ends) - dense(before)).max() < 1e-14


PAIRS = [
    (compiled_pendulum, pendulum, 10.0),
    (compiled_kepler, kepler, 10.0),
    (compiled_van_der_pol, van_der_pol, 10.0),
    (compiled_rigid_body, rigid_body, 10.0),
]


@pytest.mark.parametrize(("native", "python", "stop"), PAIRS, ids=["pendulum", "kepler", "vdp", "body"])
def test_kernel_agrees_with_scipy(
    native: Callable[[], Problem], python: Callable[[], Problem], stop: float
) -> None:
    ours, problem = simulate(native(), SimulationOptions(stop=stop, tolerance=1e-9, points=50)), python()
    assert ours.statistics.method == "dop853" and ours.accuracy.error is not None
    p, nothing = np.array([ours.parameters[q.name] for q in problem.parameters]), np.empty(0)
    theirs = solve_ivp(
        lambda t, y: problem.functions["rhs"](t, y, nothing, nothing, p),
        (0, stop),
        [ours[q.name][0] for q in problem.states],
        "DOP853",
        ours.time,
        rtol=1e-12,
        atol=1e-13,
    )
    bound = 3 * ours.accuracy.error.largest + 1e-10
    for q, column in zip(problem.states, theirs.y, strict=True):
        scale = max(1.0, float(np.abs(column).max()))
        assert np.abs(ours[q.name] - column).max() < bound * scale, q.name


def test_rk4_steps_are_multiples_of_its_step() -> None:
    for problem in (pendulum(), compiled_pendulum()):
        options = SimulationOptions(stop=1.05, method="rk4", step=0.1, estimate_error=False)
        solution = simulate(problem, options)
        assert solution.statistics.steps == 11
        assert solution.statistics.longest_step == pytest.approx(0.1, rel=1e-12)
        assert solution.statistics.shortest_step == pytest.approx(0.05, rel=1e-12)


def test_error_falls_with_the_tolerance() -> None:
    times = np.linspace(0, 12, 30)
    exact = kepler_position(times, 1.0, 1.0, 0.6)
    errors = []
    for tolerance in (1e-6, 1e-8, 1e-10, 1e-12):
        options = SimulationOptions(stop=12, points=30, tolerance=tolerance, estimate_error=False)
        solution = simulate(compiled_kepler(), options)
        errors.append(np.abs(np.column_stack([solution["x"], solution["y"]]) - exact).max())
    assert all(later < earlier / 20 for earlier, later in pairwise(errors)), errors
    assert errors[-1] < 1e-10


def test_quaternions_stay_of_unit_length() -> None:
    for problem in (rigid_body(), compiled_rigid_body()):
        solution = simulate(problem, SimulationOptions(stop=100, tolerance=1e-6))
        norm = sum(solution[f"R[{k}]"] ** 2 for k in range(1, 5))
        assert np.abs(norm - 1).max() < 1e-15
        inside = solution(np.linspace(0, 100, 777))
        assert np.abs(sum(inside[f"R[{k}]"] ** 2 for k in range(1, 5)) - 1).max() < 1e-15
        assert solution.accuracy.conserved[0].absolute < 1e-4


def test_stiffness_is_noticed() -> None:
    options = SimulationOptions(stop=200, values={"mu": 100.0}, tolerance=1e-5, estimate_error=False)
    solution = simulate(compiled_van_der_pol(), options)
    assert solution.statistics.stiff_time is not None
    assert "stiff" in solution.remarks[0]
    calm = simulate(compiled_kepler(), SimulationOptions(stop=200, tolerance=1e-12))
    assert calm.statistics.stiff_time is None


def test_stiff_problem_with_a_jacobian() -> None:
    """``auto`` changes to radau5 and says so; the explicit method alone takes many more steps."""
    options = SimulationOptions(stop=1500, values={"mu": 1000.0}, tolerance=1e-6, points=100)
    auto, implicit, explicit = (
        simulate(stiff_van_der_pol(), replace(options, method=method, estimate_error=method != "dop853"))
        for method in ("auto", "radau5", "dop853")
    )
    assert implicit.statistics.method == "radau5"
    assert implicit.statistics.jacobians > 0 and implicit.statistics.factorisations > 0
    assert auto.statistics.switches > 0
    assert auto.statistics.switch_time is not None
    assert "the method was changed" in auto.remarks[0]
    assert 10 * implicit.statistics.steps < explicit.statistics.steps
    assert 5 * auto.statistics.steps < explicit.statistics.steps
    for solution in (auto, implicit):
        assert solution.accuracy.error is not None
        bound = 3 * (solution.accuracy.error.largest + 1e-4)
        assert np.abs(solution["x1"] - explicit["x1"]).max() < bound


def test_symplectic_method_of_fixed_step() -> None:
    options = SimulationOptions(stop=100, method="gauss4", step=0.05, estimate_error=True)
    solution = simulate(compiled_pendulum(), options)
    assert solution.statistics.method == "gauss4"
    best = simulate(compiled_pendulum(), SimulationOptions(stop=100, tolerance=1e-12))
    error = np.abs(solution["theta"] - best["theta"]) / (1 + np.abs(best["theta"]))
    assert solution.accuracy.error is not None
    assert solution.accuracy.error.by_state["theta"] == pytest.approx(error.max(), rel=0.2)


def test_reproducible_kernel_gives_the_same_bits_again() -> None:
    options = SimulationOptions(stop=10, reproducible=True)
    first, second = (simulate(compiled_kepler(), options)["x"] for _ in range(2))
    assert first.tobytes() == second.tobytes()
    ordinary = simulate(compiled_kepler(), replace(options, reproducible=False))["x"]
    assert np.abs(first - ordinary).max() < 1e-6

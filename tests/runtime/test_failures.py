"""Runs that fail, are interrupted, or cannot begin: what is said, and what is kept."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable

import numpy as np
import pytest
from msgspec.structs import replace
from written_problems import (
    ORIGIN,
    called,
    compiled_kepler,
    compiled_pendulum,
    compiled_van_der_pol,
    kepler,
    pendulum,
    problem,
    scalar,
)

from mechc.runtime.case import SimulationOptions
from mechc.runtime.interface import AssertionEntry
from mechc.runtime.outcome import Outcome, SimulationError
from mechc.runtime.problem import Array, ModelFunction, Problem
from mechc.runtime.results.solution import Solution
from mechc.runtime.studies.kinds.motion import simulate


def python_scalar(rhs: Callable[[float, float], float], assertion: ModelFunction | None = None) -> Problem:
    functions: dict[str, ModelFunction] = {
        "rhs": lambda t, y, u, z, p: np.array([rhs(t, y[0])]),
        "initial": lambda t, y, u, z, p: np.ones(1),
    }
    if assertion is not None:
        functions["assertions"] = assertion
    assertions = (AssertionEntry("x stays small", ORIGIN),) if assertion else ()
    return problem("Scalar", x=[("x", "")], functions=functions, assertions=assertions)


def check_kept(solution: Solution, last: float, exact: Callable[[Array], Array]) -> None:
    assert solution.outcome is Outcome.FAILED
    assert solution.failure is not None
    assert solution.message == solution.failure.message
    assert solution.time[0] == 0
    assert solution.time[-1] == solution.failure.time == pytest.approx(last, rel=1e-6)
    assert len(solution.time) > 50
    assert np.abs(solution["x"] - exact(solution.time)).max() < 1e-4
    assert solution.failure.state == {"x": solution["x"][-1]}
    assert solution.accuracy.error is None
    assert "did not complete" in solution.accuracy.remark


def test_undefined_value_in_mid_run() -> None:
    """x' = -sqrt(1 - t)/2: not a number beyond t = 1."""
    native = scalar("Root", "-0.5 * sqrt(1 - t)")
    for p in (native, python_scalar(lambda t, x: -0.5 * np.sqrt(1 - t))):
        solution = simulate(p, SimulationOptions(stop=5))
        check_kept(solution, 1.0, lambda t: 1 - (1 - np.abs(1 - t) ** 1.5) / 3)
        assert solution.message == "the derivative of 'x' is not a number at t = 1 s"
        assert solution.failure is not None and solution.failure.origin == ORIGIN


def test_blow_up_in_finite_time() -> None:
    """x' = x^2 from 1: a pole at t = 1."""
    for p in (scalar("Square", "y[0] * y[0]"), python_scalar(lambda t, x: x**2)):
        solution = simulate(p, SimulationOptions(stop=5))
        assert solution.outcome is Outcome.FAILED
        assert solution.failure is not None
        assert solution.failure.kind == "step too small"
        assert solution.failure.time == pytest.approx(1, abs=1e-6)
        assert "the step became too small at t = " in solution.message
        assert "'x' changes fastest" in solution.message


def test_undefined_at_the_start() -> None:
    for p in (scalar("Start", "1 / t"), python_scalar(lambda t, x: float(np.divide(1.0, t)))):
        solution = simulate(p, SimulationOptions(stop=5))
        assert solution.outcome is Outcome.FAILED
        assert solution.message == "the derivative of 'x' is infinite at t = 0 s"
        assert solution.time.tolist() == [0]
        assert solution["x"].tolist() == [1]


def test_acceleration_is_named_in_the_words_of_the_model() -> None:
    for p in (compiled_pendulum(), pendulum()):
        solution = simulate(p, SimulationOptions(stop=5, values={"l": 0.0}))
        assert solution.message == "the acceleration of 'theta' is infinite at t = 0 s"
        assert solution.failure is not None and solution.failure.name == "der(theta)"


def test_assertion_stops_the_run_at_the_step_after() -> None:
    def holds(t: float, y: Array, u: Array, z: Array, p: Array) -> Array:
        return np.array([float(y[0] < 2)])

    for p in (scalar("Growth", "y[0]", assertion="y[0] < 2"), python_scalar(lambda t, x: x, holds)):
        solution = simulate(p, SimulationOptions(stop=5))
        assert solution.outcome is Outcome.FAILED
        assert solution.failure is not None
        assert solution.failure.kind == "assertion"
        assert solution.failure.origin == ORIGIN
        assert solution.message.startswith("assertion failed at t = ")
        assert solution.message.endswith("x stays small")
        assert solution["x"][-1] >= 2
        assert (solution["x"][:-1] < solution["x"][-1]).all()


def test_assertion_is_checked_at_the_start() -> None:
    solution = simulate(scalar("Big", "y[0]", initial="3", assertion="y[0] < 2"), SimulationOptions(stop=5))
    assert solution.outcome is Outcome.FAILED
    assert solution.time.tolist() == [0]


def test_bounded_number_of_steps() -> None:
    for p in (compiled_kepler(), kepler()):
        solution = simulate(p, SimulationOptions(stop=1000, max_steps=20))
        assert solution.statistics.steps == 20
        assert solution.outcome is Outcome.FAILED
        assert solution.message.startswith("20 steps were taken at t = ")
        assert 0 < solution.time[-1] < 1000


def test_zero_length_run() -> None:
    for p in (compiled_pendulum(), pendulum()):
        solution = simulate(p, SimulationOptions(stop=0))
        assert solution.outcome is Outcome.COMPLETED
        assert solution.time.tolist() == [0]
        assert solution["theta"].tolist() == [1]
        assert solution(0.0)["theta"] == 1


@pytest.mark.parametrize("make", [compiled_van_der_pol, kepler], ids=["compiled", "called"])
def test_interruption_keeps_what_exists(make: Callable[[], Problem]) -> None:
    """Ctrl-C is pressed in mid-run; what was computed stays, and ends at the last step."""
    timer: threading.Timer | None = None

    def progress(fraction: float) -> None:
        nonlocal timer
        if timer is None:
            timer = threading.Timer(0.2, lambda: os.kill(os.getpid(), signal.SIGINT))
            timer.start()

    before = signal.getsignal(signal.SIGINT)
    stop, points = 1e9, 1000
    options = SimulationOptions(stop=stop, max_step=0.01, points=points, progress=progress, dense=False)
    solution = simulate(make(), options)
    assert timer is not None
    timer.join()
    assert solution.outcome is Outcome.INTERRUPTED
    assert solution.message.startswith("interrupted at t = ")
    assert 0 < solution.time[-1] < stop
    assert solution.statistics.steps > 100
    assert all(np.isfinite(solution[name]).all() for name in solution)
    assert signal.getsignal(signal.SIGINT) is before


def test_interruption_during_the_error_estimate_keeps_the_run() -> None:
    fractions: list[float] = []

    def progress(fraction: float) -> None:
        fractions.append(fraction)
        if fraction > 0.4 and len([f for f in fractions if f > 0.4]) == 1:
            os.kill(os.getpid(), signal.SIGINT)

    options = SimulationOptions(stop=2e4, tolerance=1e-10, progress=progress)
    solution = simulate(compiled_kepler(), options)
    assert solution.outcome is Outcome.INTERRUPTED
    assert solution.time[-1] == 2e4
    assert "interrupted during the error estimate" in solution.message
    assert solution.accuracy.error is None
    assert fractions == sorted(fractions)
    assert fractions[0] > 0 and fractions[-1] <= 1


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (SimulationOptions(), "'Pendulum' does not say when to stop"),
        (SimulationOptions(stop=-1), "the stop time -1 lies before the start 0"),
        (SimulationOptions(stop=float("nan")), "start and stop are finite times"),
        (SimulationOptions(stop=1, tolerance=0), "the tolerance lies between 1e-14 and 1, it is 0"),
        (SimulationOptions(stop=1, every=0), "the output spacing is positive"),
        (
            SimulationOptions(stop=1, every=1e-12),
            r"an output spacing of 1e-12 s gives 1e\+12 rows of \d+ numbers",
        ),
        (SimulationOptions(stop=1, points=1), "at least 2 output points"),
        (SimulationOptions(stop=1, max_step=0), "the largest step is positive"),
        (SimulationOptions(stop=1, step=0.1), "'auto' chooses its steps itself"),
        (SimulationOptions(stop=1, method="radau5"), "'radau5' needs the Jacobian of the model"),
        (SimulationOptions(stop=1, method="rk45"), "there is no method 'rk45'"),
        (SimulationOptions(stop=1, method="rk4"), "'rk4' takes steps of one size; give a step: step = 1 ms"),
        (SimulationOptions(stop=1, method="rk4", step=-1.0), "the step is positive"),
        (SimulationOptions(stop=1, method="RK4"), "did you mean 'rk4'"),
        (SimulationOptions(stop=1, method="rk5"), "there is no method 'rk5' .*did you mean 'rk4'"),
        (SimulationOptions(stop=1, experiment="fast"), "'Pendulum' has no experiment 'fast'"),
        (SimulationOptions(stop=1, values={"thet": 1.0}), "state or input 'thet'; did you mean 'theta'?"),
        (SimulationOptions(stop=1, values={"energy": 1.0}), "'energy' is an output of 'Pendulum'"),
        (SimulationOptions(stop=1, values={"theta": np.nan}), "the initial value of 'theta' is not a number"),
        (SimulationOptions(stop=1, values={"l": np.inf}), "the parameter 'l' is infinite"),
    ],
)
def test_runs_that_cannot_begin(options: SimulationOptions, message: str) -> None:
    with pytest.raises(SimulationError, match=message):
        simulate(compiled_pendulum(), options)


def test_values_out_of_their_range() -> None:
    p = pendulum()
    length = replace(p.parameters[0], minimum=0.1, origin=ORIGIN)
    angle = replace(p.states[0], maximum=2.0)
    p = replace(p, parameters=(length, p.parameters[1]), states=(angle, p.states[1]))
    with pytest.raises(
        SimulationError, match=r"the parameter 'l' is 0.01 m, below its minimum 0.1 m"
    ) as caught:
        simulate(p, SimulationOptions(stop=1, values={"l": 0.01}))
    assert caught.value.origin == ORIGIN
    with pytest.raises(SimulationError, match=r"initial value of 'theta' is 3 rad, above its maximum 2 rad"):
        simulate(p, SimulationOptions(stop=1, values={"theta": 3.0}))


def test_problems_that_do_not_fit_their_functions() -> None:
    p = pendulum()
    with pytest.raises(ValueError, match="has no function 'outputs'"):
        simulate(called(replace(p, functions={k: f for k, f in p.functions.items() if k != "outputs"})))
    with pytest.raises(ValueError, match="has nq = 1, not 2"):
        simulate(replace(kepler(), library=compiled_pendulum().library))

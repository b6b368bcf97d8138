"""Experiments: which one is taken, what wins over what, settings that depend on each other, sweeps."""

from __future__ import annotations

import numpy as np
import pytest
from msgspec.structs import replace
from numpy.typing import NDArray
from written_problems import called, kepler, pendulum

from mechc.runtime.case import Case, SimulationOptions, prepare
from mechc.runtime.functions import load_functions
from mechc.runtime.interface import Experiment, Setting
from mechc.runtime.outcome import SimulationError
from mechc.runtime.problem import Array, ModelFunction, Problem
from mechc.runtime.studies.kinds.motion import simulate
from mechc.runtime.studies.kinds.sweep import Sweep

L, G = Setting("p", 0), Setting("p", 1)
THETA = Setting("y", 0)


def experiment(
    name: str, options: dict[str, float], settings: dict[Setting, float], **more: object
) -> tuple[Experiment, ModelFunction]:
    values = np.array([*options.values(), *settings.values()])
    made = Experiment(name, "", f"experiment_{name}", tuple(options), {}, tuple(settings))
    return replace(made, **more), lambda t, y, u, z, p: values


def with_experiments(p: Problem, *experiments: tuple[Experiment, ModelFunction]) -> Problem:
    functions = dict(p.functions) | {e.function: f for e, f in experiments}
    return called(replace(p, functions=functions, experiments=tuple(e for e, _ in experiments)))


def case_of(p: Problem, options: SimulationOptions) -> Case:
    return prepare(p, load_functions(p), options)


def test_which_experiment_is_taken() -> None:
    first, second = experiment("long", {"stop": 100.0}, {}), experiment("", {"stop": 3.0}, {})
    p = with_experiments(pendulum(), first, second)
    assert case_of(p, SimulationOptions()).stop == 3
    assert case_of(p, SimulationOptions(experiment="long")).stop == 100
    assert case_of(with_experiments(pendulum(), first), SimulationOptions()).experiment == "long"
    with pytest.raises(SimulationError, match="no experiment 'lon'; did you mean 'long'"):
        case_of(p, SimulationOptions(experiment="lon"))


def test_what_wins_over_what() -> None:
    made = experiment("", {"stop": 3.0, "tolerance": 1e-5, "every": 0.5, "start": 1.0}, {L: 2.0, THETA: 0.1})
    p = with_experiments(pendulum(), made)
    case = case_of(p, SimulationOptions())
    assert (case.stop, case.tolerance, case.p.tolist()) == (3, 1e-5, [2.0, 9.81])
    assert case.grid.tolist() == [1, 1.5, 2, 2.5, 3]
    assert case.y0.tolist() == [0.1, 0]
    options = SimulationOptions(stop=1.5, tolerance=1e-3, values={"l": 5.0, "der(theta)": 4.0})
    case = case_of(p, options)
    assert (case.stop, case.tolerance, case.p.tolist()) == (1.5, 1e-3, [5.0, 9.81])
    assert case.grid.tolist() == [1, 1.5]
    assert case.y0.tolist() == [0.1, 4.0]


def test_method_of_an_experiment() -> None:
    made = experiment("", {"stop": 1.0, "step": 0.1}, {}, words={"method": "rk4"})
    p = with_experiments(pendulum(), made)
    assert simulate(p).statistics.method == "rk4"
    with pytest.raises(SimulationError, match="chooses its steps itself"):
        simulate(p, SimulationOptions(method="dop853"))


def test_settings_that_depend_on_settings() -> None:
    """g = 3 l with l = 2, stop = g: settled in the second round, whatever their order."""

    def values(t: float, y: Array, u: Array, z: Array, p: Array) -> Array:
        return np.array([p[1], 3 * p[0], 2.0])

    made = Experiment("", "", "experiment", ("stop",), {}, (G, L))
    p = with_experiments(pendulum(), (made, values))
    case = case_of(p, SimulationOptions())
    assert (case.p.tolist(), case.stop) == ([2, 6], 6)
    case = case_of(p, SimulationOptions(values={"l": 5.0}))
    assert (case.p.tolist(), case.stop) == ([5, 15], 15)


def test_settings_in_a_circle() -> None:
    def values(t: float, y: Array, u: Array, z: Array, p: Array) -> Array:
        return np.array([1.0, p[1] + 1, p[0] + 1])

    made = Experiment("", "", "experiment", ("stop",), {}, (L, G))
    with pytest.raises(SimulationError, match="they depend on each other"):
        case_of(with_experiments(pendulum(), (made, values)), SimulationOptions())


def test_option_that_nobody_knows() -> None:
    made = experiment("", {"stop": 1.0, "record": 0.0}, {})
    with pytest.raises(SimulationError, match="the option 'record', which no run knows"):
        case_of(with_experiments(pendulum(), made), SimulationOptions())


def test_dependent_parameters_follow_unless_they_are_set() -> None:
    def fill(p: Array, given: NDArray[np.uint8]) -> None:
        p[0] = p[0] if given[0] else 2.0
        p[1] = p[1] if given[1] else 10 * p[0]

    p = called(replace(pendulum(), parameters_function=fill))
    stop = SimulationOptions(stop=1)
    assert case_of(p, stop).p.tolist() == [2, 20]
    assert case_of(p, replace(stop, values={"l": 3.0})).p.tolist() == [3, 30]
    assert case_of(p, replace(stop, values={"l": 3.0, "g": 1.0})).p.tolist() == [3, 1]


def test_sweep() -> None:
    sweeps = ((L, (1.0, 4.0)), (THETA, (0.01, 0.02, 0.03)))
    p = with_experiments(pendulum(), experiment("", {"stop": 2.0}, {}, sweeps=sweeps))
    with pytest.raises(SimulationError, match="sweeps l, theta"):
        simulate(p)
    fractions: list[float] = []
    sweep = Sweep(progress=fractions.append, tolerance=1e-6).solve(p)
    assert [tuple(v.values()) for v in sweep.points] == [
        (1, 0.01), (1, 0.02), (1, 0.03), (4, 0.01), (4, 0.02), (4, 0.03),
    ]  # fmt: skip
    for values, solution in zip(sweep.points, sweep.solutions, strict=True):
        assert solution["theta"][0] == values["theta"]
        assert solution.parameters["l"] == values["l"]
        expected = values["theta"] * np.cos(np.sqrt(9.81 / values["l"]) * 2)
        assert solution["theta"][-1] == pytest.approx(expected, abs=2e-6)
    assert fractions == sorted(fractions)
    fixed = Sweep(values={"theta": 0.1}).solve(p)
    assert [v["l"] for v in fixed.points] == [1, 4]
    one = simulate(p, SimulationOptions(values={"theta": 0.1, "l": 1.0}))
    assert one["theta"].tobytes() == fixed.solutions[0]["theta"].tobytes()


def test_parameter_without_a_value() -> None:
    def fill(p: Array, given: NDArray[np.uint8]) -> None:
        p[1:] = 1.0

    with pytest.raises(SimulationError, match="the parameter 'mu' has no value"):
        simulate(called(replace(kepler(), parameters_function=fill)), SimulationOptions(stop=1))

"""A problem through JSON and back."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from written_problems import ORIGIN, compiled_pendulum, pendulum, rigid_body

from mechc.runtime.case import SimulationOptions
from mechc.runtime.load import describe, problem_from
from mechc.runtime.problem import Assertion, Experiment, Problem, Setting
from mechc.runtime.simulate import simulate


def rich() -> Problem:
    setting = Setting("p", 0, True)
    experiment = Experiment(
        "long", "doc", "experiment_long", ("stop",), {"method": "rk4"}, (setting,), ((setting, (1.0, 0.1)),)
    )
    first = replace(rigid_body().states[0], nominal=0.1, minimum=-np.pi, doc="text", display="deg")
    return replace(
        rigid_body(),
        states=(first, *rigid_body().states[1:]),
        assertions=(Assertion("stays", ORIGIN), Assertion("moves", None)),
        experiments=(experiment,),
    )


@pytest.mark.parametrize("problem", [pendulum(), rich()], ids=["pendulum", "rich"])
def test_json_gives_back_the_same_problem(problem: Problem) -> None:
    description = json.loads(json.dumps(describe(problem)))
    back = problem_from(
        description, functions=problem.functions, parameters_function=problem.parameters_function
    )
    assert back == problem


def test_problem_of_a_description_and_a_library_runs() -> None:
    problem = compiled_pendulum()
    back = problem_from(json.loads(json.dumps(describe(problem))), library=problem.library)
    runs = [simulate(p, SimulationOptions(stop=1))["theta"].tobytes() for p in (problem, back)]
    assert runs[0] == runs[1]


def test_description_of_another_version() -> None:
    description = describe(pendulum())
    del description["conserved"]
    with pytest.raises(ValueError, match=r"not the description of a problem: \['conserved'\]"):
        problem_from(description)

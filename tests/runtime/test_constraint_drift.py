"""The report measures how far states are from their constraints."""

from __future__ import annotations

import json

import numpy as np
import pytest
from written_problems import problem

from mechc.runtime.case import SimulationOptions
from mechc.runtime.problem import Array
from mechc.runtime.studies.kinds.motion import simulate

RADIUS, RATE = 1.001, 0.2


def test_states_that_nothing_projects() -> None:
    """A point that rests beside its circle, with a rate across it: what is missing, over nominal + |value|."""

    def to_circle(t: float, y: Array, u: Array, z: Array, p: Array) -> Array:
        r = np.hypot(y[0], y[1])
        return np.array([*((1 - r) / r * y[:2]), r - 1])

    def along_circle(t: float, y: Array, u: Array, z: Array, p: Array) -> Array:
        across = y[:2] / np.hypot(y[0], y[1])
        return np.array([*(-(across @ y[2:]) * across), across @ y[2:]])

    p = problem(
        "Beside",
        q=[("x", "m"), ("y", "m")],
        functions={
            "rhs": lambda t, y, u, z, p: np.zeros(4),
            "initial": lambda t, y, u, z, p: np.array([RADIUS, 0, RATE, RATE]),
            "project_position": to_circle,
            "project_velocity": along_circle,
            "displace": lambda t, y, u, z, p: y[2:],
        },
    )
    solution = simulate(p, SimulationOptions(stop=1))
    positions, velocities = solution.accuracy.constraints
    assert (positions.level, positions.before) == ("positions", None)
    assert positions.after == pytest.approx(0.001 / (2 * RADIUS))
    assert velocities.after == pytest.approx(RATE / (2 * RATE))
    summary = json.loads(json.dumps(solution.summary(), allow_nan=False))["accuracy"]["constraints"]
    assert summary["positions"] == {"before_projection": None, "after_projection": positions.after}


def test_free_models_have_no_constraints() -> None:
    free = problem(
        "Free",
        q=[("x", "m")],
        functions={
            "rhs": lambda t, y, u, z, p: np.zeros(2),
            "initial": lambda t, y, u, z, p: np.ones(2),
        },
    )
    assert simulate(free, SimulationOptions(stop=1)).accuracy.constraints == ()

"""The report measures how far states are from their constraints."""

from __future__ import annotations

import numpy as np
from written_problems import problem

from mechc.runtime.case import SimulationOptions
from mechc.runtime.studies.kinds.motion import simulate

RADIUS, RATE = 1.001, 0.2


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

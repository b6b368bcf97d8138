"""A problem written by hand: a damped pendulum in two dimensions, for tests of what shows results."""

from __future__ import annotations

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray
from written_problems import called

from mechc.runtime.case import SimulationOptions
from mechc.runtime.interface import AssertionEntry, Experiment, Origin, Quantity, Setting
from mechc.runtime.problem import Array, Problem
from mechc.runtime.studies.kinds.motion import simulate
from mechc.solution import Solution

LINE = "  coordinate theta = 60 deg;"
PLACE = Origin("pendulum.mech", 5, 3, LINE)


def _rhs(t: float, y: Array, u: Array, z: Array, p: Array) -> Array:
    theta, omega, _ = y
    l, g, c = p
    return np.array([omega, -g / l * np.sin(theta) - c * omega / l**2, c * omega**2])


def _outputs(t: float, y: Array, u: Array, z: Array, p: Array) -> Array:
    theta, omega, dissipated = y
    l, g, _ = p
    kinetic, potential = 0.5 * l**2 * omega**2, -g * l * np.cos(theta)
    bob = [l * np.sin(theta), -l * np.cos(theta)]
    return np.array([*bob, kinetic, potential, kinetic + potential, dissipated])


def _parameters(p: Array, given: NDArray[np.uint8]) -> None:
    for i, value in enumerate((1.0, 9.81, 0.1)):
        if not given[i]:
            p[i] = value


def pendulum_problem() -> Problem:
    """Unit mass; states theta, its rate and the dissipated energy as an account."""
    return called(
        Problem(
            name="Pendulum",
            doc="pendulum with friction",
            nq=1,
            nv=1,
            nx=1,
            nh=0,
            time=Quantity("time", "time", "s"),
            states=(
                Quantity("theta", "coordinate", "rad", display="deg", origin=PLACE),
                Quantity("der(theta)", "rate", "rad/s", origin=PLACE),
                Quantity("energy.lost", "account", "J"),
            ),
            parameters=(
                Quantity("l", "parameter", "m"),
                Quantity("g", "parameter", "m/s^2"),
                Quantity("c", "parameter", ""),
            ),
            inputs=(),
            discretes=(),
            outputs=(
                Quantity("bob[1]", "output", "m"),
                Quantity("bob[2]", "output", "m"),
                Quantity("energy.kinetic", "energy", "J"),
                Quantity("energy.potential", "energy", "J"),
                Quantity("energy.total", "energy", "J"),
                Quantity("energy.dissipated", "energy", "J"),
            ),
            known=(True, True, True),
            rotations=(),
            assertions=(
                AssertionEntry(
                    "the bob stays below", Origin("pendulum.mech", 9, 3, '  assert theta < 2, "stay";')
                ),
            ),
            experiments=(
                Experiment("", "", "experiment_1", ("stop",), {}, ()),
                Experiment("high", "", "experiment_2", ("stop",), {"display": "rad"}, (Setting("y", 0),)),
            ),
            energy_balance=(4, 5, -1),
            functions={
                "rhs": _rhs,
                "initial": lambda t, y, u, z, p: np.array([np.pi / 3, 0.0, 0.0]),
                "outputs": _outputs,
                "assertions": lambda t, y, u, z, p: np.array([float(y[0] < 2)]),
                "experiment_1": lambda t, y, u, z, p: np.array([5.0]),
                "experiment_2": lambda t, y, u, z, p: np.array([5.0, 1.9]),
            },
            parameters_function=_parameters,
        )
    )


def pendulum_solution(**values: float) -> Solution:
    problem = pendulum_problem()
    return Solution(simulate(problem, SimulationOptions(values=values)).motion)


def failing_solution() -> Solution:
    """A run whose acceleration becomes undefined at one second."""
    problem = pendulum_problem()

    def rhs(t: float, y: Array, u: Array, z: Array, p: Array) -> Array:
        return _rhs(t, y, u, z, p) if t <= 1 else np.array([y[1], np.nan, 0.0])

    problem = called(replace(problem, functions={**problem.functions, "rhs": rhs}))
    return Solution(simulate(problem).motion)

"""Scipy's methods on the compiled functions give the motion of the kernel."""

from __future__ import annotations

import numpy as np
import pytest

import mechc
from mechc.measurement.peers import peers
from mechc.measurement.peers.scipy import METHODS
from mechc.runtime.case import SimulationOptions, prepare
from mechc.runtime.functions import load_functions
from mechc.runtime.inputs import make_table
from mechc.runtime.integrate.solver import SolverOptions
from mechc.runtime.outcome import SimulationError

BALL = """
model Ball
  parameter g = 9.81 m/s^2;
  coordinate h = 1 m;
  discrete Integer bounces = 0;
  kinetic 1/2*1 kg*der(h)^2;
  potential 1 kg*g*h;
  when h <= 0 m and der(h) < 0 m/s then
    reinit(der(h), -0.8*der(h));
    bounces := bounces + 1;
  end when;
  experiment(stop = 2 s);
end Ball;
"""
DRIVEN = """
model Driven
  coordinate x = 1 m;
  input Force f = 1 N;
  kinetic 1/2*1 kg*der(x)^2;
  force f on x;
  experiment(stop = 2 s);
end Driven;
"""


@pytest.mark.parametrize("method", METHODS)
def test_ball_bounces_as_the_closed_solution_says(method: str) -> None:
    model = mechc.loads(BALL)
    problem = model.problem()
    functions = load_functions(problem)
    case = prepare(problem, functions, SimulationOptions(points=41))
    options = SolverOptions(f"scipy:{method}", 1e-8, np.ones(problem.ny))
    done = peers(model, [options.method])[options.method](case, options)
    assert done.failure is None and done.t.size == 41
    # between impacts a parabola; each impact leaves 0.8 of the speed and lasts 0.8 of the time before
    first, speed = np.sqrt(2 / 9.81), np.sqrt(2 * 9.81)
    for t, y in zip(done.t, done.y, strict=True):
        begin, v = first, 0.8 * speed
        while t > begin + 2 * v / 9.81:
            begin, v = begin + 2 * v / 9.81, 0.8 * v
        s = t - begin
        h = 1 - 9.81 * t**2 / 2 if t < first else v * s - 9.81 * s**2 / 2
        assert abs(y[0] - h) < 1e-5  # the worst is BDF, whose error grows by each bounce


def test_evaluations_are_counted_and_constrained_models_run() -> None:
    model = mechc.loads(
        "import mech.planar.*;gravity {0, -9.81 m/s^2};Bar bar;Revolute pin(world -> bar.a, angle = 60 deg);"
        "Bar other;Revolute hinge(bar.b -> other.a, angle ~ -120 deg);cut Revolute last(other.b -> world * trans({1, 0} m));"
    )
    problem = model.problem()
    functions = load_functions(problem)
    case = prepare(problem, functions, SimulationOptions(points=11, stop=1.0))
    name = "scipy:DOP853"
    done = peers(model, [name])[name](case, SolverOptions(name, 1e-9, np.ones(problem.ny)))
    ours = model.simulate(stop=1.0, tolerance=1e-10)
    assert done.statistics.evaluations > 12
    for k, quantity in enumerate(problem.states):
        assert done.y[-1, k] == pytest.approx(ours[quantity.name][-1], abs=1e-6)


@pytest.mark.parametrize("name", ["scipy:DOP853", "cvode:Adams"])
def test_an_input_at_rest_drives_a_peer_and_a_table_does_not(name: str) -> None:
    """x = 1 + t^2/2."""
    model = mechc.loads(DRIVEN)
    problem = model.problem()
    functions = load_functions(problem)
    run = peers(model, [name])[name]
    options = SolverOptions(name, 1e-9, np.ones(problem.ny))
    case = prepare(problem, functions, SimulationOptions(points=5))
    assert run(case, options).y[:, 0] == pytest.approx(1 + case.grid**2 / 2, rel=1e-7)
    moved = {"f": make_table(np.array([0.0, 2.0]), np.array([0.0, 1.0]))}
    case = prepare(problem, functions, SimulationOptions(points=5, inputs=moved))
    with pytest.raises(SimulationError, match="no table moves"):
        peers(model, [name])[name](case, options)


@pytest.mark.parametrize("method", METHODS)
def test_run_that_takes_too_long_is_given_up_with_its_evaluations(method: str) -> None:
    model = mechc.loads(BALL.replace("potential 1 kg*g*h", "potential 1e10 N/m*h^2"))
    problem = model.problem()
    functions = load_functions(problem)
    case = prepare(problem, functions, SimulationOptions())
    options = SolverOptions(f"scipy:{method}", 1e-8, np.ones(problem.ny), seconds=0.05)
    done = peers(model, [options.method])[options.method](case, options)
    assert done.failure is not None and done.failure.kind == "given up"
    assert done.statistics.run_time < 5 and done.statistics.evaluations >= 64
    assert f"{done.statistics.evaluations} evaluations" in done.failure.message

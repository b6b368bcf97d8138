"""Scipy's methods on the compiled functions give the motion of the kernel."""

from __future__ import annotations

import numpy as np
import pytest

import mechc
from mechc.measurement.peers.scipy import METHODS, run_peer
from mechc.runtime.case import SimulationOptions, prepare
from mechc.runtime.functions import load_functions
from mechc.runtime.integrate.solver_options import SolverOptions
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
    problem = mechc.loads(BALL).problem()
    functions = load_functions(problem)
    case = prepare(problem, functions, SimulationOptions(points=41))
    options = SolverOptions(f"scipy:{method}", 1e-8, np.ones(problem.ny))
    done = run_peer(case, options)
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
    done = run_peer(case, SolverOptions("scipy:DOP853", 1e-9, np.ones(problem.ny)))
    ours = model.simulate(stop=1.0, tolerance=1e-10)
    assert done.statistics.evaluations > 12
    for k, quantity in enumerate(problem.states):
        assert done.y[-1, k] == pytest.approx(ours[quantity.name][-1], abs=1e-6)


def test_models_with_inputs_are_refused_with_the_reason() -> None:
    problem = mechc.loads(DRIVEN).problem()
    functions = load_functions(problem)
    case = prepare(problem, functions, SimulationOptions())
    with pytest.raises(SimulationError, match="without inputs"):
        run_peer(case, SolverOptions("scipy:RK45", 1e-6, np.ones(problem.ny)))


@pytest.mark.parametrize("method", METHODS)
def test_run_that_takes_too_long_is_given_up_with_its_evaluations(method: str) -> None:
    problem = mechc.loads(BALL.replace("potential 1 kg*g*h", "potential 1e10 N/m*h^2")).problem()
    functions = load_functions(problem)
    case = prepare(problem, functions, SimulationOptions())
    options = SolverOptions(f"scipy:{method}", 1e-8, np.ones(problem.ny), seconds=0.05)
    done = run_peer(case, options)
    assert done.failure is not None and done.failure.kind == "given up"
    assert done.statistics.run_time < 5 and done.statistics.evaluations >= 64
    assert f"{done.statistics.evaluations} evaluations" in done.failure.message

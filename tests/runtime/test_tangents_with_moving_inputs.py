"""Derivatives through events of what moves with time: tables of inputs, inputs by formula, and constraints that are driven."""

from __future__ import annotations

import numpy as np
import pytest
from derivatives import differences

import mechc
from mechc.runtime.case import SimulationOptions
from mechc.runtime.inputs import make_table
from mechc.runtime.problem import Array, Problem
from mechc.runtime.studies.runs.simulate import plan_run
from mechc.runtime.tangent.flow import tangent_flow

TIMES = np.linspace(0, 2, 41)
ROAD = 0.1 * np.sin(5 * TIMES)

BALL = """
model Ball "bounces on a table that is moved"
  input Length road(interpolation = "spline");
  parameter Real e = 0.7;
  coordinate Length y = 1 m;
  coordinate Length s;
  drive s = road;
  kinetic 1/2*1 kg*der(y)^2;
  potential 1 kg*9.81 m/s^2*y;
  contact c: y - s restitution e;
  experiment(stop = 1.2 s);
end Ball;
"""

BEAD = """
model Bead "on a circle whose middle is moved, between a stop and a spring that begins"
  input Length road(interpolation = "spline");
  parameter Real e = 0.7;
  parameter Length L = 1 m;
  coordinate Length x = 0 m;
  coordinate Length y;
  coordinate Length s;
  drive s = road;
  kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
  potential 1 kg*9.81 m/s^2*y;
  force 3 N on x;
  constraint x^2 + (y - s)^2 = L^2;
  contact c: 0.3 m - x restitution e;
  force if x > 0.1 m then -20 N/m*(x - 0.1 m) else 0 N on x;
  experiment(stop = 1.2 s);
end Bead;
"""

FALL = """
model Fall "what happens where it passes a level is read from a table"
  input Velocity push;
  parameter Length h = 1 m;
  coordinate Length y = 2 m;
  kinetic 1/2*1 kg*der(y)^2;
  potential 1 kg*9.81 m/s^2*y;
  when y < h then reinit(der(y), push); end when;
  experiment(stop = 0.6 s);
end Fall;
"""


def checked(problem: Problem, options: SimulationOptions, name: str) -> tuple[Array, Array]:
    """Derivatives of coordinates and rates at the end, and differences of runs."""
    plan = plan_run(problem, options)
    flow = tangent_flow(plan.case, plan.method, plan.nominal, [name], estimate_error=False)
    rows = [k for k, q in enumerate(problem.states) if q.kind != "account"]
    return flow.tangents[-1, rows, 0], differences(problem, options, name, 1e-4, 3)[-1][rows]


@pytest.mark.parametrize(("source", "name"), [(BALL, "e"), (BEAD, "e"), (BEAD, "L")])
def test_an_impact_on_what_a_table_moves_is_differentiated(source: str, name: str) -> None:
    """Against differences of runs; their own error is 1e-9."""
    problem = mechc.loads(source).problem()
    options = SimulationOptions(
        tolerance=1e-10, points=2, method="dop853", inputs={"road": make_table(TIMES, ROAD, "spline")}
    )
    found, expected = checked(problem, options, name)
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-6)


WALL = """
model Wall "throws back what passes a level that moves by formula"
  input Length level = 0.1 m*sin(5 s^-1*time);
  parameter Real e = 0.7;
  coordinate Length y = 1 m;
  kinetic 1/2*1 kg*der(y)^2;
  potential 1 kg*9.81 m/s^2*y;
  when y < level then reinit(der(y), -e*der(y)); end when;
  experiment(stop = 1.2 s);
end Wall;
"""


@pytest.mark.parametrize("name", ["e", "level"])
def test_a_level_that_moves_by_formula_is_differentiated(name: str) -> None:
    """In the input itself as well: it is raised by a constant, and moves all the same."""
    problem = mechc.loads(WALL).problem()
    plan = plan_run(problem, SimulationOptions(tolerance=1e-10, points=2, method="dop853"))
    flow = tangent_flow(plan.case, plan.method, plan.nominal, [name], estimate_error=False)

    def by_hand(e: float, raised: float) -> Array:
        """Give y and y' after two turns, by Newton's iteration on flights."""
        t, y, v = 0.0, 1.0, 0.0
        for guess in (0.43, 1.05):
            end = guess
            for _ in range(50):
                d = end - t
                gap = y + v * d - 9.81 / 2 * d**2 - raised - 0.1 * np.sin(5 * end)
                end -= gap / (v - 9.81 * d - 0.5 * np.cos(5 * end))
            d = end - t
            y, v, t = y + v * d - 9.81 / 2 * d**2, -e * (v - 9.81 * d), end
        d = 1.2 - t
        return np.array([y + v * d - 9.81 / 2 * d**2, v - 9.81 * d])

    h = 1e-5
    change = (h, 0.0) if name == "e" else (0.0, h)
    expected = (by_hand(0.7 + change[0], change[1]) - by_hand(0.7 - change[0], -change[1])) / (2 * h)
    states = [q.name for q in problem.states]
    found = flow.tangents[-1, [states.index("y"), states.index("der(y)")], 0]
    np.testing.assert_allclose(found, expected, rtol=1e-7)


def test_an_action_that_reads_a_table_is_differentiated() -> None:
    """It falls from 2 m to h at t = sqrt(2 (2 m - h)/g), and goes on with the value of a straight line there:
    y = h + v(t) (T - t) - g/2 (T - t)^2."""
    problem = mechc.loads(FALL).problem()
    table = make_table([0.0, 2.0], [1.0, 5.0], "linear")
    options = SimulationOptions(tolerance=1e-11, points=2, method="dop853", inputs={"push": table})
    plan = plan_run(problem, options)
    flow = tangent_flow(plan.case, plan.method, plan.nominal, ["h"], estimate_error=False)
    g, end = 9.81, 0.6
    t = np.sqrt(2 / g)
    dt, rest, v = -1 / (g * t), end - t, 1 + 2 * t
    expected = [1 + 2 * dt * rest - v * dt + g * rest * dt, 2 * dt + g * dt]
    np.testing.assert_allclose(flow.tangents[-1, :2, 0], expected, rtol=1e-8)


MOVED = """
model Moved "a bead on a circle whose middle is moved, and a spring that begins"
  parameter Stiffness k = 20 N/m;
  coordinate Length x = 0 m;
  coordinate Length y;
  let middle = 0.1 m*sin(5 s^-1*time);
  kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
  potential 1 kg*9.81 m/s^2*y;
  constraint x^2 + (y - middle)^2 = 1 m^2;
  force 3 N - k*x on x;
  force if x > 0.2 m then -k*(x - 0.2 m) else 0 N on x;
  experiment(stop = 1 s);
end Moved;
"""


def test_a_force_begins_while_a_constraint_moves() -> None:
    """The time at which it begins changes, and with it the place that the constraint asks for."""
    problem = mechc.loads(MOVED).problem()
    found, expected = checked(problem, SimulationOptions(tolerance=1e-10, points=2, method="dop853"), "k")
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-8)

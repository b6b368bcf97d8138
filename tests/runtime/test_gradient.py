"""Gradients backwards along a run: against closed forms, against derivatives along the motion, and what is refused."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest

import mechc
from mechc.runtime.case import SimulationOptions
from mechc.runtime.outcome import SimulationError
from mechc.runtime.problem import Problem
from mechc.runtime.studies.runs.simulate import plan_run
from mechc.runtime.tangent.flow import tangent_flow
from mechc.runtime.tangent.gradient import Gradient, Gradients

TOLERANCE = 1e-12


def both(problem: Problem, goal: str, names: Sequence[str], **options: object) -> tuple[Gradient, np.ndarray]:
    """A gradient, and the same derivatives along the motion."""
    plan = plan_run(problem, SimulationOptions(tolerance=TOLERANCE, **options))  # type: ignore[arg-type]
    found = Gradients(plan.case, goal, names).at(plan.nominal, TOLERANCE)
    flow = tangent_flow(plan.case, plan.method, plan.nominal, names, estimate_error=False)
    listed = [q.name for q in (*problem.states, *problem.outputs)]
    rows = np.concatenate([flow.tangents[-1], flow.output_tangents[-1]])
    return found, rows[listed.index(goal)]


def agree(found: Gradient, forward: np.ndarray) -> None:
    np.testing.assert_allclose(found.derivatives, forward, rtol=1e-9, atol=1e-9 * np.abs(forward).max())


SPRING = """
model Spring
  parameter m = 2 kg;
  parameter k = 3 N/m;
  coordinate x = 0.7 m;
  kinetic 1/2*m*der(x)^2;
  potential 1/2*k*x^2;
  experiment(stop = 4 s);
end Spring;
"""


def test_closed_form_of_an_oscillator() -> None:
    """x = x0 cos(w t), w = sqrt(k/m): also of the integral of x^2, x0^2 (t/2 + sin(2 w t)/(4 w))."""
    found = mechc.loads(SPRING).gradient("x", ["m", "k", "x", "der(x)"], tolerance=1e-13)
    w, t, x0 = math.sqrt(1.5), 4.0, 0.7
    by_w = -x0 * t * math.sin(w * t)
    expected = [-by_w * w / 4, by_w * w / 6, math.cos(w * t), math.sin(w * t) / w]
    np.testing.assert_allclose(list(found.details["gradient"].values()), expected, rtol=1e-11)
    assert [v.unit for v in found.values] == ["m", "m/kg", "m.s^2/kg", "", "s"]
    cost = mechc.loads(SPRING).gradient("x^2", "k,x", integral=True, tolerance=1e-13)
    value = x0**2 * (t / 2 + math.sin(2 * w * t) / (4 * w))
    by_w = x0**2 * (2 * t * math.cos(2 * w * t) / (4 * w) - math.sin(2 * w * t) / (4 * w**2))
    assert cost.details["goal"] == pytest.approx(value, rel=1e-11)
    np.testing.assert_allclose(
        list(cost.details["gradient"].values()), [by_w * w / 6, 2 * value / x0], rtol=1e-10
    )
    assert cost.values[0].unit == "m^2.s"


@pytest.mark.parametrize(
    ("name", "goal", "to"),
    [
        (
            "double_pendulum",
            "tip[1]",
            ["lower.l", "upper.m", "elbow.angle", "der(shoulder.angle)", "gravity"],
        ),
        ("heavy_top_rotation", "tip[3]", ["m", "g", "der(R)[1]"]),
        ("forced_pendulum", "der(theta)", ["a", "w", "gamma", "theta"]),
        ("henon_heiles", "energy.potential", ["q1", "E", "q20"]),
        ("rod_in_circle", "x", ["m", "r", "l", "phi"]),
        ("chaplygin_sleigh", "x", ["a", "I", "der(theta)", "x"]),
        pytest.param(
            "slider_crank",
            "main.angle",
            ["crank.l", "load", "drive_torque", "main.angle"],
            marks=pytest.mark.slow,
        ),
        pytest.param("rolling_ball_with_cavity", "s", ["rho", "hollow", "s"], marks=pytest.mark.slow),
    ],
)
def test_equals_the_derivatives_along_the_motion(name: str, goal: str, to: list[str]) -> None:
    problem = mechc.load(f"examples/{name}.mech").problem()
    known = {q.name for q in (*problem.parameters, *problem.states)}
    agree(*both(problem, goal, [n for n in to if n in known], stop=3.0))


NEAREST = """
model Nearest
  parameter m = 2 kg;
  parameter l = 0.8 m;
  parameter a = 0.3 m;
  coordinate x ~ a;
  coordinate y ~ -0.7 m;
  kinetic 1/2*m*(der(x)^2 + der(y)^2);
  potential m*(9.81 m/s^2)*y + 1/2*(3 N/m)*x^2;
  constraint rod: x^2 + y^2 = l^2;
  experiment(stop = 2 s);
end Nearest;
"""


def test_a_start_that_is_nearest_to_guesses_is_differentiated() -> None:
    problem = mechc.loads(NEAREST).problem()
    agree(*both(problem, "x", ["m", "l", "a"]))
    at_once = both(problem, "x", ["m", "l", "a"], stop=1e-9)[0].derivatives
    far = math.hypot(0.3, 0.7)  # the nearest point of the circle is (a, b) l/|(a, b)|
    np.testing.assert_allclose(at_once, [0.0, 0.3 / far, 0.8 * 0.49 / far**3], atol=1e-7)


FOLLOWING = """
model Following
  parameter m = 2 kg;
  parameter l = 0.8 m;
  parameter J = m*l^2;
  parameter th0 = 0.3 rad;
  input Torque u = 0.2 N.m*sin(3 rad/s*time)*(m/(2 kg));
  coordinate theta = th0 + 0.1*(l/(1 m));
  coordinate phi = theta/2;
  initial der(theta) = 2 rad/s*theta/(1 rad);
  kinetic 1/2*J*der(theta)^2 + 1/2*J*der(phi)^2;
  potential -m*(9.81 m/s^2)*l*cos(theta) + (1 N.m)*(theta - phi)^2;
  torque u on phi;
  experiment other(l = 0.9 m, theta = 0.2*m/(1 kg), stop = 2 s);
  experiment(stop = 2 s);
end Following;
"""


@pytest.mark.parametrize("to", [["m", "l", "th0"], ["J", "m"], ["l", "u"], ["theta", "m"]])
def test_what_follows_from_parameters_changes_too(to: list[str]) -> None:
    """Other parameters, defaults of inputs, initial values, those stated with others."""
    agree(*both(mechc.loads(FOLLOWING).problem(), "phi", to))


def test_experiments_and_values_that_are_set() -> None:
    problem = mechc.loads(FOLLOWING).problem()
    agree(*both(problem, "phi", ["m", "l", "u"], experiment="other"))
    agree(*both(problem, "phi", ["m", "theta"], experiment="other", values={"theta": 0.1, "J": 1.1}))
    with pytest.raises(SimulationError, match="stated with those of others"):
        both(problem, "phi", ["phi"])


def test_inputs_from_tables() -> None:
    from mechc.runtime.inputs import Table

    times = np.linspace(0, 2, 9)
    for interpolation in ("linear", "step"):
        table = Table(times, np.sin(3 * times), np.zeros(9), interpolation)
        agree(*both(mechc.loads(FOLLOWING).problem(), "phi", ["m", "u"], inputs={"u": table}))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("bouncing_ball", "events or laws that switch"),
        ("sampled_controller", "events or laws that switch"),
    ],
)
def test_refusals_say_why(text: str, words: str) -> None:
    model = mechc.load(f"examples/{text}.mech")
    with pytest.raises(SimulationError) as found:
        model.gradient("energy.total", [model.parameters[0].name], stop=1.0)
    assert words in found.value.message and "sensitivity" in (found.value.help or "")


def test_stiff_motions_and_other_methods_are_refused() -> None:
    stiff = SPRING.replace("end Spring;", "dissipation 1/2*(1e6 N.s/m)*der(x)^2;\nend Spring;").replace(
        "stop = 4", "stop = 40"
    )
    with pytest.raises(SimulationError, match="is stiff from"):
        mechc.loads(stiff).gradient("x", "k")
    with pytest.raises(SimulationError, match="'rk4' are not pulled back"):
        mechc.loads(SPRING).gradient("x", "k", method="rk4", step=0.01)
    with pytest.raises(SimulationError, match="needs a goal"):
        mechc.loads(SPRING).study("gradient", goal="x")


def test_steps_are_kept_and_nothing_else() -> None:
    found = mechc.loads(SPRING).gradient("x", "k", estimate_error=False)
    assert found.details["memory"] == 8 * (found.details["steps"] * 4 + 2)
    assert found.values[1].error is None


def test_derivatives_are_formed_apart_from_the_model() -> None:
    """Neither gradients nor derivatives along the motion leave their symbols where others find values that are equal."""
    model = mechc.loads(FOLLOWING)
    problem, graph = model.problem(), model.compilation.equations.graph
    size = len(graph)
    both(problem, "phi", ["m", "l"])
    assert len(graph) == size


def test_accounts_of_energy_may_be_goals() -> None:
    model = mechc.load("examples/double_pendulum.mech")
    agree(*both(model.problem(), "energy.dissipated", ["lower.l", "elbow.angle"], stop=2.0))


FROM_REST = """
model FromRest
  parameter Length h = 20 m;
  parameter g = 9.81 m/s^2;
  parameter vT = 6.8 m/s;
  coordinate y = h;
  kinetic 1/2*(1 kg)*der(y)^2;
  potential (1 kg)*g*y;
  force -(1 kg)*g/vT^2*sqrt(der(y)^2)*der(y) on y;
  experiment(stop = 3 s);
end FromRest;
"""


def test_drag_from_rest_has_derivatives() -> None:
    """y = h - vT^2/g log cosh(g t/vT); at rest the formula of the drag has none, the motion leaves that at once."""
    g, v, t = 9.81, 6.8, 3.0
    fallen, slope = math.log(math.cosh(g * t / v)), math.tanh(g * t / v)
    expected = [1.0, v**2 / g**2 * fallen - v / g * t * slope, -2 * v / g * fallen + t * slope]
    found, forward = both(mechc.loads(FROM_REST).problem(), "y", ["h", "g", "vT"])
    np.testing.assert_allclose(forward, expected, rtol=1e-10)
    np.testing.assert_allclose(found.derivatives, expected, rtol=1e-10)


def test_what_is_no_number_is_said() -> None:
    with pytest.raises(SimulationError, match="is not a number at the end of the motion"):
        mechc.loads(FROM_REST).gradient("sqrt(-abs(y)/h)", "h", stop="0.1 s")

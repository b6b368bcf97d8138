"""Derivatives of motions across events: impacts, friction, branches, samples and jumps of energy."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from derivatives import differences
from scipy.integrate import solve_ivp

import mechc
from mechc.runtime.case import SimulationOptions
from mechc.runtime.outcome import SimulationError
from mechc.runtime.studies.runs.simulate import plan_run
from mechc.runtime.tangent.flow import TangentFlow, tangent_flow

EXAMPLES = Path(__file__).parents[2] / "examples"

BALL = """
model Ball
  parameter g = 9.81 m/s^2;
  parameter e = 0.8;
  coordinate Length z = 1 m;
  kinetic 1/2*(1 kg)*der(z)^2;
  potential (1 kg)*g*z;
  contact floor: z restitution e;
  experiment(stop = 1.5 s, tolerance = 1e-11);
end Ball;
"""

BLOCK = """
model Block
  parameter m = 1 kg;
  parameter mu = 0.3;
  parameter g = 9.81 m/s^2;
  coordinate Length x = 0 m;
  initial der(x) = 2 m/s;
  kinetic 1/2*m*der(x)^2;
  friction mu*m*g on x;
  experiment(stop = 1 s, tolerance = 1e-11);
end Block;
"""

PULLED = BLOCK.replace("initial der(x) = 2 m/s;", "input F = 5*time*(1 N/s);").replace(
    "friction mu", "force F on x;\n  friction mu"
)

SPIN = """
model Spin "a ball with spin that bounces, first slipping, then with so little slip that it rolls off"
  parameter m = 1 kg;
  parameter R = 0.1 m;
  parameter mu = 0.2;
  parameter e = 0.7;
  coordinate Length x = 0 m;
  coordinate Length z = 0.5 m;
  coordinate Angle phi = 0 rad;
  initial der(x) = 1 m/s;
  initial der(phi) = 12 rad/s;
  kinetic 1/2*m*(der(x)^2 + der(z)^2) + 1/5*m*R^2*der(phi)^2;
  potential m*(9.81 m/s^2)*z;
  contact floor: z restitution e friction mu along der(x) + R*der(phi);
  experiment(stop = 1.6 s, tolerance = 1e-11);
end Spin;
"""

SAMPLED = """
model Sampled
  parameter k = 2;
  parameter Ts = 0.3 s;
  coordinate Length x = 1 m;
  discrete Real held = 0.5;
  kinetic 1/2*(1 kg)*der(x)^2;
  when sample(Ts) then
    held := 0.9*held + k*x/(1 m) + 0.2*der(x)/(1 m/s);
  end when;
  force -held*(1 N) on x;
  experiment(stop = 2 s, tolerance = 1e-11);
end Sampled;
"""

THROWN_BACK = """
model ThrownBack
  parameter wall = 2 m;
  parameter lift = 1.5;
  coordinate Length x = 0 m;
  initial der(x) = 1 m/s;
  kinetic 1/2*(1 kg)*der(x)^2;
  potential -(1 N)*x;
  when x > wall then
    reinit(der(x), -lift*pre(der(x)));
    reinit(x, x - 0.1*wall);
  end when;
  experiment(stop = 2.5 s, tolerance = 1e-11);
end ThrownBack;
"""


def flow_of(text: str, *names: str, initial: bool = False, **options: float) -> TangentFlow:
    problem = mechc.loads(text).problem()
    plan = plan_run(problem, SimulationOptions(**options))  # type: ignore[arg-type]
    unit = np.eye(2 * problem.nv + problem.nx) if initial else None
    return tangent_flow(plan.case, plan.method, plan.nominal, names, initial=unit, both_sides=True)


def test_a_bouncing_ball_has_the_derivatives_of_its_closed_solution() -> None:
    """After n impacts z = e^n w (t - T) - g/2 (t - T)^2, w = sqrt(2 g h), T = w/g (1 + 2 e + .. 2 e^n... ); by sympy."""
    import sympy

    h, g, e, t = sympy.symbols("h g e t", positive=True)
    fall = sympy.sqrt(2 * h / g)
    flow = flow_of(BALL, "z", "g", "e")
    values = {h: 1.0, g: 9.81, e: 0.8}
    numbers = np.searchsorted(flow.time[np.flatnonzero(np.diff(flow.time) == 0)], flow.time, side="right")
    pairs = np.flatnonzero(np.diff(flow.time) == 0)
    assert pairs.size == 2
    numbers[pairs] -= 1  # the side before
    for n in range(3):
        rows = numbers == n
        if n == 0:
            z = h - g / 2 * t**2
        else:
            begin = fall * (1 + 2 * sum(e**k for k in range(1, n)))
            z = e**n * g * fall * (t - begin) - g / 2 * (t - begin) ** 2
        assert rows.sum() > 10
        for k, symbol in enumerate((h, g, e)):
            for i, what in enumerate((z, sympy.diff(z, t))):
                exact = sympy.lambdify(t, sympy.diff(what, symbol).subs(values), "numpy")(flow.time[rows])
                np.testing.assert_allclose(flow.tangents[rows, i, k], exact + 0 * flow.time[rows], atol=1e-9)


def test_impacts_without_loss_keep_areas() -> None:
    """Liouville: det W = 1 for a conservative model of one coordinate, impacts included; and e^2 at each with loss
    (the velocity is reversed, and so is its derivative: the determinant is positive)."""
    flow = flow_of(BALL.replace("e = 0.8", "e = 1"), initial=True)
    np.testing.assert_allclose(np.linalg.det(flow.tangents[:, :2, :2]), 1.0, atol=1e-9)
    flow = flow_of(BALL, initial=True)
    # each impact multiplies by e (velocities) times e (times between: v+ = e v-)
    np.testing.assert_allclose(np.linalg.det(flow.tangents[-1, :2, :2]), 0.8**4, rtol=1e-8)


def test_a_block_that_comes_to_rest_stays_where_friction_stopped_it() -> None:
    """x = v^2/(2 mu g) at rest: d/dv = v/(mu g), d/dmu = -x/mu, and nothing of it depends on m."""
    flow = flow_of(BLOCK, "der(x)", "mu", "g", "m", "x")
    x = 4 / (2 * 0.3 * 9.81)
    np.testing.assert_allclose(flow.states[-1, 0], x, rtol=1e-9)
    np.testing.assert_allclose(flow.tangents[-1, 0], [2 / (0.3 * 9.81), -x / 0.3, -x / 9.81, 0, 1], atol=1e-9)
    np.testing.assert_allclose(flow.tangents[-1, 1], 0, atol=1e-9)


def test_a_block_begins_to_slide_when_the_pull_exceeds_friction() -> None:
    """m x'' = F - mu m g from F = mu m g on: x = a (t - t1)^3/6 with a = 5/m, t1 = mu m g/5: dx/dmu = -a/2 (t - t1)^2 dt1/dmu."""
    flow = flow_of(PULLED, "mu", "m")
    t, t1 = 1.0, 0.3 * 9.81 / 5
    np.testing.assert_allclose(flow.states[-1, 0], 5 * (t - t1) ** 3 / 6, rtol=1e-8)
    by_mu = -5 / 2 * (t - t1) ** 2 * 9.81 / 5
    by_m = -5 / 2 * (t - t1) ** 2 * 0.3 * 9.81 / 5 - 5 * (t - t1) ** 3 / 6
    np.testing.assert_allclose(flow.tangents[-1, 0], [by_mu, by_m], atol=1e-8)


CORNER = """
model Corner "a box in space hits the floor with one corner, whose slip the impact turns, then with the same again"
  parameter mu = 0.25; parameter e = 0.4; parameter h = 0.6 m;
  gravity {0, 0, -9.81} m/s^2;
  coordinate Length x = 0 m; coordinate Length y = 0 m; coordinate Length z = h;
  coordinate Rotation R = rotx(23 deg)*roty(31 deg);
  initial der(R) = {0.7, -0.4, 1.3} rad/s; initial der(x) = 1.2 m/s; initial der(y) = -0.5 m/s;
  frame box = world * trans({x, y, z}) * R;
  mass 2 kg at box; inertia diag({0.0362, 0.0544, 0.0725} kg.m^2) on box;
  let corner = {0.17, 0.22, -0.10} m;
  contact hit: pos(box * corner)[3] restitution e friction mu along {vel(box * corner)[1], vel(box * corner)[2]}OPTIONS;
  experiment(stop = 0.4 s);
end Corner;
"""
TIPS = """
model Tips "a bar falls on one end, slides, and then on the other: one after the other, or together"
  parameter mu = 0.2; parameter e = 0.3; parameter a0 = -0.25 rad;
  gravity {0, -9.81} m/s^2;
  coordinate Length x = 0 m; coordinate Length y = 0.2 m; coordinate Angle a = a0;
  initial der(x) = 1.5 m/s; initial der(a) = 1 rad/s;
  frame bar = world * trans({x, y}) * rot(a);
  mass 1 kg at bar; inertia 0.02 kg.m^2 on bar;
  point left = bar * {-0.3, -0.05} m; point right = bar * {0.3, -0.05} m;
  contact l: left[2] restitution e friction mu along vel(left)[1]OPTIONS;
  contact r: right[2] restitution e friction mu along vel(right)[1]OPTIONS;
  experiment(stop = STOP);
end Tips;
"""
TOGETHER = ', impacts = "simultaneous"'

AGAINST_DIFFERENCES = [
    (SPIN, ("mu", "e", "R", "der(phi)", "z"), {}),
    (SAMPLED, ("k", "Ts", "x", "der(x)"), {}),
    (THROWN_BACK, ("wall", "lift", "x", "der(x)"), {}),
    (CORNER.replace("OPTIONS", ""), ("mu", "e", "h", "der(x)"), {}),
    (TIPS.replace("OPTIONS", "").replace("STOP", "0.185 s"), ("mu", "e", "a0", "der(x)"), {}),
    (TIPS.replace("OPTIONS", TOGETHER).replace("STOP", "0.185 s"), ("mu", "e", "a0", "der(x)"), {}),
    ("potential_step", ("U2", "x", "m"), {"stop": 3.0}),
    ("coulomb_pendulum", ("l", "theta"), {"stop": 3.0}),
    ("double_pendulum_stops", None, {"stop": 2.0}),
    ("newtons_cradle", ("theta[1]", "l"), {"stop": 1.0}),
    ("relay_attitude", ("T", "on", "M"), {"stop": 3.0}),
    ("geared_servo", ("target", "rotor.J"), {"stop": 0.004}),  # a force begins, and with it its side
]


@pytest.mark.parametrize(
    ("text", "names", "options"),
    AGAINST_DIFFERENCES,
    ids=[
        *("spin", "sampled", "thrown back", "corner", "tips", "tips together"),
        *(row[0] for row in AGAINST_DIFFERENCES[6:]),
    ],
)
def test_derivatives_agree_with_differences(
    text: str, names: tuple[str, ...] | None, options: dict[str, float]
) -> None:
    """At the end of the run, 1e-6 of the largest derivative of a state: what is promised across events."""
    model = mechc.loads(text) if "\n" in text else mechc.load(EXAMPLES / f"{text}.mech")
    problem = model.problem()
    names = names or tuple(q.name for q in problem.parameters[:2])
    asked = SimulationOptions(tolerance=1e-12, points=3, **options)  # type: ignore[arg-type]
    plan = plan_run(problem, asked)
    flow = tangent_flow(plan.case, plan.method, plan.nominal, names, both_sides=True)
    assert (np.diff(flow.time) == 0).any(), "nothing happened"
    for k, name in enumerate(names):
        expected = differences(problem, asked, name, 2e-4, 3)[-1]
        error = np.abs(flow.tangents[-1, :, k] - expected)
        assert error.max() < 1e-6 * max(np.abs(expected).max(), 1e-3), (name, error, expected)
    if (
        text == "geared_servo"
    ):  # friction lets go and its bearing begins at one instant: a tighter run lists them otherwise
        return
    assert flow.errors is not None and flow.errors[-1].max() < 1e-6 * np.abs(flow.tangents[-1]).max()


REFUSED = {
    "one side only": (BALL.replace("z = 1 m", "z = 0 m;\n  initial der(z) = 1 m/s"), "z"),
    "several things happen at once": (
        BALL.replace(
            "contact floor",
            "coordinate Length w = 1 m;\n  kinetic 1/2*(1 kg)*der(w)^2;\n"
            "  potential (1 kg)*g*w;\n  contact ground: w restitution e;\n  contact floor",
        ),
        "z",
    ),
}


@pytest.mark.parametrize("reason", REFUSED)
def test_what_has_no_derivative_is_refused_with_the_reason(reason: str) -> None:
    text, name = REFUSED[reason]
    with pytest.raises(SimulationError, match=reason):
        flow_of(text, name)


def test_what_both_do_at_once_may_change_together() -> None:
    """Two balls that hit at the same time: in g they go on doing so, and each has the derivative of one alone."""
    text, _ = REFUSED["several things happen at once"]
    both, alone = flow_of(text, "g"), flow_of(BALL, "g")
    np.testing.assert_allclose(both.tangents[-1, :2, 0], alone.tangents[-1, 0, 0], atol=1e-9)


@pytest.mark.slow
def test_a_ball_that_slips_in_two_directions_rolls_with_its_closed_derivatives() -> None:
    """Where slip vanishes, its direction is that of errors: friction keeps that in which it came. Rolling at
    v = (5 v0 + 2 r w x up)/7, whatever mu, m and g are."""
    problem = mechc.load(EXAMPLES / "masse_shot.mech").problem()
    names = ["der(x)", "mu", "m", "r"]
    for tolerance, bound in ((1e-8, 5e-5), (1e-11, 1e-7)):
        plan = plan_run(problem, SimulationOptions(tolerance=tolerance, points=2))
        flow = tangent_flow(plan.case, plan.method, plan.nominal, names, estimate_error=False)
        assert flow.failure is None
        rates = [[q.name for q in problem.states].index(n) for n in ("der(x)", "der(y)")]
        found = flow.tangents[-1][rates]
        # w = (60, -80, 10)/s: w x up = (w_y, -w_x), of which 2/7 r is left
        expected = [[5 / 7, 0, 0, 2 / 7 * -80], [0, 0, 0, 2 / 7 * -60]]
        assert np.abs(found - expected).max() < bound * 23, (tolerance, found)


@pytest.mark.parametrize(("stop", "events", "bound"), [(0.65, 30, 3e-7), (0.761901, 99, 5e-6)])
def test_a_box_that_rattles_down(stop: float, events: int, bound: float) -> None:
    """Corners come to rest, twice until 0.65 s, and in the last event one as another hits. What rested had been taken to rebound:
    2e-6 off after the first, 1e-5 at the end. The differences are good to 1.3e-7 by their step and to 1e-6 by
    rounding, which soft impacts enlarge; shorter steps leave more, 3e-5 with 2e-7."""
    model = mechc.load(EXAMPLES / "falling_box.mech")
    problem, step = model.problem(), 1e-5
    plan = plan_run(problem, SimulationOptions(tolerance=1e-12, points=2, stop=stop))
    flow = tangent_flow(plan.case, plan.method, plan.nominal, ["e"], estimate_error=False)
    sides = [
        model.simulate(stop=stop, tolerance=1e-13, set={"e": 0.3 + s}, estimate_error=False)
        for s in (step, -step)
    ]
    assert [len(side.events) for side in sides] == [events, events]
    expected = np.array([(sides[0][q.name][-1] - sides[1][q.name][-1]) / (2 * step) for q in problem.states])
    np.testing.assert_allclose(flow.tangents[-1][:, 0], expected, rtol=0, atol=bound)


@pytest.mark.slow
def test_a_box_that_rattles_to_rest_is_refused_with_the_reason() -> None:
    problem = mechc.load(EXAMPLES / "falling_box.mech").problem()
    options = SimulationOptions(tolerance=1e-12, method="dop853", stop=0.9)
    plan = plan_run(problem, options)
    with pytest.raises(SimulationError, match="hits so softly that the time of the impact is not known"):
        tangent_flow(plan.case, plan.method, plan.nominal, ["a"], estimate_error=False)


SLIDING = """\
model Sliding
  dimensionless;
  coordinate x = 0.5;
  kinetic 1/2*der(x)^2;
  potential 1/2*x^2;
  force 1 on x;
  friction 1/10 on x;
  experiment(stop = 4);
end Sliding;
"""


def test_a_motion_that_begins_to_slide_is_differentiated_where_output_begins_later() -> None:
    """It slides forwards from rest about x = 0.9, turns at t = pi, where the rate changes from -0.4 to -0.2, and slides back about
    1.1: volumes shrink to a half there, and nowhere else."""
    found = mechc.loads(SLIDING).volume(stop=4)
    assert found["ratio"] == pytest.approx(0.5, rel=1e-10)
    mapped = mechc.loads(SLIDING).floquet(period=3.3).summary()["multipliers"]
    second = 3.3 - math.pi
    turn = np.array([[1, 0], [0, 0.5]])
    rotations = [
        np.array([[math.cos(t), math.sin(t)], [-math.sin(t), math.cos(t)]]) for t in (math.pi, second)
    ]
    exact = np.linalg.eigvals(rotations[1] @ turn @ rotations[0])
    assert sorted(complex(*m).real for m in mapped) == pytest.approx(sorted(exact.real), abs=1e-9)


HAMMER = """\
model Hammer "mass on a spring with dry friction, driven against a stop"
  dimensionless;
  parameter e = 0.7;
  parameter mu = 0.1;
  parameter w = 2.3;
  input push = cos(w*time);
  coordinate x = 0.5;
  kinetic 1/2*der(x)^2;
  potential 1/2*x^2;
  force push on x;
  friction mu on x;
  contact stop: x + 0.2 restitution e;
  experiment(stop = 60);
end Hammer;
"""


def slides_and_strikes(y: list[float], stop: float) -> np.ndarray:
    """Follow it by SciPy from one turn or impact to the next; it does not stick on this way."""
    t, y = 0.0, list(y)
    while stop - t > 1e-13:
        side = math.copysign(1.0, y[1]) if abs(y[1]) > 1e-12 else math.copysign(1.0, math.cos(2.3 * t) - y[0])

        def rates(t: float, y: np.ndarray, side: float = side) -> list[float]:
            return [y[1], math.cos(2.3 * t) - y[0] - 0.1 * side]

        def strikes(t: float, y: np.ndarray) -> float:
            return float(y[0] + 0.2)

        def turns(t: float, y: np.ndarray, side: float = side) -> float:
            return float(side * y[1])

        for event in (strikes, turns):
            event.terminal, event.direction = True, -1  # type: ignore[attr-defined]
        run = solve_ivp(
            rates,
            (t, stop),
            y,
            method="DOP853",
            rtol=1e-12,
            atol=1e-12,
            max_step=0.1,
            events=[strikes, turns],
        )
        t, y = float(run.t[-1]), [float(v) for v in run.y[:, -1]]
        if run.t_events[0].size:
            y = [-0.2, -0.7 * y[1]]
        elif run.t_events[1].size:
            y[1] = 0.0
    return np.array(y)


def test_an_orbit_with_dry_friction_an_impact_and_an_input() -> None:
    """Its multipliers against differences of motions by SciPy."""
    period = 2 * math.pi / 2.3
    found = mechc.loads(HAMMER).orbit(period=period).summary()
    start = [found["start"]["x"], found["start"]["der(x)"]]
    assert slides_and_strikes(start, period) == pytest.approx(start, abs=1e-9)
    h, columns = 1e-5, []
    for k in (0, 1):
        ends = [
            slides_and_strikes([v + s * h * (i == k) for i, v in enumerate(start)], period) for s in (1, -1)
        ]
        columns.append((ends[0] - ends[1]) / (2 * h))
    exact = sorted(np.linalg.eigvals(np.array(columns).T).real)
    assert sorted(m[0] for m in found["multipliers"]) == pytest.approx(exact, rel=1e-5)

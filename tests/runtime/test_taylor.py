"""Taylor's method: its series against mpmath, its orders, its motions against 30-digit references, what it refuses."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest
from gallery import EXAMPLES, at, load, references
from kernel_driver import run
from kernel_models import PENDULUM

import mechc
from mechc.compiler.pipeline import program_with
from mechc.compiler.program import model as limits
from mechc.requests.parse_values import UsageMistake
from mechc.runtime.case import SimulationOptions, prepare
from mechc.runtime.functions import load_functions
from mechc.runtime.integrate.solver import Solver
from mechc.runtime.native.kernel import load_kernel
from mechc.runtime.outcome import Outcome, SimulationError

X = mpmath.tanh
"""The solution of x' = 1 - x^2 from 0."""

RATES: dict[str, Callable[[mpmath.mpf], mpmath.mpf]] = {
    "sin(3*x)*cos(2*x)": lambda x: mpmath.sin(3 * x) * mpmath.cos(2 * x),
    "tan(x)": mpmath.tan,
    "asin(x/2) + acos(x/3)": lambda x: mpmath.asin(x / 2) + mpmath.acos(x / 3),
    "atan(2*x)": lambda x: mpmath.atan(2 * x),
    "atan2(x + 1, 2 - x^2)": lambda x: mpmath.atan2(x + 1, 2 - x**2),
    "sinh(x) - 2*cosh(x)": lambda x: mpmath.sinh(x) - 2 * mpmath.cosh(x),
    "tanh(2*x)": lambda x: mpmath.tanh(2 * x),
    "exp(-x)/(1 + x^2)": lambda x: mpmath.exp(-x) / (1 + x**2),
    "log(2 + x)": lambda x: mpmath.log(2 + x),
    "sqrt(1 + x)": lambda x: mpmath.sqrt(1 + x),
    "(1 + x^2)^(-3/2)": lambda x: (1 + x**2) ** mpmath.mpf("-1.5"),
    "x/((1 + x)*sqrt(1 + x))": lambda x: x / ((1 + x) * mpmath.sqrt(1 + x)),
    "(2 + x)^(5/2)": lambda x: (2 + x) ** mpmath.mpf("2.5"),
    "(2 + x*(1 + x)^(3/2))^(-7/2)": lambda x: (2 + x * (1 + x) ** mpmath.mpf("1.5")) ** mpmath.mpf("-3.5"),
    "(2 + x)^0.7": lambda x: (2 + x) ** mpmath.mpf("0.7"),
    "(2 + x)^(1 + x)": lambda x: (2 + x) ** (1 + x),
    "(1 + x)^k": lambda x: (1 + x) ** mpmath.mpf("1.3"),
    "k^x": lambda x: mpmath.mpf("1.3") ** x,
    "-2*x^3/k + (if k > 1 then x else 1/x)": lambda x: -2 * x**3 / mpmath.mpf("1.3") + x,
    "5": lambda x: mpmath.mpf(5),
}


def test_series_of_every_function() -> None:
    """Integrals along the motion, to rounding; explicit time beside the state."""
    states = "".join(f"state s{i} = 0; equation der(s{i}) = ({rate})/1 s;" for i, rate in enumerate(RATES))
    text = f"""
        parameter k = 1.3; state x = 0; equation der(x) = (1 - x^2)/1 s; {states}
        state last = 0; equation der(last) = sin(time/1 s)*x*time^2/1 s^3;
    """
    solution = mechc.loads(text).simulate(stop=1, method="taylor", tolerance=1e-14, estimate_error=False)
    mpmath.mp.dps = 25
    for i, (rate, function) in enumerate(RATES.items()):
        exact = mpmath.quad(lambda t, f=function: f(X(t)), [0, 0.5, 1])
        assert abs(solution[f"s{i}"][-1] - float(exact)) < 2e-14 * (1 + abs(exact)), rate
    exact = mpmath.quad(lambda t: mpmath.sin(t) * X(t) * t**2, [0, 0.5, 1])
    assert abs(solution["last"][-1] - float(exact)) < 1e-14


COUPLED: dict[str, tuple[str, Callable[[mpmath.mpf], mpmath.mpf], Callable[[mpmath.mpf], mpmath.mpf]]] = {
    "(x + cos(x)*exp(-x))/(3 - cos(x)*cos(x))": (
        "cos(x)",
        lambda x: (x + mpmath.cos(x) * mpmath.exp(-x)) / (3 - mpmath.cos(x) ** 2),
        mpmath.cos,
    ),
    "(1 - k*exp(x)*x)/(3 + k*x*sin(x))": (
        "2*sin(x)",
        lambda x: (1 - mpmath.mpf("1.3") * mpmath.exp(x) * x) / (3 + mpmath.mpf("1.3") * x * mpmath.sin(x)),
        lambda x: 2 * mpmath.sin(x),
    ),
    "-(k*cos(2*x)*exp(-x) - 2*x)/(-(5 - 2*(k*cos(2*x))*(cos(2*x)/k)))": (
        "-k*cos(2*x)",
        lambda x: (
            (mpmath.mpf("1.3") * mpmath.cos(2 * x) * mpmath.exp(-x) - 2 * x)
            / (5 - 2 * mpmath.cos(2 * x) ** 2)
        ),
        lambda x: -mpmath.mpf("1.3") * mpmath.cos(2 * x),
    ),
    "(exp(-x) + k)/(3 - cos(x)*sin(x))": (
        "cos(x)",
        lambda x: (mpmath.exp(-x) + mpmath.mpf("1.3")) / (3 - mpmath.cos(x) * mpmath.sin(x)),
        mpmath.cos,
    ),
}
"""Quotients q, and what they are times elsewhere."""


def test_two_equations_with_each_other_s_unknown() -> None:
    """As elimination leaves them: q and w q against integrals along the motion, to rounding."""
    states = "".join(
        f"state q{i} = 0; state w{i} = 0; let r{i} = {q}; equation der(q{i}) = r{i}/1 s; equation der(w{i}) = {w}*r{i}/1 s;"
        for i, (q, (w, _, _)) in enumerate(COUPLED.items())
    )
    text = f"parameter k = 1.3; state x = 0; equation der(x) = (1 - x^2)/1 s; {states}"
    solution = mechc.loads(text).simulate(stop=1, method="taylor", tolerance=1e-14, estimate_error=False)
    mpmath.mp.dps = 25
    for i, (text, (_, q, w)) in enumerate(COUPLED.items()):
        exact = mpmath.quad(lambda t, q=q: q(X(t)), [0, 0.5, 1])
        assert abs(solution[f"q{i}"][-1] - float(exact)) < 2e-14 * (1 + abs(exact)), text
        exact = mpmath.quad(lambda t, q=q, w=w: w(X(t)) * q(X(t)), [0, 0.5, 1])
        assert abs(solution[f"w{i}"][-1] - float(exact)) < 2e-14 * (1 + abs(exact)), text


def test_slots_of_two_equations() -> None:
    """Three of sines and cosines two each, two squares, two products with them, and two that join the equations."""
    assert slots_of(KINETIC.format("cos(a - b)")) == 12
    assert slots_of(KINETIC.format("2*cos(a/2 - b/2)^2 - 1")) > 12


KINETIC = (
    "coordinate a = 0 rad; coordinate b = 0 rad; kinetic 1/2*2 kg*(1 m*der(a))^2 + 1/2*1 kg*(1 m*der(b))^2"
    " + 1 kg*(1 m)^2*der(a)*der(b)*({}); potential -9.81 m/s^2*1 m*(2 kg*cos(a) + 1 kg*cos(b));"
)


def slots_of(text: str) -> int:
    program = mechc.loads(text).program(frozenset({"series"}))
    assert program.series is not None
    return program.series.n_slots


@pytest.mark.parametrize(("tolerance", "order", "step"), [(1e-6, 14, 0.1), (1e-9, 21, 0.2)])
def test_order_follows_the_tolerance(tolerance: float, order: int, step: float) -> None:
    """ln(1/tolerance), upwards; errors over halved steps, against gauss8 in quadruple precision."""
    exact = run(PENDULUM, "gauss8", (1.0, 0.0), 1.6, step=1 / 1024, quad=True)
    errors = [
        run(PENDULUM, "taylor", (1.0, 0.0), 1.6, max_step=dt, tolerance=tolerance, quad=True).error(
            exact.y, exact.low
        )
        for dt in (step, step / 2)
    ]
    assert abs(np.log2(errors[0] / errors[1]) - order) < 0.5, errors


@pytest.mark.parametrize(
    ("name", "tolerance", "order"),
    [("kepler", 1e-6, 14), ("kepler", 1e-9, 21), ("kepler", 1e-14, 31), ("pleiades", 1e-9, 17)],
)
def test_orders_and_steps(name: str, tolerance: float, order: int) -> None:
    """ln(1/tolerance) orders of few slots, 0.8 of that of many, upwards; and each step is the difference of its times to the
    last digit."""
    problem, stop = load(name).problem(method="taylor"), {"kepler": 20.0, "pleiades": 3.0}[name]
    case = prepare(problem, load_functions(problem), SimulationOptions(points=2, stop=stop, max_step=20.0))
    ny = case.y0.size
    with Solver(load_kernel(), case, "taylor", tolerance, np.full(ny, tolerance)) as solver:
        solver.start_record(200)
        solver.advance(case.stop, 10**6)
        steps = solver.recorded(solver.report()[0].steps)
    assert 10 < len(steps) < 200
    assert np.all(steps[1:, 0] - steps[:-1, 0] == steps[:-1, 1])
    assert np.all(steps[:, 2 + ny * (order + 1) :] == 0)
    assert np.any(steps[:, 2 + ny * order : 2 + ny * (order + 1)] != 0)


@pytest.mark.parametrize("name", ["kepler", "double_pendulum_points", "double_pendulum"])
def test_one_loop_of_few_slots_gives_the_bits_of_one_order_after_the_other(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With sums that end with the latest products (6 slots) and without (14 and 32)."""
    asked: dict[str, Any] = {"method": "taylor", "tolerance": 1e-12, "stop": 1.0, "reproducible": True}
    one_loop = mechc.load(EXAMPLES / f"{name}.mech").simulate(**asked)
    monkeypatch.setattr(limits, "FEW_SLOTS", -1)
    order_by_order = mechc.load(EXAMPLES / f"{name}.mech").simulate(**asked)
    for quantity, values in one_loop.items():
        np.testing.assert_array_equal(values, order_by_order[quantity], err_msg=quantity)


POINTS = {
    "th1": "th1", "th2": "th2", "w1": "der(th1)", "w2": "der(th2)", "x2": "tip[1]", "y2": "tip[2]",
}  # fmt: skip


@pytest.mark.parametrize("tolerance", [1e-3, 1e-6, 1e-8, 1e-9, 1e-10, 1e-12, 1e-14])
def test_start_from_the_horizontal_at_every_tolerance(tolerance: float) -> None:
    """Half of the coefficients of the start vanish: two in a row would give steps without a bound."""
    solution = load("double_pendulum_points").simulate(
        stop=10, method="taylor", tolerance=tolerance, estimate_error=False
    )
    for point in references("double_pendulum_point_masses"):
        if point["t"] > 10:
            continue
        expected = np.array([point["values"][k] for k in POINTS])
        got = at(solution, point["t"], list(POINTS.values()))
        bound = (30 * tolerance + 1e-14) * point["growth"]
        assert np.max(np.abs(got - expected) / (1 + np.abs(expected))) < bound, point["t"]


MASS = "coordinate x = 1 m; coordinate v = 0 m; kinetic 1/2*1 kg*(der(x)^2 + der(v)^2); "


def test_whole_parts_are_constant_between_events() -> None:
    """s' = 1 + floor(s): it takes 1/n from n - 1 to n; and the rest of a division beside it."""
    text = "dimensionless; state s = 0; state r = 0; equation der(s) = 1 + floor(s); equation der(r) = mod(s, 1);"
    stop = 1 + 1 / 2 + 1 / 3 + 0.1
    solution = mechc.loads(f"{text} experiment(stop = {stop!r}, tolerance = 1e-12);").simulate(
        method="taylor"
    )
    assert abs(solution["s"][-1] - 3.4) < 1e-12
    assert abs(solution["r"][-1] - (1 / 2 * (1 + 1 / 2 + 1 / 3) + 0.4**2 / 8)) < 1e-12


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (MASS + "force -1 N/m*abs(x) on x;", "'abs', which has no Taylor series where its pieces meet"),
        (MASS + "force -1 N*max(x/1 m, 0) on x;", "'maximum', which has no Taylor series"),
        (MASS + "input Force f = 0 N; force f on x;", "it has inputs"),
        (MASS + "force 1 N*table(x/1 m, {0, 1, 2}, {0, 2, 1}) on x;", "look-up table"),
    ],
)
def test_what_has_no_series_is_refused_in_words(text: str, reason: str) -> None:
    with pytest.raises(SimulationError, match=f"^'taylor' cannot run this model: .*{reason}"):
        mechc.loads(text).simulate(stop=1, method="taylor")


def test_where_a_series_begins_at_a_root_of_zero_is_told() -> None:
    """The drag of what is at rest: its rate is finite, the second derivative of its size is not."""
    text = MASS + "force 1 N on v; dissipation 1/3*1 kg/m*(der(x)^2 + der(v)^2)^(3/2);"
    solution = mechc.loads(text).simulate(stop=1, method="taylor")
    assert solution.outcome is Outcome.FAILED
    assert "has no Taylor series at t = 0 s" in solution.message and "'dop853'" in solution.message
    assert mechc.loads(text).simulate(stop=1, method="dop853").outcome is Outcome.COMPLETED


def test_constraints_and_quaternions() -> None:
    """A pendulum in Cartesian coordinates from 90 degrees by its elliptic function; a free symmetric top by Euler."""
    rod = mechc.loads(
        "coordinate x = 1 m; coordinate y = 0 m; kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);"
        "potential 1 kg*9 m/s^2*y; constraint rod: x^2 + y^2 = 1 m^2;"
    ).simulate(stop=3, method="taylor", tolerance=1e-12, estimate_error=False)
    k = mpmath.sin(mpmath.pi / 4)
    sn = mpmath.ellipfun("sn", mpmath.ellipk(k**2) - 3 * mpmath.mpf(3), m=k**2)
    theta = 2 * mpmath.asin(k * sn)
    assert abs(rod["x"][-1] - float(mpmath.sin(theta))) < 1e-11
    assert abs(rod["y"][-1] + float(mpmath.cos(theta))) < 1e-11
    top = mechc.loads(
        "coordinate Rotation R; initial der(R) = {1, 0, 3} rad/s; inertia diag({2, 2, 3} kg.m^2) on world * R;"
    ).simulate(stop=7, method="taylor", tolerance=1e-12, estimate_error=False)
    assert abs(top["der(R)[1]"][-1] - np.cos(1.5 * 7)) < 1e-11
    assert abs(top["der(R)[2]"][-1] - np.sin(1.5 * 7)) < 1e-11


def test_events() -> None:
    """Impacts of a ball that falls 5 m under 10 m/s^2 with restitution 1/2, at 1, 2 and 2.5 s; a switch of a force."""
    ball = mechc.loads(
        "coordinate y = 5 m; kinetic 1/2*1 kg*der(y)^2; potential 1 kg*10 m/s^2*y; contact floor: y restitution 0.5;"
    ).simulate(stop=2.25, method="taylor", tolerance=1e-10, estimate_error=False)
    assert np.allclose([event.time for event in ball.events], [1, 2], atol=1e-13)
    assert abs(ball["y"][-1] - (2.5 * 0.25 - 5 * 0.25**2)) < 1e-12
    stiffer = mechc.loads(
        "coordinate x = 1 m; kinetic 1/2*1 kg*der(x)^2; force (if x > 0 m then -1 N/m else -4 N/m)*x on x;"
    ).simulate(stop=3, method="taylor", tolerance=1e-12, estimate_error=False)
    assert abs(stiffer["x"][-1] + 0.5 * np.sin(2 * (3 - np.pi / 2))) < 1e-11


@pytest.mark.filterwarnings("ignore")  # W0566: of the kink of the dissipation
def test_what_sticks_on_a_kink_is_not_looked_at_without_end() -> None:
    """Its rate is zero but for rounding all along, and so is the margin of the kink: each half of a step is as rough as all of it."""
    text = """
    coordinate Angle q = -0.6 rad;
    kinetic 1/2*0.58 kg.m^2*der(q)^2;
    force sign(abs(0.61*q))*0.42 N.m on q;
    friction 0.48 N.m static 0.672 N.m on q, law = "stick";
    dissipation 0.26 J*abs(der(q));
    coordinate Length x = 0 m; initial der(x) = 0.07 m/s;
    kinetic 1/2*1.15 kg*der(x)^2;
    potential 1.15 kg*9.81 m/s^2*x;
    """
    solution = mechc.loads(text).simulate(stop=1, method="taylor", tolerance=1e-9)
    assert isinstance(solution, mechc.Solution)
    assert solution["q"][-1] == -0.6
    assert solution["x"][-1] == pytest.approx(0.07 - 9.81 / 2, rel=1e-12)


def test_still_states_are_constants_until_they_jump() -> None:
    """x' = c x^2 from 1 until x = 1.25 turns c: 1/x = 1 - t, from 0.2 on 0.6 + t; one slot, as c counts as a constant."""
    model = mechc.loads(
        "state c = 1; state x = 1; equation der(c) = 0 /(1 s); equation der(x) = c*x^2/1 s;"
        "when x > 1.25 then reinit(c, -c); end when;"
    )
    plan = program_with(model.compilation, {"series"}).series
    assert plan is not None
    assert plan.n_slots == 1
    solution = model.simulate(stop=1, method="taylor", tolerance=1e-12, estimate_error=False)
    assert abs(solution.events[0].time - 0.2) < 1e-12
    assert abs(solution["x"][-1] - 1 / 1.6) < 1e-11
    assert solution["c"][-1] == -1


STIFFENED = "coordinate x = 1 m; kinetic 1/2*1 kg*der(x)^2; potential 1/2*1 N/m*x^2 + 1/4*{}*x^4;"
EXPERIMENT = 'experiment(stop = 2 s, tolerance = 1e-12, method = "taylor");'


@pytest.mark.slow
def test_c_program(tmp_path: Path) -> None:
    """Duffing's oscillator x'' = -x - x^3 from 1 by its elliptic function, from a program that stands alone."""
    model = mechc.loads(STIFFENED.format("1 N/m^3") + EXPERIMENT)
    model.compile("c", tmp_path / "duffing")
    binary = tmp_path / "run"
    files = [str(file) for file in (tmp_path / "duffing").glob("*.c")]
    subprocess.run(["cc", "-O1", *files, "-o", str(binary), "-lm"], check=True)
    last = subprocess.run([str(binary)], capture_output=True, text=True, check=True).stdout.split()[-1]
    exact = mpmath.ellipfun("cn", mpmath.sqrt(2) * 2, m=mpmath.mpf(1) / 4)
    assert abs(float(last.split(",")[1]) - float(exact)) < 1e-11


def test_c_program_of_what_has_no_series_is_refused(tmp_path: Path) -> None:
    model = mechc.loads(MASS + "force -1 N/m*abs(x) on x;" + EXPERIMENT)
    with pytest.raises(UsageMistake, match=r"^'taylor' cannot run this model: .*'abs'"):
        model.compile("c", tmp_path / "refused")

"""States that are far smaller than others of their unit: the error of each relative to its own range."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechc
from mechc.presentation.report import report
from mechc.runtime.case import Case
from mechc.runtime.integrate.kernel_run import run_kernel
from mechc.runtime.integrate.solver import SolverOptions
from mechc.runtime.integrate.trajectory import Trajectory
from mechc.runtime.native.build import find_compiler
from mechc.runtime.problem import Array
from mechc.runtime.studies.runs import own_size
from mechc.runtime.studies.runs.simulate import Plan

SMALL = "coordinate Length x = {};initial der(x) = {};kinetic 1/2*1 kg*der(x)^2;potential 1/2*40 N/m*x^2;"
LARGE = (
    "coordinate Length y = 1e5 m;kinetic 1/2*1 kg*der(y)^2;potential 1/2*1 N/m*y^2;experiment(stop = 10 s);"
)
RATE = 40**0.5


def small_motion(run: mechc.Solution, x: float, v: float) -> float:
    """Return the largest true error of x over its own range."""
    exact = x * np.cos(RATE * run.time) + v / RATE * np.sin(RATE * run.time)
    return float(np.abs(run["x"] - exact).max() / np.abs(exact).max())


@pytest.mark.parametrize(("x", "v", "repeated"), [(1e-9, 0.0, False), (0.0, 1e-8, True)])
def test_nanometres_beside_kilometres(x: float, v: float, repeated: bool) -> None:
    """The step is that of the faster one: before, the error was a fifth of the range and called 1e-15."""
    run = mechc.loads(SMALL.format(f"{x} m", f"{v} m/s") + LARGE).simulate()
    error = run.accuracy.error
    assert error is not None
    true = small_motion(run, x, v)
    assert true < 1e-6 and true < 10 * error.by_state["x"]
    assert any("'x' stays below" in remark for remark in run.remarks) is repeated
    head = next(line for line in report(run).splitlines() if "estimated error" in line)
    assert head.endswith("nominal")


WEAK = """\
coordinate Length x = {} m;
coordinate Length y = {} m;
kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
potential 1/2*40 N/m*x^2 + 1/2*1 N/m*y^2;
{}
experiment(stop = 10 s);
"""


@pytest.mark.parametrize(("x", "y"), [(1e-9, 1e5), (0, 1e7)])
@pytest.mark.parametrize("coupling", ["force 1e-14 N/m*y on x;", "potential -1e-14 N/m*x*y;"])
def test_what_hardly_feels_what_is_far_larger(x: float, y: float, coupling: str) -> None:
    """Oscillator driven by one 1e14 times larger: closed form; before, x was off by a tenth and called right to 1e-15."""
    run = mechc.loads(WEAK.format(x, y, coupling)).simulate()
    error = run.accuracy.error
    assert error is not None
    driven = 1e-14 * y / (40 - 1)
    exact = driven * np.cos(run.time) + (x - driven) * np.cos(RATE * run.time)
    true = np.abs(run["x"] - exact).max() / np.abs(exact).max()
    assert true < 1e-6 and true < 10 * error.by_state["x"]


@pytest.mark.skipif(find_compiler() is None, reason="needs the kernel")
def test_steps_of_one_size_are_measured_and_not_repeated(monkeypatch: pytest.MonkeyPatch) -> None:
    made = []

    def noted(case: Case, options: SolverOptions, *reader: Any) -> Trajectory:
        made.append(options)
        return run_kernel(case, options, *reader)

    monkeypatch.setattr("mechc.runtime.studies.runs.companion.run_kernel", noted)
    run = mechc.loads(SMALL.format("0 m", "1e-8 m/s") + LARGE).simulate(method="rk4", step=0.01)
    assert len(made) == 2  # the run and its companion
    error = run.accuracy.error
    assert error is not None and small_motion(run, 0, 1e-8) < 3 * error.by_state["x"]
    assert error.nominal["x"] < 1e-8


def test_what_only_the_error_of_a_run_shows_is_no_size(monkeypatch: pytest.MonkeyPatch) -> None:
    """A coin that rolls upright: its height stays, but for what each step is off by, which a tighter run leaves less of."""
    asked: list[list[int]] = []
    kept = own_size._no_rounding

    def noted(plan: Plan, run: Trajectory, reached: Array, small: list[int]) -> list[int]:
        asked.append(kept(plan, run, reached, small))
        return asked[-1]

    monkeypatch.setattr(own_size, "_no_rounding", noted)
    run = mechc.load(Path(__file__).parents[2] / "examples" / "rolling_coin.mech").simulate()
    assert asked[0] and not any("stays below" in remark for remark in run.remarks)


@pytest.mark.parametrize("example", ["stewart_platform", "falling_box"])
def test_a_velocity_whose_coordinate_is_rounding_is_no_size(
    example: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What goes straight up or down by symmetry: before, runs of 35 and 6 times the steps were made in vain."""
    monkeypatch.setattr(own_size, "trajectory_of", lambda *_: pytest.fail("the run was repeated"))
    run = mechc.load(Path(__file__).parents[2] / "examples" / f"{example}.mech").simulate(
        estimate_error=False
    )
    aside = "der(pose.position[1])" if example == "stewart_platform" else "der(free.position[1])"
    assert 0 < np.abs(run[aside]).max() < 1e-11


def test_rounding_of_a_velocity_beside_a_constraint_is_no_size() -> None:
    """What an assembly leaves of a zero, where nothing else of its unit moves: before, errors were measured against it."""
    run = mechc.loads(
        "coordinate Length x = 0.67 m; initial der(x) = 1.7e-17 m/s; kinetic 1/2*2 kg*der(x)^2; force -1 N.s/m*der(x) on x;"
        "coordinate Angle a = 0.3; initial der(a) = 0.2 rad/s; coordinate Angle b ~ 0.2;"
        "kinetic 1/2*1 kg.m^2*(der(a)^2 + der(b)^2); constraint b = 0.7*sin(a); experiment(stop = 0.5 s);"
    ).simulate()
    error = run.accuracy.error
    assert error is not None and error.nominal["der(x)"] == pytest.approx(0.67 * 0.2 / 0.3)
    assert not any("stays below" in remark for remark in run.remarks)


def test_rounding_of_an_acceleration_in_equilibrium_is_no_size() -> None:
    """A car that stands until it meets a bump: errors were measured against 1e-7 m/s, and corners of its road were held for
    something that the run had passed over, which took 100 000 steps instead of 300."""
    run = mechc.loads(
        "coordinate Length z ~ 0.5 m; coordinate Length w ~ 0.3 m; kinetic 1/2*700 kg*der(z)^2 + 1/2*40 kg*der(w)^2;"
        "potential 9.81 m/s^2*(700 kg*z + 40 kg*w) + 1/2*42 kN/m*(z - w - 0.4 m)^2 + 1/2*380 kN/m*(w - road - 0.3 m)^2;"
        "let road = table(15 m/s*time, {0, 4, 5, 6, 6.5, 7, 8, 10, 14, 60} m, {0, 0, 0, 8, 25, 60, 68, 64, 0, 0} mm, "
        '"smooth", "hold"); damping 3000 N.s/m on z - w; damping 200 N.s/m on w - road;'
        "initial stationary z, w; experiment(stop = 3 s);"
    ).simulate()
    error = run.accuracy.error
    assert error is not None and error.nominal["der(z)"] == pytest.approx(run["z"][0] / 3)
    assert run.statistics.steps < 1000


def test_rounding_of_what_rests_on_a_contact_is_no_size() -> None:
    text = (
        "coordinate x = -0.15 m;initial der(x) = 0.79 m/s;coordinate y = 0 m;initial der(y) = 0 m/s;"
        "kinetic 1/2*1.41 kg*(der(x)^2 + der(y)^2);potential 1.41 kg*9.81 m/s^2*y;"
        "contact floor: y friction 0.33 along der(x - 1.63 m/s*abs(time - 0.11 s));experiment(stop = 1 s);"
    )
    run = mechc.loads(text).simulate(method="taylor", tolerance=1e-9)
    assert [r for r in run.remarks if not r.startswith("looked for narrow events")] == []
    assert run.accuracy.error is not None
    assert run.accuracy.error.largest < 1e-9


@pytest.mark.parametrize(
    "held",
    ["friction 3 N on x;", "potential 3 N*x; contact floor: x;", "contact floor: x friction 9 along der(y);"],
)
def test_rounding_of_what_is_held_all_the_time_is_no_size(held: str) -> None:
    """Forces that cancel leave 1e-17 of an acceleration, and with it 1e-27 m in a first run: measured against that, a millionth of the
    motion took a million steps."""
    text = "coordinate Length x = 0 m; coordinate Length y = 0 m; kinetic 1/2*3 kg*(der(x)^2 + der(y)^2);"
    pushed = "x" if "along" not in held else "y"
    text += f"force 1 N*sin(1 rad/s*time) on {pushed}; force -1 N on x; experiment(stop = 10 s);"
    run = mechc.loads(text + held).simulate(stop=1e-3)
    assert run.statistics.steps < 100
    assert mechc.loads(text + held).simulate().statistics.steps < 1000

"""Fixed-step methods over long times: energy, reversibility, rounding, exact step times, refusals."""

from __future__ import annotations

import numpy as np
import pytest
from kernel_driver import Model, Numbers, Run, run
from kernel_models import COUPLED_PENDULUM, KEPLER, PENDULUM, TWO_SPRINGS

import mechc
from mechc.runtime.native.status import Status

PERIOD = 6.69998665
"""Of the pendulum released at 1 rad: 4 K(sin 1/2), to the digits that counting periods needs."""

METHODS = ("verlet", "gauss2", "gauss4", "gauss6", "gauss8", "rattle", "lobatto4", "lobatto6")


def at_steps(step: float, stop: float, count: int) -> Numbers:
    times: Numbers = step * np.unique(np.round(np.linspace(0, stop, count) / step))[:-1]
    return times


def pendulum_energy(rows: Numbers) -> Numbers:
    """Without the cancellation of 1 - cos."""
    energies: Numbers = rows[:, 1] ** 2 / 2 + 2 * np.sin(rows[:, 0] / 2) ** 2
    return energies


def parts(values: Numbers) -> list[Numbers]:
    return np.array_split(values, 4)


LONG = [
    ("verlet", 0.11),
    ("gauss2", 0.19),
    ("gauss4", 0.31),
    ("gauss6", 0.47),
    ("gauss8", 0.73),
    ("rattle", 0.19),
    ("lobatto4", 0.31),
    ("lobatto6", 0.47),
]


@pytest.mark.parametrize(("method", "step"), LONG)
def test_energy_of_the_pendulum_over_10000_periods(method: str, step: float) -> None:
    """The energy error of the last quarter is no larger than that of the first, and its mean stays."""
    stop = 1e4 * PERIOD
    grid = at_steps(step, stop, 10**6)  # every step: a coarser grid would beat with the period
    one = run(PENDULUM, method, (1.0, 0.0), stop, step=step, grid=grid)
    assert one.status == Status.REACHED
    error = pendulum_energy(one.rows) - pendulum_energy(one.rows[:1])
    first, _, _, last = parts(error)
    assert np.abs(last).max() < 1.02 * np.abs(first).max()
    assert abs(last.mean() - first.mean()) < 0.01 * np.ptp(first)


@pytest.mark.parametrize(
    ("method", "step"), [("verlet", 2e-3), ("gauss4", 0.02), ("gauss6", 0.05), ("gauss8", 0.1)]
)
def test_energy_of_an_orbit_over_1000_periods(method: str, step: float) -> None:
    """Eccentricity 0.6. The maximum is seen in each quarter: the orbit turns through the grid."""
    stop = 2e3 * np.pi
    grid = at_steps(step, stop, 20_000)
    one = run(KEPLER, method, (0.4, 0.0, 0.0, 2.0), stop, step=step, grid=grid)
    x, y, vx, vy = one.rows.T
    error = (vx**2 + vy**2) / 2 - 1 / np.hypot(x, y) + 0.5
    first, _, _, last = parts(error)
    assert np.abs(last).max() < 1.05 * np.abs(first).max()
    assert np.abs(x * vy - y * vx - 0.8).max() < 1e-13  # a quadratic invariant


def test_explicit_method_drifts_where_symplectic_ones_do_not() -> None:
    """What the tests above would see: the energy of rk4 falls in proportion to time."""
    stop, step = 1e3 * PERIOD, 0.2
    one = run(PENDULUM, "rk4", (1.0, 0.0), stop, step=step, grid=at_steps(step, stop, 4000))
    error = pendulum_energy(one.rows) - pendulum_energy(one.rows[:1])
    assert np.abs(parts(error)[3]).max() > 3 * np.abs(parts(error)[0]).max()


@pytest.mark.parametrize(("method", "step"), [("gauss6", 0.01), ("gauss8", 0.02), ("lobatto6", 0.02)])
def test_rounding_grows_as_the_square_root_of_time(method: str, step: float) -> None:
    """Steps so short that rounding alone is seen: sqrt(steps) eps h per unit of energy is the expectation.

    1.3e-15 at most was measured, without compensated sums 1e-14 to 2e-14.
    """
    stop = 500 * PERIOD
    one = run(PENDULUM, method, (1.0, 0.0), stop, step=step, grid=at_steps(step, stop, 1000))
    error = pendulum_energy(one.rows) - pendulum_energy(one.rows[:1])
    assert np.abs(error).max() < 4e-15


@pytest.mark.parametrize("method", METHODS)
def test_reversibility(method: str) -> None:
    """Forwards, with the velocities turned round, and back: 3e-15 was measured."""
    model, start = (PENDULUM, np.array([1.0, 0.2]))
    if method[:4] in ("ratt", "loba"):
        model, start = COUPLED_PENDULUM, np.array([0.1, 0.5, 0.0, 0.3])
    turn = np.repeat([1.0, -1.0], model.nq)
    there = run(model, method, start, 50.0, step=0.05, p=(1.0,))
    back = run(model, method, turn * there.y, 50.0, step=0.05, p=(1.0,))
    assert back.error(turn * start) < 1e-13
    assert np.abs(there.y - start).max() > 0.1


def test_steps_are_multiples_of_the_step() -> None:
    """0.1 is not a binary fraction: times that add up would be off by 2e-10 after a million steps."""
    clock = Model({"rhs": "out[0] = 1; out[1] = t;"}, nx=2)
    one = run(clock, "gauss2", (0.0, 0.0), 1e5, step=0.1)
    assert one.report["steps"] == 1_000_000
    assert one.report["dt_min"] == one.report["dt_max"] == 0.1
    assert one.report["t"] == 1e5
    assert one.y[0] == pytest.approx(1e5, rel=1e-15)
    assert one.y[1] == pytest.approx(5e9, rel=1e-15)


def test_last_step_ends_at_the_stop() -> None:
    one = run(PENDULUM, "gauss4", (1.0, 0.0), 1.05, step=0.1)
    assert one.report["steps"] == 11
    assert one.report["t"] == 1.05
    assert one.report["dt_min"] == pytest.approx(0.05, rel=1e-12)
    exact = run(PENDULUM, "gauss8", (1.0, 0.0), 1.05, step=0.01)
    assert one.error(exact.y) < 1e-7


def stiff_run(model: Model, step: float) -> Run:
    return run(model, "gauss4", (1.0, 1e-3, 0.0, 0.0), 10.0, step=step, p=(1e8, 1e4))


def test_gauss_goes_over_to_newton_where_iteration_does_not_contract() -> None:
    """h^2 k = 1e6: no fixed-point iteration can do it; the slow spring is as good as ever."""
    one = stiff_run(TWO_SPRINGS, 0.1)
    assert one.status == Status.REACHED
    assert one.report["jacobians"] > 0
    soft = run(TWO_SPRINGS, "gauss4", (1.0, 0.0, 0.0, 0.0), 10.0, step=0.1, p=(1.0, 0.0))
    assert soft.report["jacobians"] == 0
    assert np.abs(one.y - soft.y)[[0, 2]].max() < 1e-12
    assert one.report["iterations"] < 4 * one.report["steps"] + 200


def test_gauss_without_a_jacobian_says_that_the_step_is_too_large() -> None:
    functions = {"rhs": TWO_SPRINGS.functions["rhs"]}
    one = stiff_run(Model(functions, nq=2, nv=2, sizes={"np": 2}), 0.1)
    assert one.status == Status.NOT_CONVERGED


def test_newton_and_fixed_point_iteration_agree() -> None:
    """The same stages by either way: a coupled model, once with a step where both work."""
    for method in ("gauss2", "gauss4", "gauss6", "gauss8"):
        damped = run(TWO_SPRINGS, method, (1.0, 1.0, 0.0, 0.0), 0.5, step=0.01, p=(100.0, 1.0))
        assert damped.report["jacobians"] == 0
        stiff = run(
            TWO_SPRINGS, method, (1.0, 0.01, 0.0, 0.0), 3.0, step=0.1, p=(1e4, 100.0), grid=(0.55, 3.0)
        )
        fine = run(
            TWO_SPRINGS, method, (1.0, 0.01, 0.0, 0.0), 3.0, step=1e-4, p=(1e4, 100.0), grid=(0.55, 3.0)
        )
        assert stiff.report["jacobians"] > 0
        assert fine.report["jacobians"] == 0
        bound = {"gauss2": 3e-3, "gauss4": 2e-6}.get(method, 1e-6)
        assert np.abs(stiff.rows[:, [0, 2]] - fine.rows[:, [0, 2]]).max() < bound


def test_undefined_derivatives_end_a_fixed_step_run() -> None:
    root = Model({"rhs": "out[0] = sqrt(1 - t);"}, nx=1)
    for method in ("gauss4", "rk4"):
        one = run(root, method, (0.0,), 2.0, step=0.1)
        assert one.status == Status.NOT_FINITE
        assert one.report["failed_index"] == 0
        assert 0.85 < one.report["t"] <= 1


def test_rotations_are_integrated_and_stay_of_unit_length() -> None:
    """A rotation about one axis, at a rate that changes: the angle is known."""
    turning = Model(
        {"rhs": "out[0] = -y[3]*y[6]/2; out[1] = y[2]*y[6]/2; out[2] = -y[1]*y[6]/2; out[3] = y[0]*y[6]/2;"
         "out[4] = 0; out[5] = 0; out[6] = cos(t);"},
        nq=4, nv=3, rotations=(0,),
    )  # fmt: skip
    one = run(turning, "gauss6", (1.0, 0, 0, 0, 0, 0, 0), 2.0, step=0.05)
    half = (1 - np.cos(2.0)) / 2
    assert one.error(np.array([np.cos(half), 0, 0, np.sin(half), 0, 0, np.sin(2.0)])) < 1e-10


def test_sums_of_verlet_are_compensated() -> None:
    """Uniform motion: a million additions of 0.01 without compensation would be off by 1e-12 of the sum."""
    free = Model({"rhs": "out[0] = y[1]; out[1] = 0;"}, nq=1, nv=1, sizes={"separable": 1})
    one = run(free, "verlet", (0.0, 0.1), 1e5, step=0.1)
    assert one.y[0] == pytest.approx(1e4, rel=4e-16)


@pytest.mark.parametrize("method", ["gauss2", "gauss4", "gauss6", "gauss8"])
def test_velocities_that_are_not_rates_of_coordinates(method: str) -> None:
    """q' = (1 + q^2) v, v' = -q / (1 + q^2): q = tan(x) with x' = v, v' = -sin(2 x) / 2. From q = 0, where q' = v."""
    model = Model({"rhs": "mech_real s = 1 + y[0]*y[0]; out[0] = s * y[1]; out[1] = -y[0] / s;"}, nq=1, nv=1)
    twice = run(PENDULUM, "gauss8", (0.0, 1.0), 3.0, step=0.01)  # 2 x is a pendulum
    errors = [
        abs(run(model, method, (0.0, 0.5), 3.0, step=step).y[0] - np.tan(twice.y[0] / 2))
        for step in (0.3, 0.15)
    ]
    order = int(method[5:])
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.5)


def test_stages_are_predicted_from_the_last_step() -> None:
    """Iterations per step to the last digit: 3.2, without the prediction 4.5, were measured."""
    one = run(KEPLER, "gauss8", (0.4, 0.0, 0.0, 2.0), 100.0, step=0.02)
    assert one.report["iterations"] < 3.8 * one.report["steps"]


SPRING = Model(
    {
        "rhs": "out[0] = y[1]; out[1] = -p[0] * y[0];",
        "momentum": "out[0] = y[1];",
        "force": "out[0] = -p[0] * y[0];",
        "mass": "out[0] = 1;",
    },
    nq=1,
    nv=1,
    sizes={"np": 1},
)


@pytest.mark.parametrize("method", ["gauss2", "gauss4", "gauss6", "gauss8", "rattle", "lobatto4", "lobatto6"])
def test_iterations_end_in_any_unit_of_time(method: str) -> None:
    """From rest to velocities a million times what counts as 1, and the reverse: the same errors."""
    errors = []
    for omega in (1e-6, 1.0, 1e6):
        stop = 100 / omega
        one = run(SPRING, method, (1.0, 0.0), stop, step=0.1 / omega, p=(omega**2,))
        assert one.status == Status.REACHED
        errors.append(one.y[0] - np.cos(100.0))
    assert errors == pytest.approx([errors[1]] * 3, rel=1e-4, abs=1e-12)


SWING = """\
coordinate theta = 1 rad;
kinetic 1/2*(1 kg.m^2)*der(theta)^2;
potential -(9.81 J)*cos(theta);
"""
COUNTED = SWING + "discrete Integer n = 0;\nwhen theta < 0 rad then n := n + 1; end when;\n"


@pytest.mark.parametrize("method", METHODS)
def test_a_step_that_is_repeated_up_to_an_event_begins_where_the_first_one_did(method: str) -> None:
    """Momenta and rounding that a method keeps are those of the end of the step that is taken back."""
    plain, counted = (
        mechc.loads(text).simulate(method=method, step=0.01, stop=3, estimate_error=False)
        for text in (SWING, COUNTED)
    )
    assert counted["n"][-1] == 2
    assert plain.accuracy.energy is not None and counted.accuracy.energy is not None
    assert plain.accuracy.energy.relative is not None and counted.accuracy.energy.relative is not None
    assert counted.accuracy.energy.relative <= 1.1 * plain.accuracy.energy.relative + 1e-14

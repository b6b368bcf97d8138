"""Constraints: projection after each step, and the methods that keep them by themselves."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from kernel_driver import Numbers, run
from kernel_models import CARTESIAN_PENDULUM, PENDULUM, SPHERICAL_PENDULUM, TILTED_BODY
from msgspec.structs import replace

from mechc.runtime.native.status import Status

START = {2: (0.6, -0.8, 0.0, 0.0), 3: (0.6, 0.0, -0.8, 0.0, 0.7, 0.0)}


def energy(rows: Numbers) -> Numbers:
    n = rows.shape[1] // 2
    kinetic: Numbers = (rows[:, n:] ** 2).sum(axis=1) / 2
    return kinetic + rows[:, n - 1]


def off_the_rod(rows: Numbers) -> tuple[float, float]:
    n = rows.shape[1] // 2
    length = (rows[:, :n] ** 2).sum(axis=1) - 1
    return float(np.abs(length).max()), float(np.abs((rows[:, :n] * rows[:, n:]).sum(axis=1)).max())


@pytest.mark.parametrize("method", ["dop853", "auto", "rk4", "gauss4"])
def test_projection_keeps_the_constraints_to_rounding(method: str) -> None:
    grid: Numbers = 0.05 * np.arange(1, 2001, dtype=np.float64)
    step = 0.05 if method in ("rk4", "gauss4") else 0.0
    one = run(CARTESIAN_PENDULUM, method, START[2], 100.0, step=step, tolerance=1e-8, grid=grid)
    assert one.status == Status.REACHED
    at_end = one.y[None]
    assert max(off_the_rod(at_end)) < 1e-15
    if step:
        assert max(off_the_rod(one.rows)) < 1e-15
    assert 1e-12 < one.report["drift_position"] < 1e-4
    assert 0.2 < one.drift[0] / one.report["drift_position"] < 5
    if method == "gauss4":  # keeps x v by itself, which is quadratic
        assert one.report["drift_velocity"] < 1e-15
    else:
        assert 1e-12 < one.report["drift_velocity"] < 1e-4


def test_projected_motion_is_that_in_the_angle() -> None:
    """Both at 1e-10; without projection the rod of the Cartesian one would grow by 1e-8."""
    angle = run(PENDULUM, "dop853", (math.asin(0.6), 0.0), 100.0, tolerance=1e-13)
    theta, omega = angle.y
    exact = np.array([math.sin(theta), -math.cos(theta), math.cos(theta) * omega, math.sin(theta) * omega])
    one = run(CARTESIAN_PENDULUM, "dop853", START[2], 100.0, tolerance=1e-10)
    assert one.error(exact) < 5e-9
    functions = {k: f for k, f in CARTESIAN_PENDULUM.functions.items() if k in ("rhs",)}
    free = run(
        replace(CARTESIAN_PENDULUM, functions=functions, sizes={}), "dop853", START[2], 100.0, tolerance=1e-6
    )
    kept = run(CARTESIAN_PENDULUM, "dop853", START[2], 100.0, tolerance=1e-6)
    assert off_the_rod(free.y[None])[0] > 1e-5
    assert off_the_rod(kept.y[None])[0] < 1e-15
    assert kept.error(exact) < free.error(exact)


def test_tighter_tolerances_drift_less() -> None:
    drifts = [
        run(SPHERICAL_PENDULUM, "dop853", START[3], 20.0, tolerance=10.0**-k).report["drift_position"]
        for k in (4, 6, 8, 10)
    ]
    assert all(later < earlier / 10 for earlier, later in itertools.pairwise(drifts)), drifts


def test_velocity_of_a_start_off_the_constraints_is_corrected() -> None:
    """The component of the velocity along the rod is gone after one step, and told as drift."""
    one = run(CARTESIAN_PENDULUM, "dop853", (0.0, -1.0, 0.5, 0.01), 0.01, step=0.01)
    assert abs(one.y[:2] @ one.y[2:]) < 1e-15
    assert one.drift[1] == pytest.approx(0.01, rel=0.1)


def test_projection_that_fails_stops_the_run() -> None:
    """A correction that always points the wrong way, and one that is undefined."""
    for correction in ("y[{}]", "0 / (y[{}] - y[{}])"):
        body = "".join(f"out[{i}] = {correction.format(i, i)};" for i in range(2)) + "out[2] = 1;"
        model = replace(
            CARTESIAN_PENDULUM, functions={**CARTESIAN_PENDULUM.functions, "project_position": body}
        )
        for method, step in (("dop853", 0.0), ("rk4", 0.1)):
            one = run(model, method, START[2], 1.0, step=step)
            assert one.status == Status.OFF_CONSTRAINTS
            assert one.report["t"] == 0
            assert one.y.tolist() == list(START[2])


def test_rotations_are_displaced_and_normalised() -> None:
    """A body that turns about one axis like a pendulum: errors of the other two are taken out."""
    model = TILTED_BODY
    half = 0.25
    start = (math.cos(half), 0, 0, math.sin(half), 1e-3, 0, 0.1)
    one = run(model, "dop853", start, 10.0, tolerance=1e-9)
    assert one.status == Status.REACHED
    assert np.abs(one.y[[1, 2, 4, 5]]).max() < 1e-16
    assert (one.y[:4] ** 2).sum() == pytest.approx(1, abs=1e-15)
    exact = run(PENDULUM, "dop853", (2 * half, 0.1), 10.0, tolerance=1e-12)
    assert 2 * math.atan2(one.y[3], one.y[0]) == pytest.approx(exact.y[0], abs=1e-7)
    assert one.drift[2] == pytest.approx(1e-3, rel=1e-6)


@pytest.mark.parametrize(("method", "step"), [("rattle", 0.03), ("lobatto4", 0.07), ("lobatto6", 0.13)])
@pytest.mark.parametrize("n", [2, 3])
def test_energy_and_momentum_of_hanging_points_over_long_times(method: str, step: float, n: int) -> None:
    """About 1000 periods: energy error bounded, angular momentum and constraints to rounding."""
    model = CARTESIAN_PENDULUM if n == 2 else SPHERICAL_PENDULUM
    stop = 7e3
    grid: Numbers = (step * np.arange(int(stop / step), dtype=np.float64))[:: max(1, int(0.1 / step))]
    one = run(model, method, START[n], stop, step=step, grid=grid)
    assert one.status == Status.REACHED
    error = energy(one.rows) - energy(one.rows[:1])
    first, _, _, last = np.array_split(error, 4)
    assert np.abs(last).max() < 1.02 * np.abs(first).max() + 1e-14
    assert abs(last.mean() - first.mean()) < 0.01 * np.ptp(first) + 1e-14
    length, rate = off_the_rod(one.rows)
    assert length < 2e-15
    assert rate < 2e-15
    if n == 3:
        x, y, _, vx, vy, _ = one.rows.T
        assert np.abs(x * vy - y * vx - 0.42).max() < 1e-12
    assert one.report["drift_position"] == 0


@pytest.mark.parametrize("method", ["rattle", "lobatto4", "lobatto6"])
def test_constrained_methods_are_reversible(method: str) -> None:
    start = np.array(START[3])
    turn = np.array([1, 1, 1, -1, -1, -1])
    there = run(SPHERICAL_PENDULUM, method, start, 30.0, step=0.05)
    back = run(SPHERICAL_PENDULUM, method, turn * there.y, 30.0, step=0.05)
    assert back.error(turn * start) < 2e-13

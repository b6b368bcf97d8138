"""radau5 and auto: stiff models against values of many digits and closed forms, failures, linear algebra."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from kernel_driver import Model, run
from kernel_models import BODY_WITH_SPRING, KEPLER, PENDULUM, TWO_SPRINGS, VAN_DER_POL

from mechc.runtime.native.status import Status

RELAXATION = {  # x'' = 10 (1 - x^2) x' - x from (2, 0), by a Taylor method in 256 bits
    1.0: (1.93385290891147127779, -0.0704235175943980156151),
    10.0: (-1.97120695682916884899, 0.0681732324531043887716),
    50.0: (-1.83790651785654317813, 0.0770440814213512677092),
}


@pytest.mark.parametrize("method", ["radau5", "auto", "dop853"])
@pytest.mark.parametrize("stop", [1.0, 10.0, 50.0])
def test_relaxation_oscillation(method: str, stop: float) -> None:
    """Errors within 100 times the tolerance: at most 15 times were measured."""
    for tolerance in (1e-6, 1e-8, 1e-10):
        one = run(VAN_DER_POL, method, (2.0, 0.0), stop, p=(10.0, 1.0), tolerance=tolerance)
        assert one.status == Status.REACHED
        assert one.error(np.array(RELAXATION[stop])) < 100 * tolerance


@pytest.mark.parametrize("method", ["radau5", "auto"])
def test_van_der_pol_with_a_million(method: str) -> None:
    """E. Hairer, G. Wanner, Solving ODEs II: y1(2) = 0.1706167732170469e1 from (2, 0)."""
    one = run(VAN_DER_POL, method, (2.0, 0.0), 2.0, p=(1e6, 1e6), tolerance=1e-9)
    assert one.status == Status.REACHED
    assert abs(one.y[0] - 1.706167732170469) < 1e-8
    assert one.report["steps"] < 2500
    if method == "auto":
        assert one.report["switches"] in (3, 5, 7)  # to and fro at each jump of the oscillation
        assert one.report["stiff_time"] < 0.01


@pytest.mark.parametrize("method", ["radau5", "auto"])
def test_stiff_spring_beside_a_soft_one(method: str) -> None:
    """Frequency 1e6, critically damped, released from 1e-3; after that the soft one alone is seen."""
    omega = 1e6
    one = run(
        TWO_SPRINGS, method, (1.0, 1e-3, 0.0, 0.0), 10.0, p=(omega**2, 2 * omega), tolerance=1e-9,
        nominal=(1, 1e-3, 1, 1e3),
    )  # fmt: skip
    assert one.status == Status.REACHED
    assert one.error(np.array([math.cos(10), 0, -math.sin(10), 0])) < 1e-8


def test_undamped_fast_oscillation_below_the_tolerance() -> None:
    one = run(TWO_SPRINGS, "radau5", (1.0, 1e-14, 0.0, 0.0), 10.0, p=(1e12, 0.0), tolerance=1e-9)
    assert one.status == Status.REACHED
    assert one.error(np.array([math.cos(10), 0, -math.sin(10), 0])) < 1e-8
    assert one.report["steps"] < 300


def test_steps_do_not_depend_on_the_stiffness() -> None:
    """On the slow motion; 1 to 1e8 times the stiffness changes the number of steps by less than 10 %."""
    steps = []
    for omega in (1e2, 1e4, 1e6, 1e8):
        one = run(TWO_SPRINGS, "radau5", (1.0, 0.0, 0.0, 0.0), 20.0, p=(omega**2, omega), tolerance=1e-8)
        assert one.error(np.array([math.cos(20), 0, -math.sin(20), 0])) < 1e-7
        steps.append(one.report["steps"])
    assert max(steps) < 1.1 * min(steps), steps
    explicit = run(TWO_SPRINGS, "dop853", (1.0, 1e-3, 0.0, 0.0), 1.0, p=(1e8, 1e4), tolerance=1e-8)
    assert explicit.report["steps"] > 5 * max(steps)  # for a twentieth of the time
    assert explicit.report["stiff_time"] < 1


def test_auto_stays_explicit_where_nothing_is_stiff() -> None:
    for model, start in ((PENDULUM, (1.0, 0.0)), (KEPLER, (0.4, 0.0, 0.0, 2.0))):
        auto = run(model, "auto", start, 200.0, tolerance=1e-8)
        explicit = run(model, "dop853", start, 200.0, tolerance=1e-8)
        assert auto.report["switches"] == 0
        assert auto.y.tobytes() == explicit.y.tobytes()


def test_auto_without_a_jacobian_goes_on_explicitly() -> None:
    functions = {"rhs": VAN_DER_POL.functions["rhs"]}
    bare = Model(functions, nx=2, sizes={"np": 2})
    one = run(bare, "auto", (2.0, 0.0), 0.05, p=(1e4, 1e4), tolerance=1e-6)
    assert one.status == Status.REACHED
    assert one.report["switches"] == 0
    assert one.report["stiff_time"] < 0.05


def test_grid_of_auto_is_good_on_both_sides_of_a_change() -> None:
    grid = np.linspace(0, 2, 400)
    auto = run(VAN_DER_POL, "auto", (2.0, 0.0), 2.0, p=(1e4, 1e4), tolerance=1e-8, grid=grid)
    exact = run(VAN_DER_POL, "radau5", (2.0, 0.0), 2.0, p=(1e4, 1e4), tolerance=1e-13, grid=grid)
    assert auto.report["n_grid"] == 400
    assert auto.report["switches"] > 2
    assert np.abs(auto.rows[:, 0] - exact.rows[:, 0]).max() < 1e-6


def test_newton_uses_the_whole_structure() -> None:
    """Rotation, spring, filter: against dop853. Wrong elements of a reduced matrix would cost iterations."""
    start = (1.0, 0, 0, 0, 0.2, 0.1, 1.0, 0.1, 0.0, 0.5)
    exact = run(BODY_WITH_SPRING, "dop853", start, 10.0, p=(4.0, 0.1), tolerance=1e-12)
    one = run(BODY_WITH_SPRING, "radau5", start, 10.0, p=(4.0, 0.1), tolerance=1e-9)
    assert one.status == Status.REACHED
    assert one.error(exact.y) < 1e-7
    assert one.report["rejected"] == 0
    assert one.report["iterations"] < 3 * one.report["steps"]
    assert abs((one.y[:4] ** 2).sum() - 1) < 1e-15


@pytest.mark.parametrize("method", ["radau5", "auto", "gauss6", "verlet", "lobatto4"])
def test_slices_and_snapshots_change_no_bit(method: str) -> None:
    """Each run is made twice, the second time from a snapshot taken after its first slice."""
    model, start, p = (VAN_DER_POL, (2.0, 0.0), (1e5, 1e5)) if method in ("radau5", "auto") else (
        PENDULUM, (1.0, 0.0), ()
    )  # fmt: skip
    whole = run(model, method, start, 2.0, step=0.0 if p else 0.01, p=p)
    for slice_steps in (1, 7, 130):
        part = run(model, method, start, 2.0, step=0.0 if p else 0.01, p=p, slice_steps=slice_steps)
        assert part.status == Status.REACHED
        assert part.y.tobytes() == whole.y.tobytes()


DRIVEN = Model(
    {"rhs": "out[0] = -1000 * (y[0] - u[0]);", "jacobian": "out[0] = -1000;", "inputs": "out[0] = 0;"},
    nx=1,
    entries=((0, 0),),
    sizes={"nu": 1},
)


def test_steps_end_at_the_jumps_of_inputs() -> None:
    """A lag of 1 ms after 1 until t = 1/2, then 3: closed form on both sides."""
    table = (1, (0.0, 0.5), (1.0, 3.0))
    grid = (0.5, 0.501, 0.502, 1.0)
    one = run(
        DRIVEN, "radau5", (0.0,), 1.0, tolerance=1e-9, tables=[table], stops=[0.5], grid=grid, max_step=0.2
    )
    assert one.status == Status.REACHED
    assert one.rows[0, 0] == pytest.approx(1, abs=1e-9)
    # a jump of 2 and errors of the dense output: the tolerance to the power of 2/3
    assert one.rows[1:, 0] == pytest.approx([3 - 2 * math.exp(-1000 * (t - 0.5)) for t in grid[1:]], abs=1e-6)


def test_failures_of_an_implicit_run_tell_where_and_what() -> None:
    root = Model({"rhs": "out[0] = sqrt(1 - t);", "jacobian": "out[0] = 0;"}, nx=1, entries=((0, 0),))
    one = run(root, "radau5", (0.0,), 2.0)
    assert one.status == Status.NOT_FINITE
    assert one.report["failed_index"] == 0
    assert 0.999 < one.report["t"] <= 1
    blow_up = Model({"rhs": "out[0] = y[0]*y[0];", "jacobian": "out[0] = 2*y[0];"}, nx=1, entries=((0, 0),))
    one = run(blow_up, "radau5", (1.0,), 2.0)
    assert one.status in (Status.STEP_TOO_SMALL, Status.NOT_FINITE, -4)
    assert one.report["t"] == pytest.approx(1, abs=1e-6)


def test_error_falls_with_the_tolerance() -> None:
    start = (0.6, 0.0, 0.0, math.sqrt(7 / 3))
    exact = run(KEPLER, "gauss8", start, 6.0, step=1 / 64, quad=True)
    errors = [run(KEPLER, "radau5", start, 6.0, tolerance=10.0**-k).error(exact.y) for k in (4, 6, 8, 10, 12)]
    assert all(later < earlier / 20 for earlier, later in itertools.pairwise(errors)), errors
    assert errors[-1] < 3e-11


OVERDAMPED = Model({"rhs": "out[0] = y[1]; out[1] = -4 * y[0] - 10 * y[1];"}, nq=1, nv=1)


@pytest.mark.parametrize("tolerance", [1e-6, 1e-8, 1e-10, 1e-12])
def test_values_between_steps_that_stability_limits(tolerance: float) -> None:
    """Where h lambda is near the end of the domain of stability the polynomials of dop853 magnify what is left of the
    fast motion: errors of 250 to 7000 times the tolerance, if only those at the ends of steps are controlled."""
    root = math.sqrt(21)
    grid = np.linspace(0.01, 10, 500)
    exact = np.exp(-5 * grid) * (np.cosh(root * grid) + 5 / root * np.sinh(root * grid))
    one = run(OVERDAMPED, "dop853", (1.0, 0.0), 10.0, tolerance=tolerance, grid=grid)
    assert one.status == Status.REACHED
    assert np.abs(one.rows[:, 0] - exact).max() < 50 * tolerance
    plain = run(OVERDAMPED, "dop853", (1.0, 0.0), 10.0, tolerance=tolerance)
    assert plain.report["steps"] <= one.report["steps"] < 1.3 * plain.report["steps"]

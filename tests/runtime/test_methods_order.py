"""Measured orders of the kernel's methods, those above 4 in quadruple precision, and their coefficients."""

from __future__ import annotations

import re
from fractions import Fraction

import mpmath
import numpy as np
import pytest
from kernel_driver import Model, Numbers, run
from kernel_models import (
    CARTESIAN_PENDULUM,
    COUPLED_PENDULUM,
    KEPLER,
    PENDULUM,
    PUSHED_PENDULUM,
    SPHERICAL_PENDULUM,
    VAN_DER_POL,
)

from mechc.runtime.methods import KERNEL_METHODS
from mechc.runtime.native.kernel import kernel_methods, kernel_sources, load_kernel
from mechc.runtime.native.status import Status

CART_START = (0.1, 0.5, 0.0, 0.3)
ROD_ENDS = (Fraction(6, 10), Fraction(-8, 10))


def on_the_rod(n: int) -> tuple[Numbers, Numbers]:
    """The point (0.6, [0,] -0.8) with a velocity along the circle of latitude, as sums of doubles."""
    start, low = np.zeros(2 * n), np.zeros(2 * n)
    for place, value in zip((0, n - 1), ROD_ENDS, strict=True):
        start[place] = float(value)
        low[place] = float(value - Fraction(start[place]))
    if n == 3:
        start[n + 1] = 0.75
    return start, low


def as_doubles(values: list[mpmath.mpf]) -> tuple[Numbers, Numbers]:
    high = [float(value) for value in values]
    return np.array(high), np.array([float(v - mpmath.mpf(h)) for v, h in zip(values, high, strict=True)])


def of_the_angle(stop: float) -> tuple[Numbers, Numbers]:
    """The plane motion from ``on_the_rod`` by gauss8 in the angle, in Cartesian coordinates."""
    with mpmath.workdps(40):
        start, low = as_doubles([mpmath.asin(mpmath.mpf(6) / 10), mpmath.mpf(0)])
        end = run(PENDULUM, "gauss8", start, stop, step=1 / 64, low=low, quad=True)
        theta, omega = (mpmath.mpf(h) + mpmath.mpf(r) for h, r in zip(end.y, end.low, strict=True))
        sine, cosine = mpmath.sin(theta), mpmath.cos(theta)
        return as_doubles([sine, -cosine, cosine * omega, sine * omega])


def slopes(steps: tuple[float, ...], errors: list[float]) -> Numbers:
    return np.diff(np.log(errors)) / np.diff(np.log(steps))


NAMES = {2: "pendulum", 3: "pushed", 4: "cart"}
UNCONSTRAINED = [
    ("verlet", 2, PENDULUM, (1.0, 0.0), (0.1, 0.05, 0.025), False),
    ("gauss2", 2, PENDULUM, (1.0, 0.0), (0.1, 0.05, 0.025), False),
    ("gauss4", 4, PENDULUM, (1.0, 0.0), (0.2, 0.1, 0.05), False),
    ("gauss6", 6, PENDULUM, (1.0, 0.0), (0.2, 0.1, 0.05), True),
    ("gauss8", 8, PENDULUM, (1.0, 0.0), (0.2, 0.1, 0.05), True),
    ("gauss6", 6, COUPLED_PENDULUM, CART_START, (0.1, 0.05, 0.025), True),
    ("gauss8", 8, COUPLED_PENDULUM, CART_START, (0.1, 0.05, 0.025), True),
    ("rattle", 2, COUPLED_PENDULUM, CART_START, (0.05, 0.025, 0.0125), False),
    ("lobatto4", 4, COUPLED_PENDULUM, CART_START, (0.1, 0.05, 0.025), False),
    ("lobatto6", 6, COUPLED_PENDULUM, CART_START, (0.1, 0.05, 0.025), True),
    ("verlet", 2, PUSHED_PENDULUM, (1.0, 0.0, 0.0), (0.05, 0.025, 0.0125), False),
    ("rattle", 2, PUSHED_PENDULUM, (1.0, 0.0, 0.0), (0.05, 0.025, 0.0125), False),
    ("lobatto4", 4, PUSHED_PENDULUM, (1.0, 0.0, 0.0), (0.1, 0.05, 0.025), False),
    ("lobatto6", 6, PUSHED_PENDULUM, (1.0, 0.0, 0.0), (0.1, 0.05, 0.025), True),
    ("rk4", 4, COUPLED_PENDULUM, CART_START, (0.05, 0.025, 0.0125), False),
    ("dop853", 8, PENDULUM, (1.0, 0.0), (0.1, 0.05, 0.025), True),
    ("taylor", 7, PENDULUM, (1.0, 0.0), (0.05, 0.025, 0.0125), True),
]


@pytest.mark.parametrize(
    ("method", "order", "model", "start", "steps", "quad"),
    UNCONSTRAINED,
    ids=[f"{case[0]}-{NAMES[case[2].ny]}" for case in UNCONSTRAINED],
)
def test_order(
    method: str, order: int, model: Model, start: tuple[float, ...], steps: tuple[float, ...], quad: bool
) -> None:
    """Against gauss8 with a step of 1/64 in quadruple precision, good to 1e-19 at least."""
    p = (1.0,)
    exact = run(model, "gauss8", start, 2.0, step=1 / 64, p=p, quad=True)
    tolerance = 1e-3 if method in ("dop853", "taylor") else 1e-8  # the largest step is the step
    errors = []
    for step in steps:
        one = run(model, method, start, 2.0, step=step, max_step=step, p=p, quad=quad, tolerance=tolerance)
        assert one.status == Status.REACHED
        assert one.report["rejected"] == 0
        errors.append(one.error(exact.y, exact.low))
    assert np.abs(slopes(steps, errors) - order).max() < 0.1, errors


@pytest.mark.parametrize("model", [CARTESIAN_PENDULUM, SPHERICAL_PENDULUM], ids=["plane", "space"])
@pytest.mark.parametrize(
    ("method", "order", "steps"),
    [
        ("rattle", 2, (0.125, 0.0625, 0.03125)),
        ("lobatto4", 4, (0.125, 0.0625, 0.03125)),
        ("lobatto6", 6, (0.125, 0.0625, 0.03125)),
        ("rk4", 4, (0.03125, 0.015625, 0.0078125)),
        ("gauss2", 2, (0.0625, 0.03125, 0.015625)),
        ("gauss4", 4, (0.125, 0.0625, 0.03125)),
        ("gauss6", 6, (0.125, 0.0625, 0.03125)),
        ("gauss8", 8, (0.25, 0.125, 0.0625)),
        ("dop853", 8, (0.03125, 0.015625)),
    ],
)
def test_order_with_constraints(model: Model, method: str, order: int, steps: tuple[float, ...]) -> None:
    """All but the first three are projected after each step. In the plane the reference is gauss8 in the angle."""
    start, low = on_the_rod(model.nq)
    if model.nq == 2:
        exact, exact_low = of_the_angle(1.5)
    else:
        reference = run(model, "gauss8", start, 1.5, step=1 / 128, low=low, quad=True)
        exact, exact_low = reference.y, reference.low
    errors = []
    for step in steps:
        one = run(model, method, start, 1.5, step=step, max_step=step, low=low, quad=True, tolerance=1e-3)
        assert one.status == Status.REACHED
        errors.append(one.error(exact, exact_low))
    assert np.abs(slopes(steps, errors) - order).max() < 0.1, errors


def test_order_of_radau5() -> None:
    """Its steps follow from the tolerance: error over number of steps, far from where Newton's bound is felt."""
    start = (0.6, 0.0, 0.0, 1.5)
    exact = run(KEPLER, "gauss8", start, 3.0, step=1 / 128, quad=True)
    runs = [run(KEPLER, "radau5", start, 3.0, tolerance=10.0**-k, quad=True) for k in (11, 13, 15)]
    errors = [one.error(exact.y, exact.low) for one in runs]
    steps = [one.report["steps"] for one in runs]
    assert np.abs(-np.diff(np.log(errors)) / np.diff(np.log(steps)) - 5).max() < 0.1, errors


def test_every_method_has_its_order_measured() -> None:
    """Those that consist of others apart, and those for contacts, whose motions are not smooth; and it is the order that it states."""
    measured = {method: order for method, order, *_ in UNCONSTRAINED} | {"radau5": 5}
    dense = {method for method, *_ in DENSE} | {"radau5"}
    kernel = load_kernel()
    for name in kernel_methods(kernel):
        if not KERNEL_METHODS[name].consists_of and not KERNEL_METHODS[name].solves_contacts:
            assert name in measured, f"the order of '{name}' is not measured: a row in UNCONSTRAINED here"
            assert name in dense, (
                f"the order of the dense output of '{name}' is not measured: a row in DENSE here"
            )
            stated = kernel.mech_method_order(kernel.mech_method_index(name.encode()))
            # orders of Taylor's method follow from the tolerance: the least is stated
            assert measured[name] == stated or (name == "taylor" and measured[name] > stated), name


@pytest.mark.parametrize("model", [CARTESIAN_PENDULUM, SPHERICAL_PENDULUM], ids=["plane", "space"])
def test_order_of_radau5_with_constraints(model: Model) -> None:
    """Projected after each step; over a ladder of tolerances, as whole steps make single pairs uneven."""
    start, low = on_the_rod(model.nq)
    if model.nq == 2:
        exact, exact_low = of_the_angle(1.5)
    else:
        reference = run(model, "gauss8", start, 1.5, step=1 / 128, low=low, quad=True)
        exact, exact_low = reference.y, reference.low
    ladder = [10.0**-k for k in (13, 14, 15, 16, 17)]
    runs = [run(model, "radau5", start, 1.5, low=low, tolerance=tolerance, quad=True) for tolerance in ladder]
    errors = [one.error(exact, exact_low) for one in runs]
    slope, _ = np.polyfit(np.log([one.report["steps"] for one in runs]), np.log(errors), 1)
    assert abs(slope + 5) < 0.1, errors


DENSE = [
    ("verlet", 3, False),
    ("gauss2", 3, False),
    ("gauss4", 4, False),
    ("gauss6", 5, True),
    ("gauss8", 6, True),
    ("lobatto4", 4, True),
    ("lobatto6", 5, True),
    ("rattle", 3, False),
    ("rk4", 4, False),
    ("dop853", 8, True),
    ("taylor", 8, True),
]


@pytest.mark.parametrize(("method", "power", "quad"), DENSE, ids=[case[0] for case in DENSE])
def test_order_of_the_dense_output(method: str, power: int, quad: bool) -> None:
    """The largest error inside a first step falls with this power of the step."""
    errors = []
    for step in (1 / 8, 1 / 16, 1 / 32):
        inside = step * np.array([0.25, 0.5, 0.75])
        exact = run(PENDULUM, "gauss8", (1.0, 0.3), step, step=step / 32, grid=inside, quad=True)
        tolerance = 1e-3 if method == "taylor" else 1e-8  # of which its order follows
        one = run(PENDULUM, method, (1.0, 0.3), step, step=step, grid=inside, tolerance=tolerance, quad=quad)
        errors.append(np.abs((one.rows - exact.rows) + (one.rows_low - exact.rows_low)).max())
    assert np.abs(np.diff(np.log2(errors)) + power).max() < 0.15, errors


def test_dense_output_of_radau5() -> None:
    """Of order 4: with steps by tolerances of one ladder its error falls as the steps to the fifth."""
    start, inside = (0.6, 0.0, 0.0, 1.5), np.linspace(0.05, 2.95, 97)
    exact = run(KEPLER, "gauss8", start, 3.0, step=1 / 2048, grid=inside, quad=True)
    errors, steps = [], []
    for k in (12, 14, 16):
        one = run(KEPLER, "radau5", start, 3.0, tolerance=10.0**-k, grid=inside, quad=True)
        errors.append(np.abs((one.rows - exact.rows) + (one.rows_low - exact.rows_low)).max())
        steps.append(one.report["steps"])
    assert np.abs(-np.diff(np.log(errors)) / np.diff(np.log(steps)) - 5).max() < 0.1, errors


def numbers_of(file: str, table: str) -> list[mpmath.mpf]:
    """All numbers of one initialiser in a file of the kernel, in order."""
    text = kernel_sources()[file]
    body = text[text.index(f"{table} = {{") :]
    body = body[: body.index("\n};")]
    found = re.findall(r"MECH_C\(([-+.\de]+)\)|K\((-?\d+)\)|(?<=[{, ])(-?\d+)(?=[,}])", body)
    return [mpmath.mpf(a or 0) + mpmath.mpf(b or 0) / 1024 + mpmath.mpf(c or 0) for a, b, c in found]


@pytest.mark.parametrize("stages", [1, 2, 3, 4])
def test_coefficients_of_gauss(stages: int) -> None:
    """Conditions that fix the method: b and a integrate all polynomials up to their degrees, to 38 digits."""
    with mpmath.workdps(45):
        values = iter(numbers_of("gauss_tableau.h", f"GAUSS{2 * stages}"))
        c = [next(values) for _ in range(stages)]
        b = [next(values) for _ in range(stages)]
        b = [x + next(values) for x in b]
        a = [[next(values) for _ in range(stages)] for _ in range(stages)]
        a = [[x + next(values) for x in row] for row in a]
        for k in range(1, 2 * stages + 1):
            assert abs(sum(x * y ** (k - 1) for x, y in zip(b, c, strict=True)) - mpmath.mpf(1) / k) < 1e-38
        for row, node in zip(a, c, strict=True):
            for k in range(1, stages + 1):
                total = sum(x * y ** (k - 1) for x, y in zip(row, c, strict=True))
                assert abs(total - node**k / k) < 1e-38


@pytest.mark.parametrize(("table", "stages"), [("RATTLE", 2), ("LOBATTO4", 3), ("LOBATTO6", 4)])
def test_coefficients_of_lobatto(table: str, stages: int) -> None:
    """b_i a^_ij + b_j a_ji = b_i b_j makes the pair symplectic."""
    with mpmath.workdps(45):
        values = iter(numbers_of("lobatto_tableau.h", table)[1:])
        c = [next(values) for _ in range(stages)]
        b = [next(values) for _ in range(stages)]
        b = [x + next(values) for x in b]
        pair = []
        for _ in range(2):
            a = [[next(values) for _ in range(stages)] for _ in range(stages)]
            pair.append([[x + next(values) for x in row] for row in a])
        a, hat = pair
        each = range(stages)
        assert max(abs(b[i] * hat[i][j] + b[j] * a[j][i] - b[i] * b[j]) for i in each for j in each) < 1e-38
        for k in range(1, 2 * stages - 1):
            assert abs(sum(x * y ** (k - 1) for x, y in zip(b, c, strict=True)) - mpmath.mpf(1) / k) < 1e-38


def test_methods_name_what_they_need() -> None:
    bare = Model({"rhs": "out[0] = y[1]; out[1] = -y[0];"}, nq=1, nv=1)
    for method, status in (("radau5", -6), ("verlet", -7), ("rattle", -8), ("lobatto6", -8)):
        assert run(bare, method, (1.0, 0.0), 1.0, step=0.1).status == status
    assert run(VAN_DER_POL, "auto", (2.0, 0.0), 1.0, p=(1.0, 1.0)).status == Status.REACHED

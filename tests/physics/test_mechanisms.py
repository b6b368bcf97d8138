"""Closed loops: linkages with known positions, reference problems, the double pendulum out of free bars."""

from __future__ import annotations

import numpy as np
import pytest
from gallery import at, load, references, run


def test_double_pendulum_out_of_free_bars() -> None:
    """K1 in six coordinates and four constraints against joint coordinates: 10 s of a chaotic motion."""
    bars, plain = run("double_pendulum_cartesian"), run("double_pendulum_bars", model="DoublePendulum")
    for name in ("B[1]", "B[2]"):
        assert bars[name] == pytest.approx(plain[name], abs=1e-8)
    tight = [run(n, model=m, tolerance=1e-13) for n, m in
             (("double_pendulum_cartesian", None), ("double_pendulum_bars", "DoublePendulum"))]  # fmt: skip
    for name in ("B[1]", "B[2]"):
        assert tight[0][name] == pytest.approx(tight[1][name], abs=1e-9)


def test_slider_crank_closes() -> None:
    solution = run("slider_crank")
    angle = solution["main.angle"]
    stroke = 0.1 * np.cos(angle) + np.sqrt(0.3**2 - (0.1 * np.sin(angle)) ** 2)
    assert solution["stroke"] == pytest.approx(stroke, abs=1e-8)


def test_four_bar_closes_and_balances() -> None:
    """Prescribed crank: the rocker from two circles; the power of the reaction is all that changes the energy."""
    solution = run("four_bar")
    crank = np.radians(60) + 10 * solution.time
    knee = np.array([0.2 * np.cos(crank), 0.2 * np.sin(crank)])
    rocker = np.array([0.5 + 0.4 * np.cos(solution["d.angle"]), 0.4 * np.sin(solution["d.angle"])])
    assert np.hypot(*(knee - rocker)) == pytest.approx(0.5, abs=1e-9)
    balance = solution.accuracy.energy
    assert balance is not None and balance.relative is not None and balance.relative < 1e-9
    total = solution["energy.kinetic"] + solution["energy.potential"]
    t, power = solution.time, 10 * solution["needed"]
    work = np.concatenate([[0], np.cumsum(np.diff(t) * (power[1:] + power[:-1]) / 2)])
    assert work == pytest.approx(total - total[0], abs=2e-3)  # the trapezium rule on 500 points


def test_peaucellier_draws_a_straight_line() -> None:
    """At (long^2 - side^2)/(2 crank) from the pivot."""
    solution = run("peaucellier")
    assert solution["tip[1]"] == pytest.approx((1.2**2 - 0.5**2) / 0.8, abs=1e-9)
    assert np.ptp(solution["tip[2]"]) > 0.1


ANGLES = ("beta", "theta", "gamma", "phi", "delta", "omega", "epsilon")


def test_squeezing_mechanism() -> None:
    """Andrews' mechanism at 0.03 s. Positions to 1e-8, multipliers two digits less; rates grow to 1e3."""
    solution = run("squeezing_mechanism")
    point = next(p for p in references("andrews_squeezer") if p["t"] == solution.time[-1])
    expected = point["values"]
    for name in ANGLES:
        assert solution[name][-1] == pytest.approx(expected[name], rel=1e-8)
        assert solution[f"der({name})"][-1] == pytest.approx(expected[f"{name}dot"], rel=1e-6)
    rows = [f"{c}[{k}]" for c in ("l3", "l4", "l6") for k in (1, 2)]
    for k, name in enumerate(rows, start=1):
        assert solution[name][-1] == pytest.approx(expected[f"lambda{k}"], rel=1e-6)


@pytest.mark.slow
def test_bricard() -> None:
    """Six hinges that count to no freedom have one. P3 at 10 s to 1e-7."""
    solution = run("bricard")
    for point in references("iftomm_a04_bricard"):
        expected = [point["values"][k] for k in ("x3", "y3", "z3")]
        assert at(solution, point["t"], ["P3[1]", "P3[2]", "P3[3]"]) == pytest.approx(expected, abs=1e-7)
    assert [d.code for d in load("bricard").diagnostics] == ["W0513"]


def test_n_four_bar_passes_its_singular_positions() -> None:
    """Twice a turn the loops lie flat and K loses rank: the row goes on as a parallelogram. 1e-6 at 10 s."""
    solution = run("n_four_bar", stop=10)
    for point in references("iftomm_a02_n_four_bar_N2"):
        if point["t"] <= solution.time[-1]:
            expected = [point["values"][k] for k in ("xB0", "yB0")]
            assert at(solution, point["t"], ["B[1]", "B[2]"]) == pytest.approx(expected, abs=1e-6)
    turned = solution["foot[1].angle"]
    assert np.ptp(turned) > 20  # six passages
    topics = {choice.topic for choice in load("n_four_bar").compilation.equations.choices}
    assert "singular positions" in topics


@pytest.mark.parametrize(
    "name", ["slider_crank", "four_bar", "squeezing_mechanism", "double_pendulum_cartesian"]
)
def test_nothing_is_softened_without_need(name: str) -> None:
    topics = {choice.topic for choice in load(name).compilation.equations.choices}
    assert "singular positions" not in topics


@pytest.mark.slow
def test_stewart_platform_closes() -> None:
    """Eighteen equations of six ball joints: each leg spans the distance of its ends, all alike by symmetry."""
    solution = run("stewart_platform")
    for i in range(1, 7):
        assert solution[f"leg[{i}].length"] == pytest.approx(solution[f"span[{i}]"], abs=1e-9)
        assert solution[f"span[{i}]"] == pytest.approx(solution["span[1]"], abs=1e-7)
    assert np.ptp(solution["height"]) > 0.01
    balance = solution.accuracy.energy
    assert balance is not None and balance.relative is not None and balance.relative < 1e-9


def test_watt_linkage_draws_his_curve() -> None:
    """b^2 - r^2 = (a sin +- sqrt(c^2 - a^2 cos^2))^2 in polar coordinates about the middle, squared once more."""
    solution = run("watt_linkage")
    a, b, c = 1.2, 1.0, 0.4
    x, y = solution["middle[1]"], solution["middle[2]"]
    r2 = x**2 + y**2
    across, inside = (a * y) ** 2 / r2, c**2 - (a * x) ** 2 / r2
    assert (b**2 - r2 - across - inside) ** 2 == pytest.approx(4 * across * inside, abs=1e-7)
    assert np.ptp(y) > 0.5


def test_five_bar_tip_from_two_circles() -> None:
    """Both cranks prescribed: the tip is where the circles about their ends meet; the work of the motors balances."""
    solution = run("five_bar")
    t = solution.time
    first = np.radians(120) + np.radians(20) * np.sin(3 * t)
    second = np.radians(60) + np.radians(30) * np.sin(5 * t)
    left = 0.3 * np.array([np.cos(first), np.sin(first)])
    right = 0.3 * np.array([np.cos(second), np.sin(second)]) + np.array([[0.4], [0]])
    apart = right - left
    distance = np.hypot(*apart)
    height = np.sqrt(0.5**2 - distance**2 / 4)
    tip = (left + right) / 2 + height / distance * np.array([-apart[1], apart[0]])
    assert solution["path[1]"] == pytest.approx(tip[0], abs=1e-8)
    assert solution["path[2]"] == pytest.approx(tip[1], abs=1e-8)
    energy = solution["energy.kinetic"] + solution["energy.potential"]
    work = np.sum((solution["given"][1:] + solution["given"][:-1]) / 2 * np.diff(t))
    assert np.ptp(solution["given"]) > 1
    # the trapezium rule; periodic: it converges fast
    assert work == pytest.approx(energy[-1] - energy[0], abs=1e-3)


def test_universal_joint_makes_the_shaft_uneven() -> None:
    """W cos(b)/(1 - sin(b)^2 cos(W t)^2), twice a turn; tan(turned) = tan(W t)/cos(b)."""
    solution = run("universal_joint_shaft")
    t, bend = solution.time, np.radians(30)
    assert solution["speed"] == pytest.approx(
        10 * np.cos(bend) / (1 - np.sin(bend) ** 2 * np.cos(10 * t) ** 2), rel=1e-9
    )
    assert np.sin(solution["turned"]) * np.cos(10 * t) * np.cos(bend) == pytest.approx(
        np.cos(solution["turned"]) * np.sin(10 * t), abs=1e-9
    )

"""Linear oscillators, all with closed solutions (V1, V2, V7, P14, P17, T8-T10, T20, U8, U9, U16, U47-U49, U53, U55)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from gallery import EXAMPLES, Array, Case, Formula, check, load, run, values
from numpy import cos, cosh, exp, pi, sin, sqrt

import mechc

g = 9.81


def two_masses() -> dict[str, Formula]:
    W = sqrt(10 * 1.5)

    def length(t: Array) -> Any:
        return 0.5 + 0.3 * cos(W * t) - 0.3 / W * sin(W * t)

    def centre(t: Array) -> Any:
        return 1.6 / 3 + 0.1 * t

    return {
        "x1": lambda t: centre(t) - 2 / 3 * length(t),
        "x2": lambda t: centre(t) + 1 / 3 * length(t),
        "centre": centre,
    }


def pushed_pair(sign: int, W: float = 4.0) -> Formula:
    return lambda t: (0.25 + 0.25 * sign) + 0.3 * t + sign * 0.3 / W * sin(W * t)


def vibrating(t: Array) -> Any:
    rest, w0, w = -0.3 - g / 40, sqrt(40), 5
    forced = 40 * 0.01 / (40 - 25)
    return rest + (-0.5 - rest - forced) * cos(w0 * t) + forced * cos(w * t)


def damped(t: Array) -> Any:
    W = sqrt(4 - 0.09)
    return exp(-0.3 * t) * (cos(W * t) + 0.3 / W * sin(W * t))


def overdamped(t: Array) -> Any:
    a, b = -5 + sqrt(21), -5 - sqrt(21)
    return (a * exp(b * t) - b * exp(a * t)) / (a - b)


def forced_damped(v: float) -> Formula:
    """Start at rest: the steady motion, and the free one that cancels it at the start."""
    w, lam = 2.0, 0.3
    steady = 1 / (w * w - v * v + 2j * lam * v)
    W = sqrt(w * w - lam * lam)

    def x(t: Array) -> Any:
        x0, v0 = -steady.real, -(1j * v * steady).real
        free = exp(-lam * t) * (x0 * cos(W * t) + (v0 + lam * x0) / W * sin(W * t))
        return (steady * exp(1j * v * t)).real + free

    return x


def hanging(m: float, M: float) -> Formula:
    rest = 0.4 + (m + M / 2) * g / 20
    return lambda t: rest + (0.5 - rest) * cos(sqrt(20 / (m + M / 3)) * t)


def swirl(t: Array) -> Any:
    """x + i y of z'' = -i k z, k = 2."""
    return np.cosh(sqrt(-2j) * t)


def swirl_rate(t: Array) -> Any:
    return sqrt(-2j) * np.sinh(sqrt(-2j) * t)


def rod(mode: int) -> dict[str, Formula]:
    omega = 2 * sqrt(1000) * sin(mode * pi / 42)
    return {
        f"x[{i}]": lambda t, i=i: 1e-3 * sin(mode * pi * i / 21) * cos(omega * t) for i in (1, 5, 10, 20)
    } | {"omega": lambda t: omega}


s2, s7 = sqrt(10), sqrt(70)

CASES = [
    Case("two_masses_spring", two_masses(), bound=100),
    Case("sprung_pair", {"x1": pushed_pair(-1), "x2": pushed_pair(1)}, bound=100),
    Case(
        "sprung_pair",
        {"x1": pushed_pair(-1, 3), "x2": pushed_pair(1, 3)},
        bound=100,
        set={"m": 2, "k": 9},
    ),
    Case(
        "forced_oscillator",
        {"x": lambda t: 0.1 * cos(2 * t) + 0.15 * sin(2 * t) - 0.1 * sin(3 * t)},
        bound=100,
    ),
    Case(
        "vibrating_base",
        {"y": vibrating, "pull": lambda t: 40 * (0.01 * cos(5 * t) - vibrating(t) - 0.3)},
        bound=100,  # the pull is 40 times a small difference of positions
    ),
    Case(
        "three_springs",
        {
            "x1": lambda t: 0.005 * (cos(s2 * t) + cos(s7 * t)),
            "x2": lambda t: 0.005 * (cos(s2 * t) - cos(s7 * t)),
        },
        bound=100,
    ),
    Case("three_springs", {x: lambda t: 0.01 * cos(s2 * t) for x in ("x1", "x2")}, 100, experiment="slow"),
    Case(
        "three_springs",
        {"x1": lambda t: 0.01 * cos(s7 * t), "x2": lambda t: -0.01 * cos(s7 * t)},
        bound=100,
        experiment="fast",
    ),
    Case("elastic_rod", rod(1), bound=100),
    Case("elastic_rod", rod(3), bound=100, experiment="third"),
    Case("forced_resonance", {"x": lambda t: 0.4 * t * sin(5 * t) / 20}, bound=300),
    Case(
        "forced_resonance",
        {"x": lambda t: 0.2 / (25 - 30.25) * (cos(5.5 * t) - cos(5 * t))},
        bound=300,  # 200 rad of motion
        experiment="beats",
    ),
    Case("damped_oscillator", {"x": damped}, bound=30),
    Case("damped_oscillator", {"x": lambda t: (1 + 2 * t) * exp(-2 * t)}, bound=30, experiment="critical"),
    # the steps are as long as stability allows, and the interpolation between them 1000 times the tolerance off
    Case("damped_oscillator", {"x": overdamped}, bound=100, experiment="heavy"),
    Case("forced_damped_oscillator", {"x": forced_damped(1.5)}, bound=100),
    Case("forced_damped_oscillator", {"x": forced_damped(sqrt(4 - 0.18))}, bound=100, experiment="resonance"),
    Case(
        "mass_on_spring",
        {"x": lambda t: 0.1 * cos(sqrt(40) * t), "period": lambda t: 2 * pi / sqrt(40)},
        bound=100,
    ),
    Case(
        "heavy_spring",
        {"x": lambda t: 0.1 * cos(sqrt(20 / 1.1) * t), "period": lambda t: 2 * pi / sqrt(20 / 1.1)},
        bound=100,
    ),
    Case(
        "hanging_spring",
        {"x": hanging(1, 0.3), "period": lambda t: 2 * pi / sqrt(20 / 1.1)},
        bound=100,
    ),
    Case(
        "hanging_spring",
        {"x": hanging(1, 0), "period": lambda t: 2 * pi / sqrt(20)},
        bound=100,
        experiment="massless",
    ),
    Case(
        "ring_of_masses",
        {
            "u[1]": lambda t: 0.1 / 3 * (1 + 2 * cos(sqrt(30) * t)),
            "u[2]": lambda t: 0.1 / 3 * (1 - cos(sqrt(30) * t)),
            "u[3]": lambda t: 0.1 / 3 * (1 - cos(sqrt(30) * t)),
        },
        bound=100,
    ),
    Case("saddle", {"x": lambda t: 0.1 * cos(t), "y": lambda t: 0.1 * cosh(t)}, bound=100),
    Case(
        "saddle",
        {"x": lambda t: 0.1 * cos(1.5 * t), "y": lambda t: 0.1 * cosh(1.5 * t)},
        bound=100,
        set={"k": 2.25},
    ),
    Case(
        "saddle_xy",
        {
            "x": lambda t: 0.1 * cosh(sqrt(2) * t) + 0.2 * cos(sqrt(2) * t),
            "y": lambda t: 0.1 * cosh(sqrt(2) * t) - 0.2 * cos(sqrt(2) * t),
            "V": lambda t: -2 * ((0.1 * cosh(sqrt(2) * t)) ** 2 - (0.2 * cos(sqrt(2) * t)) ** 2),
        },
        bound=100,
    ),
    Case(
        "swirl",
        {
            "x": lambda t: swirl(t).real,
            "y": lambda t: swirl(t).imag,
            "work": lambda t: abs(swirl_rate(t)) ** 2 / 2,
        },
        bound=100,
    ),
    Case(
        "harmonic_and_constant",
        {"x": lambda t: 0.7 / sqrt(2) * sin(sqrt(2) * t), "y": lambda t: t**2},
        bound=100,
    ),
    Case(
        "harmonic_and_constant",
        {"x": lambda t: 0.7 / 0.5 * sin(0.5 * t), "y": lambda t: t**2 / 8},
        bound=100,
        set={"m": 8},
    ),
]


@pytest.mark.parametrize("case", CASES, ids=str)
def test_closed_form(case: Case) -> None:
    check(case)


def test_steady_amplitude_is_largest_at_the_stated_frequency() -> None:
    """T10: amplitude at v^2 = w^2 - 2 lambda^2 above that at frequencies a little off; the start has decayed by e-13."""

    def amplitude(v: float) -> float:
        end = run("forced_damped_oscillator", set={"v": v}, stop=100.0)(100.0)
        return float(np.hypot(end["x"], end["der(x)"] / v))

    best = sqrt(4 - 0.18)
    assert amplitude(best) == pytest.approx(1 / (0.6 * sqrt(4 - 0.09)), rel=1e-8)
    assert amplitude(best) > max(amplitude(best - 0.05), amplitude(best + 0.05))


def test_resonance_with_a_force_of_any_phase() -> None:
    """T8: of f cos(w t + beta) x = f t sin(w t + beta)/(2 m w), if it starts with the speed that this has."""
    text = (EXAMPLES / "forced_resonance.mech").read_text(encoding="utf-8")
    text = text.replace("cos(w*time)", "cos(w*time + beta)").replace(
        "exact x = f*time*sin(w0*time)/(2*m*w0)", "output none = 0"
    )
    text = text.replace(
        "  kinetic", "  parameter beta = 1.1;\n  initial der(x) = f*sin(beta)/(2*m*w);\n  kinetic"
    )
    solution = mechc.loads(text).simulate(tolerance=1e-10)
    assert isinstance(solution, mechc.Solution)
    t = solution.time
    assert solution["x"] == pytest.approx(0.4 * t * sin(5 * t + 1.1) / 20, abs=0.4 * 300e-10)


@pytest.mark.slow
def test_rod_of_many_masses_carries_waves() -> None:
    """P17: pi v/L is the lowest frequency of a rod of length L = (N + 1) d, for v = sqrt(Y/mu) = d sqrt(k/m) (Y = k d, mu = m/d): off by
    (pi/(N + 1))^2/24 with N masses."""
    for n in (10, 40):
        (lowest, *_) = load("elastic_rod").with_values({"N": n}).modes().summary()["modes"]
        speed = lowest["frequency"] * (n + 1) / pi
        assert 1 - speed / sqrt(100 / 0.1) == pytest.approx((pi / (n + 1)) ** 2 / 24, rel=0.01)


def test_momentum_of_the_ring_is_conserved() -> None:
    """T20: w = 0."""
    assert np.max(np.abs(run("ring_of_masses")["total"])) < 100e-10


@pytest.mark.parametrize("n", [2, 5, 10])
def test_modes_of_the_elastic_rod(n: int) -> None:
    """P17 with k = m = 1: the frequencies of the reference, mode by mode."""
    known = values("normal_modes_set", f"n={n} equal masses, n+1 equal springs")
    for mode in (1, n):
        settings = {"N": n, "mode": mode, "k": 1.0, "m": 1.0}
        solution = run("elastic_rod", set=settings)
        expected = solution["x[1]"][0] * cos(known[f"omega_{mode}"] * solution.time)
        assert solution["x[1]"] == pytest.approx(expected, abs=100e-10 * abs(expected[0]))

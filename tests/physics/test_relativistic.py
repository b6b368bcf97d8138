"""Lagrangians that are not quadratic in the velocities (T26, U70, U74)."""

from __future__ import annotations

import numpy as np
import pytest
from gallery import Case, check, run
from numpy import cos, sin, sqrt

c = 299792458.0
electron = 1.602176634e-19 / 9.1093837015e-31
rate = 3e5 / (1e-3 * c)  # F/(m c)
circle = electron * sqrt(1 - 0.81)

CASES = [
    Case(
        "relativistic_constant_force",
        {
            "x": lambda t: c / rate * (sqrt(1 + (rate * t) ** 2) - 1),
            "v": lambda t: c * rate * t / sqrt(1 + (rate * t) ** 2),
            "p": lambda t: 3e5 * t,
        },
        bound=30,
    ),
    Case(
        "relativistic_charge",
        {"x": lambda t: c * c / (electron * 1e6) * (sqrt(1 + (electron * 1e6 * t / c) ** 2) - 1)},
        bound=30,
    ),
    Case(
        "relativistic_charge",
        {
            "x": lambda t: 0.9 * c / circle * sin(circle * t),
            "y": lambda t: 0.9 * c / circle * (cos(circle * t) - 1),
            "frequency": lambda t: circle,
        },
        bound=300,
        experiment="magnetic",
    ),
]


@pytest.mark.parametrize("case", CASES, ids=str)
def test_closed_form(case: Case) -> None:
    check(case)


def test_momentum_of_the_constant_force() -> None:
    """U74: p = sqrt((m c^2 + F x)^2 - m^2 c^4)/c, and 98 % of c after 5 s."""
    solution = run("relativistic_constant_force")
    rest, work = 1e-3 * c * c, 3e5 * solution["x"]
    assert solution["p"] == pytest.approx(sqrt(work * (2 * rest + work)) / c, rel=1e-8)
    assert 0.98 * c < solution["v"][-1] < c


def test_relativistic_orbit() -> None:
    """U70, m = c = 1: p = gamma v; E and l conserved; 1/r = k E/(l G)^2 + A cos(G phi), G^2 = 1 - (k/l)^2."""
    solution = run("relativistic_orbit")
    x, y, u, v = (solution[n] for n in ("x", "y", "der(x)", "der(y)"))
    gamma = 1 / sqrt(1 - u * u - v * v)
    assert solution["p[1]"] == pytest.approx(gamma * u, abs=1e-12)
    assert solution["p[2]"] == pytest.approx(gamma * v, abs=1e-12)
    k, gamma0 = 0.2, 1 / sqrt(1 - 0.16)
    E, l = gamma0 - k, 0.4 * gamma0
    assert solution["E"] == pytest.approx(E, abs=300e-10)
    assert solution["energy.total"] == pytest.approx(gamma - k / np.hypot(x, y), rel=1e-12)
    assert solution["l"] == pytest.approx(l, abs=300e-10)
    G = sqrt(1 - (k / l) ** 2)
    phi = np.unwrap(np.arctan2(y, x))
    mean = k * E / (l * G) ** 2
    assert 1 / np.hypot(x, y) == pytest.approx(mean + (1 - mean) * cos(G * phi), rel=3000e-10)
    assert phi[-1] > 4 * np.pi

"""Masses that change with time: matter joins with the velocity of the body, m(t) a = F, whatever the method."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.special import jv, yv

import mechc

SPRING = """coordinate Length x = 1 m;
initial der(x) = 2 m/s;
mass 1 kg + 1 kg/s*time at world * {x, 0 m};
potential 1/2*1 N/m*x^2;
experiment(stop = 2 s);
"""


def _closed(t: NDArray[np.float64]) -> NDArray[np.float64]:
    """(1 + t) x'' = -x: x = s (a J1(2 s) + b Y1(2 s)) with s = sqrt(1 + t), and dx/dt = a J0(2 s) + b Y0(2 s)."""
    a, b = np.linalg.solve([[jv(1, 2), yv(1, 2)], [jv(0, 2), yv(0, 2)]], [1, 2])
    s = np.sqrt(1 + t)
    return np.asarray(s * (a * jv(1, 2 * s) + b * yv(1, 2 * s)))


@pytest.fixture(scope="module")
def spring() -> mechc.Model:
    return mechc.loads(SPRING)


@pytest.mark.parametrize(
    ("method", "step", "tolerance"),
    [("dop853", None, 1e-8), ("lobatto4", "20 ms", 1e-7), ("rattle", "5 ms", 1e-4)],
)
def test_momenta_take_up_what_joins(
    spring: mechc.Model, method: str, step: str | None, tolerance: float
) -> None:
    """The methods on momenta left it out: x was 1.73 m after 2 s, not 2.66 m."""
    solution = spring.simulate(method=method, step=step)
    assert np.allclose(solution["x"], _closed(solution.time), atol=tolerance)
    assert str(solution.outcome) == "Outcome.COMPLETED"


def test_a_body_that_coasts_and_grows_has_no_constant_momentum() -> None:
    """Its velocity stays; a run whose momentum grew was called doubtful."""
    solution = mechc.loads(SPRING.replace("potential 1/2*1 N/m*x^2;", "")).simulate()
    assert str(solution.outcome) == "Outcome.COMPLETED"
    assert np.allclose(solution["x"], 1 + 2 * solution.time)
    assert np.allclose(solution["energy.supplied"], 2 * solution.time)


def test_a_mass_that_loses_matter_on_a_point_that_time_moves() -> None:
    """m s'' = -k s with the frame at u t. dh/dt = m' (s' + u) s' - 1/2 m' (s' + u)^2: joining matter counts along the coordinate alone."""
    text = """
        coordinate Length s = 0.4 m; initial der(s) = 0.1 m/s;
        mass 2 kg - 0.3 kg/s*time at world * {s + 0.5 m/s*time, 0 m};
        potential 1/2*50 N/m*s^2;
        experiment(stop = 3 s, tolerance = 1e-10);
        """
    found = mechc.loads(text).simulate()
    assert found.outcome.value == "completed", found.message
    u, flow = 0.5, -0.3

    def rates(t: float, y: list[float]) -> list[float]:
        s, v, _ = y
        return [v, -50 * s / (2 + flow * t), flow * (v + u) * v - flow * (v + u) ** 2 / 2]

    hand = solve_ivp(rates, (0, 3), [0.4, 0.1, 0.0], rtol=1e-11, atol=1e-13)
    assert found["s"][-1] == pytest.approx(hand.y[0, -1], abs=1e-9)
    assert found["energy.supplied"][-1] == pytest.approx(hand.y[2, -1], abs=1e-8)

"""Masses that change with time: matter joins with the velocity of the body, m(t) a = F, whatever the method."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
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

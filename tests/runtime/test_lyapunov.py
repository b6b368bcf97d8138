"""Lyapunov exponents and volumes: against closed forms and the literature, and the intervals that they state."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import mechc
from mechc.runtime.outcome import Outcome
from mechc.runtime.studies.lyapunov import estimated

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def example(name: str) -> mechc.Model:
    return mechc.load(EXAMPLES / f"{name}.mech")


def test_lorenz() -> None:
    """0.9056 (Wolf and others 1985, Sprott); the sum is -(sigma + 1 + b) exactly."""
    found = example("lorenz").lyapunov(time=1000).summary()
    first, half = found["exponents"][0], found["confidence"][0]
    assert abs(first - 0.9056) < 1.5 * half and half < 0.03
    assert sum(found["exponents"]) == pytest.approx(-(10 + 1 + 8 / 3), rel=1e-6)
    assert abs(found["exponents"][1]) < 3 * found["confidence"][1]


def test_a_linear_system_has_its_eigenvalues() -> None:
    """x'' = -x - 0.3 x' has -0.15 twice; x' = 2 x has 2."""
    text = """\
model Linear
  dimensionless;
  coordinate x = 1;
  state s = 0;
  kinetic 1/2*der(x)^2;
  potential 1/2*x^2;
  damping 0.3 on x;
  equation der(s) = -2*s;
  experiment(stop = 20);
end Linear;
"""
    found = mechc.loads(text).lyapunov(time=400).summary()
    assert found["exponents"] == pytest.approx([-0.15, -0.15, -2], abs=3e-3)
    assert sum(found["exponents"]) == pytest.approx(-2.3, abs=1e-7)
    one = mechc.loads(text).lyapunov(time=400, count=1).summary()
    assert len(one["exponents"]) == len(one["confidence"]) == 1


def test_regular_and_chaotic_motions_of_one_model() -> None:
    """Henon-Heiles: zero at E = 1/12; 0.13 at 1/6; pairs of opposite sign."""
    model = example("henon_heiles")
    regular = model.lyapunov(time=4000)
    assert "cannot be told from zero" in regular.message or abs(regular.summary()["exponents"][0]) < 2e-3
    chaotic = model.lyapunov(time=4000, experiment="chaotic")
    exponents, halves = np.array(chaotic.summary()["exponents"]), chaotic.summary()["confidence"]
    assert abs(exponents[0] - 0.128) < 2 * halves[0] and halves[0] < 0.06
    assert np.abs(exponents + exponents[::-1]).max() < 1e-3
    assert any("pairs" in remark for remark in chaotic.remarks)


def test_a_pendulum_with_constraints_has_two_exponents() -> None:
    found = example("pendulum_cartesian").lyapunov(time=200).summary()
    assert len(found["exponents"]) == 2 and max(map(abs, found["exponents"])) < 0.05


def test_intervals_hold_their_promise() -> None:
    """Means over batches of correlated noise: the true mean is in the interval of 95 % in at least 90 of 100 cases."""
    random = np.random.default_rng(5)
    held = 0
    for _ in range(100):
        noise = np.zeros(4000)
        shocks = random.standard_normal(4000)
        for k in range(1, 4000):
            noise[k] = 0.8 * noise[k - 1] + shocks[k]
        growth = np.cumsum(0.7 + noise)[:, None]
        means, halves = estimated(np.arange(4000.0), growth)
        held += abs(means[0] - 0.7) <= halves[0]
    assert held >= 90


def test_too_short() -> None:
    found = example("lorenz").lyapunov(time=1)
    assert found.outcome is Outcome.FAILED and "longer" in found.message


def test_volumes() -> None:
    """exp(-c t/m) of a damped mass; 1 with a mass that depends on the place, where velocities alone would not do."""
    damped = mechc.loads(
        "model M dimensionless; coordinate x = 1; kinetic der(x)^2; potential sin(x); damping 0.5 on x; "
        "experiment(stop = 3); end M;"
    ).volume()
    assert damped["ratio"] == pytest.approx(math.exp(-0.25 * 3), rel=1e-9)
    assert not damped.summary()["preserved"]
    bent = mechc.loads(
        "model M dimensionless; coordinate x = 1; kinetic (1 + x^2)/2*der(x)^2; potential x^4; "
        "experiment(stop = 2.2); end M;"
    ).volume()
    assert bent["ratio"] == pytest.approx(1, abs=1e-9) and bent.summary()["preserved"]
    lorenz = example("lorenz").volume(stop=1)
    assert lorenz["rate"] == pytest.approx(-(10 + 1 + 8 / 3), rel=1e-7)
    with pytest.raises(mechc.SimulationError, match="constraints"):
        example("pendulum_cartesian").volume()

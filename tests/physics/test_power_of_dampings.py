"""The power of a damping is that of its forces, whatever its coefficient depends on: it is what the energy loses."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import mechc
from mechc.runtime.problem import Array

PAIR = (
    "coordinate x = 0 m;initial der(x) = 2 m/s;coordinate y = 1 m;kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);"
    "potential 1/2*3 N/m*(x - y)^2;damping d: {c} on x - y;output P = power(d);"
    "state Energy W = 0;equation der(W) = power(d);experiment(stop = 2 s, tolerance = 1e-11);"
)
COEFFICIENTS: dict[str, Callable[[Array, Array], Array | None]] = {
    "1 N.s/m*(1 + x^2/(1 m^2))": lambda vx, vy: None,
    "2 N.s^3/m^3*der(x)^2": lambda vx, vy: -2 * (vx**2 * (vx - vy) ** 2 + vx**2 * (vx - vy) ** 2),
    "0.5 s/m^2*kinetic_energy()": lambda vx, vy: -0.5 * (vx**2 + vy**2) * (vx - vy) ** 2,
    "0.3 N.s^2/m^2*abs(der(x) - der(y))": lambda vx, vy: -0.45 * np.abs(vx - vy) ** 3,
}


@pytest.mark.parametrize("coefficient", COEFFICIENTS)
def test_the_energy_loses_what_the_power_says(coefficient: str) -> None:
    run = mechc.loads(PAIR.format(c=coefficient)).simulate()
    lost = run["energy.total"] - run["energy.total"][0]
    assert lost[-1] < -0.5
    np.testing.assert_allclose(run["W"], lost, atol=1e-8)
    by_hand = COEFFICIENTS[coefficient](run["der(x)"], run["der(y)"])
    if by_hand is not None:
        np.testing.assert_allclose(run["P"], by_hand, rtol=1e-10, atol=1e-12)

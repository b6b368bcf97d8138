"""A field in one dimension by elements, against the closed solution of its equation and the balance of its energy (P18)."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from gallery import load

KINK = load("kink")
V = 0.3
GAMMA = 1 / math.sqrt(1 - V**2)


def test_energy_flows_through_a_field() -> None:
    """P18: what is in one half of it changes by what flows through its ends, e_t + s_x = 0 with s = -u_x u_t, element by element."""
    run = KINK.simulate()
    assert run["half"][0] > 3.8 and run["half"][-1] < 0.02  # the kink has gone to the other half
    changed = run["half"] - run["half"][0]
    np.testing.assert_allclose(changed, run["passed"], atol=1e-9)


@pytest.mark.parametrize("quantity", ["energy.total", "momentum"])
def test_currents_of_a_kink_in_the_limit(quantity: str) -> None:
    """8 gamma and 8 gamma v, with errors of h^2: a quarter for half the element (P18)."""
    exact = 8 * GAMMA * (V if quantity == "momentum" else 1)
    off = []
    for n in (40, 80, 160):
        run = KINK.with_values({"N": n}).simulate(stop=4)
        off.append(np.abs(run[quantity] - exact).max())
    assert off[2] < 3e-3
    assert all(3.5 < wide / narrow < 4.5 for wide, narrow in itertools.pairwise(off))


def test_the_kink_moves_as_the_field_equation_says() -> None:
    """u = 4 atan(exp(gamma (x - v t))) solves u_tt - u_xx + sin u = 0; elements of h are off by h^2."""
    off = []
    for n in (40, 80):
        run = KINK.with_values({"N": n}).simulate(stop=4)
        x = (np.arange(1, n + 1) - (n + 1) / 2) * 20 / n
        u = np.array([run[f"u[{i}]"][-1] for i in range(1, n + 1)])
        inner = np.abs(x) < 6
        off.append(np.abs(u - 4 * np.arctan(np.exp(GAMMA * (x - V * 4))))[inner].max())
    assert 3.3 < off[0] / off[1] < 4.7 and off[1] < 0.02

"""Explicit steps at the bound of stability: what rounding leaves is not enlarged, and far from it nothing is measured."""

from __future__ import annotations

import numpy as np
import pytest
from kernel_driver import Model, run
from kernel_models import KEPLER

RESTING = Model(
    {"rhs": "out[0] = -20*y[0]; out[1] = -p[0]*(y[1] - 1e-16*sin(1e3*t));"}, nx=2, sizes={"np": 1}
)
"""What fades away; beside it something that would fade faster, of which as much is there as rounding leaves."""

SWINGING = Model(
    {
        "rhs": "out[0] = y[2]; out[1] = y[3]; out[2] = -400*y[0] - 40*y[2];"
        "out[3] = -p[0]*p[0]*(y[1] - 1e-16*sin(1e3*t)) - p[1]*y[3];"
    },
    nq=2,
    nv=2,
    sizes={"np": 2},
)


@pytest.mark.parametrize("rate", [25.0, 40.0, 120.0])
def test_what_is_zero_but_for_rounding_stays_so(rate: float) -> None:
    one = run(RESTING, "dop853", (1.0, 0.0), 30.0, p=(rate,), grid=np.linspace(0, 30, 301))
    assert np.abs(one.rows[:, 1]).max() < 1e-11  # 1e-12 measured; 2e-8 and more where steps are not held back
    assert one.report["steps"] < 30 * rate / 5.4 + 60, "no more than the bound asks for"


@pytest.mark.parametrize("damping", [10.0, 40.0])
def test_so_does_what_swings(damping: float) -> None:
    one = run(SWINGING, "dop853", (1.0, 0.0, 0.0, 0.0), 30.0, p=(60.0, damping), grid=np.linspace(0, 30, 301))
    assert np.abs(one.rows[:, 1]).max() < 1e-11  # 6e-13 measured; 1e-9 and more likewise


def test_far_from_the_bound_nothing_is_measured() -> None:
    one = run(KEPLER, "dop853", (1.0, 0.0, 0.0, 1.0), 10.0)
    steps = one.report["steps"] + one.report["rejected"]
    assert one.report["evaluations"] <= 12 * steps + 2

"""Contacts and frictions of masses that have nothing to do with each other, twelve powers of ten apart."""

from __future__ import annotations

import numpy as np
import pytest

import mechc

ONE = (
    "coordinate {n} = {h} m;kinetic 1/2*{m} kg*der({n})^2;potential {m} kg*10 m/s^2*{n};"
    "contact floor_{n}: {n} restitution 0.5;"
)
SLIDER = (
    "coordinate {n} = 0 m;initial der({n}) = {v} m/s;kinetic 1/2*{m} kg*der({n})^2;friction {m}*2 N on {n};"
)
END = "experiment(stop = 2 s);"


@pytest.mark.parametrize("h", [0.1, 0.17])
def test_each_bounces_as_if_alone(h: float) -> None:
    """Bounces that pile up end in rest; before, one of both never rested, as its row was rounding beside the other."""
    both = mechc.loads(ONE.format(n="x", h=0.1, m=1e-6) + ONE.format(n="y", h=h, m=1e6) + END).simulate()
    assert both.outcome.name == "COMPLETED", both.message
    for name, height in (("x", 0.1), ("y", h)):
        alone = mechc.loads(ONE.format(n=name, h=height, m=1) + END).simulate()
        found, expected = ([e.time for e in run.events if e.name == f"floor_{name}"] for run in (both, alone))
        # how many bounces are told before it rests depends on the fastest approach of all
        assert abs(len(found) - len(expected)) <= 2
        np.testing.assert_allclose(found[:15], expected[:15], rtol=1e-9)
        assert found[-1] == pytest.approx(expected[-1], rel=1e-6)


def test_each_slides_as_if_alone() -> None:
    both = mechc.loads(SLIDER.format(n="x", v=1, m=1e-6) + SLIDER.format(n="y", v=3, m=1e6) + END).simulate()
    assert both.outcome.name == "COMPLETED", both.message
    assert both["x"][-1] == pytest.approx(1 / 4, rel=1e-9)  # v^2/(2 a)
    assert both["y"][-1] == pytest.approx(9 / 4, rel=1e-9)

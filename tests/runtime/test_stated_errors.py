"""Errors that studies state hold the true ones: at loose and at the tightest tolerances, and with fixed steps."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

import mechc

SETTINGS: list[dict[str, Any]] = [
    {"tolerance": 1e-6},
    {"tolerance": 1e-14},
    {"method": "rk4", "step": 0.05},
    {"method": "gauss4", "step": 0.05},
]

SWING = """\
model Swing
  dimensionless;
  coordinate x = 1;
  kinetic 1/2*der(x)^2;
  potential 1/2*x^2;
  experiment(stop = 20);
end Swing;
"""

CYCLE = """\
model Cycle
  dimensionless;
  coordinate x = 2;
  kinetic 1/2*der(x)^2;
  potential 1/2*x^2;
  force (1 - x^2)*der(x) on x;
  experiment(stop = 30);
end Cycle;
"""

WELL = """\
model Well
  dimensionless;
  parameter b = 0.5;
  coordinate x = -10;
  coordinate y = b;
  initial der(x) = sqrt(10);
  kinetic 1/2*(der(x)^2 + der(y)^2);
  potential 4*(1/(x^2 + y^2)^6 - 1/(x^2 + y^2)^3);
end Well;
"""


@pytest.fixture(scope="module")
def swing() -> mechc.Model:
    return mechc.loads(SWING)


@pytest.fixture(scope="module")
def cycle() -> mechc.Model:
    return mechc.loads(CYCLE)


@pytest.mark.parametrize("settings", SETTINGS, ids=str)
def test_of_an_orbit(cycle: mechc.Model, settings: dict[str, Any]) -> None:
    """Van der Pol's cycle: the period by D. Viswanath (2001), and a multiplier of 1 along the orbit."""
    found = cycle.orbit(**settings)
    (period,) = (v for v in found.values if v.name == "period")
    assert period.error is not None and abs(period.value - 6.6632868593231301897) <= period.error < 1e-4
    told = found.summary()
    others = zip(told["multipliers"], told["multiplier_errors"], strict=True)
    assert all(
        abs(complex(*value) - exact) <= error < 1e-4
        for (value, error), exact in zip(others, (1.0, 0.0008596950636048), strict=True)
    )


def test_of_the_orbit_of_a_relaxation() -> None:
    """mu = 1000: 1614.4011258088 (Radau's method of SciPy at 1e-12); the multiplier across is exp(-8e5), to ten digits nothing."""
    model = mechc.loads(CYCLE.replace("(1 - x^2)", "1000*(1 - x^2)").replace("stop = 30", "stop = 4000"))
    for tolerance in (None, 1e-12):
        found = model.orbit(**({} if tolerance is None else {"tolerance": tolerance}))
        assert found["period"] == pytest.approx(1614.4011258088, rel=1e-12)
        along, across = found.summary()["multipliers"]
        errors = found.summary()["multiplier_errors"]
        assert abs(complex(*along) - 1) <= errors[0] < 1e-7
        assert abs(complex(*across)) <= errors[1] < 1e-10


@pytest.mark.parametrize("settings", SETTINGS, ids=str)
def test_of_a_section_an_action_a_threshold_and_an_optimum(
    swing: mechc.Model, settings: dict[str, Any]
) -> None:
    """x = cos t: where it comes down to 1/2, at which rate; I = E/w; reaches -1 from x = 1 on; is 1/2 at t = 1 for x = 1/(2 cos 1)."""
    found = swing.section(every=2.0, count=10, **settings)
    told = found.summary()["accuracy"]
    assert told["agreeing"] == [10]
    for name, exact in (("x", np.cos(2 * np.arange(10))), ("der(x)", -np.sin(2 * np.arange(10)))):
        off = float(np.abs(found.arrays[name] - exact).max())
        assert off <= 1.05 * told["errors"][name] + 1e-15 and told["errors"][name] < 1e-4
    action = swing.action(**settings)
    (value,) = (v for v in action.values if v.name == "I")
    assert value.error is not None and abs(value.value - 0.5) <= value.error < 1e-4
    (one,) = swing.threshold(over="x = 0.1 .. 2", reaches="x = -1", **settings).summary()["thresholds"]
    assert abs(one["parameter"]["x"] - 1) <= one["error"] < 1e-4
    best = swing.optimum(vary="x = 0.1 .. 2", goal="1 - (x - 1/2)^2", stop=1, **settings)
    (place,) = (v for v in best.values if v.name == "x")
    assert place.error is not None and abs(place.value - 0.5 / math.cos(1)) <= 1.01 * place.error < 1e-4


def deflection(b: float) -> float:
    """pi - 2 b times the integral of du/sqrt(1 - b^2 u^2 - V(1/u)/E), u = turn sin(s)."""

    def inside(u: float) -> float:
        return 1 - b**2 * u**2 - 4 * (u**12 - u**6) / 5

    grid = np.linspace(0, 2, 2001)
    k = next(k for k in range(1, 2001) if inside(grid[k]) < 0)
    turn = brentq(inside, grid[k - 1], grid[k], xtol=1e-15)
    path = quad(
        lambda s: turn * math.cos(s) / math.sqrt(inside(turn * math.sin(s))), 0, math.pi / 2, epsabs=1e-13
    )
    return float(math.pi - 2 * b * path[0])


@pytest.mark.parametrize("tolerance", [1e-4, 1e-6])
def test_of_scattering(tolerance: float) -> None:
    """A Lennard-Jones well: what the tolerance leaves is the same at all distances, so that extrapolation does not see it."""
    found = mechc.loads(WELL).scattering(over="b = 0.5 .. 2, 4", tolerance=tolerance).summary()
    for b, angle, error in zip(
        found["parameter"]["b"], found["deflection"], found["angle_errors"], strict=True
    ):
        assert abs(angle - deflection(b)) <= 1.05 * error < 1e-2 * math.sqrt(tolerance)


def test_scattering_has_no_fixed_steps() -> None:
    with pytest.raises(mechc.SimulationError, match="'rk4' is not a method that does") as told:
        mechc.loads(WELL).scattering(over="b = 0.5 .. 2, 4", method="rk4", step=0.01)
    assert "'auto' takes one" in (told.value.help or "")

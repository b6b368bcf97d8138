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


BELT = (
    "coordinate Length x = 0 m; initial der(x) = 0.25 m/s; kinetic 1/2*1 kg*der(x)^2; {what}"
    "experiment(stop = 1 s, tolerance = 1e-11);"
)
DRIVEN = "coordinate Length y; drive y = 1 m/s*time; "


@pytest.mark.parametrize(
    ("by_time", "by_drive"),
    [
        ("damping 2 N.s/m on x - 1 m/s*time;", "damping 2 N.s/m on x - y;"),
        ("force -2 N.s/m*(der(x) - 1 m/s) on x - 1 m/s*time;", "force -2 N.s/m*der(x - y) on x - y;"),
        ("damping 1 kg/s*(2 + der(x)/1 m*1 s) on x - 1 m/s*time;", "damping 1 kg/s*(2 + der(x)/1 m*1 s) on x - y;"),
        (
            "import mech.planar.*; frame base = world * trans({1 m/s*time, 0 m}); frame end_ = world * trans({5 m + x, 0 m}); Damper d(from = base, to = end_, c = 2 N.s/m);",
            "import mech.planar.*; frame base = world * trans({y, 0 m}); frame end_ = world * trans({5 m + x, 0 m}); Damper d(from = base, to = end_, c = 2 N.s/m);",
        ),
    ],
)  # fmt: skip
def test_what_time_carries_away_is_supplied(by_time: str, by_drive: str) -> None:
    """A belt given by time takes and brings what one that is driven does: heat is the force times the speed that rubs."""
    one, other = (mechc.loads(BELT.format(what=what)).simulate() for what in (by_time, DRIVEN + by_drive))
    for name in ("energy.dissipated", "energy.supplied", "energy.total"):
        np.testing.assert_allclose(one[name], other[name], atol=1e-10)
    assert one["energy.dissipated"][-1] > 0.2
    if "2 N.s/m" in by_time:  # u = v - 1 m/s falls as exp(-2 t)
        np.testing.assert_allclose(
            one["energy.dissipated"], 0.75**2 / 2 * (1 - np.exp(-4 * one.time)), atol=1e-10
        )


TURNING = (
    "import mech.{space}.*; import mech.fields.*; Body b(m = 1 kg, J = {J}, com = {com});"
    "Revolute j(world -> b.a, angle = 0.4 rad, der(angle) = 2 rad/s); frame arm = b.a * trans({at});"
    "Body c(m = 1 kg, J = {J}); Revolute k(arm -> c.a, der(angle) = -3 rad/s); frame tip = c.a * trans({at});"
    "{drag}; experiment(stop = 1 s, tolerance = 1e-10);"
)
PLANE = {"space": "planar", "J": "0.2 kg.m^2", "com": "{0.3, 0.1} m", "at": "{0.5, 0.2} m"}
SPACE = {
    "space": "spatial",
    "J": "diag({1, 2, 3} kg.m^2)",
    "com": "{0.3, 0.1, 0} m",
    "at": "{0.5, 0.2, 0.1} m",
}


@pytest.mark.parametrize("where", [PLANE, SPACE], ids=["plane", "space"])
@pytest.mark.parametrize(
    "drag",
    [
        "QuadraticDrag d(to = tip, k = 0.5 kg/m)",
        "force -0.5 kg/m*norm(vel(tip))*vel(tip) on tip",
        "force -1 N.s/m*(vel(tip) - vel(arm)) on tip from arm",
        "force -1 N.s/m*vel_at(c.a, tip) on c.a at tip",
        "force -1 N.s/m*components(c.a, vel(tip)) on tip in c.a",
        "torque -1 N.m.s*(angvel(c.a) - angvel(b.a)) on c.a from b.a",
        "torque -1 N.m.s*angvel(c.a) on c.a",
        "force -1 N.m.s*(der(j.angle) - der(k.angle)) on j.angle from k.angle",
    ],
)
def test_a_drag_on_what_turns_is_dissipated(drag: str, where: dict[str, str]) -> None:
    """Whatever the joints that carry it, a drag takes energy out, and brings none in."""
    run = mechc.loads(TURNING.format(drag=drag, **where)).simulate()
    lost = run["energy.total"][0] - run["energy.total"]
    assert lost[-1] > 0.01
    assert "energy.supplied" not in run
    np.testing.assert_allclose(run["energy.dissipated"], lost, atol=1e-8)

"""Steady motions against closed forms: governor, tops, conical pendulum, circular orbits."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechc
from mechc.runtime.outcome import SimulationError

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def steady(name: str, **settings: Any) -> list[dict[str, Any]]:
    found = mechc.load(EXAMPLES / f"{name}.mech").steady(**settings).summary()["steady"]
    assert isinstance(found, list)
    return found


def frequencies(one: dict[str, Any]) -> list[float]:
    return sorted(abs(v[1]) for v in one["eigenvalues"] if v[1] > 0)


def test_governor_leans_out_at_a_given_speed() -> None:
    """cos(theta) = g/(l w^2), and 0 and 180 degrees."""
    found = steady("governor", vary="theta")
    lean = math.acos(9.81 / (0.5 * 64))
    places = [one["values"]["theta"] for one in found]
    assert places == pytest.approx([-lean, 0, lean, math.pi], abs=1e-12)
    assert [one["stable"] for one in found] == [True, False, True, False]


def test_governor_with_the_momentum_of_its_start() -> None:
    """p = (I + 2 m l^2 sin^2) w with cos = g/(l w^2); the frequency is that of U'' at this momentum, by differences."""
    p = (0.2 + 0.5 * math.sin(0.5) ** 2) * 8
    for one in steady("governor"):
        theta, w = one["values"]["theta"], one["values"]["der(phi)"]
        assert (0.2 + 0.5 * math.sin(theta) ** 2) * w == pytest.approx(p, rel=1e-13)
        assert math.sin(theta) * (math.cos(theta) * 0.5 * w**2 - 9.81) == pytest.approx(0, abs=1e-11)
        if one["stable"]:

            def u(x: float) -> float:
                return p**2 / (2 * (0.2 + 0.5 * math.sin(x) ** 2)) - 9.81 * math.cos(x)

            h = 1e-3
            slope = (
                -u(theta - 2 * h) + 16 * u(theta - h) - 30 * u(theta) + 16 * u(theta + h) - u(theta + 2 * h)
            ) / (12 * h * h)
            assert frequencies(one) == pytest.approx([math.sqrt(slope / 0.5)], rel=1e-7)


def test_steady_precessions_of_a_top_are_two() -> None:
    """P13: A W^2 cos(theta) - C w3 W + m g l = 0 with w3 = psi' + W cos(theta); the stated errors hold."""
    found = steady("heavy_symmetric_top", vary="der(phi)")
    a, c, weight, theta = 0.5, 0.2, 9.81 / 2, 0.5
    spin = found[0]["values"]["der(psi)"]
    exact = sorted(np.roots([(a - c) * math.cos(theta), -c * spin, weight]))
    assert len(found) == 2 and all(one["stable"] for one in found)
    for one, rate in zip(found, exact, strict=True):
        assert abs(one["values"]["der(phi)"] - rate) <= one["errors"]["der(phi)"] + 4e-16 * rate
        assert one["errors"]["der(phi)"] < 1e-12


def test_a_top_that_spins_too_slowly_has_none() -> None:
    """(C w3)^2 < 4 A m g l cos(theta)."""
    assert steady("heavy_symmetric_top", vary="der(phi)", set={"der(psi)": 3.0}) == []


def test_conical_pendulum_and_circular_orbit() -> None:
    """W^2 = g/(l cos(theta)), in both directions; r = p^2/(m k) and the period of small deviations is that of the orbit."""
    found = steady("spherical_pendulum", vary="der(phi)")
    model = mechc.load(EXAMPLES / "spherical_pendulum.mech").simulate(stop=0.01)
    rate = math.sqrt(model.parameters["g"] / model.parameters["l"] / math.cos(model["theta"][0]))
    assert [one["values"]["der(phi)"] for one in found] == pytest.approx([-rate, rate], rel=1e-13)
    (one,) = steady("orbit_equation")
    assert one["values"] == pytest.approx({"r": 1, "der(phi)": 1}, rel=1e-13)
    assert frequencies(one) == pytest.approx([1], rel=1e-12)


def test_orbits_in_steep_fields_are_unstable() -> None:
    """U = -1/r^3: a maximum of the effective potential."""
    text = """\
model Steep
  dimensionless;
  coordinate r(min = 0.1) = 1;
  coordinate phi = 0;
  initial der(phi) = 2;
  kinetic 1/2*(der(r)^2 + r^2*der(phi)^2);
  potential -1/r^3;
end Steep;
"""
    (one,) = mechc.loads(text).steady().summary()["steady"]
    assert one["values"]["r"] == pytest.approx(3 / 4, rel=1e-12)  # p^2/r^3 = 3/r^4
    assert one["stable"] is False


def test_over_a_quantity() -> None:
    """From the speed sqrt(g/l) on the governor leans out: the number of steady motions changes there."""
    found = steady("governor", vary="theta", over="der(phi) = 4 .. 5, 5")
    for one in found:
        w, theta = one["parameter"]["der(phi)"], one["values"]["theta"]
        assert one["stable"] is (abs(theta) < 1e-9 if w < math.sqrt(2 * 9.81) else 1e-9 < abs(theta) < 3)
    assert len(found) == sum(2 if 4 + k / 4 < math.sqrt(2 * 9.81) else 4 for k in range(5))


def test_friction_on_the_shaft_leaves_only_rest() -> None:
    text = (EXAMPLES / "governor.mech").read_text(encoding="utf-8")
    model = mechc.loads(text.replace("experiment", "damping 0.1 N.m.s on phi; experiment"))
    assert model.steady(vary="theta").summary()["steady"] == []


@pytest.mark.parametrize(
    ("name", "settings", "said"),
    [
        ("kepler", {}, "no cyclic coordinate: its forces depend on x, y"),
        ("pendulum_cartesian", {}, "has constraints or rotations"),
        ("stick_slip_belt", {}, "switches"),
        ("lorenz", {}, "states of first order"),
        ("governor", {"vary": "phi"}, "'phi' cannot be sought"),
        ("governor", {"vary": "theta, der(phi)"}, "1 equations are left"),
    ],
)
def test_what_moves_otherwise_is_refused(name: str, settings: dict[str, str], said: str) -> None:
    with pytest.raises(SimulationError, match=said):
        steady(name, **settings)

"""Slow sweeps up and down: jumps against folds in closed form, and against a sweep that shares no code."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from shared_models import CUBIC

import mechc
from mechc.runtime.outcome import SimulationError

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


RELAY = """\
model Relay
  dimensionless;
  parameter u = -2;
  discrete Integer on = 0;
  state Real x = -2;
  equation der(x) = u - x;
  when x > 1 then
    on := 1;
  elsewhen x < -1 then
    on := 0;
  end when;
  output y = on;
end Relay;
"""

HANGING = """\
model Hanging
  dimensionless;
  parameter l = 1;
  coordinate x ~ 0.6;
  coordinate y ~ -0.8;
  kinetic 1/2*(der(x)^2 + der(y)^2);
  potential y;
  constraint x^2 + y^2 = l^2;
  damping 2 on x;
  damping 2 on y;
end Hanging;
"""


def sweep(text: str, **settings: Any) -> dict[str, Any]:
    found = mechc.loads(text).hysteresis(**settings).summary()
    assert isinstance(found, dict)
    return found


def test_folds_of_a_cubic() -> None:
    """x' = r + x - x^3 jumps at r = 2/(3 sqrt(3)) upwards, at the opposite value downwards; between them two branches."""
    fold = 2 / (3 * math.sqrt(3))
    found = sweep(CUBIC, over="r = -1 .. 1, 41", hold=150)
    assert [jump["direction"] for jump in found["jumps"]] == ["up", "down"]
    for jump, place in zip(found["jumps"], (fold, -fold), strict=True):
        low, high = sorted(jump["between"])
        assert low < place < high
    assert found["hysteresis"] == pytest.approx([-0.35, 0.35], abs=1e-12)
    for one in found["up"]:
        r = one["parameter"]["r"]
        roots = np.roots([-1, 0, 1, r])
        real = np.sort(roots[np.abs(roots.imag) < 1e-9].real)
        assert one["mean"] == pytest.approx(real[0] if r < fold else real[-1], abs=1e-4)


def test_discrete_variables_are_carried() -> None:
    found = sweep(RELAY, over="u = -2 .. 2, 9", hold=20, of="y")
    assert [jump["between"] for jump in found["jumps"]] == [[1, 1.5], [-1, -1.5]]


def test_constraints_hold_for_each_value() -> None:
    found = sweep(HANGING, over="l = 1 .. 2, 3", hold=60, of="y")
    assert [one["mean"] for one in found["up"]] == pytest.approx([-1, -1.5, -2], abs=1e-9)
    assert [one["mean"] for one in found["down"]] == pytest.approx([-2, -1.5, -1], abs=1e-9)


def by_scipy(values: list[float], a: float, gamma: float, rounds: int) -> list[float]:
    """The horizontally forced pendulum, theta'' = a w^2 sin(w t) cos(theta) - sin(theta) - gamma theta', carried on."""
    y, found = np.zeros(2), []
    for w in values:
        end = rounds * 2 * math.pi / w
        t = np.linspace(0.75 * end, end, 4000)
        run = solve_ivp(
            lambda t, y, w=w: [y[1], a * w * w * math.sin(w * t) * math.cos(y[0]) - math.sin(y[0]) - gamma * y[1]],
            (0, end), y, method="DOP853", rtol=1e-9, atol=1e-9, t_eval=t,
        )  # fmt: skip
        found.append(float(np.std(run.y[0])))
        y = run.y[:, -1]
    return found


@pytest.mark.slow
def test_a_forced_pendulum_folds_over() -> None:
    """U88, U152: the resonance of a strongly forced pendulum has two branches, going up and going down."""
    values = [0.87, 0.89, 0.91, 0.93]
    found = mechc.load(EXAMPLES / "forced_pendulum.mech").hysteresis(
        over="w = 0.87 .. 0.93, 4", hold="60*2*pi/w", set={"a": 0.1, "gamma": 0.05}
    )
    up, down = (np.array([one["rms"] for one in found.details[way]]) for way in ("up", "down"))
    expected = by_scipy([*values, *values[::-1]], 0.1, 0.05, 60)
    assert np.allclose(up, expected[:4], rtol=1e-4)
    assert np.allclose(down, expected[4:], rtol=1e-4)
    assert down[1] > 1.5 * up[2]  # at 0.89 and 0.91 the motion that came from above is the large one
    assert found.details["hysteresis"] is not None


def test_weakly_forced_it_does_not() -> None:
    """U88: small amplitudes are a w^2/sqrt((w^2 - 1)^2 + (w gamma)^2), both ways."""
    found = mechc.load(EXAMPLES / "forced_pendulum.mech").hysteresis(
        over="w = 0.8 .. 0.92, 3", hold="60*2*pi/w"
    )
    assert found.details["hysteresis"] is None and found.details["jumps"] == []
    for one in (*found.details["up"], *found.details["down"]):
        w = one["parameter"]["w"]
        amplitude = 1e-3 * w**2 / math.sqrt((w * w - 1) ** 2 + (0.1 * w) ** 2)
        assert math.sqrt(2) * one["rms"] == pytest.approx(amplitude, rel=3e-4)  # of the order of its square


def test_what_is_missing_is_said() -> None:
    with pytest.raises(SimulationError, match="what goes up and down, and how long each value is held"):
        sweep(CUBIC, over="r = -1 .. 1")
    with pytest.raises(SimulationError, match="'x' is part of the state"):
        sweep(CUBIC, over="x = -1 .. 1", hold=1)
    with pytest.raises(SimulationError, match="is held is positive, it is -1"):
        sweep(CUBIC, over="r = -1 .. 1", hold="-r^2")


def test_the_highest_value_is_that_beside_an_impact() -> None:
    """A ball hits the floor with sqrt(2 g h), and leaves it with half of that, in the last quarter of the hold, which is seen."""
    ball = mechc.loads(
        "parameter Length h = 1 m; coordinate Length y = h; kinetic 1/2*1 kg*der(y)^2; potential 9.81 N*y;"
        " contact floor: y restitution 0.5; parameter F = 0 N; force F on y;"
    )
    (row, _) = ball.hysteresis(over="F = 0 N .. 1e-9 N, 2", hold="0.5 s", of="der(y)").details["up"]
    assert row["lowest"] == pytest.approx(-math.sqrt(2 * 9.81), rel=1e-9)
    assert row["highest"] == pytest.approx(math.sqrt(2 * 9.81) / 2, rel=1e-9)

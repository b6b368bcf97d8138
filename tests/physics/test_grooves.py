"""Gaps that are the least of several: a body in the corner of a groove touches both sides, and each is a contact of its own."""

from __future__ import annotations

import numpy as np
import pytest

import mechc
from mechc.runtime.outcome import Outcome

GROOVE = """\
parameter e = 0;
parameter mu = 0;
parameter load = 0 N;
coordinate Length x = 0 m;
coordinate Length y = 1 m;
kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
potential 1 kg*9.81 m/s^2*y;
force load*cos(2 rad/s*time) on x;
let l = (y - x)/sqrt(2);
let r = (y + x)/sqrt(2);
experiment(stop = 2 s);
"""
TWO = """\
contact left: l restitution e friction mu along der(y) - der(x);
contact right: r restitution e friction mu along der(y) - der(x);
output push = multiplier(left) + multiplier(right);
output rests = if closed(left) or closed(right) then 1 else 0;
"""
ONE = """\
contact g: {} restitution e friction mu along der(y) - der(x);
output push = multiplier(g);
output rests = if closed(g) then 1 else 0;
"""
GAPS = ["min(l, r)", "(y - abs(x))/sqrt(2)", "if l < r then l else r"]
RUNS = [
    {},
    {"x": 1},
    {"x": 0.3, "e": 0.5},
    {"x": 0.3, "e": 0.5, "mu": 0.2},
    {"y": 0, "load": 20},
    {"x": 0.2, "load": 3, "mu": 0.1},
]
"""The middle of the bottom, down a side, bounces to and fro, with friction; a load that lifts it out and lets it fall in."""


@pytest.fixture(scope="module")
def two() -> mechc.Model:
    return mechc.loads(GROOVE + TWO)


@pytest.fixture(scope="module", params=GAPS)
def one(request: pytest.FixtureRequest) -> mechc.Model:
    return mechc.loads(GROOVE + ONE.format(request.param))


@pytest.mark.parametrize("values", RUNS)
def test_a_groove_is_two_contacts(one: mechc.Model, two: mechc.Model, values: dict[str, float]) -> None:
    ours, theirs = (m.simulate(set=values, estimate_error=False) for m in (one, two))
    assert ours.outcome is theirs.outcome is Outcome.COMPLETED
    for name in ("x", "y", "der(x)", "der(y)", "push", "rests", "energy.dissipated"):
        assert ours[name] == pytest.approx(theirs[name], abs=1e-9), name


def test_a_body_that_falls_into_the_corner_stays(one: mechc.Model) -> None:
    """All of m g h is lost, and both sides press with m g/sqrt(2)."""
    s = one.simulate(estimate_error=False)
    assert (s["x"][-1], s["y"][-1]) == pytest.approx((0, 0), abs=1e-12)
    assert s["energy.dissipated"][-1] == pytest.approx(9.81, rel=1e-12)
    assert s["push"][-1] == pytest.approx(9.81 * np.sqrt(2), rel=1e-9)


def test_all_of_a_groove_is_released() -> None:
    """After a second it falls again, through both sides."""
    text = GROOVE + ONE.format("min(l, r)") + "when time >= 1 s then release g; end when;"
    s = mechc.loads(text).simulate(estimate_error=False)
    assert s["y"][-1] == pytest.approx(-9.81 / 2, rel=1e-9) and s["rests"][-1] == 0


@pytest.mark.parametrize("height", [0, 1])
def test_a_corner_that_only_a_parameter_makes_hollow_ends_in_words(height: float) -> None:
    """Whether y - k |x| is a groove or a roof depends on k; before, a run went from side to side without an end."""
    text = GROOVE + "parameter k = 1; contact g: y - k*abs(x);"
    s = mechc.loads(text).simulate(set={"y": height}, estimate_error=False)
    assert s.outcome is Outcome.FAILED and "write a contact for each" in s.message
    assert s.time[-1] < 1

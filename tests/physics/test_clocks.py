"""Instants that are known before: ticks that belong together are one instant, and what begins at the start."""

from __future__ import annotations

import math

import numpy as np
import pytest

import mechc

BODY = "coordinate Length x = 0 m; kinetic 1/2*1 kg*der(x)^2;\n"
TASKS = """\
discrete Integer fast = 0;
discrete Integer slow = 0;
discrete Integer astray = 0;
when sample({fast}) then fast := fast + 1; end when;
when sample({slow}) then
  slow := slow + 1;
  astray := astray + (if fast == {ratio}*slow - {ratio} + 1 then 0 else 1);
end when;
"""


@pytest.mark.parametrize(
    ("fast", "slow", "ratio"),
    [
        ("0.1 s", "0.3 s", 3),
        ("T", "3*T", 3),
        ("T", "0.7 s", 7),
        ("T/7", "T", 7),
        ("1 ms", "0.11 s", 110),
        ("0.1 s, 0.05 s", "0.3 s, 0.05 s", 3),
    ],
)
def test_ticks_that_belong_together_are_one_instant(fast: str, slow: str, ratio: int) -> None:
    """The faster task stands first in the text, so that it has counted the common tick when the slow one acts."""
    text = "parameter T = 0.1 s;\n" + BODY + TASKS.format(fast=fast, slow=slow, ratio=ratio)
    solution = mechc.loads(text).simulate(stop=10.01, estimate_error=False)
    assert solution["slow"][-1] > 10
    assert solution["astray"][-1] == 0
    apart = np.diff([e.time for e in solution.events])
    assert not np.any((apart > 0) & (apart < 1e-6))


def test_a_tick_and_a_time_that_are_the_same() -> None:
    """3*0.1 is 0.30000000000000004: the tick, the time and the end of the run are one instant all the same."""
    text = BODY + "parameter T = 0.1 s; discrete Integer n = 0; discrete Integer seen = -1;\n"
    acts = "when sample(T) then n := n + 1; end when; when time >= 0.3 s then seen := n; end when;"
    solution = mechc.loads(text + acts).simulate(stop=0.3, estimate_error=False)
    assert (solution["n"][-1], solution["seen"][-1]) == (4, 4)


@pytest.mark.parametrize(
    ("condition", "times"),
    [
        ("time > 0 s", [0]),
        ("0 s < time", [0]),
        ("time >= 0 s", []),
        ("time > start", [0]),
        ("not time <= 0 s", [0]),
        ("time < 0 s", []),
        ("time > 0.5 s", [0.5]),
        ("time >= 0.5 s", [0.5]),
    ],
)
def test_what_becomes_true_at_the_start(condition: str, times: list[float]) -> None:
    """At 0 itself ``time > 0 s`` is false yet, and ``time >= 0 s`` has been true from the beginning."""
    text = "parameter start = 0 s; discrete Integer n = 0;\n" + BODY
    solution = mechc.loads(text + f"when {condition} then n := n + 1; end when;").simulate(stop=1)
    assert [e.time for e in solution.events] == times
    assert solution["n"][-1] == len(times)


@pytest.mark.parametrize(
    ("other", "first"),
    [
        ("when sample(0.1999998 s) then m := m + 1; end when;", 1),
        ("when time > 0.1999998 s then m := m + 1; end when;", 0),
    ],
)
def test_clocks_that_nearly_meet_are_no_accumulation(other: str, first: int) -> None:
    """Their last interval is a millionth of those before, and is not a bounce that dies away."""
    text = BODY + "discrete Integer n = 0; discrete Integer m = 0; initial der(x) = 1 m/s;\n"
    acts = f"when sample(0.05 s) then n := n + 1; end when; {other}"
    solution = mechc.loads(text + acts).simulate(stop=0.52)
    assert solution.outcome.value == "completed", solution.message
    assert (solution["n"][-1], solution["m"][-1]) == (11, first + (2 if first else 1))


@pytest.mark.parametrize("lag", [1e-9, 1e-12])
def test_a_clock_is_not_blamed_for_a_motion_that_slides_along_a_jump(lag: float) -> None:
    """It ticked long before: x + v, which a filter follows, is zero after sqrt(1.6) - 1 s and is held there by both sides of the law."""
    text = f"""
    coordinate x = 0.3 m; kinetic 1/2*1 kg*der(x)^2; force if z > 0 m/s then -1 N else 1 N on x;
    state Velocity z = 1 m/s; equation der(z) = (x/(1 s) + der(x) - z)/({lag} s);
    discrete Integer n = 0; when sample(0.05 s) then n := n + 1; end when;
    """
    solution = mechc.loads(text).simulate(stop=2, tolerance=1e-6, method="radau5")
    assert solution.outcome.value == "failed" and "slides along it" in solution.message
    assert solution["n"][-1] == 6 and abs(solution.time[-1] - (math.sqrt(1.6) - 1)) < 1e-6


def test_bounces_beside_a_clock_still_accumulate() -> None:
    text = (
        "coordinate Length h = 1 m; kinetic 1/2*1 kg*der(h)^2; potential 9.81 N*h; discrete Integer n = 0;\n"
    )
    acts = "when sample(0.05 s) then n := n + 1; end when; when h < 0 m then reinit(der(h), -0.5*der(h)); end when;"
    solution = mechc.loads(text + acts).simulate(stop=3)
    assert solution.outcome.value == "failed" and "ever shorter intervals" in solution.message

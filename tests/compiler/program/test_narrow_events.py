"""Which models have events, and derivatives, that are looked at closely."""

from __future__ import annotations

import pytest

import mechc

HELD = (
    "coordinate Length x = 0 m;kinetic 1/2*4 kg*der(x)^2;friction 3 N on x;parameter T = 2 s;let s = time/T;"
)
LATER = "discrete Time d = 0 s;when x > 1 m then d := 1 s; end when;"


@pytest.mark.parametrize(
    "force",
    [
        "exp(-s)",
        "1/(1 + s^2)",
        "(1 + s^2)^(-0.3)",
        "sqrt(1 + s^2)",
        "log(1 + s^2)",
        "asinh(s)",
        "2^s",
        "cos(s)^40",
        "abs(cos(s))^9.5",
        "s/(2 + s*cos(s))",
        "table(s, {0, 1, 2, 3}, {0, 1, 0, 0})",
        "a",
        "max(0, 1 - s^2)",
        "max(0, sin(s) - 0.9)",
        "max(0, 1 - abs(mod(s, 10) - 5))",
        "1/(1 + (s - d/(1 s))^2)",
        "max(0, 1 - abs(x/(1 m)))",
        "max(0, 1 - (x/(1 m))^2)",
        "min(1, abs(der(x)/(1 m/s) - 1))",
    ],
)
def test_peaks_in_time(force: str) -> None:
    given = "input Real a = exp(-s^2);" if force == "a" else ""
    problem = mechc.loads(f"{HELD}{LATER}{given}force 1 N*({force}) on x;").problem()
    assert problem.narrow_events
    assert problem.narrow


@pytest.mark.parametrize(
    "force",
    [
        "max(0, 1 - abs(s))",
        "abs(s - 1) - 2*abs(s) + abs(s + 1)",
        "min(1, max(0, s))",
        "clamp(s, 0, 1) - clamp(s - 1, 0, 1)",
    ],
)
def test_steps_end_at_kinks_of_lines_of_time(force: str) -> None:
    """Runs see these as they are; whoever steps otherwise may not."""
    problem = mechc.loads(f"{HELD}force 1 N*({force}) on x;").problem()
    assert problem.narrow_events
    assert not problem.narrow
    assert problem.timed_points


@pytest.mark.parametrize(
    "force",
    [
        "1",
        "exp(-T/(1 s))",
        "1/(1 + (T/(1 s))^2)",
        "s",
        "s^3 - s",
        "sin(s)*cos(3*s)^2",
        "1/(3 + s)",
        "1/(2 + cos(s))",
        "sqrt(2 + cos(s))",
        "mod(s, 1)",
        "floor(s)",
        "max(0, x/(1 m))",
        "abs(x)/(1 m) - 1",
        "abs(der(x))*der(x)/(1 m/s)^2",
        "(if s < 1 then 1 else s)",
        "1/(1 + (x/(1 m) - s)^2)",
        "a",
    ],
)
def test_what_is_wide(force: str) -> None:
    problem = mechc.loads(f"{HELD}input Real a = sin(s);force 1 N*({force}) on x;").problem()
    assert not problem.narrow_events
    assert not problem.narrow


def test_without_events_there_is_none_to_look_for() -> None:
    text = "coordinate Length x = 0 m;kinetic 1/2*4 kg*der(x)^2;force 1 N/(1 + (time/(1 s))^2) on x;"
    problem = mechc.loads(text).problem()
    assert problem.narrow
    assert not problem.narrow_events


def test_a_limit_that_is_cut() -> None:
    problem = mechc.loads(
        "coordinate Length x = 0 m;kinetic 1/2*4 kg*der(x)^2;force 1 N on x;"
        "friction min(3 N, 2 N*abs(time/(1 s) - 1)) on x;"
    ).problem()
    assert problem.narrow_events

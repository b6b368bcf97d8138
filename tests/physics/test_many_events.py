"""Ten thousand events of a kind: none is lost, none is found twice, and the energy balance closes."""

from __future__ import annotations

import math

import numpy as np
import pytest

import mechc
from mechc.solution import Solution

GRAVITY = 9.81

PLATE = """\
parameter w = 100 rad/s;
parameter A = 1 mm;
parameter phase = 0 rad;
parameter e = 0.8;
coordinate Length h = 1 m;
kinetic 1/2*(1 kg)*der(h)^2;
potential (9.81 N)*h;
contact plate: h - A*sin(w*time + phase) restitution e;
"""

BELT = """\
parameter u = 1.962 m/s;
coordinate x = 0 m;
initial der(x) = u;
kinetic 1/2*(1 kg)*der(x)^2;
potential 1/2*(1 N/m)*x^2;
friction 0.2*(9.81 N) static 0.3*(9.81 N) on x - u*time;
"""


def times(solution: Solution, kind: str) -> np.ndarray:
    return np.array([e.time for e in solution.events if e.kind == kind])


def closes(solution: Solution, relative: float) -> bool:
    drift = solution.accuracy.energy
    return drift is not None and drift.relative is not None and drift.relative < relative


@pytest.mark.parametrize("periods", [1, 20])
def test_ten_thousand_bounces_in_step_with_a_vibrating_plate(periods: int) -> None:
    """A stable orbit: each flight lasts a whole number of the plate's periods.

    With T the flight, g T/2 - u = e (g T/2 + u) for the speed u = A w cos(phase) of the plate at the impact; it is
    stable for 0 < K < 2 (1 + e), K = 2 (1 + e) A w^2 sin(phase)/g (P. J. Holmes 1982); here K = 1. In steps of the
    free flight the plate vibrates many times.
    """
    e, w = 0.8, 100.0
    flight = periods * 2 * math.pi / w
    along = GRAVITY * flight / 2 * (1 - e) / (1 + e) * w
    across = GRAVITY / (2 * (1 + e))
    phase, amplitude = math.atan2(across, along), math.hypot(along, across) / w**2
    values = {
        "A": amplitude,
        "phase": phase,
        "h": amplitude * math.sin(phase),
        "der(h)": GRAVITY * flight / 2,
    }
    model = mechc.loads(PLATE)
    solution = model.simulate(stop=10_000.5 * flight, estimate_error=False, set=values)
    hits = times(solution, "impact")
    assert len(hits) == 10_000
    assert hits == pytest.approx(flight * np.arange(1, 10_001), rel=1e-11)
    assert closes(solution, 1e-9)


@pytest.mark.parametrize(("w", "amplitude", "e"), [(3000.0, 4e-5, 0.8), (2e4, 1e-5, 0.8), (1e5, 2e-6, 0.8)])
def test_no_impact_is_missed_on_a_plate_that_vibrates_fast(w: float, amplitude: float, e: float) -> None:
    """Between two impacts the flight is a parabola, which is held against the plate a hundred times a period.

    The motion is chaotic: rounding decides whether some impacts pile up. The ball then rests on the plate, which presses,
    and is released where the plate falls back as fast as the ball would.
    """
    values = {"w": w, "A": amplitude, "e": e}
    solution = mechc.loads(PLATE).simulate(stop=40, estimate_error=False, set=values)
    events = [event for event in solution.events if event.kind != "when"]
    assert sum(event.kind == "impact" for event in events) > 200
    assert not {event.kind for event in events} - {"impact", "rest", "lift-off"}
    begin, height, speed, resting = 0.0, 1.0, 0.0, False
    for event in events:
        falls_back = amplitude * w**2 * math.sin(w * event.time)
        assert resting == (event.kind == "lift-off")
        if event.kind == "impact":
            flight = event.time - begin
            t = np.linspace(0, flight, int(100 * flight * w / (2 * math.pi)) + 100)[:-1]
            gap = height + speed * t - GRAVITY / 2 * t**2 - amplitude * np.sin(w * (begin + t))
            assert np.min(gap) > -1e-9 * amplitude - 1e-14
            speed = event.after["der(h)"]
        elif event.kind == "rest":
            assert falls_back < GRAVITY
        else:
            # a time is right to a rounding of 40 s: 7e-15 s, and the acceleration to w times that of its amplitude
            assert falls_back == pytest.approx(GRAVITY, abs=1e-12 * amplitude * w**3)
            speed = amplitude * w * math.cos(w * event.time)
        begin, height, resting = event.time, amplitude * math.sin(w * event.time), event.kind == "rest"
    assert closes(solution, 1e-9)


@pytest.mark.slow
def test_ten_thousand_cycles_of_stick_and_slip() -> None:
    """Each cycle slips for 2 pi - 2 atan(1/2) and sticks for 1: see test_friction."""
    period = 2 * math.pi - 2 * math.atan(0.5) + 1
    solution = mechc.loads(BELT).simulate(stop=1.5 + 9_999.5 * period, estimate_error=False)
    slips, sticks = times(solution, "slip"), times(solution, "stick")
    assert len(slips) == 10_000
    assert len(sticks) == 9_999  # it sticks at the start
    assert slips == pytest.approx(1.5 + period * np.arange(10_000), rel=1e-8)
    assert np.all(slips[:-1] < sticks) and np.all(sticks < slips[1:])
    assert closes(solution, 1e-8)


@pytest.mark.slow
def test_rows_beyond_those_of_formulas_are_solved_by_numbers() -> None:
    """Up to 64 contacts have formulas of their own; beyond that the forces are found by numbers, and the motion is the same."""
    text = """
    model Drop
      coordinate Length h = 1 m;
      kinetic 1/2*(1 kg)*der(h)^2;
      potential (9.81 N)*h;
      contact floor: h restitution 0.5;
    end Drop;
    model Rain
      Drop drop[COUNT];
    end Rain;
    """
    fall = math.sqrt(2 / 9.81)
    for count in (64, 65):
        found = mechc.loads(text.replace("COUNT", str(count))).simulate(stop=0.6, estimate_error=False)
        assert found.outcome.value == "completed"
        assert [e.time for e in found.events] == pytest.approx(count * [fall], rel=1e-12)
        assert {e.name for e in found.events} == {f"drop[{k + 1}].floor" for k in range(count)}
        speeds = [found[f"der(drop[{k + 1}].h)"][-1] for k in range(count)]
        assert speeds == pytest.approx(count * [0.5 * 9.81 * fall - 9.81 * (0.6 - fall)], rel=1e-10)


def test_turns_under_a_constant_torque_are_no_accumulation() -> None:
    """The n-th turn is full at sqrt(4 pi n): intervals shrink without an end."""
    solution = mechc.loads(
        "discrete Integer n = 0; coordinate Angle a = 0 rad; kinetic 1/2*1 kg.m^2*der(a)^2; force 1 N.m on a; "
        "when a > 2*pi*(n + 1) then n := n + 1; end when;"
    ).simulate(stop=60)
    assert solution["n"][-1] == 286 == math.floor(60**2 / 2 / (2 * math.pi))
    times = [e.time for e in solution.events]
    assert times == pytest.approx([math.sqrt(4 * math.pi * n) for n in range(1, 287)], rel=1e-9)


@pytest.mark.parametrize("restitution", [0.5, 0.9, 0.99])
def test_bounces_by_when_pile_up(restitution: float) -> None:
    """Intervals of a constant ratio end: the run says so."""
    solution = mechc.loads(
        "coordinate h = 1 m; kinetic 1/2*(1 kg)*der(h)^2; potential (9.81 N)*h; "
        f"when h < 0 m then reinit(der(h), -{restitution}*der(h)); end when;"
    ).simulate(stop=1000)
    assert solution.failure is not None and "shorter intervals" in solution.message


@pytest.mark.parametrize("condition", ["sample(1e-18 s)", "sin(x*1e18) >= 0"])
def test_events_that_lead_nowhere_near_time_zero_are_bounded(condition: str) -> None:
    """1e18 events would have to be counted; beside t = 1e-15 s, a thousand of them are not a small part."""
    solution = mechc.loads(
        "coordinate x = 0; initial der(x) = 1 s^-1; kinetic 1/2*(1 kg.m^2)*der(x)^2; discrete n = 0; "
        f"when {condition} then n := n + 1; end when;"
    ).simulate(stop=1.0, estimate_error=False)
    assert solution.outcome.value == "failed"
    assert "ever shorter intervals" in solution.message or "to and fro" in solution.message
    assert solution.time[-1] < 1e-12

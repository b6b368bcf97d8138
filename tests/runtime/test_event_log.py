"""Events of a run: kept as the kernel notes them, made when they are asked for."""

from __future__ import annotations

import itertools
import math

import pytest

import mechc
from mechc.runtime.integrate.events import Event, Events

BALL = """model Ball
  parameter m = 1 kg;
  parameter h = 1 m;
  parameter g = 9.81 m/s^2;
  coordinate Length y = 1 m;
  kinetic 1/2*m*der(y)^2;
  potential m*g*y;
  contact floor: y restitution 0.999;
  experiment(stop = 400 s);
end Ball;
"""


@pytest.fixture(scope="module")
def bounced() -> mechc.Solution:
    return mechc.loads(BALL).simulate(estimate_error=False)


def test_events_of_a_ball_are_at_its_bounces(bounced: mechc.Solution) -> None:
    speeds = [math.sqrt(2 * 9.81) * 0.999**k for k in range(len(bounced.events))]
    flights = [0.0, *(2 * speed / 9.81 for speed in speeds[1:])]
    times = [math.sqrt(2 / 9.81) + before for before in itertools.accumulate(flights)]
    assert len(times) > 512  # more than the first buffer holds
    assert [event.time for event in bounced.events] == pytest.approx(times, rel=1e-6)
    assert [event.value for event in bounced.events] == pytest.approx(speeds, rel=1e-6)
    for event, speed in zip(bounced.events, speeds, strict=True):
        assert (event.name, event.kind) == ("floor", "impact")
        assert event.before["der(y)"] == pytest.approx(-speed, rel=1e-6)
        assert event.after["der(y)"] == pytest.approx(0.999 * speed, rel=1e-6)
        assert "y" not in event.after


def test_events_are_a_sequence(bounced: mechc.Solution) -> None:
    events = bounced.events
    assert events[:2] == (events[0], events[1]) and events[-1] == events[len(events) - 1]
    assert events == tuple(events) and events != events[1:]
    assert isinstance(events[0], Event)
    with pytest.raises(IndexError):
        events[len(events)]


def test_events_are_made_when_they_are_asked_for(bounced: mechc.Solution) -> None:
    events = bounced.events
    assert isinstance(events, Events)
    assert events.noted.nbytes == 32 * len(events)
    assert events[0] == events[0] and events[0] is not events[0]

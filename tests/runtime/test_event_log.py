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


@pytest.mark.parametrize(
    ("text", "names"),
    [
        (
            "model Cell coordinate Length x = 1 m; initial der(x) = -1 m/s; kinetic 1/2*1 kg*der(x)^2;"
            "when x < 0 m then reinit(der(x), -der(x)); end when; end Cell;"
            "model M Cell c[3](x = {1, 2, 3} m); experiment(stop = 3.5 s); end M;",
            ["c[1]: x < 0 m", "c[2]: x < 0 m", "c[3]: x < 0 m"],
        ),
        (
            "coordinate Length x[2] = {1, 2} m; for i in 1:2 loop kinetic 1/2*1 kg*der(x[i])^2; initial der(x[i]) = -1 m/s;"
            "when x[i] < 0 m then reinit(der(x[i]), -der(x[i])); end when; end for; experiment(stop = 2.5 s);",
            ["x[1] < 0", "x[2] < 0"],
        ),
    ],
)
def test_events_of_arrays_name_their_element(text: str, names: list[str]) -> None:
    """All elements had one name, the text of their condition."""
    run = mechc.loads(text).simulate(estimate_error=False)
    assert [event.name for event in run.events] == names

"""What begins while nothing moves is seen, where steps have grown past it."""

from __future__ import annotations

import math
from typing import Any

import pytest

import mechc
from mechc.runtime.outcome import Outcome

PUSH = "force 100 N*exp(-((time - 55 s)/(10 ms))^2) on x;"
IMPULSE = 100 * 0.01 * math.sqrt(math.pi)


def slider(push: str, speed: float = 0.0) -> str:
    return f"coordinate Length x = 0 m; initial der(x) = {speed} m/s; kinetic 1/2*1 kg*der(x)^2; {push}"


@pytest.mark.parametrize("speed", [0.0, 2.0])
def test_push_after_rest(speed: float) -> None:
    """The step has grown to ten seconds when a push of ten milliseconds comes."""
    solution = mechc.loads(slider(PUSH, speed)).simulate(stop=100, tolerance=1e-9)
    assert solution.outcome is Outcome.COMPLETED
    assert solution["der(x)"][-1] == pytest.approx(speed + IMPULSE, rel=1e-7)
    assert solution["x"][-1] == pytest.approx(100 * speed + 45 * IMPULSE, rel=1e-7)
    remark = solution.remarks[0]
    assert remark.startswith("something begins at t = 54.9")
    assert "repeated with steps of at most 0.0" in remark


def test_push_on_what_rests_on_a_floor() -> None:
    """It is pushed up so hard that the contact, which holds it, has to let it go."""
    text = (
        slider("", 0)
        + "potential 10 N*x; contact floor: x; state s = 0; equation der(s) = exp(-((time - 55 s)/(10 ms))^2)*1 Hz;"
    )
    solution = mechc.loads(text).simulate(stop=100, tolerance=1e-10)
    assert solution["s"][-1] == pytest.approx(0.01 * math.sqrt(math.pi), rel=1e-7)


def test_fixed_steps_say_what_they_pass_over() -> None:
    solution = mechc.loads(slider(PUSH)).simulate(stop=100, method="gauss4", step=0.7)
    assert any("take steps of 0.0" in remark for remark in solution.remarks)


@pytest.mark.parametrize(
    ("text", "stop"),
    [
        (slider(""), 100),
        (slider("", 3.0), 1e6),
        (slider("potential 1/2*4 N/m*x^2;"), 100),
        (slider("force 1 N on x; friction 2 N on x;"), 100),
        (
            slider("", 1e-9)
            + "coordinate Angle a = 1e9 rad; kinetic 1/2*1 kg.m^2*der(a)^2; initial der(a) = 1e7 rad/s;",
            10,
        ),
        (slider("potential 10 N*x; contact floor: x;"), 10),
        (
            "coordinate Rotation R; initial der(R) = {0, 0, 3} rad/s; inertia diag({1, 2, 3} kg.m^2) on world*R;",
            10,
        ),
        (slider("input Force u = 0 N; force u*sin(time/(1 s)) on x;"), 100),
    ],
)
def test_where_nothing_begins_nothing_is_said(text: str, stop: float) -> None:
    options: dict[str, Any] = {"stop": stop}
    solution = mechc.loads(text).simulate(**options)
    assert solution.outcome is Outcome.COMPLETED
    assert not any("begins" in remark for remark in solution.remarks)
    assert solution.statistics.steps < 200


TABLED = """model M
  input Force push = 0 N;
  coordinate Length x = 0 m;
  coordinate Length y = 0 m;
  kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
  force push on x;
  potential 10 N*y;
  contact floor: y;
  experiment(stop = 10 s);
end M;
"""

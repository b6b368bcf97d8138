"""Conditions that compare what a constraint keeps equal: their values are rounding, and a run with them ends."""

from __future__ import annotations

import math

import pytest

import mechc

PAIR = """\
coordinate Length a = 0 m;
coordinate Length b = 0 m;
kinetic 1/2*1 kg*der(a)^2 + 1/2*2 kg*der(b)^2;
force 3 N on a;
damping 0.5 N.s/m on b;
"""


@pytest.mark.parametrize(
    "text",
    [
        "constraint lock: der(b) = der(a); when der(a) > der(b) then engage lock; end when;",
        "constraint lock: der(b) = der(a); when der(a) >= der(b) then engage lock; end when;",
        "constraint lock: b = a; when a > b then engage lock; end when;",
        "constraint lock: b = a; discrete Integer n = 0; when a - b > 0 m then n := n + 1; end when;",
        "constraint lock: b = a; when 2*a > a + b then engage lock; end when;",
    ],
)
def test_a_condition_of_rounding_changes_nothing(text: str) -> None:
    """Both move as 3 kg with a drag: v = 6 m/s (1 - exp(-t/(6 s)))."""
    solution = mechc.loads(PAIR + text).simulate(stop=1)
    assert solution.time[-1] == 1
    assert solution.statistics.steps < 100
    assert solution["der(a)"][-1] == pytest.approx(6 * (1 - math.exp(-1 / 6)), rel=1e-9)
    assert solution["b"][-1] == pytest.approx(6 - 36 * (1 - math.exp(-1 / 6)), rel=1e-8)


VALLEY = """
model Valley
  coordinate Length x = 1 m;
  initial der(x) = 0.3 m/s;
  kinetic 1/2*1 kg*der(x)^2;
  potential 3 N*abs(x);
  {law}
  experiment(stop = 60 s);
end Valley;
"""


def test_rest_in_a_valley_of_dry_friction_is_told() -> None:
    """It went on in ever smaller steps without a word. Up it brakes with 4 m/s^2, down it gains 2: each height is half the one before,
    and the durations sum to 0.075 s + (sqrt(h) + sqrt(h)/2)/(1 - sqrt(1/2)), h = 1 + 0.3^2/8."""
    run = mechc.loads(VALLEY.format(law="friction 1 N on x;")).simulate(estimate_error=False)
    assert run.failure is not None and run.failure.kind == "chattering"
    assert "comes to rest where a force jumps at 'x < 0'" in run.failure.message
    height = 1 + 0.3**2 / 8
    rest = 0.075 + 1.5 * height**0.5 / (1 - 0.5**0.5)
    assert run.time[-1] == pytest.approx(rest, abs=0.01)  # and a thousand turns more
    assert abs(run["x"][-1]) < 1e-8 and run.statistics.steps < 5000


@pytest.mark.slow
def test_rest_in_a_valley_of_damping_is_told() -> None:
    """Bounces of height h last sqrt(h), without an end: h falls by (1 - c v/3 ...)^2 each."""
    run = mechc.loads(VALLEY.format(law="damping 2 N.s/m on x;")).simulate(estimate_error=False)
    assert run.failure is not None and "comes to rest where a force jumps" in run.failure.message
    assert abs(run["x"][-1]) < 1e-8


def test_a_motion_that_only_gets_small_goes_on() -> None:
    """To and fro through the bend of a force that does not jump: a decaying oscillation below its tolerance is a motion. Over 60 s it
    turns 60 s/(pi/300 + pi/200) = 2300 times, of which 1600 with less than 1e-8 of its first amplitude, exp(-t)."""
    text = VALLEY.replace("potential 3 N*abs(x);", "force (if x > 0 m then -9e4 N/m else -4e4 N/m)*x on x;")
    run = mechc.loads(text.format(law="damping 2 N.s/m on x;")).simulate(estimate_error=False)
    assert run.failure is None and run.time[-1] == 60


BURSTS = {
    "turns": """
        model Turns
          dimensionless;
          coordinate x = -850; initial der(x) = -0.4; kinetic 1/2*0.55*der(x)^2; potential 1/2*2.1*x^2; damping 0.4 on x;
          coordinate y = 900; initial der(y) = -0.2; kinetic 1/2*1.2*der(y)^2; potential 1/2*2.2*y^2; damping 0.07 on y;
          coordinate z = 490; initial der(z) = -1; kinetic 1/2*0.52*der(z)^2; potential 1/2*1.5*z^2; damping 0.27 on z;
          coordinate u = 0.9; potential 1/2*5.1*(y - u)^2; damping 1.6 on u - x; friction slide: 0.5 on u - x;
          coordinate w = 0.7; potential 1/2*2.9*(y - w)^2; damping 0.9 on w - z;
          force -0.74*z^2 on z;
          force 0.33*cos(x)*delay(x^2, 0.35) on y;
          experiment(stop = 3, tolerance = 1e-11);
        end Turns;
        """,
    "looks": """
        model Looks
          dimensionless;
          coordinate z = -30; initial der(z) = 1;
          coordinate y = 0.3;
          coordinate u = 0.1;
          kinetic 1/2*der(z)^2 + 1/2*der(y)^2;
          potential -1/2*z^3 + 5*(y - z)^2 + 1/2*(y - u)^2;
          damping 1.5 on u - y;
          friction slide: 0.5 on u - y;
          experiment(stop = 3, tolerance = 1e-11);
        end Looks;
        """,
}


@pytest.mark.parametrize("name", BURSTS)
def test_what_goes_to_infinity_is_not_told_to_slide(name: str) -> None:
    """z'' = c z^2 ends in a pole, z = (6/c)/(t - t0)^2. Frictions beside it turned to and fro by rounding there, and were blamed."""
    run = mechc.loads(BURSTS[name]).simulate(estimate_error=False)
    assert run.failure is not None
    assert run.failure.kind in ("step too small", "not finite") and run.failure.name == "der(z)"
    assert abs(run["z"][-1]) > 1e15
    c = {"turns": 0.74 / 0.52, "looks": 1.5}[name]
    early = run.time[-1] - 1e-3
    assert abs(run(early)["z"]) == pytest.approx(6 / c / 1e-6, rel=0.02)

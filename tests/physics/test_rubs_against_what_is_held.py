"""Frictions on what others hold, a constraint or a drive: they slide as soon as what they rub against moves.

Judges: the work of a force that is known, over a way that is.
"""

from __future__ import annotations

from math import pi, sqrt

import pytest

import mechc

HELD = "coordinate Length x = 0 m; kinetic 1/2*1 kg*der(x)^2; constraint x = 0 m;"
LIES = HELD + "coordinate Length y = 0 m; kinetic 1/2*1 kg*der(y)^2; potential 9.81 N*y;"
SLOWLY = "let belt = 1 m/s*(time/1 s)^3;"
LATER = "let belt = 1 m/s*max(0, time/1 s - 1)^3;"
PULSE = "let belt = 1 m/s*exp(-((time - 18.01 s)/(10 ms))^2);"
WAVE = "let belt = 1 m/s*sin(3*time/1 s);"


@pytest.mark.parametrize(
    ("text", "stop", "expected"),
    [
        (f"{HELD} {SLOWLY} friction 5 N on der(x) - belt;", 2.0, 5 * 4),
        (f"{HELD} {LATER} friction 5 N on der(x) - belt;", 2.0, 5 / 4),
        (f"{HELD} {PULSE} friction 5 N on der(x) - belt;", 30.0, 5 * 0.01 * sqrt(pi)),
        (f"{HELD} {WAVE} friction 5 N on der(x) - belt;", pi, 5 * 2),
        (f"{LIES} {SLOWLY} contact c: y friction 0.5 along der(x) - belt;", 2.0, 4.905 * 4),
        (f"{LIES} {PULSE} contact c: y friction 0.5 along der(x) - belt;", 30.0, 4.905 * 0.01 * sqrt(pi)),
        (
            f"{LIES} coordinate Length z = 0 m; kinetic 1/2*1 kg*der(z)^2; constraint z = 0 m; {SLOWLY}"
            "contact c: y friction 0.5 along {der(x) - 0.6*belt, der(z) - 0.8*belt};",
            2.0,
            4.905 * 4,
        ),
        (
            "coordinate Length x = 0 m; kinetic 1/2*1 kg*der(x)^2; friction 1 N on x;"
            "coordinate Length p; drive p = 1 m*(time/1 s)^4; friction 5 N on p;",
            2.0,
            5 * 16,
        ),
    ],
    ids=[
        "slowly",
        "later",
        "a pulse",
        "to and fro",
        "a contact",
        "a contact, a pulse",
        "a surface",
        "a drive",
    ],
)
def test_the_work_of_the_friction(text: str, stop: float, expected: float) -> None:
    found = mechc.loads(f"{text} experiment(stop = {stop!r} s);").simulate(estimate_error=False)
    assert found["energy.dissipated"][-1] == pytest.approx(expected, rel=1e-7)
    assert found["energy.supplied"][-1] == pytest.approx(expected, rel=1e-7)


def test_what_stands_on_many_feet_goes_with_a_shaking_table() -> None:
    """Of four feet two or three frictions hold the rest; none of them slides below the limit."""
    feet = " ".join(f"contact c{k}: y - h friction 0.5 along {{der(x) - der(s), der(z)}};" for k in range(4))
    text = (
        "coordinate Length x = 0 m; coordinate Length z = 0 m; coordinate Length y = 0 m; let h = 0 m; coordinate Length s;"
        "drive s = 10 mm*sin(7*time/1 s)^4; kinetic 1/2*1 kg*(der(x)^2 + der(y)^2 + der(z)^2); potential 9.81 N*y;"
        f"{feet} experiment(stop = 5 s);"
    )
    found = mechc.loads(text).simulate(estimate_error=False)
    assert found["x"] == pytest.approx(found["s"], abs=1e-8)
    assert found["energy.dissipated"][-1] == pytest.approx(0, abs=1e-7)
    assert not found.events

"""Contacts that hit at one instant with the same speed: the motion does not depend on which stands first in the text."""

from __future__ import annotations

import math

import pytest
from slow_params import slow_but

import mechc
from mechc.runtime.outcome import Outcome

BOX = """
parameter speed = 0 m/s;
parameter e = 0;
parameter mu = 0;
gravity {0, -9.81} m/s^2;
coordinate Length x = 0 m;
coordinate Length y = 1 m;
coordinate Angle a = 0 deg;
initial der(x) = speed;
frame box = world * trans({x, y}) * rot(a);
mass 1 kg at box;
inertia 0.05 kg.m^2 on box;
point left = box * {-0.3, -0.1} m;
point right = box * {0.3, -0.1} m;
"""
LEGS = [
    f"contact on_{leg}: {leg}[2] restitution e friction mu along vel({leg})[1];" for leg in ("left", "right")
]


def in_both_orders(text: str, first: str, second: str) -> list[mechc.Model]:
    return [mechc.loads(f"{text}{first}\n{second}\n") for first, second in ((first, second), (second, first))]


@pytest.fixture(scope="module")
def boxes() -> list[mechc.Model]:
    return in_both_orders(BOX, *LEGS)


@pytest.mark.parametrize("e", [0, 0.5, 1])
@pytest.mark.parametrize("mu", [0, 0.3, 2])
@pytest.mark.parametrize("speed", [0, 1, 10])
def test_a_box_that_falls_flat_does_not_turn(
    boxes: list[mechc.Model], e: float, mu: float, speed: float
) -> None:
    """It rises with e times its speed, and friction takes mu (1 + e) of that from the slip, or all of the slip."""
    fall, rise = math.sqrt(2 * 0.9 / 9.81), 0.05
    down = 9.81 * fall
    slip = max(0, speed - mu * (1 + e) * down)
    height = e * down * rise - 9.81 * rise**2 / 2 if e else 0
    way = slip * rise - (mu * 9.81 * rise**2 / 2 if not e and slip else 0)
    settings = {"e": e, "mu": mu, "speed": speed}
    for box in boxes:
        s = box.simulate(stop=fall + rise, set=settings, estimate_error=False)
        assert s["a"][-1] == pytest.approx(0, abs=1e-12)
        assert [event.time for event in s.events][:2] == pytest.approx([fall, fall])
        assert s["y"][-1] == pytest.approx(0.1 + height, abs=1e-9)
        assert s["x"][-1] == pytest.approx(speed * fall + way, abs=1e-9)


BALLS = """
coordinate Length x = 0 m;
coordinate Length y = -1 m;
coordinate Length u1 = 0.5 m;
coordinate Length v1 = 0 m;
coordinate Length u2 = -0.5 m;
coordinate Length v2 = 0 m;
initial der(y) = 1 m/s;
kinetic 1/2*1 kg*(der(x)^2 + der(y)^2 + der(u1)^2 + der(v1)^2 + der(u2)^2 + der(v2)^2);
"""


@pytest.mark.parametrize(("mu", "speed"), [(0.1, 2.6), (0.2, 4.6)])
def test_a_box_that_bounces_flat_slides_on_flat(boxes: list[mechc.Model], mu: float, speed: float) -> None:
    """At every bounce both corners slide, though one of them would pull if both stuck; at rest, it slides on."""
    e, down = 0.65, math.sqrt(2 * 9.81 * 0.9)
    rest = down / 9.81 * (1 + 2 * e / (1 - e))
    slower = mu * ((1 + e) * down / (1 - e) + 9.81 * (2.1 - rest))
    for box in boxes:
        solution = box.simulate(set={"speed": speed, "e": e, "mu": mu}, stop=2.1, estimate_error=False)
        assert abs(solution["der(a)"]).max() < 1e-12
        assert solution["der(x)"][-1] == pytest.approx(speed - slower, abs=1e-6)


def test_a_ball_hits_two_at_once() -> None:
    """Three equal elastic balls that touch pairwise: the first is thrown back with 1/5 of its speed."""
    hits = [f"contact hit{k}: norm({{u{k} - x, v{k} - y}}) - 1 m restitution 1;" for k in (1, 2)]
    for balls in in_both_orders(BALLS, *hits):
        s = balls.simulate(stop=1, estimate_error=False)
        assert s["der(y)"][-1] == pytest.approx(-1 / 5, abs=1e-9)
        assert s["der(x)"][-1] == pytest.approx(0, abs=1e-9)
        for k, side in ((1, 1), (2, -1)):
            assert s[f"der(u{k})"][-1] == pytest.approx(side * math.sqrt(3) / 5, abs=1e-9)
            assert s[f"der(v{k})"][-1] == pytest.approx(3 / 5, abs=1e-9)


TABLE = """
gravity {0, 0, -9.81} m/s^2;
coordinate Length x = 0 m;
coordinate Length y = 0 m;
coordinate Length z = 1 m;
coordinate Rotation R;
frame top = world * trans({x, y, z}) * R;
mass 10 kg at top;
inertia diag({1, 1, 2} kg.m^2) on top;
"""


def on_legs(mu: float, initial: str = "") -> mechc.Model:
    legs = initial
    for k, (i, j) in enumerate(((1, 1), (1, -1), (-1, 1), (-1, -1))):
        friction = f" friction {mu} along {{vel(p{k})[1], vel(p{k})[2]}}" if mu else ""
        legs += f"point p{k} = top * {{{i * 0.4}, {j * 0.6}, -0.7}} m;\ncontact leg{k}: p{k}[3]{friction};\n"
    return mechc.loads(TABLE + legs)


@pytest.mark.parametrize("mu", slow_but([0], [0, 0.6]))
def test_a_table_falls_on_four_legs(mu: float) -> None:
    """Three legs determine the impact; the fourth one hits as well, and the table rests at once."""
    solution = on_legs(mu).simulate(stop=0.4, estimate_error=False)
    assert solution.outcome is Outcome.COMPLETED
    assert solution["z"][-1] == pytest.approx(0.7, abs=1e-9)
    assert sum(e.kind == "impact" for e in solution.events) == 4
    assert solution["R[1]"][-1] == pytest.approx(1, abs=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("speed", [1, 4])
def test_a_table_that_moves_on_falls_on_four_legs(speed: float) -> None:
    """Legs that are alike push alike, so that it goes straight on: all stick, or it slides and tips onto the front ones."""
    solution = on_legs(0.6, f"initial der(x) = {speed} m/s;\n").simulate(stop=0.3, estimate_error=False)
    hit = next(event for event in solution.events if event.kind == "impact")
    after = {**hit.before, **hit.after}
    down = math.sqrt(2 * 9.81 * 0.3)
    if speed == 1:
        spin = 0.0
        assert after["der(x)"] == pytest.approx(0, abs=1e-9)
    else:  # the impulse N of the front, by which mass: N - 0.4 w = down, w = 10 (0.7 mu - 0.4) N
        push = down / (1 - 0.4 * 10 * (0.7 * 0.6 - 0.4))
        spin = 10 * (0.7 * 0.6 - 0.4) * push
        assert after["der(x)"] == pytest.approx(speed - 0.6 * push, abs=1e-9)
    assert after.get("der(R)[2]", 0) == pytest.approx(spin, abs=1e-9)
    assert abs(solution["der(y)"]).max() < 1e-9 and abs(solution["der(R)[3]"]).max() < 1e-9

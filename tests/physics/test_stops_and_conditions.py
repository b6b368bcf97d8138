"""Conditions on rates that dry friction ends: what comes to rest has rate zero, which is neither above nor below it."""

from __future__ import annotations

import pytest

import mechc

SLIDES = {
    "friction": ("", "friction stop: 8 N on x;", "der(x)"),
    "two sides": ("", "friction stop: forward 3 N backward 8 N on x;", "der(x)"),
    "on a floor": (
        "coordinate Length y = 0 m; kinetic 1/2*1 kg*der(y)^2; potential 1 kg*9.81 m/s^2*y;",
        "contact floor: y friction 0.8 along der(x);",
        "der(x)",
    ),
    "on a surface": (
        "coordinate Length y = 0 m; coordinate Length z = 0 m; initial der(z) = 0.7 m/s;"
        "kinetic 1/2*1 kg*(der(y)^2 + der(z)^2); potential 1 kg*9.81 m/s^2*y;",
        "contact floor: y friction 0.8 along {der(x), der(z)};",
        "der(x)",
    ),
    "a clutch": (
        "coordinate Length y = 0 m; initial der(y) = 2 m/s; kinetic 1/2*3 kg*der(y)^2;",
        "friction stop: 8 N + 1 N*sin(3*x/1 m) on x - y;",
        "der(x) - der(y)",
    ),
    "a pair that touches": (
        "coordinate Length y = 0 m; initial der(y) = -1 m/s; kinetic 1/2*2 kg*der(y)^2;",
        "contact touch: y - x; force -1 N on y; friction stop: 8 N + 0.3 N*sin(5*x/1 m) on x;",
        "der(y)",
    ),
}


@pytest.mark.parametrize("speed", [-1, -0.3, -0.7123])
@pytest.mark.parametrize("slide", SLIDES.values(), ids=list(SLIDES))
def test_what_stops_does_not_turn_back(slide: tuple[str, str, str], speed: float) -> None:
    """Friction takes a rate from below to zero: it is never positive, at the stop or afterwards."""
    more, law, rate = slide
    solution = mechc.loads(f"""
    coordinate Length x = 0 m;
    initial der(x) = {speed} m/s;
    kinetic 1/2*1 kg*der(x)^2;
    {more}
    {law}
    discrete Integer turns = 0;
    when {rate} > 0 m/s then
      turns := turns + 1;
    end when;
    output Real forward = if {rate} > 0 m/s then 1 else 0;
    output ends = {rate};
    """).simulate(stop=1)
    assert [e.name for e in solution.events if e.kind == "stick"]
    assert abs(solution["ends"][-1]) < 1e-12
    assert solution["turns"][-1] == 0
    assert max(solution["forward"]) == 0


def test_what_turns_back_at_once_does() -> None:
    """A spring of 20 N against friction of 8 N: x' = 0 is passed where the slip reverses, at half a turn."""
    solution = mechc.loads("""
    coordinate Length x = 1 m;
    kinetic 1/2*1 kg*der(x)^2;
    potential 1/2*25 N/m*x^2;
    friction rub: 2 N on x;
    discrete Integer turns = 0;
    discrete Length where = 0 m;
    when der(x) > 0 m/s then
      turns := turns + 1;
      where := x;
    end when;
    """).simulate(stop=1)
    assert solution["turns"][-1] == 1
    assert solution["where"][-1] == pytest.approx(-(1 - 2 * 2 / 25), abs=1e-9)
    (event,) = [e for e in solution.events if e.kind == "when"]
    assert event.time == pytest.approx(3.141592653589793 / 5, abs=1e-9)

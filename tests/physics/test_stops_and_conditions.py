"""Conditions on rates that dry friction ends: what comes to rest has rate zero, which is neither above nor below it."""

from __future__ import annotations

import math

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


RESTS = {
    "friction": (
        "coordinate Length x = 0 m; initial der(x) = -1 m/s; kinetic 1/2*1 kg*der(x)^2; friction 8 N on x;",
        "der(x)",
    ),
    "a belt": (
        "coordinate Length x = 0 m; initial der(x) = -1 m/s; kinetic 1/2*1 kg*der(x)^2;"
        "friction 8 N on x - 0.5 m/s*time;",
        "der(x) - 0.5 m/s",
    ),
    "a plastic impact": (
        "coordinate Length y = 1 m; initial der(y) = -0.2 m/s; kinetic 1/2*1 kg*der(y)^2; potential 1 kg*9.81 m/s^2*y;"
        "contact floor: y restitution 0;",
        "der(y)",
    ),
    "bounces": (
        "coordinate Length y = 0.1 m; initial der(y) = -0.2 m/s; kinetic 1/2*1 kg*der(y)^2;"
        "potential 1 kg*9.81 m/s^2*y; contact floor: y restitution 0.3;",
        "der(y)",
    ),
    "a freewheel": (
        "coordinate Length h = 0 m; coordinate Length w = 0 m; initial der(h) = 2 m/s; initial der(w) = 1 m/s;"
        "kinetic 1/2*1 kg*der(h)^2 + 1/2*2 kg*der(w)^2; damping 3 N.s/m on h;"
        "friction forward infinite backward 0 N on w - h;",
        "der(w) - der(h)",
    ),
}
"""What brings a rate, which is the second of each, from below to zero, and holds it there."""


@pytest.mark.parametrize("model, rate", RESTS.values(), ids=list(RESTS))
def test_what_rests_is_neither_above_nor_below_zero(model: str, rate: str) -> None:
    """At rest `<` and `>` do not hold, `<=` and `>=` do: in outputs, and in conditions, which become so."""
    solution = mechc.loads(f"""
    {model}
    output Real less = if {rate} < 0 m/s then 1 else 0;
    output Real most = if {rate} <= 0 m/s then 1 else 0;
    output Real least = if {rate} >= 0 m/s then 1 else 0;
    output Real more = if {rate} > 0 m/s then 1 else 0;
    discrete Integer reached = 0;
    when {rate} >= 0 m/s then
      reached := reached + 1;
    end when;
    """).simulate(stop=1)
    assert [solution[n][0] for n in ("less", "most", "least", "more")] == [1, 1, 0, 0]
    assert [solution[n][-1] for n in ("less", "most", "least", "more")] == [0, 1, 1, 0]
    assert solution["reached"][-1] >= 1


@pytest.mark.parametrize("static", [1.001, 1.5, 3])
def test_a_slip_that_begins_is_one_event(static: float) -> None:
    """A belt that speeds up by a = 0.5 m/s2 carries a block until 8*a*t^2/2 + a is what static friction holds; from then on the
    block swings about 1/8 m. A condition on its slip sees it begin, and does not stop it again."""
    begin = math.sqrt((static - 0.5) / 2)
    solution = mechc.loads(f"""
    coordinate Length x = 0 m;
    kinetic 1/2*1 kg*der(x)^2;
    potential 1/2*8 N/m*x^2;
    friction 1 N static {static} N on x - 0.25 m/s^2*time^2;
    discrete Integer begins = 0;
    when der(x) - 0.5 m/s^2*time < 0 m/s then
      begins := begins + 1;
    end when;
    """).simulate(stop=begin + 0.3, tolerance=1e-10)
    assert [e.kind for e in solution.events] == ["slip", "when"]
    w, carried, speed = math.sqrt(8), begin**2 / 4 - 1 / 8, begin / 2
    swings = 1 / 8 + carried * math.cos(w * 0.3) + speed / w * math.sin(w * 0.3)
    assert abs(solution["x"][-1] - swings) < 1e-9


def slides_of_node(damped: bool, drive: float, stop: float, dt: float = 1e-5) -> tuple[int, int, int]:
    """Count how often a node begins to move forwards and backwards, and stops, by small steps.

    A mass of 1 kg is driven and drags the node by a spring of 100 N/m against friction of 2 N, and against either a damping of 5 N.s/m,
    so that the force beyond 2 N decides the rate, or a spring of 30 N/m, so that the node keeps within 2 N of balance.
    """
    x = v = n = 0.0
    was, counts = 0, [0, 0, 0]
    for k in range(round(stop / dt)):
        pull = 100 * (x - n)
        if damped:
            moved = n + dt / 5 * (pull - min(max(pull, -2), 2))
        else:
            moved = min(max(n, (100 * x - 2) / 130), (100 * x + 2) / 130)
        force = drive * math.sin(2 * k * dt) + (0.5 * drive if damped else 0) - pull - 0.3 * v
        now = (moved - n > 1e-9 * dt) - (moved - n < -1e-9 * dt)
        if now != was:
            counts[(2, 0, 1)[now]] += 1
        was, n = now, moved
        v += dt * force
        x += dt * v
    return counts[0], counts[1], counts[2]


@pytest.mark.parametrize("damped", [False, True])
@pytest.mark.parametrize("drive", [3, 4.5, 7])
def test_what_has_no_mass_stops_before_its_rate_is_asked(damped: bool, drive: float) -> None:
    """A node that friction stops does not turn back, also if a condition on its rate is located at the same instant."""
    law = "damping 5 N.s/m on n;" if damped else "potential 1/2*30 N/m*n^2;"
    solution = mechc.loads(f"""
    coordinate Length x = 0 m;
    coordinate Length n ~ 0 m;
    kinetic 1/2*1 kg*der(x)^2;
    potential 1/2*100 N/m*(x - n)^2;
    {law}
    friction 2 N on n;
    damping 0.3 N.s/m on x;
    force {drive} N*sin(2 rad/s*time){f" + {0.5 * drive} N" if damped else ""} on x;
    discrete Integer forth = 0;
    discrete Integer back = 0;
    discrete Integer rests = 0;
    when der(n) > 0 m/s then
      forth := forth + 1;
    end when;
    when der(n) < 0 m/s then
      back := back + 1;
    end when;
    when not (der(n) < 0 m/s or der(n) > 0 m/s) then
      rests := rests + 1;
    end when;
    """).simulate(stop=6)
    found = tuple(int(solution[name][-1]) for name in ("forth", "back", "rests"))
    assert found == slides_of_node(damped, drive, 6)


def turns_of_node(x: float, stop: float) -> list[float]:
    """Times at which a node begins to slide and stops: a mass of 1 on a spring of 1 drags it by a spring of 5 against friction of 0.5.

    Both are let go at x > 0; the node slides where its spring is longer or shorter by 0.1.
    """
    node, time, found = x, 0.0, list[float]()
    while True:
        frequency, middle = math.sqrt(6), 5 * node / 6
        apart, turned = x - middle, math.copysign(0.1, node - x) if found else -0.1
        share = (node + turned - middle) / apart
        if abs(share) > 1:
            return found
        wait = math.acos(share) / frequency
        rate = -frequency * apart * math.sin(frequency * wait)
        time, x = time + wait, node + turned
        found.append(time)
        force = math.copysign(0.5, rate)
        wait = math.atan2(rate, x + force) % math.pi
        x = -force + (x + force) * math.cos(wait) + rate * math.sin(wait)
        time, node = time + wait, x - math.copysign(0.1, rate)
        found.append(time)
        if time > stop:
            return [t for t in found if t < stop]


@pytest.mark.parametrize("method", ["radau5", "dop853", "auto"])
@pytest.mark.parametrize("tolerance", [1e-4, 1e-6, 1e-8])
@pytest.mark.parametrize("x", [0.5, 1, 2, 3])
def test_what_begins_to_stick_at_its_limit_sticks(x: float, tolerance: float, method: str) -> None:
    """The force of a node is that of friction when it stops, and less at once, but by less than polynomials of steps err."""
    solution = mechc.loads(f"""
    dimensionless;
    coordinate x = {x};
    coordinate n = {x};
    kinetic 1/2*der(x)^2;
    potential 1/2*x^2 + 1/2*5*(x - n)^2;
    friction 0.5 on n;
    """).simulate(stop=10, method=method, tolerance=tolerance, estimate_error=False)
    times = [event.time for event in solution.events]
    assert times == pytest.approx(turns_of_node(x, 10), abs=30 * tolerance)

"""Random models in which something switches, as text: eight families, each drawn by hypothesis."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from hypothesis import strategies as st
from msgspec import Struct


class HybridModel(Struct, frozen=True):
    """``gaps``: outputs that must not become negative; ``stop`` [s]: how long it runs."""

    text: str
    gaps: tuple[str, ...]
    stop: float


class Drawn:
    """Numbers and choices of one model, with the lines of its text."""

    def __init__(self, draw: st.DrawFn, lines: Sequence[str] = ()) -> None:
        self._draw = draw
        self.lines = list(lines)
        self.gaps: list[str] = []

    def number(self, low: float, high: float) -> float:
        return round(self._draw(st.floats(low, high)), 5)

    def one_of(self, *choices: float) -> float:
        return self._draw(st.sampled_from(choices))

    def count(self, low: int, high: int) -> int:
        return self._draw(st.integers(low, high))

    def sometimes(self) -> bool:
        return self._draw(st.booleans())

    def add(self, *lines: str) -> None:
        self.lines += lines

    def contact(self, name: str, gap: str, restitution: float, friction: str = "") -> None:
        self.add(f"contact {name}: {gap} restitution {restitution}{friction};", f"output gap_{name} = {gap};")
        self.gaps.append(f"gap_{name}")

    def point(self, i: int, x: float, y: float, speed: float) -> None:
        self.add(f"coordinate Length x{i} = {x!r} m;", f"coordinate Length y{i} = {y!r} m;")
        self.add(f"initial der(x{i}) = {self.number(-speed, speed)} m/s;")
        self.add(f"initial der(y{i}) = {self.number(-speed, speed)} m/s;")
        self.add(f"point P{i} = world * {{x{i}, y{i}}};", f"mass {self.number(0.2, 3)} kg at P{i};")

    def slider(self, i: int, x: float, speed: float) -> float:
        mass = self.number(0.3, 3)
        self.add(
            f"coordinate Length x{i} = {x!r} m;", f"initial der(x{i}) = {self.number(-speed, speed)} m/s;"
        )
        self.add(f"kinetic 1/2*({mass} kg)*der(x{i})^2;")
        return mass

    def model(self, stop: float) -> HybridModel:
        return HybridModel("\n".join(self.lines) + "\n", tuple(self.gaps), stop)


GRAVITY = "gravity {0, -9.81} m/s^2;"


def balls_in_a_box(draw: st.DrawFn) -> HybridModel:
    d, count = Drawn(draw, [GRAVITY]), 0
    count, rough = d.count(1, 3), d.sometimes()
    for i in range(count):
        d.point(i, round((i + 0.5) / count + d.number(-0.03, 0.03), 5), d.number(0.1, 0.9), 2)
        walls = {"floor": (f"y{i} - 0.05 m", "x"), "left": (f"x{i} - 0.05 m", "y")}
        walls |= {"right": (f"0.95 m - x{i}", "y"), "top": (f"0.95 m - y{i}", "x")}
        for name, (gap, along) in walls.items():
            friction = f" friction {d.number(0.05, 0.8)} along der({along}{i})" if rough else ""
            restitution = d.one_of(0, 0.3, 0.6) if rough else d.one_of(0, 0.3, 0.7, 0.9, 1)
            d.contact(f"{name}{i}", gap, restitution, friction)
        for j in range(i):
            d.contact(f"hit{i}{j}", f"norm(P{i} - P{j}) - 0.1 m", d.one_of(0, 0.3, 0.7, 0.9, 1))
    return d.model(2)


def stacked_masses(draw: st.DrawFn) -> HybridModel:
    d = Drawn(draw)
    below, height = "0 m", 0.02
    if d.sometimes():
        below = f"{d.number(0.0005, 0.02)} m*sin(time*{d.number(5, 200)} rad/s)"
    for i in range(d.count(1, 4)):
        height = round(height + d.one_of(0, 0, 0.05, 0.3), 5)
        mass = d.slider(i, height, 1)
        d.add(f"potential ({mass} kg)*(9.81 m/s^2)*x{i};")
        d.contact(f"c{i}", f"x{i} - {below}", d.one_of(0, 0.2, 0.5, 0.8))
        below = f"x{i}"
    return d.model(1.5)


def stick_and_slip(draw: st.DrawFn) -> HybridModel:
    d = Drawn(draw)
    count = d.count(1, 3)
    for i in range(count):
        d.slider(i, d.number(-1, 1), 2)
        limit = d.number(0.1, 4)
        static = f" static {round(limit * d.number(1, 1.6), 5)} N" if d.sometimes() else ""
        d.add(f"friction {limit} N{static} on x{i} - {d.one_of(0, 0.3, 0.7)} m/s*time;")
        d.add(f"potential 1/2*({d.number(0.5, 20)} N/m)*(x{i}{f' - x{i - 1}' if i else ''})^2;")
    if d.sometimes():
        d.add(f"force {d.number(0.5, 5)} N*sin(time*{d.number(0.5, 8)} rad/s) on x{count - 1};")
    return d.model(8)


def joint_stops(draw: st.DrawFn) -> HybridModel:
    d = Drawn(draw, [GRAVITY])
    parent = "world"
    for i in range(d.count(1, 3)):
        d.add(f"coordinate Angle q{i} = {d.number(-0.8, 0.8)} rad;")
        d.add(f"initial der(q{i}) = {d.number(-3, 3)} rad/s;", f"frame F{i} = {parent}*rot(q{i});")
        d.add(f"mass {d.number(0.3, 2)} kg at F{i}*{{0, {-d.number(0.3, 1)}}} m;")
        restitution = d.one_of(0, 0.4, 0.8, 1)
        d.contact(f"above{i}", f"{d.number(0.85, 1.4)} rad - q{i}", restitution)
        d.contact(f"below{i}", f"q{i} + {d.number(0.85, 1.4)} rad", restitution)
        if d.sometimes():
            d.add(f"friction {d.number(0.05, 1.5)} N.m on q{i};")
        parent = f"F{i}*trans({{0, {-d.number(0.3, 1)}}} m)"
    return d.model(3)


def falling_block(draw: st.DrawFn) -> HybridModel:
    d = Drawn(draw, [GRAVITY])
    b, h, angle = d.number(0.1, 0.6), d.number(0.1, 0.6), d.number(-0.6, 0.6)
    clearance = d.one_of(1e-5, 0.1, 0.5)
    height = abs(b * math.sin(angle)) + h * math.cos(angle) + clearance
    d.add(f"coordinate Angle th = {angle} rad;", "coordinate Length x = 0 m;")
    d.add(f"coordinate Length y = {round(height, 7)} m;", f"initial der(x) = {d.number(-2, 2)} m/s;")
    d.add(f"initial der(th) = {d.number(-3, 3)} rad/s;", "frame B = world * trans({x, y}) * rot(th);")
    d.add("mass 1 kg at B;", f"inertia {(b * b + h * h) / 3:.6f} kg.m^2 on B;")
    coefficient = d.number(0.05, 0.9) if d.sometimes() else 0
    restitution = 0 if coefficient else d.one_of(0, 0.3, 0.6)
    for name, x, y in (("a", -b, -h), ("b", b, -h), ("c", b, h), ("d", -b, h)):
        d.add(f"point p{name} = B * {{{x}, {y}}} m;")
        friction = f" friction {coefficient} along vel(p{name})[1]" if coefficient else ""
        d.contact(name, f"p{name}[2]", restitution, friction)
    return d.model(2)


def controller(draw: st.DrawFn) -> HybridModel:
    d = Drawn(draw)
    d.slider(0, d.number(-1, 1), 2)
    d.add(f"potential 1/2*({d.number(0.2, 9)} N/m)*x0^2;", f"damping {d.number(0, 0.3)} N.s/m on x0;")
    d.add("discrete Boolean on = false;", "discrete Integer n = 0;", "discrete Force u = 0 N;")
    low = d.number(-0.5, 0.3)
    high = round(low + d.number(0.05, 0.6), 5)
    d.add(f"when x0 > {high} m then on := true; n := n + 1;")
    d.add(f"elsewhen x0 < {low} m then on := false; n := n + 1; end when;")
    d.add(f"force if on then {-d.number(0.5, 4)} N else {d.number(0, 4)} N on x0;")
    if d.sometimes():
        d.add(f"when sample({d.number(0.03, 0.4)} s) then u := {-d.number(0.1, 3)} N.s/m*der(x0); end when;")
        d.add("force u on x0;")
    if d.sometimes():
        d.add(f"potential if x0 > {d.number(0.2, 0.8)} m then {d.number(-0.3, 0.3)} J else 0 J;")
    return d.model(8)


def ropes(draw: st.DrawFn) -> HybridModel:
    d = Drawn(draw, [GRAVITY])
    x = y = 0.0
    for i in range(d.count(1, 3)):
        length, angle = d.number(0.4, 1), d.number(-3, 3)
        taut = d.one_of(0.5, 0.9, 1 - 1e-9)
        x, y = x + taut * length * math.sin(angle), y - taut * length * math.cos(angle)
        d.point(i, x, y, 3)
        between = f"P{i} - P{i - 1}" if i else "P0"
        d.contact(f"rope{i}", f"{length} m - norm({between})", d.one_of(0, 0.3, 0.8))
    return d.model(2)


def rough_balls(draw: st.DrawFn) -> HybridModel:
    d = Drawn(draw)
    d.add(f"gravity {{{d.one_of(0, -1.5, 2)}, 0, -9.81}} m/s^2;", "coordinate Rotation R;")
    d.add("coordinate Length x = 0 m;", "coordinate Length y = 0 m;")
    d.add(f"coordinate Length z = {d.one_of(0.1, 0.3, 0.6)} m;")
    for rate in ("der(x)", "der(y)"):
        d.add(f"initial {rate} = {d.number(-3, 3)} m/s;")
    spin = ", ".join(str(d.number(-20, 20)) for _ in range(3))
    d.add(f"initial der(R) = {{{spin}}} rad/s;", "frame ball = world * trans({x, y, z}) * R;")
    d.add("mass 1 kg at ball;", "inertia diag({0.0038, 0.004, 0.0037} kg.m^2) on ball;")
    d.add("let s = vel_at(ball, world * {x, y, z - 0.1 m});")
    d.add("let w = vel_at(ball, world * {x + 0.1 m, y, z});")
    coefficient, restitution = d.number(0.05, 0.9), d.one_of(0, 0, 0.5, 0.8)
    d.contact("floor", "z - 0.1 m", restitution, f" friction {coefficient} along {{s[1], s[2]}}")
    d.contact("wall", "0.5 m - x - 0.1 m", restitution, f" friction {coefficient} along {{w[2], w[3]}}")
    return d.model(2)


FAMILIES: tuple[Callable[[st.DrawFn], HybridModel], ...] = (
    balls_in_a_box,
    stacked_masses,
    stick_and_slip,
    joint_stops,
    falling_block,
    controller,
    ropes,
    rough_balls,
)

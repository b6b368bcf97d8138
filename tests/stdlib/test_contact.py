"""Balls, capsules and boxes that touch: distances against least squares with bounds, motions against closed forms."""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq, lsq_linear
from scipy.spatial.transform import Rotation

import mechc

Array = NDArray[np.float64]
HEAD = "import mech.contact.*;\nimport mech.{}.*;\nmodel M\n"
EDGES = (0.5, 0.3, 0.4)

PAIRS = {
    "BallOnBall": ("r_from = 0.1 m, r_to = 0.05 m", (0, 0, 0), (0, 0, 0), 0.15),
    "BallOnCapsule": ("r_from = 0.1 m, r_to = 0.05 m, l = 0.5 m", (0.5, 0, 0), (0, 0, 0), 0.15),
    "BallOnBox": ("edges = {E} m, r_to = 0.05 m", EDGES, (0, 0, 0), 0.05),
    "CapsuleOnCapsule": (
        "r_from = 0.1 m, r_to = 0.05 m, l_from = 0.5 m, l_to = 0.8 m",
        (0.5, 0, 0),
        (0.8, 0, 0),
        0.15,
    ),
}
"""By part: its parameters, the boxes that are the cores of both, and the sum of the radii."""


def pose(n: int, x: Array) -> tuple[Array, Array]:
    if n == 2:
        c, s = math.cos(x[3]), math.sin(x[3])
        return x[:2], np.array([[c, -s], [s, c]])
    return x[:3], Rotation.from_euler("XYZ", x[3:]).as_matrix()


def distance(
    n: int, core: tuple[float, ...], other: tuple[float, ...], x: Array, y: Array
) -> tuple[float, Array]:
    """The least distance of two boxes in poses x and y, and the unit vector from one to the other."""
    (p, a), (q, b) = pose(n, x), pose(n, y)
    half = np.array([*core[:n], *other[:n]]) / 2
    free = half > 0
    across = np.hstack([a, -b])[:, free]
    least = lsq_linear(across, q - p, (-half[free], half[free]), tol=1e-15) if free.any() else None
    between = q - p - (across @ least.x if least is not None else 0)
    size = float(np.linalg.norm(between))
    return size, between / max(size, 1e-300)


def separated(
    n: int, core: tuple[float, ...], other: tuple[float, ...], radii: float, seed: int
) -> tuple[Array, Array]:
    random = np.random.default_rng(seed)
    while True:
        x, y = random.uniform(-0.6, 0.6, 6), random.uniform(-0.6, 0.6, 6)
        x[3:], y[3:] = random.uniform(-3, 3, 3), random.uniform(-3, 3, 3)
        if distance(n, core, other, x, y)[0] > radii + 0.01:
            return x, y


def bodies(n: int, part: str, given: str) -> str:
    """Two bodies in poses that parameters say, with a contact between them."""
    text = HEAD.format("spatial" if n == 3 else "planar")
    for name in "ab":
        text += "".join(f"  parameter Length {name}{k} = 0 m;\n" for k in range(n))
        text += "".join(f"  parameter Angle {name}{k} = 0 rad;\n" for k in range(3, 4 if n == 2 else 6))
        turn = f"rot({name}3)" if n == 2 else f"rotx({name}3)*roty({name}4)*rotz({name}5)"
        at = ", ".join(f"{name}{k}" for k in range(n))
        inertia = "0.1 kg.m^2" if n == 2 else "0.1*identity(3) kg.m^2"
        text += f"  Body {name}(m = 1 kg, J = {inertia}); Free f{name}(world * trans({{{at}}}) * {turn} -> {name}.a);\n"
    edges = "{" + ", ".join(map(str, EDGES[:n])) + "}"
    given = given.replace("{E}", edges)
    across = "".join(f" output Real n{k} = p.normal[{k + 1}];" for k in range(n))
    return f"{text}  {part} p(a.a -> b.a, {given}); output Length gap = p.gap;{across}\n  experiment(stop = 0 s);\nend M;\n"


@pytest.mark.parametrize("n", [2, 3])
@pytest.mark.parametrize("part", PAIRS)
def test_distances_are_those_of_least_squares(part: str, n: int) -> None:
    given, core, other, radii = PAIRS[part]
    model = mechc.loads(bodies(n, part, given))
    for seed in range(40):
        x, y = separated(n, core, other, radii, seed)
        values = {f"a{k}": x[k] for k in range(n if n == 2 else 6)} | {
            f"b{k}": y[k] for k in range(n if n == 2 else 6)
        }
        if n == 2:
            values |= {"a3": x[3], "b3": y[3]}
        solution = model.simulate(set=values, estimate_error=False)
        expected, normal = distance(n, core, other, x, y)
        assert solution["gap"][0] == pytest.approx(expected - radii, abs=1e-12), seed
        found = [solution[f"n{k}"][0] for k in range(n)]
        assert np.abs(found - normal).max() < 1e-7 / max(expected, 1e-3), seed


def test_parallel_capsules_touch_at_one_of_their_points() -> None:
    model = mechc.loads(bodies(3, *PAIRS_OF_CAPSULES))
    solution = model.simulate(set={"b1": 0.4, "b0": 0.2}, estimate_error=False)
    assert solution["gap"][0] == pytest.approx(0.4 - 0.15, abs=1e-14)


PAIRS_OF_CAPSULES = ("CapsuleOnCapsule", PAIRS["CapsuleOnCapsule"][0])


@pytest.mark.parametrize("space", ["planar", "spatial"])
def test_capsules_turn_past_each_other_in_a_plane(space: str) -> None:
    """Again and again their lines become parallel, and their common normal runs through all places at once; gaps by all four ends."""
    placed = "trans({s, h})" if space == "planar" else "trans({s, 0 m, h}) * roty(0 rad)"
    axis = "" if space == "planar" else ", axis = {0, -1, 0}"
    inertia = "0.01 kg.m^2" if space == "planar" else "0.01*identity(3) kg.m^2"
    model = mechc.loads(
        f"import mech.contact.*; import mech.{space}.*;\nmodel M\n"
        "  parameter AngularVelocity w = 1 rad/s; parameter Length h = 0.3 m; parameter Length s = 0.2 m;"
        f"Body a(m = 1 kg, J = {inertia}); Body b(m = 1 kg, J = {inertia});"
        f"Revolute fa(world -> a.a, angle = 0.3 rad{axis}); Revolute fb(world * {placed} -> b.a, angle = -0.2 rad{axis});"
        "initial der(fb.angle) = w;"
        "CapsuleOnCapsule on(a.a -> b.a, r_from = 0.05 m, r_to = 0.04 m, l_from = 0.18 m, l_to = 0.16 m);"
        "output Length gap = on.gap; experiment(stop = 1 s);\nend M;"
    )

    def to_line(p: np.ndarray, middle: np.ndarray, half: np.ndarray) -> float:
        along = np.clip((p - middle) @ half / (half @ half), -1, 1)
        return float(np.linalg.norm(p - middle - along * half))

    for w, s, h in itertools.product((0.1, 1.0, 33.0), (0.0, 0.07, 0.2), (0.25, 0.31, 1.7)):
        run = model.simulate(set={"w": w, "s": s, "h": h}, stop=f"{8 / w} s", estimate_error=False)
        assert run.outcome.value == "completed", (w, s, h, run.message)
        one, middle = 0.09 * np.array([math.cos(0.3), math.sin(0.3)]), np.array([s, h])
        for t, gap in zip(run.time[::7], run["gap"][::7], strict=True):
            angle = -0.2 + w * t
            other = 0.08 * np.array([math.cos(angle), math.sin(angle)])
            ends = [to_line(sign * one, middle, other) for sign in (-1, 1)]
            ends += [to_line(middle + sign * other, np.zeros(2), one) for sign in (-1, 1)]
            assert gap == pytest.approx(min(ends) - 0.09, abs=1e-11)


def run(text: str, stop: float, space: str = "spatial") -> mechc.Solution:
    whole = f"{HEAD.format(space)}{text}\n  experiment(stop = {stop} s, tolerance = 1e-11);\nend M;\n"
    solution = mechc.loads(whole).simulate()
    assert solution.outcome.value == "completed", solution.message
    return solution


BALL = "Body ball(m = 1 kg, J = 0.004*identity(3) kg.m^2); Free f(world -> ball.a, position = {0, 0, 0.1} m); gravity {0, 0, -9.81} m/s^2;"


def test_a_ball_on_a_slope_rolls_after_it_has_slipped() -> None:
    """Thrown along it without spin: v = v0 - mu g cos(a) t + g sin(a) t until v = r w, then 5/7 g sin(a)."""
    a, mu, g, v0 = math.radians(20), 0.3, 9.81, 1.0
    s = run(
        "Body ball(m = 1 kg, J = 0.004*identity(3) kg.m^2); gravity {0, 0, -9.81} m/s^2; frame slope = world * roty(20 deg);"
        "Free f(slope -> ball.a, position = {0, 0, 0.1} m); initial der(f.position) = {1, 0, 0} m/s;"
        "BallOnPlane on(slope -> ball.a, r = 0.1 m, friction = 0.3);",
        1.0,
    )
    slip = g * (math.sin(a) - mu * math.cos(a)), mu * g * math.cos(a) * 0.1 / 0.004
    rolls = v0 / (slip[1] * 0.1 - slip[0])
    v = v0 + slip[0] * rolls + 5 / 7 * g * math.sin(a) * (1 - rolls)
    assert s["der(f.position[1])"][-1] == pytest.approx(v, abs=1e-9)
    assert s["on.pressure[1]"][-1] == pytest.approx(g * math.cos(a), abs=1e-9)
    stick = next(e for e in s.events if e.kind == "stick")
    assert stick.time == pytest.approx(rolls, abs=1e-9)


def test_a_ball_leaves_the_ball_on_which_it_slides_down() -> None:
    """Without friction where cos(a) = 2/3 of that at the start."""
    a0 = 0.1
    x, z = 0.5 * math.sin(a0), 0.5 * math.cos(a0)
    s = run(
        "gravity {0, 0, -9.81} m/s^2; Particle p(m = 2 kg);"
        f"Translation f(world -> p.a, position = {{{x!r}, 0, {z!r}}} m); BallOnBall on(world -> p.a, r_from = 0.4 m, r_to = 0.1 m);",
        1.0,
    )
    off = next(e for e in s.events if e.kind == "lift-off")
    k = int(np.searchsorted(s.time, off.time))
    assert s["f.position[3]"][k] / 0.5 == pytest.approx(2 / 3 * math.cos(a0), abs=1e-8)


@pytest.mark.parametrize("space", ["planar", "spatial"])
def test_a_box_slides_down_a_slope_and_its_corners_carry_it(space: str) -> None:
    """a = g (sin - mu cos); the corners below carry more, by mu h."""
    a, mu, g = math.radians(25), 0.2, 9.81
    n = 2 if space == "planar" else 3
    frame = "rot(-25 deg)" if n == 2 else "roty(25 deg)"
    body = "J = 0.02 kg.m^2" if n == 2 else "J = 0.02*identity(3) kg.m^2"
    edges = "{0.4, 0.2}" if n == 2 else "{0.4, 0.3, 0.2}"
    at = "y = 0.1 m" if n == 2 else "position = {0, 0, 0.1} m"
    down = "{0, -9.81}" if n == 2 else "{0, 0, -9.81}"
    s = run(
        f"gravity {down} m/s^2; frame slope = world * {frame}; Body box(m = 1 kg, {body}); Free f(slope -> box.a, {at});"
        f"BoxOnPlane on(slope -> box.a, edges = {edges} m, friction = 0.2);",
        0.5,
        space,
    )
    place = "f.x" if n == 2 else "f.position[1]"
    assert s[place][-1] == pytest.approx(g * (math.sin(a) - mu * math.cos(a)) * 0.125, abs=1e-9)
    loads = np.array([s[f"on.pressure[{k}]"][-1] for k in range(1, 2**n + 1)])
    weight = g * math.cos(a)
    front = weight * (0.5 + mu * 0.1 / 0.4)
    fronts = loads[0::2].sum()  # corners at positive x
    assert loads.sum() == pytest.approx(weight, abs=1e-9)
    assert max(fronts, weight - fronts) == pytest.approx(front, abs=1e-9)


def test_crossed_capsules_bounce_by_their_masses() -> None:
    """One falls across the middle of another, which is at rest: v1' = (m1 - e m2)/(m1 + m2) v1."""
    s = run(
        "Body a(m = 1 kg, J = 0.01*identity(3) kg.m^2); Body b(m = 3 kg, J = 0.01*identity(3) kg.m^2);"
        "Free fa(world -> a.a); Free fb(world -> b.a, position = {0, 0, 0.5} m, orientation = rotz(90 deg));"
        "initial der(fb.position) = {0, 0, -2} m/s;"
        "CapsuleOnCapsule on(a.a -> b.a, r_from = 0.1 m, r_to = 0.1 m, l_from = 0.6 m, l_to = 0.6 m, restitution = 0.5, friction = 0.4);",
        0.5,
    )
    (hit,) = [e for e in s.events if e.kind == "impact"]
    assert hit.time == pytest.approx(0.15, abs=1e-12)
    assert s["der(fb.position[3])"][-1] == pytest.approx(-2 * (3 - 0.5) / 4, abs=1e-12)
    assert s["der(fa.position[3])"][-1] == pytest.approx(-2 * 3 * 1.5 / 4, abs=1e-12)


def test_a_ball_rocks_over_the_edge_of_a_box() -> None:
    """It comes from the face, turns about the edge with its centre at the distance r, and the face is kept until then; energy is kept."""
    s = run(
        "gravity {0, -9.81} m/s^2; Particle p(m = 1 kg); Translation f(world -> p.a, position = {0.1, 0.3} m);"
        "initial der(f.position) = {0.5, 0} m/s; BallOnBox on(world -> p.a, edges = {0.6, 0.4} m, r_to = 0.1 m);",
        0.6,
        "planar",
    )
    edge = int(np.searchsorted(s.time, 0.4))
    assert np.abs(s["f.position[2]"][: edge - 1] - 0.3).max() < 1e-12
    # from the edge on: v^2 = v0^2 + 2 g r (1 - cos), off where v^2/r = g cos
    cosine = (0.25 / (9.81 * 0.1) + 2) / 3
    off = next(e for e in s.events if e.kind == "lift-off")
    k = int(np.searchsorted(s.time, off.time))
    assert (s["f.position[2]"][k] - 0.2) / 0.1 == pytest.approx(cosine, abs=1e-8)


def test_an_array_of_balls_in_a_row_passes_the_blow_on() -> None:
    """Parts in an array, frames of an array: of four equal balls the last one leaves."""
    s = run(
        "Particle p[4](m = 1 kg); Translation f[4](from = world, to = p.a, position = {{0.2*k, 0} m for k in 1:4});"
        "initial der(f[1].position) = {1, 0} m/s;"
        "BallOnBall on[3](from = {p[k].a for k in 1:3}, to = {p[k].a for k in 2:4}, r_from = 0.1 m, r_to = 0.1 m, restitution = 1);",
        0.1,
        "planar",
    )
    assert [s[f"der(f[{k}].position[1])"][-1] for k in range(1, 5)] == pytest.approx([0, 0, 0, 1], abs=1e-12)


def test_how_far_a_ball_rolls_down_in_a_ball_is_found_by_friction() -> None:
    """A ball that is laid on another one of the same size sticks to it, and slips where its friction reaches mu times the load."""
    mu, a0 = 0.4, 0.05
    x, z = 0.4 * math.sin(a0), 0.4 * math.cos(a0)
    s = run(
        "gravity {0, 0, -9.81} m/s^2; Body ball(m = 1 kg, J = 0.016*identity(3) kg.m^2);"
        f"Free f(world -> ball.a, position = {{{x!r}, 0, {z!r}}} m);"
        "BallOnBall on(world -> ball.a, r_from = 0.2 m, r_to = 0.2 m, friction = 0.4);",
        1.2,
    )
    # rolling from rest: v^2 = 10/7 g R (cos a0 - cos a); N = g (17 cos a - 10 cos a0)/7, T = 2/7 g sin a
    slips = brentq(lambda a: mu * (17 * math.cos(a) - 10 * math.cos(a0)) - 2 * math.sin(a), a0, 0.95)
    slip = next(e for e in s.events if e.kind == "slip")
    k = int(np.searchsorted(s.time, slip.time))
    assert math.atan2(s["f.position[1]"][k], s["f.position[3]"][k]) == pytest.approx(slips, abs=1e-7)


YARD = """
import mech.planar.*;
import mech.contact.*;
model Trolley
  frame from;
  frame deck = from * trans({0 m, 0.05 m});
  frame top = deck * trans({0 m, 0.05 m});
  Body ball(m = 0.5 kg, J = 0.5*0.5 kg*(0.05 m)^2);
  Free free(top -> ball.a, y = 0.25 m);
  BallOnPlane on(top -> ball.a, r = 0.05 m, friction = 0.6, restitution = 0.3);
end Trolley;
model Yard "a ball falls on a trolley that a measured input drives, and rolls off it"
  gravity {0, -9.81} m/s^2;
  input Length road(interpolation = "spline") = 0 m;
  Body base(m = 5 kg, J = 0.1 kg.m^2);
  Prismatic rail(world -> base.a, axis = {1, 0});
  drive rail.position = road;
  Trolley car(from = base.a);
  when car.free.x < -0.25 m then terminate("off the plate"); end when;
  experiment(stop = 2 s, tolerance = 1e-10);
end Yard;
"""


def test_a_ball_falls_on_a_trolley_that_an_input_drives() -> None:
    """By flights, impulses and rolling one after the other, over the same natural spline."""
    times = np.arange(2001) / 1000
    road = CubicSpline(times, 0.75 * times**2, bc_type="natural")
    s = mechc.loads(YARD).simulate(inputs={"road": (times, 0.75 * times**2)}, estimate_error=False)
    mass, r, g, rest, mu = 0.5, 0.05, 9.81, 0.3, 0.6
    inertia = 0.5 * mass * r * r
    t, place, speed, spin, rises, height = 0.0, 0.0, float(road(0, 1)), 0.0, 0.0, 0.2
    while rises > 1e-10 or not t:
        flight = (rises + math.sqrt(rises**2 + 2 * g * height)) / g
        t, place, fall, height = t + flight, place + speed * flight, g * flight - rises, 0.0
        stick = -(speed - float(road(t, 1)) + r * spin) / (1 / mass + r * r / inertia)
        push = max(-1.0, min(1.0, stick / (mu * mass * (1 + rest) * fall))) * mu * mass * (1 + rest) * fall
        speed, spin, rises = speed + push / mass, spin + push * r / inertia, rest * fall
    x, v, a = place - float(road(t)), speed - float(road(t, 1)), -2 / 3 * 1.5
    last = (-v - math.sqrt(v**2 - 2 * a * (x + 0.25))) / a
    assert s.outcome.value == "terminated"
    assert s.time[-1] == pytest.approx(t + last, abs=1e-8)
    assert s["der(car.free.angle)"][-1] == pytest.approx(spin - a * last / r, abs=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("part", PAIRS)
def test_distances_are_those_of_coal(part: str, tmp_path: Path) -> None:
    """20 000 pairs each of the library that robots use for collisions, where it is installed."""
    coal = pytest.importorskip("coal")
    given, core, other, _ = PAIRS[part]
    count = 20_000
    random = np.random.default_rng(5)
    near, turns = random.uniform(-0.6, 0.6, (count, 6)), random.uniform(-3, 3, (count, 6))

    def shape(edges: tuple[float, ...], radius: float) -> object:
        if not any(edges):
            return coal.Sphere(radius)
        return coal.Box(*edges) if all(edges) else coal.Capsule(radius, edges[0])

    def place(x: Array, angles: Array, line: bool) -> object:
        turn = Rotation.from_euler("XYZ", angles)
        if line:  # along z there, along x here
            turn = turn * Rotation.from_euler("y", 90, degrees=True)
        return coal.Transform3s(turn.as_matrix(), x)

    def is_line(edges: tuple[float, ...]) -> bool:
        return any(edges) and not all(edges)

    r_from = 0.0 if part == "BallOnBox" else 0.1
    one, two = shape(core, r_from), shape(other, 0.05)
    asked, found = coal.DistanceRequest(), []
    asked.gjk_tolerance = 1e-12
    for x, t in zip(near, turns, strict=True):
        result = coal.DistanceResult()
        at = place(x[:3], t[:3], is_line(core)), place(x[3:], t[3:], is_line(other))
        coal.distance(one, at[0], two, at[1], asked, result)
        found.append(result.min_distance)
    apart = np.array(found) > 1e-3
    columns = {
        f"{b}{k}": (near if k < 3 else turns)[apart, (k % 3) + 3 * (b == "b")] for b in "ab" for k in range(6)
    }
    text = bodies(3, part, given)
    path = tmp_path / "pairs.csv"
    np.savetxt(
        path, np.transpose(list(columns.values())), "%.17g", ",", header=",".join(columns), comments=""
    )
    gaps = mechc.loads(text).ensemble(str(path), keep="final(gap)", errors=False)
    assert np.abs(gaps["final(gap)"] - np.array(found)[apart]).max() < 1e-9


CAPSULE = """
import mech.SPACE.*;
import mech.contact.*;
model M
  gravity {DOWN} m/s^2;
  Body b(m = 2 kg, J = INERTIA);
  Free free(world -> b.a, START);
  CapsuleOnPlane p(world -> b.a, r = 0.1 m, l = 0.6 m, restitution = 0.7);
  output height = pos(b.a)[size(pos(b.a), 1)];
  output along = pos(b.a)[1];
  experiment(stop = 0.5 s, tolerance = 1e-11);
end M;
"""


@pytest.mark.parametrize("space", ["planar", "spatial"])
def test_a_capsule_falls_on_one_of_its_ends(space: str) -> None:
    """Its centre falls freely and it turns evenly until y - l/2 |sin angle| = r; without friction the impulse there,
    (1 + e) speed/(1/m + arm^2/J), changes both rates."""
    text = CAPSULE.replace("SPACE", space)
    plane = space == "planar"
    for word, value in (
        ("DOWN", "0, -9.81" if plane else "0, 0, -9.81"),
        ("INERTIA", "0.05 kg.m^2" if plane else "diag({0.03, 0.05, 0.08}) kg.m^2"),
        ("START", "x = 0.2 m, y = 1.1 m, angle = 0.4 rad, der(x) = 0.3 m/s, der(angle) = 2 rad/s" if plane else
         "position = {0.2, 0, 1.1} m, orientation = roty(-0.4 rad), der(position) = {0.3, 0, 0} m/s, der(orientation) = {0, -2, 0} rad/s"),
    ):  # fmt: skip
        text = text.replace(word, value)
    found = mechc.loads(text).simulate(estimate_error=False)
    hit = float(
        brentq(lambda t: 1.1 - 4.905 * t * t - 0.3 * abs(math.sin(0.4 + 2 * t)) - 0.1, 0, 0.5, xtol=1e-15)
    )
    angle, down = 0.4 + 2 * hit, -9.81 * hit
    arm = -math.copysign(0.3 * math.cos(angle), math.sin(angle))  # of the lower end
    push = -1.7 * (down + 2 * arm) / (1 / 2 + arm**2 / 0.05)
    (event,) = found.events
    assert event.time == pytest.approx(hit, abs=1e-12) and push > 0
    rest = 0.5 - hit
    height = 0.1 + 0.3 * abs(math.sin(angle)) + (down + push / 2) * rest - 4.905 * rest**2
    turned = angle + (2 + arm * push / 0.05) * rest
    assert found["height"][-1] == pytest.approx(height, abs=1e-10)
    assert found["along"][-1] == pytest.approx(0.2 + 0.3 * 0.5, abs=1e-12)
    if plane:
        assert found["free.angle"][-1] == pytest.approx(turned, abs=1e-9)

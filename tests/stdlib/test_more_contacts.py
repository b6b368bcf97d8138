"""Boxes, cylinders, cones, polyhedra and terrain that touch, and rays: distances by other formulas, motions by closed forms."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.interpolate import PchipInterpolator
from scipy.optimize import lsq_linear, minimize_scalar
from scipy.spatial.transform import Rotation
from slow_params import slow_but

import mechc

Array = NDArray[np.float64]
R, L = 0.3, 0.8
A, B = np.array([0.5, 0.3, 0.4]), np.array([0.2, 0.6, 0.3])
XS, ZS = np.array([-1.0, -0.2, 0.3, 1.0]), np.array([0.4, 0.0, 0.1, 0.5])
TERRAIN = f"x = {{{', '.join(map(str, XS))}}} m, y = {{-1, 1}} m, z = {{{', '.join(f'{{{z}, {z}}}' for z in ZS)}}} m"


def frames(n: int, part: str, outputs: str) -> str:
    """Two frames in poses that parameters say, with a part between them."""
    text = f"import mech.contact.*;\nimport mech.{'spatial' if n == 3 else 'planar'}.*;\nmodel M\n"
    for name in "ab":
        text += "".join(f"  parameter Length {name}{k} = 0 m;\n" for k in range(n))
        text += "".join(f"  parameter Angle {name}{k} = 0 rad;\n" for k in range(3, 4 if n == 2 else 6))
        turn = f"rot({name}3)" if n == 2 else f"rotx({name}3)*roty({name}4)*rotz({name}5)"
        at = ", ".join(f"{name}{k}" for k in range(n))
        inertia = "0.1 kg.m^2" if n == 2 else "0.1*identity(3) kg.m^2"
        text += f"  Body {name}(m = 1 kg, J = {inertia}); Free f{name}(world * trans({{{at}}}) * {turn} -> {name}.a);\n"
    return f"{text}  {part}\n  {outputs}\n  experiment(stop = 0 s);\nend M;\n"


def poses(n: int, count: int, seed: int) -> dict[str, Array]:
    random = np.random.default_rng(seed)
    keys = [0, 1, 3] if n == 2 else range(6)
    found = {}
    for name in "ab":
        for k in keys:
            size = 0.7 if k < 3 else 3.0
            found[f"{name}{k}"] = random.uniform(-size, size, count)
    return found


def matrices(n: int, values: dict[str, Array], name: str) -> tuple[Array, Array]:
    """Places [count, n] and turns [count, n, n]."""
    places = np.transpose([values[f"{name}{k}"] for k in range(n)])
    if n == 3:
        angles = np.transpose([values[f"{name}{k}"] for k in (3, 4, 5)])
        return places, Rotation.from_euler("XYZ", angles).as_matrix()
    c, s = np.cos(values[f"{name}3"]), np.sin(values[f"{name}3"])
    return places, np.moveaxis(np.array([[c, -s], [s, c]]), 2, 0)


def told(text: str, values: dict[str, Array], names: list[str], path: Path) -> Array:
    """The outputs of all members, one row for each name; of bodies that overlap, which no run begins with, no numbers."""
    np.savetxt(path, np.transpose(list(values.values())), "%.17g", ",", header=",".join(values), comments="")
    keep = ", ".join(f"final({name})" for name in names)
    found = mechc.loads(text).ensemble(str(path), keep=keep, errors=False)
    return np.array([found[f"final({name})"] for name in names])


COUNTS = slow_but([200], [200, 20_000])


@pytest.mark.parametrize("count", COUNTS)
@pytest.mark.parametrize("part", ["CylinderOnPlane", "ConeOnPlane"])
def test_rims_on_a_plane(part: str, count: int, tmp_path: Path) -> None:
    """The lowest point of a circle spanned by u and v is R |(u_n, v_n)| below its middle."""
    given = f"r = {R} m, {'l' if part == 'CylinderOnPlane' else 'h'} = {L} m, bulge = 0"
    text = frames(
        3, f"{part} p(a.a -> b.a, {given});", "output Length g1 = p.gap[1]; output Length g2 = p.gap[2];"
    )
    values = poses(3, count, 1)
    found = told(text, values, ["g1", "g2"], tmp_path / "m.csv")
    (p, S), (q, T) = matrices(3, values, "a"), matrices(3, values, "b")
    up = S[:, :, 2]
    low = np.hypot(np.sum(T[:, :, 1] * up, 1), np.sum(T[:, :, 2] * up, 1))
    ends = [(-L / 2, R), (L / 2, R)] if part == "CylinderOnPlane" else [(0, R), (L, 0)]
    gaps = np.array([np.sum((q + end * T[:, :, 0] - p) * up, 1) - rim * low for end, rim in ends])
    overlap = (gaps < 0).any(0)
    assert np.all(np.isnan(found).any(0) == overlap)
    assert np.abs(found - gaps)[:, ~overlap].max() < 1e-12


@pytest.mark.parametrize("count", COUNTS)
def test_a_ball_and_a_cylinder(count: int, tmp_path: Path) -> None:
    """As far as the point (x, distance from the axis) from a rectangle."""
    text = frames(
        3, f"BallOnCylinder p(a.a -> b.a, r = {R} m, l = {L} m, r_to = 0.05 m);", "output Length g = p.gap;"
    )
    values = poses(3, count, 2)
    (found,) = told(text, values, ["g"], tmp_path / "m.csv")
    (p, S), (q, _) = matrices(3, values, "a"), matrices(3, values, "b")
    at = np.einsum("kij,ki->kj", S, q - p)
    x, out = np.maximum(np.abs(at[:, 0]) - L / 2, 0), np.maximum(np.hypot(at[:, 1], at[:, 2]) - R, 0)
    gap = np.hypot(x, out) - 0.05
    assert np.all(np.isnan(found) == (gap < 0))
    assert np.abs(found - gap)[gap > 0].max() < 1e-12


def far_from_box(at: Array, along: Array, size: Array) -> Array:
    """The least distances of lines at + s along, |s| <= L/2, from a box: by halving where that of their points, which is convex, falls."""

    def from_box(s: Array) -> Array:
        x = at + s[:, None] * along
        slope: Array = np.sum(along * (x - np.clip(x, -size / 2, size / 2)), 1)
        return slope

    low, high = np.full(len(at), -L / 2), np.full(len(at), L / 2)
    for _ in range(60):
        middle = (low + high) / 2
        falls = from_box(middle) < 0
        low, high = np.where(falls, middle, low), np.where(falls, high, middle)
    x = at + low[:, None] * along
    found: Array = np.linalg.norm(np.maximum(np.abs(x) - size / 2, 0), axis=1)
    return found


@pytest.mark.parametrize("count", COUNTS)
@pytest.mark.parametrize("n", slow_but([2], [2, 3]))
def test_a_capsule_and_a_box(n: int, count: int, tmp_path: Path) -> None:
    """The nearest of its ends, corners and edges. A line that goes through the box is refused, though its ends are outside."""
    edges = ", ".join(map(str, A[:n]))
    text = frames(
        n,
        f"CapsuleOnBox p(a.a -> b.a, edges = {{{edges}}} m, l = {L} m, r_to = 0.05 m);",
        "output Length g = min(p.gap);",
    )
    values = poses(n, count, 7)
    (found,) = told(text, values, ["g"], tmp_path / "m.csv")
    (p, S), (q, T) = matrices(n, values, "a"), matrices(n, values, "b")
    at, along = np.einsum("kij,ki->kj", S, q - p), np.einsum("kij,ki->kj", S, T[:, :, 0])
    gap = far_from_box(at, along, A[:n]) - 0.05
    assert np.all(np.isnan(found) == (gap < 0))
    assert np.abs(found - gap)[gap > 0].max() < 1e-12
    assert count / 50 < (gap < 0).sum() < count / 1.2


@pytest.mark.slow
def test_a_capsule_parallel_to_a_face_or_an_edge(tmp_path: Path) -> None:
    """Where more than one point is nearest."""
    edges = ", ".join(map(str, A))
    text = frames(
        3,
        f"CapsuleOnBox p(a.a -> b.a, edges = {{{edges}}} m, l = {L} m, r_to = 0.05 m);",
        "output Length g = min(p.gap);",
    )
    values = {
        **{k: np.zeros(8) for k in poses(3, 1, 0)},
        "b0": np.linspace(-1, 1, 8),
        "b1": np.full(8, 0.3),
        "b2": np.linspace(0.4, 0, 8),
    }
    (found,) = told(text, values, ["g"], tmp_path / "m.csv")
    at, along = np.transpose([values[f"b{k}"] for k in range(3)]), np.tile([1.0, 0, 0], (8, 1))
    assert np.abs(found - far_from_box(at, along, A) + 0.05).max() < 1e-12


def polygons(n: int, values: dict[str, Array]) -> tuple[Array, Array]:
    """How far boxes are apart along the best of the normals of their faces, and the least distance of their corners from the other."""
    sides, corners = [], []
    signs = np.array(np.meshgrid(*[[-0.5, 0.5]] * n)).reshape(n, -1).T
    (p, S), (q, T) = matrices(n, values, "a"), matrices(n, values, "b")
    for (place, turn, size), (other, spun, extent) in (((p, S, A), (q, T, B)), ((q, T, B), (p, S, A))):
        points = other[:, None] + np.einsum("kij,cj->kci", spun, signs * extent[:n])
        seen = np.einsum("kij,kci->kcj", turn, points - place[:, None])
        low, high = seen.min(1) - size[:n] / 2, -seen.max(1) - size[:n] / 2
        sides.append(np.maximum(low, high).max(1))
        outside = np.maximum(np.abs(seen) - size[:n] / 2, 0)
        corners.append(np.linalg.norm(outside, axis=2).min(1))
    return np.maximum(*sides), np.minimum(*corners)


def boxes(n: int) -> str:
    a, b = (", ".join(map(str, size[:n])) for size in (A, B))
    part = f"BoxOnBox p(a.a -> b.a, edges_from = {{{a}}} m, edges_to = {{{b}}} m, r = 0 m);"
    return frames(n, part, "output Length g = min(p.gap); output Length d = p.distance;")


@pytest.mark.parametrize("count", COUNTS)
@pytest.mark.parametrize("n", slow_but([2], [2, 3]))
def test_two_boxes(n: int, count: int, tmp_path: Path) -> None:
    """In the plane they are as far apart as the nearest corner; in space also where that stands above a face, while edges may
    be nearer. No gap is larger, and in the plane one is negative where they overlap, but for such as a cross."""
    values = poses(n, count, 3)
    found, distance = told(boxes(n), values, ["g", "d"], tmp_path / "m.csv")
    side, corner = polygons(n, values)
    overlap = np.isnan(found)
    assert np.abs(distance - corner)[~overlap].max() < 1e-12
    assert np.all(found[~overlap] <= corner[~overlap] + 1e-12)
    assert np.all(overlap <= (side < 0))
    assert n == 3 or np.all(side[(side < 0) & ~overlap] < -0.04)
    assert count / 50 < overlap.sum() < count / 1.2


def test_the_oracle_of_boxes_is_that_of_least_squares() -> None:
    """In the plane the distance is that of a corner."""
    values = poses(2, 40, 3)
    side, corner = polygons(2, values)
    (p, S), (q, T) = matrices(2, values, "a"), matrices(2, values, "b")
    half = np.array([*A[:2], *B[:2]]) / 2
    for k in np.flatnonzero(side > 0):
        least = lsq_linear(np.hstack([S[k], -T[k]]), q[k] - p[k], (-half, half), tol=1e-15)
        assert math.sqrt(2 * least.cost) == pytest.approx(corner[k], abs=1e-9)


def test_a_polyhedron_on_a_plane(tmp_path: Path) -> None:
    corners = np.random.default_rng(4).uniform(-0.3, 0.3, (6, 3))
    listed = ", ".join("{" + ", ".join(map(repr, map(float, row))) + "}" for row in corners)
    part = f"PolyhedronOnPlane p(a.a -> b.a, corners = {{{listed}}} m);"
    values = poses(3, 100, 5)
    (found,) = told(frames(3, part, "output Length g = min(p.gap);"), values, ["g"], tmp_path / "m.csv")
    (p, S), (q, T) = matrices(3, values, "a"), matrices(3, values, "b")
    seen = np.einsum("kij,kci->kcj", S, (q - p)[:, None] + np.einsum("kij,cj->kci", T, corners))
    gap = seen[:, :, 2].min(1)
    assert np.all(np.isnan(found) == (gap < 0))
    assert np.abs(found - gap)[gap > 0].max() < 1e-12


def nearest(curve: PchipInterpolator, x: float, z: float) -> float:
    """The least distance of a point from a curve."""
    tries = np.linspace(-1.5, 1.5, 600)
    k = int(np.argmin(np.hypot(tries - x, curve(tries) - z)))
    at = (tries[max(k - 1, 0)], tries[min(k + 1, 599)])
    best = minimize_scalar(
        lambda s: math.hypot(s - x, curve(s) - z), bounds=at, method="bounded", options={"xatol": 1e-12}
    )
    return float(best.fun)


@pytest.mark.slow
def test_a_ball_above_terrain(tmp_path: Path) -> None:
    """A height that follows SciPy's cubics in x, low enough above it for one nearest point."""
    text = frames(3, f"BallOnTerrain p(a.a -> b.a, r_to = 0.02 m, {TERRAIN});", "output Length g = p.gap;")
    random, curve = np.random.default_rng(6), PchipInterpolator(XS, ZS)
    x = random.uniform(-0.7, 0.7, 100)
    z = curve(x) + random.uniform(0.04, 0.08, 100)
    values = {"b0": x, "b1": random.uniform(-0.5, 0.5, 100), "b2": z}
    (found,) = told(text, values, ["g"], tmp_path / "m.csv")
    expected = [nearest(curve, *at) - 0.02 for at in zip(x, z, strict=True)]
    assert np.abs(found - expected).max() < 1e-9


RAYS = """
  frame eye = world * trans({a0, a1, a2}) * rotx(a3)*roty(a4)*rotz(a5);
  frame thing = world * trans({b0, b1, b2}) * rotx(b3)*roty(b4)*rotz(b5);
  RayToPlane plane(eye -> thing, reach = 9 m);
  RayToBall ball(eye -> thing, r = 0.3 m, reach = 9 m);
  RayToBox box(eye -> thing, edges = {0.5, 0.3, 0.4} m, reach = 9 m);
"""


@pytest.mark.parametrize("count", COUNTS)
def test_rays(count: int, tmp_path: Path) -> None:
    """The first point of each ray in the body, by bisection of what stands in it."""
    values = poses(3, count, 7)
    values |= {f"a{k}": 2 * values[f"a{k}"] for k in range(3)}
    outputs = [f"{body}.distance" for body in ("plane", "ball", "box")]
    found = told(frames(3, RAYS, ""), values, outputs, tmp_path / "m.csv")
    (p, S), (q, T) = matrices(3, values, "a"), matrices(3, values, "b")
    start = np.einsum("kij,ki->kj", T, p - q)
    along = np.einsum("kij,ki->kj", T, S[:, :, 0])
    into: tuple[Callable[[Array], Array], ...] = (
        lambda at: np.asarray(at[..., 2]),
        lambda at: np.asarray(np.linalg.norm(at, axis=-1) - 0.3),
        lambda at: np.asarray(np.max(np.abs(at) - A / 2, axis=-1)),
    )
    ways = np.linspace(0, 6, 601)
    for k, depth in enumerate(into):
        outside = depth(start) > 1e-2
        values_along = depth(start[:, None] + along[:, None] * ways[:, None])
        inside = values_along < 0
        hit = inside.any(1) & outside
        first = inside[hit].argmax(1)
        low, high = ways[first - 1], ways[first]
        for _ in range(45):
            middle = (low + high) / 2
            within = depth(start[hit] + along[hit] * middle[:, None]) < 0
            low, high = np.where(within, low, middle), np.where(within, middle, high)
        assert hit.sum() > count / 200
        assert np.abs(found[k][hit] - high).max() < 1e-9
        missed = outside & (values_along.min(1) > 0.05) & (found[k] < 6)
        assert not missed.any()


MOVING = """
import mech.contact.*;
import mech.SPACE.*;
model M
  Body a(m = 1 kg, J = INERTIA);
  Body b(m = 1 kg, J = INERTIA);
  Free fa(world -> a.a, START1);
  Free fb(world -> b.a, START2);
  PART
  output Length gap = GAP;
  output Velocity rate = der(GAP);
  output Acceleration second = der(GAP, 2);
  experiment(stop = 4 ms, tolerance = 1e-12, every = 0.2 ms);
end M;
"""
STARTS = {
    "spatial": (
        "der(position) = {1, -2, 0.5} m/s, der(orientation) = {3, 1, -2} rad/s",
        "position = {0.4, 0.7, 0.8} m, der(position) = {-1, 0.3, 0.2} m/s, orientation = rotx(0.4)*roty(0.7), der(orientation) = {-1, 2, 4} rad/s",
    ),
    "planar": (
        "der(x) = 1 m/s, der(angle) = 3 rad/s",
        "x = 0.5 m, y = 0.9 m, angle = 0.4, der(y) = 0.4 m/s, der(angle) = -2 rad/s",
    ),
}


@pytest.mark.parametrize(
    ("space", "part", "gap"),
    [
        ("spatial", "CylinderOnPlane p(a.a -> b.a, r = 0.3 m, l = 0.8 m);", "p.gap[2]"),
        ("spatial", "ConeOnPlane p(a.a -> b.a, r = 0.3 m, h = 0.8 m, bulge = 0.3);", "p.gap[1]"),
        ("spatial", "BallOnCylinder p(a.a -> b.a, r = 0.3 m, l = 0.8 m, r_to = 0.1 m);", "p.gap"),
        ("planar", "CapsuleOnBox p(a.a -> b.a, edges = {0.5, 0.3} m, l = 0.7 m, r_to = 0.1 m);", "p.gap[3]"),
        pytest.param("spatial", "CapsuleOnBox p(a.a -> b.a, edges = {0.5, 0.3, 0.4} m, l = 0.7 m, r_to = 0.1 m);", "p.gap[3]", marks=pytest.mark.slow),
        pytest.param("spatial", "BoxOnBox p(a.a -> b.a, edges_from = {0.5, 0.3, 0.4} m, edges_to = {0.2, 0.6, 0.3} m);", "p.gap[3]", marks=pytest.mark.slow),
        ("planar", "BoxOnBox p(a.a -> b.a, edges_from = {0.5, 0.3} m, edges_to = {0.2, 0.6} m);", "p.gap[6]"),
        pytest.param("spatial", f"BallOnTerrain p(a.a -> b.a, r_to = 0.02 m, {TERRAIN});", "p.gap", marks=pytest.mark.slow),
    ],
)  # fmt: skip
def test_rates_of_distances_are_their_differences(space: str, part: str, gap: str) -> None:
    """Of bodies that fly by each other, over 0.2 ms: fourth differences."""
    inertia = "0.1*identity(3) kg.m^2" if space == "spatial" else "0.1 kg.m^2"
    text = (
        MOVING.replace("PART", part).replace("GAP", gap).replace("SPACE", space).replace("INERTIA", inertia)
    )
    for word, value in zip(("START1", "START2"), STARTS[space], strict=True):
        text = text.replace(word, value)
    s = mechc.loads(text).simulate(estimate_error=False)
    g, k, h = s["gap"], np.arange(2, 19), 2e-4
    assert len(g) == 21, s.events
    first = (g[k - 2] - 8 * g[k - 1] + 8 * g[k + 1] - g[k + 2]) / (12 * h)
    second = (-g[k - 2] + 16 * g[k - 1] - 30 * g[k] + 16 * g[k + 1] - g[k + 2]) / (12 * h**2)
    assert np.abs(np.diff(g)).max() > 1e-5
    assert np.abs(first - s["rate"][k]).max() < 1e-7
    assert np.abs(second - s["second"][k]).max() < 1e-4


def run(text: str, stop: float, space: str = "spatial", tolerance: float = 1e-11) -> mechc.Solution:
    whole = f"import mech.{space}.*;\nimport mech.contact.*;\nmodel M\n{text}\n  experiment(stop = {stop} s, tolerance = {tolerance});\nend M;\n"
    s = mechc.loads(whole).simulate(estimate_error=False)
    assert s.outcome.value == "completed", s.message
    return s


def test_a_box_tips_over_the_edge_of_another() -> None:
    """Its centre is 2 cm beyond the ball that rounds the corner: it turns about that, as a rigid body about a fixed point."""
    beyond, round_, half = 0.02, 1e-3 * 0.1, 0.05
    s = run(
        "gravity {0, -9.81} m/s^2; Body box(m = 2 kg, J = 0.016 kg.m^2);"
        f"Free f(world -> box.a, x = {0.2 - round_ + beyond} m, y = 0.15 m);"
        "BoxOnBox on(world -> box.a, edges_from = {0.4, 0.2} m, edges_to = {0.3, 0.1} m, friction = 2);"
        "output turns = der(f.angle, 2); output Force F[2] = {sum(on.force[:, k]) for k in 1:2};",
        0.1,
        "planar",
    )
    about = 0.016 + 2 * (beyond**2 + half**2)
    assert s["turns"][0] == pytest.approx(-2 * 9.81 * beyond / about, rel=1e-9)
    assert s["F[2]"][0] == pytest.approx(2 * (9.81 + s["turns"][0] * beyond), rel=1e-9)
    assert s["f.angle"][-1] < -0.01


@pytest.mark.parametrize("shift", [0.0, 0.03])
def test_a_stack_of_boxes(shift: float) -> None:
    """Two equal boxes on a third, one exactly above the other or not: they stay, and corners carry weights and moments."""
    sizes = "edges_from = {0.3, 0.1} m, edges_to = {0.3, 0.1} m"
    s = run(
        "gravity {0, -9.81} m/s^2; Body b[2](m = 1 kg, J = 0.01 kg.m^2);"
        f"Free f1(world -> b[1].a, y = 0.2 m); Free f2(world -> b[2].a, x = {shift} m, y = 0.3 m);"
        "BoxOnBox low(world -> b[1].a, edges_from = {2, 0.3} m, edges_to = {0.3, 0.1} m, friction = 0.3);"
        f"BoxOnBox high(b[1].a -> b[2].a, {sizes}, friction = 0.3);"
        "output L = sum(low.pressure); output H = sum(high.pressure);"
        "output M = sum(pos(high.c[i])[1]*high.force[i, 2] for i in 1:8);",
        1,
        "planar",
    )
    assert s["L"][-1] == pytest.approx(2 * 9.81, abs=1e-9)
    assert s["H"][-1] == pytest.approx(9.81, abs=1e-9)
    assert s["M"][-1] == pytest.approx(9.81 * shift, abs=1e-9)
    assert abs(s["f2.x"][-1] - shift) + abs(s["f2.y"][-1] - 0.3) + abs(s["f2.angle"][-1]) < 1e-9


MOREAU = 'method = "moreau", step = 1 ms'
CAPSULE = (
    "Body b(m = 2 kg, J = J0); CapsuleOnBox on(FLOOR -> b.a, edges = EDGES m, l = LENGTH m, friction = MU);"
)


def capsule(
    space: str,
    start: str,
    length: float,
    friction: float,
    stop: float,
    how: str = "",
    floor: str = "world",
    edges: str = "{0.6, 0.2}",
) -> mechc.Solution:
    """A capsule of radius 10 cm on a box that is 20 cm high, in the plane with these edges."""
    plane = space == "planar"
    text = f"{CAPSULE} Free f({floor} -> b.a, {start}); gravity {'{0, -9.81}' if plane else '{0, 0, -9.81}'} m/s^2; frame slope = world * {'rot(-20 deg)' if plane else 'rotx(-20 deg)'};"
    words = {
        "J0": "0.05 kg.m^2" if plane else "diag({0.01, 0.05, 0.05}) kg.m^2",
        "EDGES": edges if plane else "{0.6, 2, 0.2}",
    }
    for word, value in {**words, "FLOOR": floor, "LENGTH": str(length), "MU": str(friction)}.items():
        text = text.replace(word, value)
    settings = how or "tolerance = 1e-11"
    whole = f"import mech.{space}.*;\nimport mech.contact.*;\nmodel M\n{text}\n  experiment(stop = {stop} s, {settings});\nend M;\n"
    s = mechc.loads(whole).simulate(estimate_error=False)
    assert s.outcome.value == "completed", s.message
    return s


def loads(s: mechc.Solution) -> list[float]:
    """What presses at the end, without zeros."""
    found = [s[name][-1] for name in s.columns() if name.startswith("on.pressure")]
    return [float(load) for load in found if abs(load) > 1e-9]


@pytest.mark.parametrize("how", ["", MOREAU])
@pytest.mark.parametrize(
    ("length", "x", "share"), [(0.4, 0.0, 1 / 2), (0.9, 0.0, 1 / 2), (0.9, 0.1, 2 / 3), (0.4, 0.2, 2 / 3)]
)
def test_a_capsule_lies_on_a_box(length: float, x: float, share: float, how: str) -> None:
    """Dropped flat from 1 cm by events: it stays where it fell, on its ends, on both edges, or on one end and one edge, which
    share its weight as levers. The edges are 0.3 m from the middle, the ends of the last 0 m and 0.4 m."""
    s = capsule("planar", f"x = {x} m, y = {0.2 if how else 0.21} m", length, 0.3, 0.5, how)
    weight = 2 * 9.81
    assert sorted(loads(s)) == pytest.approx([(1 - share) * weight, share * weight], rel=1e-7)
    assert [s["f.x"][-1], s["f.y"][-1], s["f.angle"][-1]] == pytest.approx([x, 0.2, 0], abs=1e-9)


@pytest.mark.parametrize("how", ["", MOREAU])
@pytest.mark.parametrize("length", [0.3, 2.0])
def test_a_capsule_slides_on_a_box(length: float, how: str) -> None:
    """v^2/(2 mu g) far, on its ends or over the edges, from which it does not fall. Moreau's steps end the slip on one of
    them, a speed of mu g h/2 too early at most: 1.5e-3 m/s, and as long."""
    s = capsule("planar", "x = -0.1 m, der(x) = 0.9 m/s, y = 0.2 m", length, 0.3, 0.5, how)
    far = 0.9**2 / (2 * 0.3 * 9.81)
    assert s["f.x"][-1] + 0.1 == pytest.approx(far, abs=1e-3 if how else 1e-10)
    assert s["f.angle"][-1] == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize("how", ["", MOREAU])
def test_a_capsule_tips_over_the_edge_of_a_box(how: str) -> None:
    """Its middle is 5 cm beyond the edge, on which friction holds it: it turns about that, as SciPy solves it."""
    s = capsule("planar", "x = 0.35 m, y = 0.2 m", 0.4, 3, 0.3, how)
    beyond, r, m, g = 0.05, 0.1, 2, 9.81
    about = 0.05 + m * (beyond**2 + r**2)
    turning = solve_ivp(
        lambda t, y: [y[1], -m * g * (beyond * math.cos(y[0]) - r * math.sin(y[0])) / about],
        (0, 0.3), [0, 0], "DOP853", rtol=1e-12, atol=1e-12,
    ).y[:, -1]  # fmt: skip
    found = [s["f.angle"][-1], s["der(f.angle)"][-1]]
    assert found == pytest.approx(turning, abs=2e-2 if how else 1e-9)
    assert turning[0] < -0.6


def test_a_capsule_rocks_from_edge_to_edge() -> None:
    """As a block does (G. W. Housner 1963): the first impact leaves 1 - 2 m b^2/(J + m (b^2 + r^2)) of the rate of turning."""
    tilt, half, r = 0.05, 0.1, 0.1
    x, y = (
        -half + half * math.cos(tilt) - r * math.sin(tilt),
        0.1 + half * math.sin(tilt) + r * math.cos(tilt),
    )
    s = capsule("planar", f"x = {x!r} m, y = {y!r} m, angle = {tilt} rad", 0.9, 9, 0.5, edges="{0.2, 0.2}")
    rates, angles = s["der(f.angle)"], s["f.angle"]
    first = next(event.time for event in s.events if event.kind == "impact" and event.time > 0.01)
    before, after = rates[s.time == first][[0, -1]]
    left = 1 - 2 * 2 * half**2 / (0.05 + 2 * (half**2 + r**2))
    assert 0 < left < 1 and before < -0.1
    assert after / before == pytest.approx(left, rel=1e-8)
    assert abs(angles[s.time == first][0]) < 1e-9 and angles.min() < -0.01


@pytest.mark.slow
@pytest.mark.parametrize("how", ["", MOREAU])
@pytest.mark.parametrize("length", [0.4, 0.9])
def test_a_capsule_rolls_down_a_box(length: float, how: str) -> None:
    """On its ends and across two edges: with g sin a/(1 + J/(m r^2))."""
    s = capsule("spatial", "position = {0, 0, 0.2} m", length, 0.5, 0.5, how, "slope")
    far = 9.81 * math.sin(math.radians(20)) / (1 + 0.01 / (2 * 0.1**2)) * 0.5**2 / 2
    assert s["f.position[2]"][-1] == pytest.approx(far, abs=1e-3 if how else 1e-9)
    assert sorted(loads(s)) == pytest.approx(
        [9.81 * math.cos(math.radians(20))] * 2, rel=1e-3 if how else 1e-8
    )


@pytest.mark.slow
@pytest.mark.parametrize("how", ["", MOREAU])
@pytest.mark.parametrize(
    ("turn", "x", "length"), [(0, 0.1, 0.9), (30, 0.0, 0.4), (30, 0.1, 0.9), (90, 0.1, 0.4)]
)
def test_a_capsule_lies_on_a_box_in_space(turn: float, x: float, length: float, how: str) -> None:
    """On its ends, the edges that it crosses at any angle, or one of each, with the loads of levers."""
    s = capsule(
        "spatial", f"position = {{{x}, 0, 0.2}} m, orientation = rotz({turn} deg)", length, 0.3, 0.3, how
    )
    half = length * math.cos(math.radians(turn)) / 2
    low, high = max(x - half, -0.3), min(x + half, 0.3)
    share = (x - low) / (high - low)
    assert sorted(loads(s)) == pytest.approx([(1 - share) * 2 * 9.81, share * 2 * 9.81], rel=1e-6)
    assert s["f.position[3]"][-1] == pytest.approx(0.2, abs=1e-9)


DRUM = "Body drum(m = 3 kg, J = diag({0.06, 0.085, 0.085}) kg.m^2);"


def test_a_cylinder_rolls_down_a_slope() -> None:
    """With 2/3 g sin a, both rims pressed alike; J = 1/2 m r^2."""
    s = run(
        f"gravity {{0, 0, -9.81}} m/s^2; {DRUM} frame slope = world * rotx(-20 deg);"
        "Free f(slope -> drum.a, position = {0, 0, 0.2} m);"
        "CylinderOnPlane on(slope -> drum.a, r = 0.2 m, l = 0.5 m, friction = 0.5);"
        "output Force F[3] = components(slope, {sum(on.force[:, k]) for k in 1:3});",
        1,
    )
    a = 2 / 3 * 9.81 * math.sin(math.radians(20))
    assert s["f.position[2]"][-1] == pytest.approx(a / 2, abs=1e-9)
    weight = 3 * 9.81 * math.cos(math.radians(20))
    assert [s[f"on.pressure[{k}]"][-1] for k in (1, 2)] == pytest.approx([weight / 2] * 2, abs=1e-8)
    assert [s[f"F[{k}]"][-1] for k in (1, 2, 3)] == pytest.approx([0, -3 * a / 2, weight], abs=1e-8)


def test_a_cylinder_stands_and_rocks_on_the_bulge_of_its_end() -> None:
    """Height of its centre over the tilt s: l/2 cos s + r (sqrt(s^2 + b^2) - b)/(sqrt(1 + b^2) - b); rolling, the moment about the
    point that touches is J + m l^2/4. 1e-4 of tilt, which changes the rate by 3/8 (1e-4/b)^2 of itself, 3e-5 rad in 1 s."""
    b, r, length, tilt = 0.05, 0.2, 0.5, 1e-4
    s = run(
        f"gravity {{0, 0, -9.81}} m/s^2; {DRUM}"
        f"Free f(world -> drum.a, orientation = roty(-90 deg)*roty({tilt}), position = {{0, 0, h}});"
        f"let h = {length / 2}*cos({tilt})*1 m + 0.2 m*(sqrt(sin({tilt})^2 + {b}^2) - {b})/(sqrt(1 + {b}^2) - {b});"
        f"CylinderOnPlane on(world -> drum.a, r = {r} m, l = {length} m, bulge = {b}, friction = 0.5);"
        "output lean = direction(drum.a, {1, 0, 0})[1];",
        1,
    )
    up = r / b / (math.sqrt(1 + b * b) - b) - length / 2
    w = math.sqrt(3 * 9.81 * up / (0.085 + 3 * length**2 / 4))
    assert s["lean"] / tilt == pytest.approx(np.cos(w * s.time) * s["lean"][0] / tilt, abs=5e-5)
    assert abs(s["lean"][0]) == pytest.approx(tilt, rel=1e-6)


def coin(stop: float, r: float, half: float, turn: Array, spin: Array, m: float, J: Array) -> Array:
    """Where the centre of a disk is that rolls on the rim of one end: Newton's and Euler's laws with the point at rest."""

    def rates(t: float, y: Array) -> Array:
        quaternion = Rotation.from_quat(y[3:7])
        R, w = quaternion.as_matrix(), y[10:13]
        axis = R[:, 0]
        end = -half if axis[2] > 0 else half
        down = axis[2] * axis - np.array([0, 0, 1])
        size = np.linalg.norm(down)
        axis_rate = np.cross(w, axis)
        down_rate = axis_rate[2] * axis + axis[2] * axis_rate
        arm = end * axis + r * down / size
        arm_rate = end * axis_rate + r * (down_rate / size - down * (down @ down_rate) / size**3)
        inertia = R @ np.diag(J) @ R.T
        # unknowns: acceleration, angular acceleration, force: 0 = a + dw x arm + w x arm'
        cross = np.array([[0, arm[2], -arm[1]], [-arm[2], 0, arm[0]], [arm[1], -arm[0], 0]])
        A = np.zeros((9, 9))
        A[:3, :3], A[:3, 6:] = m * np.eye(3), -np.eye(3)
        A[3:6, 3:6], A[3:6, 6:] = inertia, cross
        A[6:, :3], A[6:, 3:6] = np.eye(3), cross
        right = np.concatenate([[0, 0, -9.81 * m], -np.cross(w, inertia @ w), -np.cross(w, arm_rate)])
        found = np.linalg.solve(A, right)
        q = quaternion.as_quat()  # scalar part last
        product = np.array([*(w * q[3] + np.cross(w, q[:3])), -w @ q[:3]])
        return np.concatenate([y[7:10], product / 2, found[:6]])

    R = Rotation.from_matrix(turn)
    axis = turn[:, 0]
    down = axis[2] * axis - np.array([0, 0, 1])
    arm = (-half if axis[2] > 0 else half) * axis + r * down / np.linalg.norm(down)
    start = np.concatenate([[0, 0, -arm[2]], R.as_quat(), -np.cross(spin, arm), spin])
    found = solve_ivp(rates, (0, stop), start, method="DOP853", rtol=1e-12, atol=1e-13)
    return np.array(found.y[:, -1])


def test_a_coin_wobbles_on_its_rim() -> None:
    """Rolling without slip from 40 degrees of tilt, against an integration of its own of rates, forces and the rim."""
    r, half, m = 0.1, 0.01, 0.5
    across = m * (3 * r * r + (2 * half) ** 2) / 12
    J = np.array([m * r * r / 2, across, across])
    turn = Rotation.from_euler("y", 40, degrees=True).as_matrix()
    spin = np.array([1.0, 0.5, 9.0])
    axis = turn[:, 0]
    down = axis[2] * axis - np.array([0, 0, 1])
    arm = (-half if axis[2] > 0 else half) * axis + r * down / np.linalg.norm(down)
    v = -np.cross(spin, arm)
    w = turn.T @ spin
    expected = coin(0.4, r, half, turn, spin, m, J)
    s = run(
        f"gravity {{0, 0, -9.81}} m/s^2; Body coin(m = {m} kg, J = diag({{{J[0]}, {across}, {across}}}) kg.m^2);"
        f"Free f(world -> coin.a, position = {{0, 0, {-arm[2]:.17g}}} m, der(position) = {{{v[0]:.17g}, {v[1]:.17g}, {v[2]:.17g}}} m/s,"
        f"orientation = roty(40 deg), der(orientation) = {{{w[0]:.17g}, {w[1]:.17g}, {w[2]:.17g}}} rad/s);"
        f"CylinderOnPlane on(world -> coin.a, r = {r} m, l = {2 * half} m, bulge = 0, friction = 5);",
        0.4,
    )
    place = np.array([s[f"f.position[{k}]"][-1] for k in (1, 2, 3)])
    assert np.abs(place - expected[:3]).max() < 1e-7
    assert np.abs(place[:2]).max() > 0.01


@pytest.mark.slow
def test_a_ball_rolls_on_terrain_as_on_a_curve() -> None:
    """Its centre goes at the distance r from the curve, with 7/5 of its mass: an equation in the place of the foot alone."""
    r, curve = 0.05, PchipInterpolator(XS, ZS)
    first, second, third = (curve.derivative(k) for k in (1, 2, 3))

    def rates(t: float, y: Array) -> list[float]:
        u, v = y
        g, c, d = first(u), second(u), third(u)
        n = 1 + g * g
        k = 1 - r * c / n**1.5  # of the centre by that of the foot
        kd = -r * (d / n**1.5 - 3 * g * c * c / n**2.5)
        # path: s' = sqrt(n) k u'; s'' = 5/7 of -g dz/ds
        a = -5 / 7 * 9.81 * g / math.sqrt(n)
        return [v, (a - v * v * (g * c / math.sqrt(n) * k + math.sqrt(n) * kd)) / (math.sqrt(n) * k)]

    u0 = 0.1
    n0 = math.sqrt(1 + first(u0) ** 2)
    x0, z0 = u0 - r * first(u0) / n0, curve(u0) + r / n0
    found = solve_ivp(rates, (0, 0.4), [u0, 0], method="DOP853", rtol=1e-11, atol=1e-12)
    s = run(
        "gravity {0, 0, -9.81} m/s^2; Body ball(m = 2 kg, J = 0.002*identity(3) kg.m^2);"
        f"Free f(world -> ball.a, position = {{{x0:.17g}, 0, {z0 + 1e-15:.17g}}} m);"
        f"BallOnTerrain on(world -> ball.a, r_to = {r} m, {TERRAIN}, friction = 2);",
        0.4,
    )
    assert s["on.foot_x"][-1] == pytest.approx(found.y[0, -1], abs=1e-6)
    assert abs(found.y[0, -1] - u0) > 0.02

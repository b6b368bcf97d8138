"""Contacts of shapes: the motions of the same scenes with gaps written out by other formulas, and closed forms."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq
from slow_params import slow_but

import mechc
from mechc.compiler.flat.names.files import library_folder

PLANAR = """
import mech.planar.*;
import mech.shapes.*;
model M
  gravity {0, -9.81} m/s^2;
  parameter mu = 0.3;
  Disk ball[3](m = {0.1, 0.2, 0.3} kg, r = {5, 6, 7} cm);
  Free free[i in 1:3](world -> ball[i].a, x = 0.1 m*i, y = 0.2 m*i, angle = 0 rad, der(x) = 0.2 m/s*(3 - i), der(y) = 0 m/s, der(angle) = 2 rad/s);
  frame slope = world * rot(-10 deg);
  shape Sphere(r = {5, 6, 7} cm) on ball;
  shape floor: Plane on slope at {0, -3} cm;
  shape wall: Plane on world * trans({0.5, 0} m) * rot(90 deg);
  contact ball with ball, floor, wall friction mu restitution 0.5;
  experiment(stop = 0.7 s, tolerance = 1e-11);
end M;
"""

BY_HAND = """
model M
  parameter mu = 0.3;
  parameter m[3] = {0.1, 0.2, 0.3} kg;
  parameter r[3] = {5, 6, 7} cm;
  coordinate Length x[3] = {0.1, 0.2, 0.3} m;
  coordinate Length y[3] = {0.2, 0.4, 0.6} m;
  coordinate Angle a[3] = {0, 0, 0} rad;
  initial der(x) = {0.4, 0.2, 0} m/s;
  initial der(y) = {0, 0, 0} m/s;
  initial der(a) = {2, 2, 2} rad/s;
  let s = sin(10 deg);
  let c = cos(10 deg);
  for i in 1:3 loop
    kinetic 1/2*m[i]*(der(x[i])^2 + der(y[i])^2 + 1/2*r[i]^2*der(a[i])^2);
    potential m[i]*9.81 m/s^2*y[i];
    for j in i + 1:3 loop
      contact h[i, j]: sqrt((x[i] - x[j])^2 + (y[i] - y[j])^2) - r[i] - r[j] restitution 0.5 friction mu
        along ((x[j] - x[i])*(der(y[j]) - der(y[i])) - (y[j] - y[i])*(der(x[j]) - der(x[i])))/sqrt((x[i] - x[j])^2 + (y[i] - y[j])^2)
          - r[i]*der(a[i]) - (sqrt((x[i] - x[j])^2 + (y[i] - y[j])^2) - r[i])*der(a[j]);
    end for;
    contact f[i]: s*x[i] + c*y[i] + 3 cm - r[i] restitution 0.5 friction mu along c*der(x[i]) - s*der(y[i]) + r[i]*der(a[i]);
    contact w[i]: 0.5 m - x[i] - r[i] restitution 0.5 friction mu along der(y[i]) + r[i]*der(a[i]);
  end for;
  experiment(stop = 0.7 s, tolerance = 1e-11);
end M;
"""

NAMES = {
    f"free[{i}].{ours}": f"{theirs}[{i}]"
    for i in (1, 2, 3)
    for ours, theirs in (("x", "x"), ("y", "y"), ("angle", "a"))
}


@pytest.mark.parametrize("method", ["", ', method = "moreau", step = 1 ms'])
def test_balls_move_as_by_formulas_of_ones_own(method: str) -> None:
    """Balls meet each other, a slope and a wall: impacts of every kind of pair, slip and stick."""
    texts = [
        text.replace(", tolerance = 1e-11", method or ", tolerance = 1e-11") for text in (PLANAR, BY_HAND)
    ]
    shapes, hand = (mechc.loads(text).simulate(estimate_error=False) for text in texts)
    assert shapes.outcome.value == hand.outcome.value == "completed"
    if not method:
        kinds = {e.name.partition(".")[0] for e in shapes.events if e.kind == "impact"}
        pairs = ("ball[1]-ball[2]", "ball[1]-ball[3]", "ball[2]-ball[3]", "ball[3]-floor", "ball[2]-wall")
        assert kinds >= {*pairs, "ball[1]-floor", "ball[2]-floor"}
    for ours, theirs in NAMES.items():
        assert shapes[ours][-1] == pytest.approx(hand[theirs][-1], abs=1e-9)
        assert shapes[f"der({ours})"][-1] == pytest.approx(hand[f"der({theirs})"][-1], abs=1e-8)


CRATE = """
import mech.SPACE.*;
import mech.shapes.*;
model M
  gravity DOWN m/s^2;
  Box crate(size = EDGES m, density = 700 kg/m^3);
  Free free(world * TURN -> crate.a, AT);
  initial der(free.position[1]) = -1 m/s;
  shape Box(size = crate.size) on crate;
  shape Plane on world * TURN;
  contact c: crate with world friction 0.5;
  output Force load = multiplier(c);
  output pressed = if closed(c) then 1 else 0;
  output Length low = min(c.gap);
  experiment(stop = 1 s);
end M;
"""
SPACES = {
    "planar": (
        "{0.4, 0.2}",
        "rot(-20 deg)",
        "y = 0.1 m, x = 0 m, der(x) = -1 m/s, angle = 0 rad",
        "{0, -9.81}",
        700 * 0.4 * 0.2,
    ),
    "spatial": (
        "{0.4, 0.3, 0.2}",
        "roty(20 deg)",
        "position = {0, 0, 0.1} m",
        "{0, 0, -9.81}",
        700 * 0.4 * 0.3 * 0.2,
    ),
}


@pytest.mark.parametrize("space", ["planar", pytest.param("spatial", marks=pytest.mark.slow)])
def test_a_crate_slides_up_a_slope_and_stays(space: str) -> None:
    """v^2/(2 g (sin + mu cos)) far, since mu > tan; then its weight rests on its corners."""
    edges, turn, at, down, mass = SPACES[space]
    text = CRATE
    for word, value in (("SPACE", space), ("EDGES", edges), ("TURN", turn), ("AT", at), ("DOWN", down)):
        text = text.replace(word, value)
    if space == "planar":
        text = text.replace("  initial der(free.position[1]) = -1 m/s;\n", "")
    s = mechc.loads(text).simulate()
    a, g = math.radians(20), 9.81
    far = 1 / (2 * g * (math.sin(a) + 0.5 * math.cos(a)))
    place = "free.x" if space == "planar" else "free.position[1]"
    assert s[place][-1] == pytest.approx(-far, abs=1e-9)
    assert s["load"][-1] == pytest.approx(mass * g * math.cos(a), rel=1e-9)
    assert s["pressed"][-1] == 1
    assert abs(s["low"][-1]) < 1e-9


def test_balls_thrown_into_a_box_of_planes_keep_their_momenta() -> None:
    """Two balls collide in the middle without restitution lost: they exchange their velocities along the line of centres."""
    s = mechc.loads(
        """
import mech.spatial.*;
import mech.shapes.*;
model M
  Body ball[2](m = 1 kg, J = 0.004*identity(3) kg.m^2);
  Free free[i in 1:2](world -> ball[i].a, position = {0.5*(2*i - 3), 0.06*(2*i - 3), 0} m);
  initial der(free[1].position) = {1, 0, 0} m/s;
  initial der(free[2].position) = {-1, 0, 0} m/s;
  shape Sphere(r = 0.1 m) on ball;
  contact ball with ball restitution 1;
  experiment(stop = 0.8 s);
end M;
"""
    ).simulate()
    (hit,) = (e for e in s.events if e.kind == "impact")
    along = np.array([0.16, 0.12]) / 0.2
    assert hit.time == pytest.approx((1 - 0.16) / 2, abs=1e-12)
    for k, sign in ((1, 1), (2, -1)):
        v = sign * (np.array([1, 0]) - 2 * along * along[0])
        found = [s[f"der(free[{k}].position[{i}])"][-1] for i in (1, 2)]
        assert found == pytest.approx(v, abs=1e-11)


def test_the_contact_of_a_part_can_be_switched() -> None:
    """Released at 0.2 s, the floor lets both balls through, which would have landed at 0.30 s."""
    s = mechc.loads(
        """
import mech.planar.*;
import mech.shapes.*;
model M
  gravity {0, -9.81} m/s^2;
  Disk ball[2](r = 5 cm);
  Free free[i in 1:2](world -> ball[i].a, x = 1 m*i, y = 0.5 m);
  shape Sphere(r = 5 cm) on ball;
  shape floor: Plane on world;
  contact c: ball with floor;
  when time > 0.2 s then release c; end when;
  experiment(stop = 0.5 s);
end M;
"""
    ).simulate()
    assert not [e for e in s.events if e.kind == "impact"]
    assert s["free[2].y"][-1] == pytest.approx(0.5 - 9.81 / 8, abs=1e-10)


THROWN = """
import mech.planar.*;
import mech.shapes.*;
model M
  gravity {0, -9.81} m/s^2;
  parameter e = 0.6;
  parameter Length rad = 5 cm;
  Disk ball[2](r = rad, m = 1 kg);
  Free free[i in 1:2](world -> ball[i].a, x = 0.02 m*i, y = 0.2 m*i, der(x) = 0.5 m/s);
  shape Sphere(r = rad) on ball;
  shape floor: Plane on world;
  contact ball with ball, floor friction 0.3 restitution e;
  output Length far = free[2].x;
  experiment(stop = 0.45 s, tolerance = 1e-11);
end M;
"""


def test_derivatives_and_ensembles_go_through_contacts_of_shapes(tmp_path: Path) -> None:
    """Of a distance after five impacts, in restitution and radius: against differences, whose error is 1e-6."""
    model = mechc.loads(THROWN)
    path = tmp_path / "members.csv"
    steps = {"e": 1e-5, "rad": 1e-6}
    rows = [
        (0.6 + d * (p == "e"), 0.05 + d * (p == "rad")) for p, step in steps.items() for d in (step, -step)
    ]
    path.write_text("e,rad\n" + "".join(f"{e!r},{r!r}\n" for e, r in rows), encoding="utf-8")
    far = model.ensemble(str(path), keep="final(far)", errors=False)["final(far)"]
    s = model.simulate(sensitivity=["e", "rad"], estimate_error=False)
    assert len([e for e in s.events if e.kind == "impact"]) == 5
    for k, (p, step) in enumerate(steps.items()):
        difference = (far[2 * k] - far[2 * k + 1]) / 2 / step
        assert s.sensitivity("far", p).values[-1] == pytest.approx(difference, abs=1e-6)


LIFT = """
import mech.planar.*;
import mech.shapes.*;
model Pan
  frame root;
  frame top = root * trans({0 m, 2 cm});
  frame plate = top;
  shape Plane on plate;
end Pan;
model Carrier
  frame root;
  Pan pan(root = root);
end Carrier;
model Lift "a ball on a pan in a carrier that a measured input lifts, until it comes near again"
  gravity {0, -9.81} m/s^2;
  input Length road(interpolation = "spline");
  frame cage;
  Prismatic guide(world -> cage, axis = {0, 1});
  drive guide.position = road;
  Carrier carrier(root = cage);
  Disk ball(r = 5 cm, m = 1 kg);
  Free free(world -> ball.a, y = 0.5 m);
  shape Sphere(r = 5 cm) on ball;
  parameter e = 0.6;
  contact c: ball with carrier restitution e;
  when free.y - road < 0.09 m and der(free.y) < 0 m/s and time > 0.5 s then terminate("near"); end when;
  experiment(stop = 3 s, tolerance = 1e-10);
end Lift;
"""


def test_a_shape_of_a_part_of_a_part_is_lifted_by_a_measured_input() -> None:
    """One flight, one impact and one flight by hand over SciPy's natural spline, and the derivative at the end by differences of these."""
    t = np.linspace(0, 3, 61)
    road = CubicSpline(t, 0.1 * np.sin(3 * t), bc_type="natural")

    def flight(e: float, end: float | None = None) -> tuple[float, float, float]:
        hit = brentq(lambda s: 0.5 - 9.81 / 2 * s**2 - road(s) - 0.07, 0.1, 0.6)
        y, v = road(hit) + 0.07, road(hit, 1) + e * (9.81 * hit + road(hit, 1))

        def place(s: float) -> float:
            return float(y + v * (s - hit) - 9.81 / 2 * (s - hit) ** 2)

        until = brentq(lambda s: place(s) - road(s) - 0.09, 0.5, 0.8) if end is None else end
        return until, place(until), float(v - 9.81 * (until - hit))

    end, y, v = flight(0.6)
    s = mechc.loads(LIFT).simulate(inputs={"road": (t, 0.1 * np.sin(3 * t))}, sensitivity="e")
    assert s.outcome.value == "terminated"
    assert [s.time[-1], s["free.y"][-1], s["der(free.y)"][-1]] == pytest.approx([end, y, v], abs=1e-8)
    change = (flight(0.6 + 1e-5, end)[1] - flight(0.6 - 1e-5, end)[1]) / 2e-5
    assert np.asarray(s.sensitivity("free.y", "e"))[-1] == pytest.approx(change, rel=1e-6)


TURRET = """
import mech.spatial.*;
import mech.shapes.*;
model Turret
  parameter h = 30 cm;
  gravity {0, 0, -9.81} m/s^2;
  Body turret(m = 1 kg, J = diag({1, 1, 1} kg.m^2));
  Body arm(m = 1 kg, J = diag({0.1, 0.1, 0.1} kg.m^2), com = {0.2, 0, 0} m);
  Revolute yaw(world * trans({0 m, 0 m, h}) -> turret.a, axis = {0, 0, 1});
  Revolute shoulder(turret.a -> arm.a, axis = {0, 1, 0});
  shape Plane on world;
  shape Sphere(r = 10 cm) on turret;
  shape Sphere(r = 5 cm) on arm.a at {0.4, 0, 0} m;
  contact c: world with turret, arm;
  output load[3] = {multiplier(c), multiplier(c[1]), multiplier(c[2])};
  output shut[3] = {if b then 1 else 0 for b in {closed(c), closed(c[1]), closed(c[2])}};
  output gap = min(c.gap);
  experiment(stop = 1 s);
end Turret;
"""


def test_shapes_whose_distance_nothing_changes_press_nothing() -> None:
    """The ball of a turret keeps its height above the floor; that of the arm falls to sin(angle) = (h - r)/l and carries half
    of the weight of the arm, whose centre is in its middle."""
    model = mechc.loads(TURRET)
    run = model.simulate()
    assert run["shoulder.angle"][-1] == pytest.approx(math.asin(0.25 / 0.4), abs=1e-12)
    assert run["load"][-1] == pytest.approx([9.81 / 2, 0, 9.81 / 2], rel=1e-12)
    assert list(run["shut"][-1]) == [1, 0, 1]
    assert run["gap"][0] == pytest.approx(0.2) and abs(run["gap"][-1]) < 1e-15
    assert model.simulate(set={"h": "10 cm"}).outcome.value == "completed"
    sunk = model.simulate(set={"h": "9 cm"})
    assert sunk.outcome.value == "failed"
    assert (
        "the shapes of the contact 'c[1].touch[1]' overlap, and nothing that moves freely can part them"
        in sunk.message
    )


def test_shapes_that_only_drives_move_press_nothing_and_must_not_overlap() -> None:
    """A turret on a lift sinks towards the floor at 0.2 m/s: its ball touches it after 2 s."""
    run = mechc.loads(
        TURRET.replace(
            "parameter h = 30 cm;", "coordinate Length h; drive h = 0.5 m - 0.2 m/s*time;"
        ).replace("stop = 1 s", "stop = 3 s")
    ).simulate(set={"shoulder.angle": -1.2})
    assert run.outcome.value == "failed" and 2 < run.time[-1] < 2.5
    assert "overlap, and nothing that moves freely can part them" in run.message
    assert (run["load"][:, 1] == 0).all()
    with pytest.raises(mechc.CompileError, match="must depend on coordinates that move freely"):
        mechc.loads(
            "coordinate Length h; drive h = 1 m - 0.2 m/s*time; coordinate Length x = 0 m;"
            "kinetic 1/2*1 kg*der(x)^2; contact h;"
        )


PAIRS = {
    "BoxOnBox": ("planar", "shape Box(size = {0.6, 0.2} m) on a; shape Box(size = {0.1, 0.4} m) on b.a;", "edges_from = {0.6, 0.2} m, edges_to = {0.1, 0.4} m"),
    "PolyhedronOnPlane": ("planar", "shape Plane on a; shape Polyhedron(corners = {{-0.1, 0}, {0.2, 0}, {0, 0.3}} m) on b.a;", "corners = {{-0.1, 0}, {0.2, 0}, {0, 0.3}} m"),
    "CylinderOnPlane": ("spatial", "shape Plane on a; shape Cylinder(r = 0.2 m, l = 0.3 m) on b.a;", "r = 0.2 m, l = 0.3 m"),
    "ConeOnPlane": ("spatial", "shape Plane on a; shape Cone(r = 0.2 m, h = 0.3 m) on b.a;", "r = 0.2 m, h = 0.3 m"),
    "BallOnCylinder": ("spatial", "shape Cylinder(r = 0.2 m, l = 0.5 m) on a; shape Sphere(r = 0.1 m) on b.a;", "r = 0.2 m, l = 0.5 m, r_to = 0.1 m"),
    "BallOnPlane": ("planar", "shape Plane on a; shape Sphere(r = 0.1 m) on b.a;", "r = 0.1 m"),
    "CapsuleOnPlane": ("planar", "shape Plane on a; shape Capsule(r = 0.1 m, l = 0.4 m) on b.a;", "r = 0.1 m, l = 0.4 m"),
    "BoxOnPlane": ("planar", "shape Plane on a; shape Box(size = {0.1, 0.4} m) on b.a;", "edges = {0.1, 0.4} m"),
    "BallOnBall": ("planar", "shape Sphere(r = 0.2 m) on a; shape Sphere(r = 0.1 m) on b.a;", "r_from = 0.2 m, r_to = 0.1 m"),
    "BallOnCapsule": ("planar", "shape Capsule(r = 0.1 m, l = 0.5 m) on a; shape Sphere(r = 0.2 m) on b.a;", "r_from = 0.1 m, l = 0.5 m, r_to = 0.2 m"),
    "BallOnBox": ("planar", "shape Box(size = {0.6, 0.2} m) on a; shape Sphere(r = 0.1 m) on b.a;", "edges = {0.6, 0.2} m, r_to = 0.1 m"),
    "CapsuleOnCapsule": ("planar", "shape Capsule(r = 0.1 m, l = 0.5 m) on a; shape Capsule(r = 0.2 m, l = 0.3 m) on b.a;", "r_from = 0.1 m, l_from = 0.5 m, r_to = 0.2 m, l_to = 0.3 m"),
    "CapsuleOnBox": ("planar", "shape Box(size = {0.6, 0.2} m) on a; shape Capsule(r = 0.1 m, l = 0.4 m) on b.a;", "edges = {0.6, 0.2} m, r_to = 0.1 m, l = 0.4 m"),
    "BallOnTerrain": ("spatial", "shape Terrain(x = {-1, 0, 1} m, y = {-1, 1} m, z = {{0.4, 0.2}, {0, 0.1}, {0.2, 0.3}} m) on a; shape Sphere(r = 0.1 m) on b.a;",
                      "x = {-1, 0, 1} m, y = {-1, 1} m, z = {{0.4, 0.2}, {0, 0.1}, {0.2, 0.3}} m, r_to = 0.1 m"),
}  # fmt: skip
THROWN_ON = """
import mech.SPACE.*;
import mech.shapes.*;
import mech.contact.*;
model M
  gravity {DOWN} m/s^2;
  frame a = world * TURN;
  Body b(m = 1 kg, J = INERTIA kg.m^2);
  Free free(world * TURN -> b.a, START);
  CONTACT
  experiment(stop = 0.4 s);
end M;
"""


def test_every_pair_of_the_library_is_in_the_table() -> None:
    text = (library_folder() / "shapes.mech").read_text(encoding="utf-8")
    assert sorted(re.findall(r'" *contact model for .*: (\w+)"', text)) == sorted(PAIRS)


@pytest.mark.parametrize("part", slow_but([*PAIRS][:5], [*PAIRS]))
def test_shapes_touch_as_their_parts(part: str) -> None:
    """Dropped from a height, with spin, on what is tilted: the motions are the same, and something is hit."""
    space, shapes, given = PAIRS[part]
    plane = space == "planar"
    text = THROWN_ON
    for word, value in (
        ("SPACE", space),
        ("DOWN", "0, -9.81" if plane else "0, 0, -9.81"),
        ("TURN", "rot(10 deg)" if plane else "rotx(10 deg)"),
        ("INERTIA", "0.02" if plane else "0.02*identity(3)"),
        ("START", "x = 0.05 m, y = 0.5 m, der(angle) = 2 rad/s" if plane else "position = {0.05, 0.02, 0.5} m, der(orientation) = {1, 2, 0.5} rad/s"),
    ):  # fmt: skip
        text = text.replace(word, value)
    by_shapes, by_part = (
        mechc.loads(text.replace("CONTACT", statement)).simulate(estimate_error=False)
        for statement in (
            f"{shapes} contact a with b friction 0.4 restitution 0.2;",
            f"{part} p(a -> b.a, {given}, friction = 0.4, restitution = 0.2);",
        )
    )
    assert by_part.outcome.value == "completed" and [e for e in by_part.events if e.kind == "impact"]
    for name in by_part.columns():
        if name.startswith(("free", "der(free")):
            assert by_shapes[name][-1] == pytest.approx(by_part[name][-1], abs=1e-12)


SLIDING = """import mech.planar.*; import mech.shapes.*;
model Sliding
  gravity {0, -10} m/s^2;
  Box box[2](size = {0.4, 0.2} m, m = 2 kg);
  Free free[i in 1:2](world -> box[i].a, x = 1 m*i, y = 0.1 m, der(x) = 1 m/s*i);
  shape Box(size = {0.4, 0.2} m) on box;
  shape floor: Plane on world;
  contact c: box with floor friction 0.2;
  output all = power(c.friction);
  output second = power(c[2].friction);
  output Real sticks = if closed(c.friction) then 1 else 0;
  output Real second_sticks = if closed(c[2].friction) then 1 else 0;
  output lost = integral(power(c.friction));
  experiment(stop = 1.5 s, every = 50 ms);
end Sliding;
"""


def test_the_friction_of_all_points_of_a_contact_is_asked_about_together() -> None:
    """Two boxes of 2 kg come to rest from 1 and 2 m/s by 2 m/s^2: the power is -4 N v of each."""
    solution = mechc.loads(SLIDING).simulate()
    t = solution.time
    first, second = np.maximum(1 - 2 * t, 0), np.maximum(2 - 2 * t, 0)
    assert solution["all"] == pytest.approx(-4 * (first + second), abs=1e-7)
    assert solution["second"] == pytest.approx(-4 * second, abs=1e-7)
    assert solution["lost"][-1] == pytest.approx(-1 - 4, abs=1e-7)
    apart = (np.abs(t - 0.5) > 1e-6) & (np.abs(t - 1) > 1e-6)
    assert solution["sticks"][apart].tolist() == (t > 0.5)[apart].tolist(), "one of them"
    assert solution["second_sticks"][apart].tolist() == (t > 1)[apart].tolist()


@pytest.mark.parametrize(
    ("statement", "said"),
    [
        ("output q = multiplier(c.friction);", "ask for 'c.force'"),
        ("output q = multiplier(c[2].friction);", "ask for 'c[2].force'"),
        ("output q = power(smooth.friction);", "the contact 'smooth' has no friction"),
    ],
)
def test_what_has_no_friction_of_its_own_is_told(statement: str, said: str) -> None:
    smooth = """Disk d(r = 1 cm); Free f(world -> d.a, y = 1 m); shape Sphere(r = 1 cm) on d;
  contact smooth: d with floor;"""
    text = SLIDING.replace("experiment", f"{smooth} {statement} experiment")
    with pytest.raises(mechc.CompileError) as raised:
        mechc.loads(text)
    assert said in str(raised.value)

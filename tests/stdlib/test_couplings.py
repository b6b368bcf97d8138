"""Couplings: gears, belts, racks, rods, points on curves and surfaces, rolling; each against its textbook answer."""

from __future__ import annotations

import numpy as np
import pytest

import mechc

g = 9.81
TWO_WHEELS = """
import mech.planar.*;
import mech.couplings.*;
Body first(m = 1 kg, J = 0.2 kg.m^2);
Body second(m = 1 kg, J = 0.5 kg.m^2);
Revolute a(world -> first.a, angle = 0.3 rad);
Revolute b(world * trans({1, 0} m) -> second.a, angle ~ 0 rad);
torque 2 N.m on first.a;
"""


def run(text: str, stop: float = 1.0) -> mechc.Solution:
    solution = mechc.loads(text).simulate(stop=stop, tolerance=1e-11)
    assert isinstance(solution, mechc.Solution)
    assert solution.outcome.value == "completed", solution.message
    return solution


@pytest.mark.parametrize(
    ("coupling", "row", "r1", "r2"),
    [("Gear", "mesh", 0.1, 0.25), ("Gear", "mesh", 0.1, -0.25), ("Belt", "strand", 0.1, 0.25)],
)
def test_two_wheels(coupling: str, row: str, r1: float, r2: float) -> None:
    """The second inertia counts (r1/r2)^2 at the first wheel; the force between them turns it."""
    sign = -1 if coupling == "Belt" else 1
    solution = run(
        f"{TWO_WHEELS}{coupling} c(angle1 = a.angle, angle2 = b.angle, r1 = {r1} m, r2 = {r2} m, "
        f"offset = 0.01 m);\noutput f = multiplier(c.{row});"
    )
    ratio = -sign * r1 / r2
    acceleration = 2 / (0.2 + 0.5 * ratio**2)
    angle = 0.3 + acceleration * solution.time**2 / 2
    assert solution["a.angle"] == pytest.approx(angle, abs=1e-10)
    assert solution["b.angle"] == pytest.approx(sign * 0.01 / r2 + ratio * angle, abs=1e-10)
    assert solution["f"] == pytest.approx(0.5 * ratio * acceleration / (sign * r2), abs=1e-9)


def test_planetary_gear() -> None:
    """Ring held, Willis: the sun turns (1 + 3) times as fast as the carrier; the teeth of the sun push it on."""
    solution = run(
        TWO_WHEELS
        + "coordinate Angle ring;\ndrive ring = 0 rad;\n"
        + "Planetary p(sun = a.angle, ring = ring, carrier = b.angle, r_sun = 0.1 m, r_ring = 0.3 m);\n"
        + "output f = multiplier(p.mesh);"
    )
    acceleration = 2 / (0.2 + 0.5 / 16)
    angle = 0.3 + acceleration * solution.time**2 / 2
    assert solution["a.angle"] == pytest.approx(angle, abs=1e-10)
    assert solution["b.angle"] == pytest.approx(angle / 4, abs=1e-10)
    assert solution["f"] == pytest.approx((0.2 * acceleration - 2) / 0.1, abs=1e-9)


def test_rack() -> None:
    solution = run(
        "import mech.planar.*;\nimport mech.couplings.*;\n"
        "Body wheel(m = 1 kg, J = 0.2 kg.m^2);\nBody bar(m = 3 kg);\n"
        "Revolute a(world -> wheel.a);\nPrismatic b(world -> bar.a, position = 0.5 m);\n"
        "torque 2 N.m on wheel.a;\n"
        "Rack c(angle = a.angle, position = b.position, r = 0.1 m);\noutput f = multiplier(c.mesh);"
    )
    acceleration = 0.1 * 2 / (0.2 + 3 * 0.1**2)
    assert solution["b.position"] == pytest.approx(0.5 + acceleration * solution.time**2 / 2, abs=1e-10)
    assert solution["f"] == pytest.approx(-3 * acceleration, abs=1e-9)


@pytest.mark.parametrize(("library", "start", "field"), [("planar", "{0.6, 0.8}", "{0, -9.81}"),
                                                          ("spatial", "{0.6, 0, 0.8}", "{0, 0, -9.81}")])  # fmt: skip
def test_distance(library: str, start: str, field: str) -> None:
    """Tension of a pendulum m (v^2/l - g r.e/l); the one that starts above its pivot is pushed at first."""
    n = 2 if library == "planar" else 3
    solution = run(
        f"import mech.{library}.*;\nimport mech.couplings.*;\ngravity {field} m/s^2;\n"
        f"Particle p(m = 2 kg);\nTranslation t(world -> p.a, position ~ {start} m);\n"
        "Distance d(world -> p.a, l = 1 m);\noutput f = multiplier(d.rod);"
    )
    up = solution[f"t.position[{n}]"]
    speed = sum(solution[f"der(t.position[{k}])"] ** 2 for k in range(1, n + 1))
    assert speed == pytest.approx(2 * g * (0.8 - up), abs=1e-8)
    assert solution["f"] == pytest.approx(2 * (speed - g * up), abs=1e-7)
    assert solution["f"][0] == pytest.approx(-2 * g * 0.8)


PARTICLE = """
import mech.spatial.*;
import mech.couplings.*;
gravity {0, 0, -9.81} m/s^2;
Particle p(m = 2 kg);
"""


def test_point_on_curve_of_the_plane() -> None:
    """On a parabola by energy; at rest the wire carries the part of the weight across itself."""
    solution = run(
        """
        import mech.planar.*;
        import mech.couplings.*;
        model Parabola
          extends PointOnCurve;
          parameter Length f = 2 m;
          let off = p[2] - p[1]^2/(2*f);
        end Parabola;
        model Bead
          gravity {0, -9.81} m/s^2;
          Particle b(m = 2 kg);
          Translation t(world -> b.a, position = {1 m, 0.25 m});
          Parabola wire(world -> b.a);
          output push = multiplier(wire.curve);
        end Bead;
        """
    )
    x, y, rate = solution["t.position[1]"], solution["t.position[2]"], solution["der(t.position[1])"]
    assert (1 + x**2 / 4) * rate**2 / 2 + g * x**2 / 4 == pytest.approx(g / 4, abs=1e-9)
    assert y == pytest.approx(x**2 / 4, abs=1e-9)
    assert solution["push"][0] == pytest.approx(2 * g / (1 + 1 / 4), rel=1e-12)


def test_point_on_curve_of_space() -> None:
    """Down a helix of slope h/R: constant acceleration g h^2/(R^2 + h^2)."""
    solution = run(
        """
        import mech.spatial.*;
        import mech.couplings.*;
        model Helix
          extends PointOnCurve;
          parameter Length R = 0.5 m;
          parameter Length h = 0.2 m;
          let off[2] = p[1:2] - R*{cos(p[3]/h), sin(p[3]/h)};
        end Helix;
        model Bead
          gravity {0, 0, -9.81} m/s^2;
          Particle b(m = 2 kg);
          Translation t(world -> b.a, position ~ {0.5, 0, 0} m);
          Helix wire(world -> b.a);
        end Bead;
        """
    )
    fall = g * 0.04 / (0.25 + 0.04) * solution.time**2 / 2
    assert solution["t.position[3]"] == pytest.approx(-fall, abs=1e-9)


def test_point_on_surface() -> None:
    """A paraboloid by the heir's formula and as a quadric: one motion; and its energy."""
    slide = "Translation t(world -> p.a, position = {1 m, 0 m, 0.5 m}, der(position) ~ {0, 1, 0} m/s);\n"
    quadric = (
        PARTICLE
        + slide
        + "PointOnQuadric s(world -> p.a, A = {{1, 0, 0}, {0, 1, 0}, {0, 0, 0}} m^-2, b = {0, 0, -2} m^-1, c = 0);\n"
    )
    heir = (
        "import mech.spatial.*;\nimport mech.couplings.*;\nmodel Bowl\n  extends PointOnSurface;\n"
        "  let off = p[3] - (p[1]^2 + p[2]^2)/2 m;\nend Bowl;\nmodel M\n"
        + "".join(PARTICLE.splitlines(keepends=True)[3:])
        + slide
        + "Bowl s(world -> p.a);\nend M;\n"
    )
    one, other = run(quadric), run(heir)
    for k in (1, 2, 3):
        assert one[f"t.position[{k}]"] == pytest.approx(other[f"t.position[{k}]"], abs=1e-9)
    assert one["t.position[3]"] == pytest.approx(
        (one["t.position[1]"] ** 2 + one["t.position[2]"] ** 2) / 2, abs=1e-9
    )
    speed = sum(one[f"der(t.position[{k}])"] ** 2 for k in (1, 2, 3))
    assert speed / 2 + g * one["t.position[3]"] == pytest.approx(0.5 + g / 2, abs=1e-9)


def test_point_on_inclined_plane() -> None:
    solution = run(
        PARTICLE
        + "frame slope = world * roty(30 deg);\nTranslation t(world -> p.a);\n"
        + "PointOnPlane s(slope -> p.a);\noutput push = multiplier(s.plane);"
    )
    fall = g * 0.25 * solution.time**2 / 2  # g sin(a), of which sin(a) goes down
    assert solution["t.position[3]"] == pytest.approx(-fall, abs=1e-10)
    assert solution["push"] == pytest.approx(2 * g * np.cos(np.pi / 6), rel=1e-10)


def test_rolling_ball_on_incline() -> None:
    """5/7 of the acceleration without friction; friction takes 2/7 of the weight along the slope."""
    solution = run(
        """
        import mech.spatial.*;
        gravity {0, 0, -9.81} m/s^2;
        frame slope = world * roty(30 deg);
        Sphere ball(m = 2 kg, r = 0.1 m);
        Free pose(slope -> ball.a, position ~ {0, 0, 0.1} m);
        RollingSphere on_slope(slope -> ball.a, r = ball.r);
        output push = multiplier(on_slope.ground);
        output hold[2] = multiplier(on_slope.roll);
        """
    )
    along = g * np.sin(np.pi / 6)
    assert solution["pose.position[1]"] == pytest.approx(5 / 7 * along * solution.time**2 / 2, abs=1e-9)
    assert solution["der(pose.orientation)[2]"] == pytest.approx(
        5 / 7 * along * solution.time / 0.1, abs=1e-8
    )
    assert solution["push"] == pytest.approx(2 * g * np.cos(np.pi / 6), rel=1e-9)
    assert solution["hold[1]"] == pytest.approx(-2 / 7 * 2 * along, rel=1e-9)
    assert solution["hold[2]"] == pytest.approx(0, abs=1e-9)


def test_rolling_disk_on_incline() -> None:
    """Upright along the line of greatest slope: 2/3 of g sin(a) for a disk."""
    solution = run(
        """
        import mech.spatial.*;
        gravity {0, 0, -9.81} m/s^2;
        frame slope = world * roty(30 deg);
        Cylinder wheel(m = 2 kg, r = 0.1 m, l = 1 cm, axis = {0, 1, 0});
        Free pose(slope -> wheel.a, position ~ {0, 0, 0.1} m);
        RollingDisk on_slope(slope -> wheel.a, r = wheel.r, axis = {0, 1, 0});
        output push = multiplier(on_slope.ground);
        output hold[2] = multiplier(on_slope.roll);
        """
    )
    along = g * np.sin(np.pi / 6)
    assert solution["pose.position[1]"] == pytest.approx(2 / 3 * along * solution.time**2 / 2, abs=1e-9)
    assert solution["push"] == pytest.approx(2 * g * np.cos(np.pi / 6), rel=1e-9)
    assert solution["hold[1]"] == pytest.approx(-1 / 3 * 2 * along, rel=1e-9)


def test_wheels_roll_in_the_plane() -> None:
    """Down a slope and in a bowl: a solid cylinder with 2/3 of the acceleration of what slides."""
    slope = run(
        """
        import mech.planar.*;
        gravity {0, -9.81} m/s^2;
        Disk wheel(m = 2 kg, r = 0.1 m);
        Rolling on_slope(world * rot(-30 deg) -> wheel.a, r = 0.1 m);
        """
    )
    assert slope["on_slope.position"] == pytest.approx(2 / 3 * g / 2 * slope.time**2 / 2, abs=1e-10)
    bowl = run(
        """
        import mech.planar.*;
        gravity {0, -9.81} m/s^2;
        Disk wheel(m = 2 kg, r = 0.1 m);
        RollingOnCircle in_bowl(world -> wheel.a, track = 0.5 m, r = -0.1 m, angle = -60 deg);
        """
    )
    angle, rate = bowl["in_bowl.angle"], bowl["der(in_bowl.angle)"]
    assert 0.75 * (0.4 * rate) ** 2 == pytest.approx(g * 0.4 * (-np.sin(angle) - np.sin(np.pi / 3)), abs=1e-9)


def test_ball_rolls_on_a_turning_table() -> None:
    """On ground that moves: circles at 2/7 of its rate, whatever the speed."""
    solution = run(
        """
        import mech.spatial.*;
        gravity {0, 0, -9.81} m/s^2;
        frame table = world * rotz(3 rad/s*time);
        Sphere ball(m = 0.2 kg, r = 3 cm);
        Free pose(world -> ball.a, position ~ {0.2, 0, 0.03} m, der(position) ~ {0, 0.3, 0} m/s);
        RollingSphere on_table(table -> ball.a, r = ball.r);
        """,
        stop=3.0,
    )
    start = {k: solution[f"pose.position[{k}]"][0] for k in (1, 2)}
    speed = {k: solution[f"der(pose.position[{k}])"][0] for k in (1, 2)}
    rate = 2 / 7 * 3
    turned = rate * solution.time
    x = start[1] + (speed[1] * np.sin(turned) + speed[2] * (np.cos(turned) - 1)) / rate
    y = start[2] + (speed[2] * np.sin(turned) - speed[1] * (np.cos(turned) - 1)) / rate
    assert np.hypot(*speed.values()) > 0.1
    assert solution["pose.position[1]"] == pytest.approx(x, abs=1e-8)
    assert solution["pose.position[2]"] == pytest.approx(y, abs=1e-8)


def test_a_wheel_rolls_on_a_circle_while_an_arm_holds_its_centre() -> None:
    """One of both equations repeats the arm, the other one is regular all the way round; the energy gives the speed. Before,
    the equation that was kept was singular where it looks along the path."""
    solution = run(
        """
        import mech.planar.*;
        gravity {0, -9.81} m/s^2;
        Body wheel(m = 1 kg, J = 0.5 kg.m^2);
        Body arm(m = 1 kg, J = 0.1 kg.m^2, com = {1 m, 0 m});
        Revolute pin(world -> arm.a, angle = 30 deg);
        Revolute axle(arm.a * trans({2, 0} m) -> wheel.a);
        RollingOnCircle roll(world -> wheel.a, track = 1 m, r = 1 m);
        """,
        stop=20.0,
    )
    assert not any("singular" in remark for remark in solution.remarks)
    angle = solution["pin.angle"]
    inertia = 0.1 + 1 + 2**2 + 0.5 * 2**2  # the wheel turns twice as fast as the arm
    square = 2 * g * (1 + 2) * (np.sin(np.pi / 6) - np.sin(angle)) / inertia
    np.testing.assert_allclose(solution["der(pin.angle)"] ** 2, square, atol=1e-7)
    assert np.ptp(angle) > np.pi


@pytest.mark.parametrize(
    "joints", ["Weld w({0}*trans({{4e-17, 0, 0}} m) -> one.a); Universal u({0} -> one.a);",
               "Universal u({0} -> one.a); Weld w({0}*trans({{4e-17, 0, 0}} m) -> one.a);"],
)  # fmt: skip
def test_a_weld_beside_a_universal_joint_that_is_off_by_rounding(joints: str) -> None:
    place = "world*rotx(0.3 rad)*roty(0.7 rad)"
    solution = run(
        "import mech.spatial.*;\ngravity {0, 0, -9.81} m/s^2;\n"
        "Body one(m = 1 kg, J = diag({1, 1, 1})*(1 kg.m^2), com = {0.1, 0.2, -0.3} m);\n"
        + joints.format(place)
        + "\noutput where = pos(one.a);"
    )
    assert np.abs([solution[f"where[{i}]"] for i in (1, 2, 3)]).max() < 1e-15

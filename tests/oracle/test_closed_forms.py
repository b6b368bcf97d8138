"""The oracle against answers that can be written down."""

import math

import numpy as np
import pytest
from oracle import Meaning, Undetermined
from oracle.accounts import dissipated
from oracle.impacts import impacts

import mechc


def meaning(text: str, **options: object) -> Meaning:
    return Meaning(mechc.loads(text).compilation.flat, **options)  # type: ignore[arg-type]


def test_pendulum_turns_back_as_gravity_says() -> None:
    m = meaning(
        "parameter l = 0.7 m; coordinate Angle a = 1 rad; gravity {0, -9.81} m/s^2;"
        "mass 2 kg at world * rot(a) * {0, -l};"
    )
    assert m.accelerations({"a": 0.4, "der(a)": 3.0})["der(a, 2)"] == pytest.approx(
        -9.81 / 0.7 * math.sin(0.4), rel=1e-14
    )


def test_period_of_a_pendulum() -> None:
    """T = 4 K(sin(a0/2)) sqrt(l/g), by the arithmetic-geometric mean."""
    m = meaning("coordinate Angle a = 1 rad; kinetic 1/2*1 kg.m^2*der(a)^2; potential -9 J*cos(a);")
    x, y = 1.0, math.cos(0.5)
    for _ in range(8):
        x, y = (x + y) / 2, math.sqrt(x * y)
    period = 2 * math.pi / x / 3
    end = m.motion(period).states[-1]
    assert end["a"] == pytest.approx(1, abs=1e-10) and end["der(a)"] == pytest.approx(0, abs=1e-9)


@pytest.mark.slow
def test_free_body_obeys_euler() -> None:
    m = meaning(
        "coordinate Rotation R; initial der(R) = {1, 2, 3} rad/s; frame b = world * R;"
        "inertia diag({2, 3, 5} kg.m^2) on b; output L = direction(b, {2*der(R)[1], 3*der(R)[2], 5*der(R)[3]});"
    )
    a = m.accelerations(m.start())
    assert [a[f"der(R, 2)[{k}]"] for k in (1, 2, 3)] == pytest.approx(
        [-2 * 6 / 2, 3 * 3 / 3, -1 * 2 / 5], rel=1e-14
    )
    motion = m.motion(0.2)
    first, last = m.outputs(motion.states[0]), m.outputs(motion.states[-1])
    assert [last[f"L[{k}]"] for k in (1, 2, 3)] == pytest.approx(
        [first[f"L[{k}]"] for k in (1, 2, 3)], abs=1e-9
    )


def test_steady_precession_of_a_top() -> None:
    """(C (psi' + phi' cos) - A phi' cos) phi' = m g l, in a frame that follows the body."""
    A, C, mgl, tilt, turn = 0.5, 0.2, 4.905, 0.6, 1.3
    spin = (mgl / turn + A * turn * math.cos(tilt)) / C
    m = meaning(
        "gravity {0, 0, -9.81} m/s^2; coordinate Rotation R = rotx(0.6 rad); frame b = world * R;"
        "mass 1 kg at b * {0, 0, 0.5 m}; inertia diag({0.25, 0.25, 0.2} kg.m^2) on b;"
        "output w = angvel(b);"
    )
    state = m.start() | {"der(R)[2]": turn * math.sin(tilt), "der(R)[3]": spin}
    a = m.accelerations(state)
    assert a["der(R, 2)[3]"] == pytest.approx(0, abs=1e-12)
    own = spin - turn * math.cos(tilt)
    assert a["der(R, 2)[1]"] == pytest.approx(turn * math.sin(tilt) * own, rel=1e-12)
    assert a["der(R, 2)[2]"] == pytest.approx(0, abs=1e-12)


def test_parallelogram_of_four_bars_is_a_pendulum() -> None:
    m = meaning(
        """import mech.planar.*;
model A
  gravity {0, -9.81} m/s^2;
  Rod left(m = 1 kg, l = 1 m);
  Rod right(m = 1 kg, l = 1 m);
  Bar top(m = 2 kg, l = 3 m);
  Revolute p(world -> left.a, angle = 0.5 rad);
  Revolute q(world * trans({3, 0} m) -> right.a, angle ~ 0.4 rad);
  Revolute r(left.b -> top.a, angle ~ -0.5 rad);
  cut Revolute s(top.b -> right.b);
end A;"""
    )
    state = m.start()
    assert state["q.angle"] == pytest.approx(0.5, abs=1e-12)
    a = m.accelerations(state)
    expected = -(2 * 0.5 + 2) * 9.81 * math.sin(0.5) / (2 / 3 + 2)
    assert a["der(p.angle, 2)"] == pytest.approx(expected, rel=1e-12)
    assert a["der(r.angle, 2)"] == pytest.approx(-expected, rel=1e-12)


def test_ball_bounces_at_the_times_of_a_geometric_series() -> None:
    m = meaning(
        "coordinate Length y = 1 m; kinetic 1/2*1 kg*der(y)^2; potential 9.81 N*y; contact floor: y restitution 0.3;"
    )
    motion = m.motion(1.2)
    fall = math.sqrt(2 / 9.81)
    hits = [e.time for e in motion.events if e.kind == "impact"]
    assert hits[0] == pytest.approx(fall, abs=1e-10)
    assert hits[1] - hits[0] == pytest.approx(2 * 0.3 * fall, abs=1e-10)
    rest = next(e.time for e in motion.events if e.kind == "rest")
    assert rest == pytest.approx(fall * (1 + 2 * 0.3 / 0.7), abs=1e-8)  # 1e-9 of the first speed is left out
    assert motion.states[-1]["y"] == pytest.approx(0, abs=1e-12)


def test_block_slides_stops_and_stays() -> None:
    m = meaning(
        "coordinate Length x = 0 m; initial der(x) = 2 m/s; kinetic 1/2*1 kg*der(x)^2; friction 4 N on x;"
    )
    motion = m.motion(1)
    assert [(e.kind, round(float(e.time), 9)) for e in motion.events] == [("stick", 0.5)]
    assert motion.states[-1]["x"] == pytest.approx(0.5, abs=1e-10)


def test_two_dimensional_slip_starts_along_the_force() -> None:
    m = meaning(
        "gravity {0, 0, -10} m/s^2; coordinate Length x[3] = {0, 0, 0} m; point P = world * x; mass 1 kg at P;"
        "contact floor: x[3] friction 0.2 along {der(x[1]), der(x[2])}; force {-3, 4, 0} N on P;"
    )
    a = m.accelerations(m.start())
    assert [a[f"der(x[{k}], 2)"] for k in (1, 2, 3)] == pytest.approx([-3 + 1.2, 4 - 1.6, 0], abs=1e-10)
    assert m.modes(m.start())["floor"] == "slip*"


REACTION = """import mech.{space}.*;
model A
  Body b(m = 1 kg, J = {J});
  Revolute h(world -> b.a, angle = 0 rad);
  {law}
  output F = reaction(h);
  output N = moment(h);
end A;"""


@pytest.mark.parametrize(
    ("law", "moment"),
    [
        ("Spring s(world * trans({3, 4} m) -> b.a, k = 10 N/m);", 0.0),
        ("potential 1/2*10 N/m*dot(pos(b.a) - {3, 4} m, pos(b.a) - {3, 4} m);", 0.0),
        ("force {30, 40} N on b.a;", 0.0),
        ("lagrangian 30 N*pos(b.a)[1] + 40 N*pos(b.a)[2];", 0.0),
        ("force {30, 40} N on b.a; torque 2 N.m on b.a; force 5 N.m on h.angle;", 5.0),
    ],
)
def test_reaction_holds_whatever_acts(law: str, moment: float) -> None:
    """A cut carries all loads; a force on the coordinate of the joint itself goes through the joint."""
    m = meaning(REACTION.format(space="planar", J="1 kg.m^2", law=law))
    y = m.outputs(m.start())
    assert [y["F[1]"], y["F[2]"], y["N"]] == pytest.approx([-30, -40, moment], abs=1e-10)


def test_reaction_of_the_same_joint_in_the_tree_and_in_a_loop() -> None:
    text = """import mech.planar.*;
model A
  gravity {0, -9.81} m/s^2;
  Bar arm(m = 1 kg, l = 1 m);
  Revolute shoulder(world -> arm.a, angle = 0.3 rad, der(angle) = 2 rad/s);
  Bar fore(m = 0.5 kg, l = 0.7 m);
  %s
  force 3 N.m on elbow.angle;
  damping 0.2 N.m.s on elbow.angle;
  output F = reaction(elbow);
  output N = moment(elbow);
end A;"""
    tree = meaning(text % "Revolute elbow(arm.b -> fore.a, angle = 0.4 rad, der(angle) = -1 rad/s);")
    loop = meaning(
        text
        % "Planar free(world -> fore.a); cut Revolute elbow(arm.b -> fore.a, angle = 0.4 rad, der(angle) = -1 rad/s);"
    )
    a, b = tree.outputs(tree.start()), loop.outputs(loop.start())
    assert [a[k] for k in ("F[1]", "F[2]", "N")] == pytest.approx(
        [b[k] for k in ("F[1]", "F[2]", "N")], abs=1e-10
    )
    assert a["N"] == pytest.approx(3 + 0.2, abs=1e-10)


def test_questions_inside_of_laws() -> None:
    pump = meaning(
        "coordinate Length x = 1 m; initial der(x) = 0.5 m/s; kinetic 1/2*1 kg*der(x)^2; potential 1/2*1 N/m*x^2;"
        "force -0.1 s/m^2*(energy() - 2 J)*der(x) on x;"
    )
    assert pump.accelerations(pump.start())["der(x, 2)"] == pytest.approx(
        -1 - 0.1 * (0.625 - 2) * 0.5, rel=1e-14
    )
    weight = meaning(
        "gravity {0, -10} m/s^2; coordinate Length x = 0 m; coordinate Length y = 0 m; initial der(x) = 1 m/s;"
        "mass 2 kg at world * {x, y}; contact floor: y; state Force N = 5 N;"
        "equation der(N) = (multiplier(floor) - N)/0.1 s; force (if closed(floor) then -1 N else 0 N) on x;"
    )
    a = weight.accelerations(weight.start())
    assert a["der(N)"] == pytest.approx(150, rel=1e-12) and a["der(x, 2)"] == pytest.approx(-0.5, rel=1e-12)


def test_friction_that_follows_from_a_reaction() -> None:
    """The guide carries the weight and a spring across; N^(1/3) makes the law nonlinear."""
    text = """import mech.planar.*;
model A
  gravity {0, -10} m/s^2;
  Particle b(m = 2 kg);
  Translation t(world -> b.a, der(position) = {1, 0} m/s);
  constraint rail: t.position[2] = 0.5 m*(t.position[1]/1 m)^2;
  %s
end A;"""
    m = meaning(text % "force -3 N*(multiplier(rail)/1 N)^(1/3) on t.position[1];")
    N = 20 + 2  # the curve asks for an acceleration 1 m/s^2 upwards
    assert m.accelerations(m.start())["der(t.position[1], 2)"] == pytest.approx(
        -1.5 * N ** (1 / 3), rel=1e-12
    )
    guide = meaning(
        """import mech.planar.*;
model A
  gravity {0, -10} m/s^2;
  Body b(m = 2 kg, J = 1 kg.m^2);
  Prismatic g(world -> b.a, der(position) = 1 m/s);
  Spring s(world * trans({0, 1} m) -> b.a, k = 6 N/m);
  friction 0.2*abs(reaction(g)[2]) on g.position;
end A;"""
    )
    assert guide.accelerations(guide.start())["der(g.position, 2)"] == pytest.approx(-0.2 * 14 / 2, rel=1e-12)


def test_coulombs_law_with_no_solution_or_several_is_refused() -> None:
    """Painlevé's rod: its tip slides, the friction is large; the normal force would have to be negative (or is not unique)."""
    text = """gravity {0, -10} m/s^2;
coordinate Length x = 0 m; coordinate Length y = 0.5 m*sin(1.1); coordinate Angle a = 1.1 rad;
initial der(x) = -5 m/s; initial der(a) = %s rad/s; initial der(y) = 0.5 m*cos(1.1)*%s rad/s;
frame rod = world * trans({x, y}) * rot(a);
mass 1 kg at rod; inertia 1/12*1 kg.m^2 on rod;
point tip = rod * {-0.5, 0} m;
contact floor: tip[2] friction 3 along vel(tip)[1];"""
    for rate in (0, 6):  # at rest gravity closes: none; spinning fast the centripetal force opens: two
        m = meaning(text % (rate, rate))
        with pytest.raises(Undetermined):
            m.accelerations(m.start())


@pytest.mark.parametrize(
    ("body", "value"),
    [
        ("cos(200*s) for s in 0:1", math.sin(200) / 200),
        ("sqrt(1 - s^2) for s in 0:1", math.pi / 4),
        ("1/sqrt(s) for s in 0:1", 2.0),
        ("abs(s - 0.3) for s in 0:1", (0.09 + 0.49) / 2),
        ("exp(-((s - 0.4)/0.001)^2) for s in 0:1", 0.001 * math.sqrt(math.pi)),
        ("(if s < 0.25 then 1 else 3) for s in 0:1", 0.25 + 2.25),
    ],
)
def test_definite_integrals(body: str, value: float) -> None:
    m = meaning(f"coordinate x = 0 m; kinetic 1/2*1 kg*der(x)^2; output I = integral({body});")
    assert m.outputs(m.start())["I"] == pytest.approx(value, rel=1e-9)


def test_integral_with_a_kink_that_moves() -> None:
    """V = k int_0^1 |s - x| ds = k (x^2 + (1 - x)^2)/2: the force is -k (2 x - 1), its rate is -2 k x'."""
    m = meaning(
        "dimensionless; coordinate x = 0.3; initial der(x) = 2; kinetic 1/2*der(x)^2;"
        "potential 5*integral(abs(s - x) for s in 0:1); output r = der(integral(abs(s - x) for s in 0:1), 2);"
    )
    a = m.accelerations(m.start())["der(x, 2)"]
    assert a == pytest.approx(-5 * (2 * 0.3 - 1), rel=1e-9)
    assert m.outputs(m.start())["r"] == pytest.approx(2 * 4 + (2 * 0.3 - 1) * a, rel=1e-9)


def test_conditions_act_when_they_become_true() -> None:
    m = meaning(
        "discrete Integer n = 0; discrete Real late = 0; coordinate Length x = 0 m; initial der(x) = 1 m/s;"
        "kinetic 1/2*1 kg*der(x)^2;"
        "when x > 0.1 m*(n + 1) then n := n + 1; reinit(der(x), 2*der(x)); end when;"
        "when sample(0.05 s) then late := time/1 s; end when;"
        'when time >= 0.17 s then terminate("enough"); end when;'
    )
    motion = m.motion(1)
    assert motion.outcome == "terminated" and motion.time[-1] == pytest.approx(0.17, abs=1e-11)
    assert motion.states[-1]["n"] == 2 and motion.states[-1]["late"] == pytest.approx(0.15, abs=1e-12)
    assert motion.states[-1]["x"] == pytest.approx(0.2 + 4 * 0.02, abs=1e-10)


def test_contact_over_an_edge_lets_go() -> None:
    """What rests at y = -max(0, x)/2 and comes to x = 0 at 1 m/s flies from there: y = -g t^2/2, free of the slope."""
    m = meaning(
        "coordinate Length x = -0.1 m; initial der(x) = 1 m/s; coordinate Length y = 0 m;"
        "kinetic 1/2*1 kg*(der(x)^2 + der(y)^2); potential 10 N*y; contact floor: y + max(0, x)/2;"
    )
    motion = m.motion(0.15, tolerance=1e-10, scan=0.01)
    assert [(round(float(e.time), 9), e.kind) for e in motion.events] == [(0.1, "lift-off")]
    assert motion.states[-1]["y"] == pytest.approx(-5 * 0.05**2, abs=1e-9)


@pytest.mark.slow
def test_potential_step_refracts_and_reflects() -> None:
    text = (
        "coordinate Length x = -1 m; coordinate Length y = 0 m; initial der(x) = %s m/s; initial der(y) = 1 m/s;"
        "kinetic 1/2*1 kg*(der(x)^2 + der(y)^2); potential if x > 0 m then 1.5 J else 0 J;"
    )
    end = meaning(text % 2).motion(1).states[-1]
    assert (end["der(x)"], end["der(y)"]) == pytest.approx((1, 1), abs=1e-12)
    end = meaning(text % 1).motion(1.5).states[-1]
    assert (end["der(x)"], end["der(y)"], end["x"]) == pytest.approx((-1, 1, -0.5), abs=1e-10)


def test_known_values_stay_where_guesses_move() -> None:
    m = meaning(
        "coordinate Length x = 3 m; coordinate Length y ~ 1 m; initial der(x) ~ 0; initial der(y) = 6 m/s;"
        "kinetic 1/2*1 kg*(der(x)^2 + der(y)^2); constraint rod: norm({x, y}) = 5 m;"
    )
    s = m.start()
    assert (s["x"], s["y"], s["der(x)"], s["der(y)"]) == pytest.approx((3, 4, -8, 6), abs=1e-12)


def test_a_momentum_may_be_given() -> None:
    m = meaning(
        "coordinate Angle a = 1 rad; coordinate Length r = 2 m; kinetic 1/2*3 kg*(der(r)^2 + r^2*der(a)^2);"
        "initial momentum(a) = 6 kg.m^2/s;"
    )
    assert m.start()["der(a)"] == pytest.approx(0.5, rel=1e-12)


def test_random_states_lie_on_the_constraints() -> None:
    m = meaning(
        "coordinate Length x ~ 3 m; coordinate Length y ~ 4 m; kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);"
        "constraint rod: norm({x, y}) = 5 m;"
    )
    s = m.random(np.random.default_rng(0))
    assert math.hypot(s["x"], s["y"]) == pytest.approx(5, abs=1e-12)
    assert s["x"] * s["der(x)"] + s["y"] * s["der(y)"] == pytest.approx(0, abs=1e-12)


def test_a_force_at_a_point_turns_its_body() -> None:
    """The moment about a ball joint of F at r, written as a torque."""
    text = (
        "import mech.spatial.*; model A Box b(m = 1 kg, size = {0.1, 0.2, 0.3} m);"
        "Spherical u(world -> b.a * trans({0.1, 0.2, 0.05} m)); %s end A;"
    )
    at = meaning(text % "force {1, 2, 3} N on b.a at b.a * {0.3, 0.1, 0.2} m;")
    moved = meaning(text % "force {1, 2, 3} N on b.a; torque cross({0.3, 0.1, 0.2} m, {1, 2, 3} N) on b.a;")
    assert at.accelerations(at.start()) == pytest.approx(moved.accelerations(moved.start()), rel=1e-12)


def test_table_goes_through_its_points_without_overshoot() -> None:
    m = meaning(
        "coordinate Length x = 0.3 m; kinetic 1/2*1 kg*der(x)^2;"
        "output y = table(x, {0, 1, 3} m, {0, 2, 2} m); output z = table(x, {0, 1} m, {0, 2} m);"
    )
    heights = [m.outputs({"x": x, "der(x)": 0.0})["y"] for x in (0, 1, 2, 3, 4)]
    assert heights == pytest.approx([0, 2, 2, 2, 2], abs=1e-12)
    assert m.outputs({"x": -1.0, "der(x)": 0.0})["z"] == pytest.approx(-2, rel=1e-14)


def test_belt_whose_speed_jumps() -> None:
    """Slip 0.4 m/s turns to -0.1 at once: friction pushes on until the block goes with the belt."""
    m = meaning(
        "coordinate Length x = 0 m; initial der(x) = 1 m/s; kinetic 1/2*1 kg*der(x)^2;"
        "friction 2 N on x - max(0 m, 0.5 m/s*(time - 0.3 s));"
    )
    motion = m.motion(0.5)
    assert motion.at(0.32)["der(x)"] == pytest.approx(0.4 + 2 * 0.02, abs=1e-9)
    assert motion.states[-1]["der(x)"] == pytest.approx(0.5, abs=1e-9)
    assert motion.events[-1].kind == "stick" and motion.events[-1].time == pytest.approx(0.35, abs=1e-9)


def test_power_of_a_damping_whose_coefficient_depends_on_velocities() -> None:
    """R = 1/2 c v^4, so that the force is -2 c v^3: what compiler and definition say of its power."""
    text = (
        "coordinate Length x = 0; coordinate Length y = 0; kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);"
        "damping rub: 0.3 N.s^3/m^3*der(x)^2 on x - y; output lost = power(rub);"
    )
    state = {"x": 0.0, "y": 0.0, "der(x)": 2.0, "der(y)": 0.5}
    m = meaning(text)
    assert m.outputs(state)["lost"] == pytest.approx(-2 * 0.3 * 2.0**2 * 1.5**2, rel=1e-12)
    a = m.accelerations(state)
    assert m.outputs(state)["lost"] == pytest.approx(2 * a["der(x, 2)"] + 0.5 * a["der(y, 2)"], rel=1e-9)


def test_outputs_that_equations_determine() -> None:
    """Kepler's equation and its rate M'/(1 - e cos E); a vector whose first entry its length tells."""
    m = meaning(
        """coordinate x = 0.3 m; kinetic 1/2*1 kg*der(x)^2; force 2 N on x; initial der(x) = 0.5 m/s;
        let M = 2*time/1 s + x/1 m;
        output E ~ M; equation E - 0.6*sin(E) = M; output rate = der(E);
        output B[2] ~ {1, 1} N; equation B[2] = 4 N; equation norm(B) = 5 N;"""
    )
    state = {"x": 0.3, "der(x)": 0.5, "time": 0.4}
    found = m.outputs(state)
    angle = found["E"]
    assert angle - 0.6 * math.sin(angle) == pytest.approx(1.1, abs=1e-14)
    assert found["rate"] == pytest.approx(2.5 / (1 - 0.6 * math.cos(angle)), rel=1e-13)
    assert (found["B[1]"], found["B[2]"]) == pytest.approx((3, 4), rel=1e-14)


def test_several_solutions_beside_a_guess_are_refused() -> None:
    m = meaning(
        """coordinate x = 0.3 m; kinetic 1/2*1 kg*der(x)^2;
        output y ~ 0.57; equation y^3 - y = 0;"""
    )
    with pytest.raises(Undetermined, match="several"):
        m.outputs({"x": 0.3, "der(x)": 0.5})


def test_dissipation_by_an_energy_is_differentiated_through_it() -> None:
    """D = 1/2 c E v^2, so that the force is -c v (E + 1/2 m v^2); its power is that of section 13."""
    m = meaning(
        "coordinate Length x = 0; kinetic 1/2*2 kg*der(x)^2; potential 1/2*3 N/m*x^2;"
        "damping rub: 0.2 s/m^2*energy() on x; output lost = power(rub);"
    )
    x, v = 0.3, 0.7
    energy = v**2 + 1.5 * x**2
    force = -0.2 * v * (energy + v**2)
    state = {"x": x, "der(x)": v}
    assert m.accelerations(state)["der(x, 2)"] == pytest.approx((force - 3 * x) / 2, rel=1e-14)
    assert m.outputs(state)["lost"] == pytest.approx(force * v, rel=1e-14)


def test_dissipation_by_the_power_of_a_damping_is_differentiated_through_it() -> None:
    """D = -1/2 k c v^4, so that the force is 2 k c v^3 beside -c v."""
    m = meaning(
        "coordinate Length x = 0; kinetic 1/2*2 kg*der(x)^2; damping rub: 0.4 N.s/m on x;"
        "damping 0.3 N.s/m*(1 s/J)*power(rub) on x;"
    )
    v = 0.7
    force = -0.4 * v + 2 * 0.3 * 0.4 * v**3
    assert m.accelerations({"x": 0.0, "der(x)": v})["der(x, 2)"] == pytest.approx(force / 2, rel=1e-14)


def test_energy_and_momentum_are_rates_that_a_damping_acts_along() -> None:
    """1/2 c E^2 gives -c E p, and 1/2 c p^2 gives -c p m."""
    m = meaning(
        "coordinate Length x = 0; coordinate Length y = 0; kinetic 1/2*2 kg*der(x)^2 + 1/2*1 kg*der(y)^2;"
        "damping 0.2/(1 J*1 s) on energy(); damping 0.3/(1 kg*1 s) on momentum(y);"
        "damping 0.5 N.s/m on x/(1 m)*der(x) - der(y); force 2 N on x/(1 m)*der(x) - der(y);"
    )
    x, v, w = 0.3, 0.7, 0.4
    energy, slip = v**2 + 0.5 * w**2, x * v - w
    a = m.accelerations({"x": x, "y": 0.0, "der(x)": v, "der(y)": w})
    assert a["der(x, 2)"] == pytest.approx((-0.2 * energy * 2 * v - 0.5 * slip * x + 2 * x) / 2, rel=1e-14)
    assert a["der(y, 2)"] == pytest.approx(-0.2 * energy * w - 0.3 * w + 0.5 * slip - 2, rel=1e-14)


@pytest.mark.parametrize("asked", ["energy()", "momentum(ball.orientation)[2]*1 s^-1"])
def test_what_a_dissipation_asks_for_moves_with_what_a_reaction_holds(asked: str) -> None:
    written = "(1/2*dot(vel(c), vel(c))*2 kg + 1/2*(0.2*w[1]^2 + 0.3*w[2]^2 + 0.25*w[3]^2)*1 kg.m^2)"
    if (
        "momentum" in asked
    ):  # of the turn in the body, about the ball, by the arm of the mass and by its own spin
        written = "(cross({0.4 m, 0 m, 0.1 m}, components(b, vel(c)))[2]*2 kg + 0.3 kg.m^2*w[2])*1 s^-1"
    text = (
        "model M coordinate Length x = 0; kinetic 1/2*1 kg*der(x)^2; Body body(m = 2 kg, J = diag({0.2, 0.3, 0.25} kg.m^2),"
        "com = {0.4 m, 0 m, 0.1 m}); Spherical ball(world -> body.a, orientation = rotz(40 deg)*rotx(20 deg));"
        "initial der(ball.orientation) = {0.5, -0.7, 0.9} rad/s;"
        "let b = body.a; let c = b*{0.4 m, 0 m, 0.1 m}; let w = components(b, angvel(b)); let e = %s;"
        "damping 0.2 s/m^2*e on pos(c)[1]; output F = reaction(ball); output M = moment(ball); end M;"
    )
    asks, formula = (meaning("import mech.spatial.*;" + text % s) for s in (asked, written))
    state = asks.start()
    mine, theirs = ({**m.outputs(state), **m.accelerations(state)} for m in (asks, formula))
    assert mine == pytest.approx(theirs, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize(("between", "n"), [("elsewhen", 1), ("end when; when", 11)])
def test_a_tick_and_a_time_that_are_due_together_are_one_instant(between: str, n: float) -> None:
    """Of one `when` the first branch acts alone; before, the time was found right behind the tick."""
    text = "when sample(0.3 s, 0.3 s) then n := n + 1; %s time > 0.3 s then n := n + 10; end when;"
    m = meaning("coordinate x = 0 m; kinetic 1/2*1 kg*der(x)^2; discrete Real n = 0;" + text % between)
    motion = m.motion(0.5)
    assert motion.states[-1]["n"] == n and {round(e.time, 9) for e in motion.events} == {0.3}


def test_what_flies_lands_behind_the_bend_of_its_floor() -> None:
    """It slides off an edge at 1.2 m/s and falls 0.048 m, over a ramp that it does not touch and that ends below it."""
    m = meaning(
        "coordinate Length x = -0.03 m; coordinate Length y = 0 m; initial der(x) = 1.2 m/s;"
        "kinetic 1/2*1 kg*(der(x)^2 + der(y)^2); potential 1 kg*9.81 m/s^2*y;"
        "contact floor: y + 0.48*clamp(x, 0 m, 0.1 m);"
    )
    first = 0.03 / 1.2
    hits = [e.time for e in m.motion(0.2).events if e.kind == "impact"]
    assert hits[0] == pytest.approx(first + math.sqrt(2 * 0.048 / 9.81), abs=1e-8)


def test_a_bead_in_a_driven_tube() -> None:
    """A tube that is tilted by 0.5 and turned at w about the vertical: s'' = (w^2 cos^2 0.5 - k/m) s, and its drive tells its rate."""
    m = meaning(
        "coordinate Rotation R; drive R = rotz(2 rad/s*time)*rotx(0.5 rad); coordinate Length s = 0.5 m;"
        "frame tube = world * R; mass 1 kg at tube * {0 m, s, 0 m}; potential 1/2*9 N/m*s^2;"
        "output w = der(R); output M = reaction(R);"
    )
    state = m.start()
    assert m.accelerations(state)["der(s, 2)"] == pytest.approx(0.5 * (4 * math.cos(0.5) ** 2 - 9), rel=1e-13)
    out = m.outputs(state)
    assert [out[f"w[{k}]"] for k in (1, 2, 3)] == pytest.approx([0, 2 * math.sin(0.5), 2 * math.cos(0.5)])
    # y = s cos 0.5 and z = s sin 0.5 turn at w: the moment about x keeps the tube from swinging up, s'' acts along it
    assert out["M[1]"] == pytest.approx(0.5**2 * 4 * math.sin(0.5) * math.cos(0.5), rel=1e-12)
    assert m.driven == ["R[1]", "R[2]", "R[3]", "R[4]"]
    assert "der(R)[1]" not in m.rates


@pytest.mark.parametrize(
    ("force", "taken"),
    [
        ("-2 N.s/m*der(x)", [0.5]),
        ("2 N.s/m*der(x)", [0.0]),
        ("-2 N.s/m^3*(x^2 - 1 m^2)*der(x)", [0.0]),
        ("-2 N.s/m^3*(x^2 + 1 m^2)*der(x)", [0.0, 2.5]),
    ],
)
def test_what_brakes_whatever_the_motion_dissipates(force: str, taken: list[float]) -> None:
    """At x = 2 m, x' = 0.5 m/s; whether x^2 + 1 m^2 has one sign is told by looking, which leaves it open."""
    m = meaning(f"coordinate Length x = 2 m; kinetic 1/2*1 kg*der(x)^2; force {force} on x;")
    assert dissipated(m, {"x": 2.0, "der(x)": 0.5, "time": 0.0}) == pytest.approx(taken)


def test_ends_that_are_equally_fast_hit_together() -> None:
    """A bar that falls flat with a rebound rises flat, although its ends differ by rounding."""
    m = meaning(
        "coordinate Length y = 0.2 m; coordinate Angle a = 0 rad; potential 1 kg*9.81 m/s^2*y;"
        "kinetic 1/2*1 kg*der(y)^2 + 1/2*0.2 kg.m^2*der(a)^2;"
        "contact left: y - 0.3 m*a restitution 0.5; contact right: y + 0.3 m*a restitution 0.5;"
    )
    fallen = {"y": 0.0, "a": 0.0, "der(y)": -2.0, "der(a)": 1e-11, "time": 0.0}
    contacts = list(m.flat.contacts)
    after, hit = impacts(m, fallen, contacts, [], dict.fromkeys(("left", "right"), 1e-9))
    assert hit == ["left", "right"]
    assert (after["der(y)"], after["der(a)"]) == pytest.approx((1.0, 0.0), abs=1e-10)

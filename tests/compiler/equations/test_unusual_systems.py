"""Systems that leave the beaten track: each against its closed form."""

from __future__ import annotations

import math

import pytest
from compiled import compiled, outcome
from refusals import refused

import mechc
from mechc.lang.diagnostics import CompileError
from mechc.runtime.outcome import SimulationError

ROUNDING = 1e-13
"""Some ten operations on numbers of size 10."""


def test_lagrangian_with_second_derivatives_integrates_by_parts() -> None:
    """L = -1/2 m q q'' - 1/2 k q^2 is the oscillator (V9, U62)."""
    model = compiled("coordinate q = 1 m; lagrangian -1/2*2 kg*q*der(q, 2) - 1/2*3 N/m*q^2;")
    state = {"q": 0.7, "der(q)": -0.4}
    assert outcome(model, "rhs", state)["der(q)"] == pytest.approx(-1.5 * 0.7, abs=ROUNDING)
    energy = 1 / 2 * 2 * 0.4**2 + 1 / 2 * 3 * 0.7**2
    assert outcome(model, "outputs", state)["energy.total"] == pytest.approx(energy, abs=ROUNDING)


def test_light_cone_coordinates_have_a_zero_diagonal() -> None:
    """L = u'v' - u^2/2 - v^2/2 gives v'' = -u and u'' = -v."""
    model = compiled(
        "dimensionless; coordinate u = 1; coordinate v = 1; lagrangian der(u)*der(v) - (u^2 + v^2)/2;"
    )
    found = outcome(model, "rhs", {"u": 0.3, "v": -0.8, "der(u)": 1.0, "der(v)": 2.0})
    assert (found["der(u)"], found["der(v)"]) == pytest.approx((0.8, -0.3), abs=ROUNDING)


DRIVEN_RATE = """
coordinate Angle phi;
coordinate x = 0.1 m;
drive der(phi) = 3 rad/s;
mass 2 kg at world * rot(phi) * {x, 0};
output M = reaction(phi);
"""


def test_driven_rate_keeps_its_angle_as_a_state() -> None:
    """A bead on a rod that turns at a given rate: x'' = w^2 x, M = 2 m w x x'."""
    model = compiled(DRIVEN_RATE)
    state = {"phi": 1.1, "x": 0.5, "der(x)": 0.25}
    rates = outcome(model, "rhs", state)
    assert (rates["phi"], rates["der(x)"]) == pytest.approx((3.0, 9 * 0.5), abs=ROUNDING)
    assert outcome(model, "outputs", state)["M"] == pytest.approx(2 * 2 * 3 * 0.5 * 0.25, abs=ROUNDING)


def test_formulas_without_a_symbol_do_not_keep_it() -> None:
    """The reaction of the driven rate does not depend on x'', though it is formed from terms that do."""
    equations = compiled(DRIVEN_RATE).equations
    outputs = [n for f in equations.functions for n in f.outputs]
    assert set(equations.graph.support(*outputs)) <= set(equations.layout)


@pytest.mark.slow
def test_driven_rotation_gives_its_torque_in_the_body() -> None:
    """Spun about a fixed axis at a constant rate: M = w x J w (Euler)."""
    model = compiled(
        """
        coordinate Rotation R;
        coordinate x = 0 m;
        kinetic 1/2*1 kg*der(x)^2;
        drive R = axis_angle({1, 2, 2}/3, 3 rad/s*time);
        inertia diag({1, 2, 3} kg.m^2) on world * R;
        output M = reaction(R);
        """
    )
    w, moments = (1.0, 2.0, 2.0), (1.0, 2.0, 3.0)
    h = [j * c for j, c in zip(moments, w, strict=True)]
    expected = [w[1] * h[2] - w[2] * h[1], w[2] * h[0] - w[0] * h[2], w[0] * h[1] - w[1] * h[0]]
    found = outcome(model, "outputs", {"time": 0.4})
    assert [found[f"M[{k}]"] for k in (1, 2, 3)] == pytest.approx(expected, abs=10 * ROUNDING)


def test_reaction_of_a_joint_is_the_force_on_its_to_side() -> None:
    """A mass that hangs at rest pulls its hinge down: the hinge pulls it up with m g."""
    model = compiled(
        """
        import mech.planar.*;
        gravity {0, -9.81 m/s^2};
        Body bob(m = 2 kg, com = {0, -1} m);
        Revolute pin(world -> bob.a, angle = 0 rad);
        output F = reaction(pin);
        """
    )
    found = outcome(model, "outputs", {"pin.angle": 0.0, "der(pin.angle)": 0.0})
    assert (found["F[1]"], found["F[2]"]) == pytest.approx((0.0, 2 * 9.81), abs=ROUNDING)


def test_mass_that_grows_keeps_its_velocity() -> None:
    """``mass`` means m a = F: matter joins at the velocity of the point (rocket with an explicit jet)."""
    model = compiled("parameter r = 2 kg/s; coordinate x = 0 m; mass 1 kg + r*time at world * {x, 0};")
    assert outcome(model, "rhs", {"der(x)": 3.0, "time": 1.0})["der(x)"] == pytest.approx(0.0, abs=ROUNDING)
    supplied = outcome(model, "rhs", {"der(x)": 3.0, "time": 1.0})["energy.supplied"]
    assert supplied == pytest.approx(1 / 2 * 2 * 3.0**2, abs=ROUNDING)


def test_rheonomic_frame_supplies_energy() -> None:
    """A bead on a hoop that is turned: h is not T + V, and both are as defined."""
    model = compiled(
        """
        parameter w = 2 rad/s;
        gravity {0, 0, -9.81 m/s^2};
        coordinate th = 0.5 rad;
        mass 1 kg at world * rotz(w*time) * roty(th) * {0, 0, -1 m};
        """
    )
    found = outcome(model, "outputs", {"th": 0.5, "der(th)": 0.3, "time": 0.8})
    potential = -9.81 * math.cos(0.5)
    swing, turn = 0.3**2 / 2, (2 * math.sin(0.5)) ** 2 / 2
    assert found["energy.kinetic"] == pytest.approx(swing + turn, abs=ROUNDING)
    assert found["energy.total"] == pytest.approx(swing - turn + potential, abs=ROUNDING)


def test_rigid_body_is_what_moves_together() -> None:
    """A box of 1 kg with a mass of 3 kg on its axis: centre at 3/4 m, Steiner's term 3/4 kg.m^2."""
    model = compiled(
        """
        import mech.spatial.*;
        Box box(m = 1 kg, size = {1, 2, 3} m);
        Body other(m = 5 kg, J = identity(3)*1 kg.m^2);
        Free free(world -> box.a);
        Revolute hinge(box.a -> other.a, axis = {1, 0, 0});
        mass 3 kg at box.a * {0, 0, 1 m};
        output c = mass_centre(box.a);
        output J = inertia_tensor(box.a);
        """
    )
    found = outcome(model, "outputs", {"free.orientation[1]": 1.0})
    assert [found[f"c[{k}]"] for k in (1, 2, 3)] == pytest.approx([0, 0, 0.75], abs=ROUNDING)
    expected = [[13 / 12 + 3 / 4, 0, 0], [0, 10 / 12 + 3 / 4, 0], [0, 0, 5 / 12]]
    tensor = [[found[f"J[{i},{j}]"] for j in (1, 2, 3)] for i in (1, 2, 3)]
    assert tensor == [pytest.approx(row, abs=ROUNDING) for row in expected]


def conserved(text: str) -> set[str]:
    equations = compiled(text).equations
    return {equations.outputs[k].name for k in equations.conserved}


TWO_BOXES = """
import mech.spatial.*;
Box a(m = 1 kg, size = {1, 2, 3} m);
Box b(m = 2 kg, size = {1, 0.5, 0.3} m);
Free free(world -> a.a);
Spherical joint(a.a * trans({0, 0, 1.5 m}) -> b.a);
"""


def test_free_bodies_keep_their_total_momentum() -> None:
    cyclic = {f"momentum(free.position[{k}])" for k in (1, 2, 3)}
    assert conserved(TWO_BOXES) == cyclic | {f"angular_momentum.{axis}" for axis in "xyz"}


def test_a_force_from_outside_breaks_what_it_changes() -> None:
    found = conserved(TWO_BOXES + "force {0, 0, 1} N on a.a;")
    assert found == {"momentum.x", "momentum.y", "angular_momentum.z"}


def test_a_step_of_the_potential_breaks_a_momentum() -> None:
    text = """
    coordinate x = 0 m; coordinate y = 1 m;
    kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
    potential if y > 0 m then 0 else 2 J;
    """
    assert "momentum(y)" not in conserved(text)


def test_reinit_breaks_momenta() -> None:
    text = """
    coordinate x = 0 m;
    kinetic 1/2*1 kg*der(x)^2;
    when x > 1 m then reinit(der(x), -der(x)); end when;
    """
    assert conserved(text) == set()


def test_rows_that_cancel_are_constraints_all_the_same() -> None:
    text = """
    coordinate x = 0 m; coordinate y = 0 m;
    kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
    constraint first: x - 2*y = 0;
    constraint second: sin((2*y - x)/1 m) = 0;
    """
    assert not conserved(text) & {"momentum(x)", "momentum(y)"}


def test_friction_holds_nothing_that_has_no_mass() -> None:
    """While it sticks the coordinate is determined, while it slides nothing is: told before the run."""
    text = """
    gravity {0, -9.81} m/s^2;
    coordinate x = 0 m; coordinate y = 1 m; coordinate Angle a = 0 rad;
    mass 1 kg at world * {x, y};
    contact floor: y friction 0.2 along der(x) + (1 m)*der(a);
    """
    with pytest.raises(CompileError) as caught:
        compiled(text)
    (found,) = caught.value.diagnostics
    assert (found.code, found.message) == ("E0520", "nothing with mass moves with 'a'")


def test_neither_a_constraint_nor_friction_holds_what_has_no_mass() -> None:
    """Projections onto the constraint divide by its mass, too."""
    text = """
    coordinate Length h[2] = 1 m; coordinate x = 1 m;
    kinetic 1/2*1 kg*der(x)^2;
    constraint roll: der(h[1]) = der(h[2]);
    friction 0.1 N on h[2];
    """
    with pytest.raises(CompileError) as caught:
        compiled(text)
    errors = [d for d in caught.value.diagnostics if d.code.startswith("E")]
    assert [(d.code, d.message) for d in errors] == [("E0520", "nothing with mass moves with 'h'")]


def test_a_combination_without_mass_is_named() -> None:
    text = "coordinate x[2] = {1, 2} m; kinetic 1/2*1 kg*(der(x[1]) + der(x[2]))^2; potential 1 N/m*(x[1] + x[2])^2;"
    with pytest.raises(CompileError) as caught:
        compiled(text)
    (found,) = caught.value.diagnostics
    assert (found.code, found.message) == ("E0520", "some motion of 'x[1]' and 'x[2]' together moves no mass")


def test_a_rotation_without_inertia_of_its_own_is_named() -> None:
    text = """
    coordinate Rotation R; coordinate Angle a;
    frame body = world * R * rotx(a);
    mass 1 kg at body; inertia diag({1, 2, 3} kg.m^2) on body;
    """
    with pytest.raises(CompileError) as caught:
        compiled(text)
    (found,) = caught.value.diagnostics
    assert (found.code, found.message) == ("E0520", "some motion of 'R' and 'a' together moves no mass")


ELLIPSOID = """
parameter a = 0.2 m;
parameter b = 0.03 m;
coordinate Length p[3] = {0 m, 0 m, b};
coordinate Rotation R;
frame body = world * trans(p) * R;
let u = components(body, {0, 0, 1});
let s = sqrt(a^2*u[1]^2 + b^2*u[2]^2 + b^2*u[3]^2);
mass 1 kg at body;
inertia diag({2, 2, 2} g.m^2) on body;
constraint touch: p[3] = s;
nonholonomic constraint grip: vel(body) + direction(body, cross(der(R), {-a^2*u[1], -b^2*u[2], -b^2*u[3]}/s)) = {0, 0, 0};
"""


def test_elimination_ends_where_a_definition_comes_to_depend_on_a_younger_one() -> None:
    """An ellipsoid that rolls and spins about the vertical through its lowest point: nothing accelerates."""
    model = compiled(ELLIPSOID)
    state = {"p[3]": 0.03, "R[1]": 1.0, "der(R)[3]": 2.0}
    names = {f"p[{k}]": 0.0 for k in (1, 2)} | {f"R[{k}]": 0.0 for k in (2, 3, 4)}
    names |= {f"der(p[{k}])": 0.0 for k in (1, 2, 3)} | {f"der(R)[{k}]": 0.0 for k in (1, 2)}
    found = outcome(model, "rhs", names | state)
    accelerations = [found[f"der(p[{k}])"] for k in (1, 2, 3)] + [found[f"der(R)[{k}]"] for k in (1, 2, 3)]
    assert accelerations == pytest.approx([0] * 6, abs=ROUNDING)


HINGED = "import mech.planar.*;\nBody b(m = 1 kg, J = 1 kg.m^2);\nRevolute h(world -> b.a);\n"


def test_a_joint_between_the_same_frames_twice_is_named() -> None:
    """The second hinge holds nothing that the first one does not hold, so its force is anything."""
    found = mechc.loads(f"{HINGED}Revolute k(world -> b.a);\n").diagnostics
    assert [d.code for d in found] == ["W0513"]
    assert found[0].message == "joint 'k' repeats 2 equations already implied by the others; dropped"


def test_what_others_fulfil_is_named_where_the_reaction_is_asked_for() -> None:
    """A second hinge on the axis of the first takes no freedom; alone it needs no words."""
    text = "import mech.spatial.*;\nBody b(m = 1 kg, J = identity(3)*1 kg.m^2);\nRevolute h(world -> b.a);\n"
    slot = "cut Cylindrical k(world -> b.a);\n"
    assert [d.code for d in mechc.loads(text + slot + "output F = reaction(k);\n").diagnostics] == ["W0513"]


def test_a_joint_from_a_body_to_itself() -> None:
    """Also where nothing places the body."""
    assert "E0511" in [
        d.code
        for d in refused("import mech.planar.*;\nBody b(m = 1 kg, J = 1 kg.m^2);\nRevolute h(b.a -> b.a);\n")
    ]


TWO_BARS = """
import mech.spatial.*;
parameter h = 0 m;
Bar one;
Bar two;
Revolute a(world -> one.a);
Revolute b(one.b -> two.a);
cut Revolute c(two.b -> world * trans({1 m, 0 m, h}));
"""


def test_a_loop_that_no_coordinate_can_close() -> None:
    """Off its plane by a parameter: told by how much; not where the parameter is zero, which the assembly checks."""
    assert [d.code for d in mechc.loads(TWO_BARS).diagnostics] == ["W0513"]
    (found,) = refused(TWO_BARS.replace("h = 0 m", "h = 20 cm"))
    assert found.code == "E0529"
    assert (
        found.message
        == "the loop that joint 'c' closes cannot close: 'c[3]' is off by 0.2 m in every position"
    )
    with pytest.raises(SimulationError) as raised:
        mechc.loads(TWO_BARS).simulate(stop=1, set={"h": 0.2})
    assert raised.value.code == "E0606" and "'c[3]' is off by 0.2 m" in raised.value.notes[0]


def test_what_contradicts_does_not_repeat() -> None:
    """2 x = 3 is not implied by x = 1: the assembly tells, and nothing is said to be superfluous before."""
    text = (
        "coordinate x ~ 0 m;coordinate y = 0 m;kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);constraint a: x = 1 m;"
    )
    assert [d.code for d in mechc.loads(text + "constraint b: 2*x = 2 m;").diagnostics] == ["W0513"]
    wrong = mechc.loads(text + "constraint b: 2*x = 3 m;")
    assert wrong.diagnostics == ()
    with pytest.raises(SimulationError) as refused:
        wrong.simulate(stop=1)
    assert refused.value.code == "E0605" and len(refused.value.notes) == 2

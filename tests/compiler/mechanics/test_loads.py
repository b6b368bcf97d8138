"""What forces and constraints cannot mean, or do not do, is told."""

from __future__ import annotations

import math

import pytest
from refusals import refused

import mechc

PLANE = """
coordinate Length x[2] = {1, 0} m;
coordinate Length y[2] = 0 m;
coordinate Angle a = 0 rad;
frame F = world * trans(x) * rot(a);
frame G = F * trans({1, 0} m);
point P = world * x;
point Q = world * y;
mass 1 kg at F;
inertia 1 kg.m^2 on F;
mass 1 kg at Q;
"""


def codes_of(text: str) -> list[str]:
    return [found.code for found in mechc.loads(text).diagnostics]


def codes(statement: str) -> list[str]:
    return codes_of(PLANE + statement)


@pytest.mark.parametrize(
    ("statement", "code"),
    [
        ("force {0, 1} N on P from Q;", "W0530"),  # moving points of the plane, not of its bodies
        ("force {0, 1} N on F from Q;", "W0530"),
        ("force {0, 1} N on P from world;", ""),
        ("force 1 N/m*(P - Q) on P from Q;", ""),
        ("force {0, 1} N on F from F;", "W0531"),
        ("force {0, 1} N on F at Q from F;", "W0531"),
        ("torque 1 N.m on G from F;", "W0531"),
        ("force 1 N on x[1] from x[1];", "W0531"),
        ("when time > 1 s then impulse {0, 1} N.s on F from F; end when;", "W0531"),
        ("force {0, 1} N on F;", ""),
        ("force {0, 1} N on F at Q from world;", ""),
        ("force 1 N on x[1] from x[2];", ""),
    ],
)
def test_forces_that_make_momentum_or_cancel_are_told(statement: str, code: str) -> None:
    assert codes(statement) == ([code] if code else [])


def test_a_constraint_of_accelerations_says_so() -> None:
    (found,) = refused(PLANE + "constraint c: der(x[1], 2) = der(y[1], 2);")
    assert (found.code, found.message) == ("E0501", "constraint 'c' contains accelerations")


MASSES = "parameter c = -1 N.s/m; parameter w = 1 N.s/m; coordinate x = 1 m; coordinate y = 0 m; kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);"


@pytest.mark.parametrize(
    ("statement", "code"),
    [
        ("damping -1 N.s/m on x;", "W0532"),
        ("damping c on x;", "W0532"),
        ("damping c on x - y;", "W0532"),
        ("dissipation 1/2*c*der(x)^2;", "W0532"),
        ("dissipation -w*(der(x)^2 + der(y)^2);", "W0532"),
        ("damping w on x;", ""),
        ("damping c + w on x;", ""),
        ("damping w*(x^2/1 m^2 - 1) on x;", ""),
        ("damping -w*sin(2 rad/s*time) on x;", ""),
        ("dissipation w*(der(x)^2 - der(y)^2);", ""),
        ("dissipation 1/2*w*(der(x) - der(y))^2;", ""),
    ],
)
def test_damping_that_feeds_is_told(statement: str, code: str) -> None:
    found = [c for c in codes_of(MASSES + statement) if c != "W0402"]
    assert found == ([code] if code else [])


@pytest.mark.parametrize(
    ("statement", "wrong"),
    [
        ("friction 1 N static 0.5 N on x;", True),
        ("friction 1 N static 1 N on x;", False),
        ("friction 1 N static 1.5 N on x;", False),
        ("contact c: y friction 0.4 static 0.3 along der(x);", True),
        ("contact c: y friction 0.3 static 0.4 along der(x);", False),
    ],
)
def test_sticking_holds_at_least_as_much_as_sliding(statement: str, wrong: bool) -> None:
    text = MASSES.partition(";")[2].partition(";")[2] + statement
    if wrong:
        assert [d.code for d in refused(text)] == ["E0706"]
    else:
        assert codes_of(text) == []


ROWS = (
    "structural parameter Integer n = {n}; coordinate Length x[n] = 1 m; kinetic sum(1/2*1 kg*der(x[i])^2 for i in 1:n);"
    "for i in 1:n loop {statement} end for;"
)


def test_more_rows_than_a_run_decides_over_are_told_when_compiling() -> None:
    with pytest.raises(mechc.CompileError, match=r"E0720.*has 65 rows"):
        mechc.loads(ROWS.format(n=65, statement="friction 1 N on x[i];"))
    assert codes_of(ROWS.format(n=65, statement="contact c[i]: x[i];")) == []
    smooth = 'friction 1 N on x[i], law = "regularized", v_stick = 1 mm/s;'
    assert codes_of(ROWS.format(n=65, statement=smooth)) == []


def test_the_kernel_has_room_for_as_many_rows() -> None:
    from mechc.compiler.equations.rows.modes import MOST_ROWS
    from mechc.runtime.integrate import kernel_failure
    from mechc.runtime.native.kernel import kernel_sources

    assert kernel_failure.MOST_ROWS > MOST_ROWS
    assert f"MECH_MOST_ROWS = {kernel_failure.MOST_ROWS} " in kernel_sources()["event_state.h"]


@pytest.mark.parametrize("statement", ["force {0, 1} N on F at Q from P;", "force {0, 1} N on P at Q;"])
def test_a_force_at_a_point_acts_between_frames(statement: str) -> None:
    (found,) = refused(PLANE + statement)
    assert found.code == "E0332" and "acts between frames" in found.message


@pytest.mark.parametrize(
    "text",
    [
        "force {i*1 N for i in 1:2} on f; coordinate Length x[2]; frame f = world*trans(x); mass 1 kg at f;",
        "import mech.planar.*; for i in 1:2 loop force {1*i, 2} N on b[i].a; end for; "
        "if true then Body b[2](m = 1 kg); Planar h[2](world -> b.a); end if;",
    ],
)
def test_space_is_known_wherever_it_is_told(text: str) -> None:
    assert mechc.loads(text).compilation.flat.space == 2


@pytest.mark.parametrize("space", ["", "inertia 1 kg.m^2*identity(3) on F;"])
def test_virtual_displacements_leave_the_arm_of_a_force_as_it_is(space: str) -> None:
    """F on a body at a point that follows a rate or a question is F and its moment; the rate itself is not pushed."""
    three = bool(space)
    text = f"""
coordinate Angle a = 0.3 rad;
coordinate Length x = 0.2 m;
initial der(a) = 2 rad/s;
initial der(x) = 0.5 m/s;
kinetic 1/2*(2 kg)*der(x)^2;
frame F = world * {"rotz(a)" if three else "rot(a)"};
{space or "inertia 1 kg.m^2 on F;"}
force {{3, 4{", 0" if three else ""}}} N on F at F * ({{0.7*der(x)/(1 m/s) + kinetic_energy()/(9 J), 0{", 0" if three else ""}}}*1 m);
"""
    solution = mechc.loads(text + "output A = der(a, 2); output X = der(x, 2);").simulate(stop=0.0)
    arm = 0.7 * 0.5 + (0.5 * 4 + 0.25) / 9
    moment = arm * (math.cos(0.3) * 4 - math.sin(0.3) * 3)
    assert solution["A"][0] == pytest.approx(moment, rel=1e-12)
    assert solution["X"][0] == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize(
    "arm",
    ["(1 s)*angvel(slide.a)", "(1 s)*(angvel(slide.a) - angvel(wheel.a))", "vel(slide.a)[2]*(1 s)/(1 m)"],
)
def test_joints_on_whose_rates_an_arm_depends_carry_nothing_of_its_force(arm: str) -> None:
    """What slides cannot turn, and nothing acts on it: that a force on the wheel asks for its spin is not a load of its joint."""
    text = f"""
    import mech.planar.*;
    Body slide(m = 2 kg, J = 0.1 kg.m^2);
    Prismatic guide(world -> slide.a, axis = {{0.8, 0.6}}, position = 0.3 m, der(position) = 0.4 m/s);
    Body wheel(m = 1 kg, J = 0.2 kg.m^2);
    Revolute hinge(world -> wheel.a, angle = 0.2 rad, der(angle) = 0.3 rad/s);
    force {{0.59, 0.3}} N on wheel.a at wheel.a * {{{arm}*1 m, 1 m}};
    output load[2] = reaction(guide);
    output moment = moment(guide);
    """
    solution = mechc.loads(text).simulate(stop=0.0)
    assert [*solution["load"][0], solution["moment"][0]] == pytest.approx([0, 0, 0], abs=1e-15)


@pytest.mark.parametrize("question", ["", "output held = reaction(guide);"])
def test_what_brakes_does_so_whether_its_joint_is_asked_or_not(question: str) -> None:
    """A force by the rate of a place brakes, as long as the place moves along the joint alone."""
    text = f"""
    import mech.planar.*;
    Body slide(m = 2 kg, J = 0.1 kg.m^2);
    Prismatic guide(world -> slide.a, axis = {{0, -1}}, der(position) = -0.9 m/s);
    force 1 kg/s*der(pos(slide.a)[2]) on guide.position;
    {question}
    """
    solution = mechc.loads(text).simulate(stop=1.0)
    lost = 0.5 * 2 * 0.9**2 * (1 - math.exp(-1.0))
    assert solution["energy.dissipated"][-1] == pytest.approx(lost, rel=1e-8)

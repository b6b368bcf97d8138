"""Joints of SymPy beside those of the library."""

from __future__ import annotations

from typing import Any

from sympy import symbols
from sympy.physics.mechanics import (
    CylindricalJoint,
    PinJoint,
    PlanarJoint,
    Point,
    PrismaticJoint,
    ReferenceFrame,
    RigidBody,
    dynamicsymbols,
    inertia,
)
from sympy.physics.mechanics import System as Assembly

from foreign.case import Judge, System
from foreign.judges import kane


def ground_and_bodies() -> tuple[Any, Any, Any]:
    ground, found = RigidBody("ground"), []
    for n in (1, 2):
        frame = ReferenceFrame(f"B{n}")
        centre = Point(f"c{n}")
        J = inertia(frame, *symbols(f"J{n}x J{n}y J{n}z"))
        found.append(RigidBody(f"body{n}", centre, frame, symbols(f"m{n}"), (J, centre)))
    return ground, *found


def assembled(ground: Any, *joints: Any) -> Judge:
    assembly = Assembly.from_newtonian(ground)
    assembly.add_joints(*joints)
    assembly.apply_uniform_gravity(-symbols("g") * ground.z)
    assembly.form_eoms()
    return kane(assembly.eom_method)


def pin_and_cylinder() -> Judge:
    """A pin about an oblique axis, then a cylindrical joint about an axis across."""
    ground, one, two = ground_and_bodies()
    q, u = dynamicsymbols("q1:4"), dynamicsymbols("u1:4")
    a, b = symbols("a b")
    pin = PinJoint(
        "pin",
        ground,
        one,
        q[0],
        u[0],
        joint_axis=ground.x + 2 * ground.y + 2 * ground.z,
        child_point=-a * one.x,
    )
    slide = CylindricalJoint(
        "slide",
        one,
        two,
        q[1],
        q[2],
        u[1],
        u[2],
        joint_axis=one.y,
        parent_point=b * one.z,
        child_point=a * two.x,
    )
    return assembled(ground, pin, slide)


def plane_and_slider() -> Judge:
    """A body on a plane, whose normal SymPy takes along x, and a slider along an oblique axis of it."""
    ground, one, two = ground_and_bodies()
    q, u = dynamicsymbols("q1:5"), dynamicsymbols("u1:5")
    a, b = symbols("a b")
    plane = PlanarJoint("plane", ground, one, q[0], q[1:3], u[0], u[1:3], child_point=b * one.y)
    slide = PrismaticJoint(
        "slide", one, two, q[3], u[3], joint_axis=3 * one.x + 4 * one.z, child_point=a * two.y
    )
    return assembled(ground, plane, slide)


BODIES = """
import mech.spatial.*;
parameter m1 = 1 kg;
parameter m2 = 1 kg;
parameter J1[3] = {1, 1, 1} kg.m^2;
parameter J2[3] = {1, 1, 1} kg.m^2;
parameter a = 1 m;
parameter b = 1 m;
parameter g = 9.81 m/s^2;
gravity {0, 0, -g};
experiment(stop = 1 s);
"""

SIZES = {f"J{n}{axis}": f"J{n}[{k}]" for n in (1, 2) for k, axis in enumerate("xyz", 1)}

SYSTEMS = (
    System(
        name="pin and cylindrical joint",
        source="SymPy test_joint: test_pin_joint_arbitrary_axis, test_cylindrical_joint",
        compared="accelerations",
        text=BODIES
        + """
Body one(m = m1, J = diag(J1), com = {a, 0, 0});
Body two(m = m2, J = diag(J2), com = {-a, 0, 0});
Revolute pin(world -> one.a, axis = {1, 2, 2});
Cylindrical slide(one.a * trans({a, 0, b}) -> two.a, axis = {0, 1, 0});
""",
        judge=pin_and_cylinder,
        stored=True,
        names=SIZES | {"q1": "pin.angle", "q2": "slide.angle", "q3": "slide.position"},
    ),
    System(
        name="planar and prismatic joint",
        source="SymPy test_joint: test_planar_joint, test_prismatic_joint_arbitrary_axis",
        compared="accelerations",
        text=BODIES
        + """
frame side;
Planar plane(world * axis_angle({1, 1, 1}, 120 deg) -> side);
Body one(m = m1, J = diag(J1), com = {0, -b, 0});
Weld turn(side * axis_angle({1, 1, 1}, -120 deg) -> one.a);
Body two(m = m2, J = diag(J2), com = {0, -a, 0});
Prismatic slide(one.a * trans({0, -b, 0}) -> two.a, axis = {3, 0, 4});
""",
        judge=plane_and_slider,
        names=SIZES | {"q1": "plane.angle", "q2": "plane.x", "q3": "plane.y", "q4": "slide.position"},
        remark="SymPy's plane is that of y and z, with its normal along x; that of the library is x and y",
    ),
)

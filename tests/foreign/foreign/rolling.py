"""Discs, wheels and stones that roll without slip."""

from __future__ import annotations

from typing import Any

from sympy import cos, pi, sin, sqrt, symbols
from sympy.physics.mechanics import (
    Lagrangian,
    Point,
    ReferenceFrame,
    RigidBody,
    cross,
    dynamicsymbols,
    inertia,
)

from foreign.case import Judge, System
from foreign.judges import kane, kanes, lagrange

T = dynamicsymbols._t


def turned(q: Any) -> tuple[Any, Any, Any, Any]:
    """The world, and frames turned about its z by q1, then about x by q2 and about y by q3."""
    N = ReferenceFrame("N")
    Y = N.orientnew("Y", "Axis", [q[0], N.z])
    L = Y.orientnew("L", "Axis", [q[1], Y.x])
    return N, Y, L, L.orientnew("R", "Axis", [q[2], L.y])


def disc_from_contact() -> Judge:
    """The contact has no velocity, so that three speeds are enough; two auxiliary speeds give the forces along the ground."""
    q1, q2, q3, u1, u2, u3, u4, u5, f1, f2 = dynamicsymbols("q1 q2 q3 u1 u2 u3 u4 u5 f1 f2")
    r, m, g = symbols("r m g")
    N, Y, L, R = turned((q1, q2, q3))
    turning = R.ang_vel_in(N)
    R.set_ang_vel(N, u1 * L.x + u2 * L.y + u3 * L.z)
    kde = [(R.ang_vel_in(N) - turning).dot(e) for e in L]
    across = cross(Y.z, L.x)
    C = Point("C")
    C.set_vel(N, u4 * L.x + u5 * across)
    centre = C.locatenew("centre", r * L.z)
    centre.v2pt_theory(C, N, R)
    I = inertia(L, m / 4 * r**2, m / 2 * r**2, m / 4 * r**2)
    disc = RigidBody("disc", centre, R, m, (I, centre))
    loads = [(centre, -m * g * Y.z), (C, f1 * L.x + f2 * across)]
    method = kanes(N, [q1, q2, q3], [u1, u2, u3], kde, [disc], loads, u_auxiliary=[u4, u5])
    return kane(method, [f1, f2])


def disc_with_all_forces() -> Judge:
    """Gravity along z, six speeds of which three depend on the others, and the height as a dependent coordinate."""
    q = dynamicsymbols("q:4")
    u, ua = dynamicsymbols("u:6"), dynamicsymbols("ua:3")
    r, m, g, I, J = symbols("r m g I J")
    F = dynamicsymbols("Fx Fy Fz")
    N, A, B, C = turned(q)
    turning = C.ang_vel_in(N)
    C.set_ang_vel(N, u[0] * B.x + u[1] * B.y + u[2] * B.z)
    P = Point("P")
    P.set_vel(N, sum((s * e for s, e in zip(ua, A, strict=True)), 0 * A.x))
    O = P.locatenew("O", q[3] * A.z + r * sin(q[1]) * A.y)
    O.set_vel(N, u[3] * A.x + u[4] * A.y + u[5] * A.z)
    kde = [(turning - C.ang_vel_in(N)).dot(e) for e in B] + [q[3].diff(T) - u[5]]
    rolling = O.vel(N) - P.vel(N) - cross(C.ang_vel_in(N), O.pos_from(P))
    disc = RigidBody("disc", O, C, m, (inertia(B, I, J, I), O))
    push = sum((f * e for f, e in zip(F, A, strict=True)), 0 * A.x)
    method = kanes(
        N,
        q[:3],
        u[:3],
        kde,
        [disc],
        [(O, m * g * A.z), (P, push)],
        q_dependent=q[3:],
        configuration_constraints=[-r * cos(q[1]) - q[3]],
        u_dependent=u[3:],
        velocity_constraints=[rolling.dot(e) for e in A],
        u_auxiliary=ua,
    )
    return kane(method, F)


def disc_in_five() -> Judge:
    """The place of the contact as two coordinates, whose rates the rolling decides."""
    q = dynamicsymbols("q1:6")
    u = dynamicsymbols("u1:6")
    g, r, m = symbols("g r m")
    N, _, L, R = turned(q)
    turning = R.ang_vel_in(N)
    R.set_ang_vel(N, u[0] * R.x + u[1] * R.y + u[2] * R.z)
    C, centre = Point("C"), Point("centre")
    C.set_vel(N, u[3] * N.x + u[4] * N.y)
    centre.set_pos(C, r * L.z)
    centre.set_vel(N, cross(R.ang_vel_in(N), r * L.z))
    kde = [(turning - R.ang_vel_in(N)).dot(e) for e in R] + [q[3].diff(T) - u[3], q[4].diff(T) - u[4]]
    slip = C.vel(N) + cross(R.ang_vel_in(L), -r * L.z)
    disc = RigidBody("disc", centre, R, m, (inertia(R, m * r**2 / 4, m * r**2 / 2, m * r**2 / 4), centre))
    method = kanes(
        N,
        q,
        u[:3],
        kde,
        [disc],
        [(centre, -m * g * N.z)],
        u_dependent=u[3:],
        velocity_constraints=[slip.dot(N.x), slip.dot(N.y)],
        constraint_solver="LU",
    )
    return kane(method)


def substituted_lagrangian() -> Judge:
    """Lagrange's equations of three angles from a kinetic energy into which rolling was substituted."""
    q = dynamicsymbols("q1:4")
    r, m, g = symbols("r m g")
    N, _, L, R = turned(q)
    C = Point("C")
    C.set_vel(N, 0)
    centre = C.locatenew("centre", r * L.z)
    centre.v2pt_theory(C, N, R)
    disc = RigidBody("disc", centre, R, m, (inertia(L, m * r**2 / 4, m * r**2 / 2, m * r**2 / 4), centre))
    disc.potential_energy = -m * g * r * cos(q[1])
    return lagrange(Lagrangian(N, disc), q)


def down_an_incline() -> Judge:
    y, theta = dynamicsymbols("y theta")
    m, g, R, l, alpha = symbols("m g R l alpha")
    N = ReferenceFrame("N")
    A = N.orientnew("A", "Axis", [pi / 2 - alpha, N.z])
    B = A.orientnew("B", "Axis", [-theta, A.z])
    centre = Point("centre")
    centre.set_vel(N, y.diff(T) * A.x)
    disc = RigidBody("disc", centre, B, m, (inertia(B, 0, 0, m * R**2 / 2), centre))
    disc.potential_energy = m * g * (l - y) * sin(alpha)
    lam = dynamicsymbols("lam1")
    return lagrange(Lagrangian(N, disc), [y, theta], config=[y - R * theta], reactions={"push": lam})


def three_wheeled_car() -> Judge:
    """Kane, Levinson 1985, exercises 8.12 and 8.17: a car on an incline with two wheels that roll, and pushes at a third place."""
    q1, q2, q3, u1, u2, u3, u4, u5 = dynamicsymbols("q1:4 u1:6")
    R, M, g, e, f, theta = symbols("R M g e f theta")
    a, b, mA, mB, IA, J, K = symbols("a b mA mB IA J K")
    Q = symbols("Q1 Q2 Q3")
    F = ReferenceFrame("F")
    P = F.orientnew("P", "Axis", [-theta, F.y])
    A = P.orientnew("A", "Axis", [q1, P.x])
    A.set_ang_vel(F, u1 * A.x + u3 * A.z)
    D = Point("D")
    D.set_vel(F, u2 * A.y)
    kde = [q1.diff(T) - u1, q2.diff(T) - u4, q3.diff(T) - u5]
    weight, pushed = D.locatenew("S", e * A.y), D.locatenew("Q", f * A.y - R * A.x)
    frame_centre = D.locatenew("A*", a * A.y)
    for point in (weight, pushed, frame_centre):
        point.v2pt_theory(D, F, A)
    bodies = [RigidBody("frame", frame_centre, A, mA, (inertia(A, IA, 1, 1), frame_centre))]
    held = []
    for name, angle, speed, side in (("B", q2, u4, b), ("C", q3, u5, -b)):
        wheel = A.orientnew(name, "Axis", [angle, A.z])
        wheel.set_ang_vel(A, speed * A.z)
        centre = D.locatenew(f"{name}*", side * A.z)
        centre.v2pt_theory(D, F, A)
        touching = centre.locatenew(f"{name}^", -R * A.x)
        touching.v2pt_theory(centre, F, wheel)
        held.append(touching.vel(F).dot(A.y).subs(u3, 0))
        bodies.append(RigidBody(name, centre, wheel, mB, (inertia(wheel, K, K, J), centre)))
    loads = [(weight, -M * g * F.x), (pushed, Q[0] * A.x + Q[1] * A.y + Q[2] * A.z)]
    more = {"u_dependent": [u4, u5], "velocity_constraints": held, "u_auxiliary": [u3]}
    return kane(kanes(F, [q1, q2, q3], [u1, u2], kde, bodies, loads, **more))


def rattleback(surface: str) -> Judge:
    """A stone on a plane with gravity along z: the contact lies where the surface has the plane's normal."""
    q, u = dynamicsymbols("q1:4"), dynamicsymbols("u1:4")
    m, g, s, a, b, c, d, e, f = symbols("m g s a b c d e f")
    Ixx, Iyy, Izz, Ixy, Iyz, Ixz = symbols("Ixx Iyy Izz Ixy Iyz Ixz")
    N, Y, _, R = turned(q)
    turning = R.ang_vel_in(N)
    R.set_ang_vel(N, u[0] * R.x + u[1] * R.y + u[2] * R.z)
    kde = [(turning - R.ang_vel_in(N)).dot(axis) for axis in R]
    P = Point("P")
    P.set_vel(N, 0)
    down = [axis.dot(Y.z) for axis in R]
    if surface == "ellipsoid":
        size = sqrt((a * down[0]) ** 2 + (b * down[1]) ** 2 + (c * down[2]) ** 2)
        contact = (
            (a**2 * down[0] / size) * R.x + (b**2 * down[1] / size) * R.y + (c**2 * down[2] / size) * R.z
        )
    else:
        x, y = down[0] / down[2] / (2 * a), down[1] / down[2] / (2 * b)
        contact = x * R.x + y * R.y + (1 - a * x**2 - b * y**2) * R.z
    centre = P.locatenew("centre", d * R.x + e * R.y + f * R.z - contact)
    centre.set_vel(N, cross(R.ang_vel_in(N), centre.pos_from(P)))
    stone = RigidBody("stone", centre, R, m, (inertia(R, Ixx, Iyy, Izz, Ixy, Iyz, Ixz), centre))
    loads = [(centre, m * g * Y.z), (R, -s * R.ang_vel_in(N))]
    return kane(kanes(N, q, u, kde, [stone], loads))


def ellipsoid() -> Judge:
    return rattleback("ellipsoid")


def paraboloid() -> Judge:
    return rattleback("paraboloid")


ANGLES = {"q1": "yaw", "q2": "lean", "q3": "spin"}

DISC = """
parameter r = 1 m;
parameter m = 1 kg;
parameter g = 9.81 m/s^2;
gravity {0, 0, -g};
coordinate Length x = 0 m;
coordinate Length y = 0 m;
coordinate yaw = 0.1 rad;
coordinate lean = 0.2 rad;
coordinate spin = 0 rad;
frame Y = world * trans({x, y, 0 m}) * rotz(yaw);
frame L = Y * rotx(lean);
frame R = L * trans({0, 0, r}) * roty(spin);
mass m at R;
inertia diag({1/4, 1/2, 1/4})*m*r^2 on R;
let slip = components(Y, vel_at(R, L));
constraint along: slip[1] = 0 m/s;
constraint across: slip[2] = 0 m/s;
output f1 = multiplier(along);
output f2 = multiplier(across);
experiment(stop = 1 s);
"""

STONE = """
parameter m = 1 kg;
parameter g = 9.81 m/s^2;
parameter s = 1 N.m.s;
parameter Length d = 0.1 m;
parameter Length e = 0.1 m;
parameter Length f = 0.1 m;
parameter Ixx = 3 kg.m^2;
parameter Iyy = 4 kg.m^2;
parameter Izz = 5 kg.m^2;
parameter Ixy = 0.1 kg.m^2;
parameter Iyz = 0.1 kg.m^2;
parameter Ixz = 0.1 kg.m^2;
gravity {0, 0, g};
coordinate Length x = 0 m;
coordinate Length y = 0 m;
coordinate Length z ~ -1 m;
coordinate yaw = 0.1 rad;
coordinate lean = 0.2 rad;
coordinate spin = 0.1 rad;
frame R = world * trans({x, y, z}) * rotz(yaw) * rotx(lean) * roty(spin);
mass m at R * {d, e, f};
inertia {{Ixx, Ixy, Ixz}, {Ixy, Iyy, Iyz}, {Ixz, Iyz, Izz}} on R;
let n = components(R, {0, 0, 1});
let Length contact[3] = place_of_the_contact;
constraint vel_at(R, R * contact) = {0, 0, 0};
dissipation 1/2*s*dot(angvel(R), angvel(R));
experiment(stop = 1 s);
"""

INERTIAS = {"Ixx": 3.0, "Iyy": 4.0, "Izz": 5.0, "Ixy": 0.3, "Iyz": -0.2, "Ixz": 0.4}

SYSTEMS = (
    System(
        name="rolling disc, from its contact",
        source="SymPy test_kane: test_rolling_disc, test_aux; test_linearize: test_linearize_rolling_disc_kane; PyDy rollingdisc",
        compared="accelerations, both forces along the ground",
        text=DISC,
        judge=disc_from_contact,
        stored=True,
        names=ANGLES,
    ),
    System(
        name="rolling disc, place of the contact",
        source="SymPy test_kane5: test_kane_rolling_disc_lu, test_kane_rolling_disc_kdes_callable",
        compared="accelerations",
        text=DISC,
        judge=disc_in_five,
        stored=True,
        names=ANGLES | {"q4": "x", "q5": "y"},
    ),
    System(
        name="rolling disc, all forces of the contact",
        source="SymPy test_kane2: test_aux_dep; PyDy rollingdisc_nonminimal, Kane1985 Ex11.5",
        compared="accelerations, three forces at the contact",
        text="""
parameter r = 1 m;
parameter m = 1 kg;
parameter g = 9.81 m/s^2;
parameter I = 0.25 kg.m^2;
parameter J = 0.5 kg.m^2;
gravity {0, 0, g};
coordinate Length x = 0 m;
coordinate Length y = 0 m;
coordinate Length z ~ -1 m;
coordinate yaw = 0.1 rad;
coordinate lean = 0.2 rad;
coordinate spin = 0 rad;
frame A = world * trans({x, y, z}) * rotz(yaw);
frame B = A * rotx(lean);
frame C = B * roty(spin);
mass m at C;
inertia diag({I, J, I}) on C;
let slip = components(A, vel_at(C, B * {0, 0, r}));
constraint along: slip[1] = 0 m/s;
constraint across: slip[2] = 0 m/s;
constraint ground: z + r*cos(lean) = 0 m;
output Fx = multiplier(along);
output Fy = multiplier(across);
output Fz = multiplier(ground);
experiment(stop = 1 s);
""",
        judge=disc_with_all_forces,
        stored=True,
        names={"q0": "yaw", "q1": "lean", "q2": "spin", "q3": "z"},
    ),
    System(
        name="disc with rolling put into its Lagrangian",
        source="SymPy test_lagrange: test_rolling_disc; test_linearize: test_linearize_rolling_disc_lagrange; PyDy Kane1985 Ex11.12_11.13",
        compared="accelerations",
        text="""
parameter r = 1 m;
parameter m = 1 kg;
parameter g = 9.81 m/s^2;
coordinate yaw = 0.1 rad;
coordinate lean = 0.2 rad;
coordinate spin = 0 rad;
let turning = der(spin) + der(yaw)*sin(lean);
kinetic 1/2*5/4*m*r^2*der(lean)^2 + 1/2*3/2*m*r^2*turning^2 + 1/2*1/4*m*r^2*(der(yaw)*cos(lean))^2;
potential -m*g*r*cos(lean);
experiment(stop = 1 s);
""",
        judge=substituted_lagrangian,
        names=ANGLES,
        remark="This is not a rolling disc: substituting a velocity constraint into the kinetic energy drops the constraint forces. "
        "Agreement is with SymPy's Lagrangian, in which gravity has the wrong sign, as for a hanging disc; the three rows above model the real disc",
    ),
    System(
        name="disc down an incline",
        source="SymPy test_lagrange: test_disc_on_an_incline_plane",
        compared="accelerations, force of the contact",
        text="""
import mech.planar.*;
import mech.couplings.*;
parameter m = 1 kg;
parameter g = 9.81 m/s^2;
parameter R = 1 m;
parameter l = 1 m;
parameter alpha = 30 deg;
gravity {0, -g};
frame slope = world * rot(-alpha);
coordinate Length y = 0 m;
coordinate theta = 0 rad;
frame disc = slope * trans({y, 0 m}) * rot(-theta);
mass m at disc;
inertia 1/2*m*R^2 on disc;
constraint rolling: y = R*theta;
output push = multiplier(rolling);
experiment(stop = 1 s);
""",
        judge=down_an_incline,
    ),
    System(
        name="car on two rolling wheels",
        source="SymPy test_kane2: test_non_central_inertia, test_sub_qdot; PyDy Kane1985 Ex8.12_8.17, Ex11.4",
        compared="accelerations",
        text="""
parameter R = 1 m;
parameter M = 1 kg;
parameter g = 9.81 m/s^2;
parameter Length e = 1 m;
parameter f = 1 m;
parameter theta = 10 deg;
parameter a = 1 m;
parameter b = 1 m;
parameter mA = 1 kg;
parameter mB = 1 kg;
parameter IA = 1 kg.m^2;
parameter J = 1 kg.m^2;
parameter K = 1 kg.m^2;
parameter Force Q[3] = 0;
coordinate Length y = 0 m;
coordinate Length z = 0 m;
coordinate q1 = 0 rad;
coordinate q2 = 0 rad;
coordinate q3 = 0 rad;
frame plane = world * roty(-theta);
frame A = plane * trans({0 m, y, z}) * rotx(q1);
frame B = A * trans({0, 0, b}) * rotz(q2);
frame C = A * trans({0, 0, -b}) * rotz(q3);
mass mA at A * {0, a, 0};
inertia diag({IA, 1 kg.m^2, 1 kg.m^2}) on A;
mass mB at B;
inertia diag({K, K, J}) on B;
mass mB at C;
inertia diag({K, K, J}) on C;
force {-M*g, 0, 0} on A * {0, e, 0};
force Q on A * {-R, f, 0} in A;
let left = components(A, vel_at(B, A * {-R, 0, b}));
let right = components(A, vel_at(C, A * {-R, 0, -b}));
constraint components(A, vel(A))[3] = 0 m/s;
constraint left[2] = 0 m/s;
constraint right[2] = 0 m/s;
experiment(stop = 1 s);
""",
        judge=three_wheeled_car,
        stored=True,
        names={f"Q{n}": f"Q[{n}]" for n in (1, 2, 3)},
    ),
    System(
        name="rattleback, ellipsoid",
        source="PyDy rattleback: ellipsoid_no_slip",
        compared="accelerations of the three angles",
        text="parameter a = 0.2 m;\nparameter b = 0.3 m;\nparameter c = 0.4 m;"
        + STONE.replace(
            "place_of_the_contact", "{a^2*n[1], b^2*n[2], c^2*n[3]}/norm({a*n[1], b*n[2], c*n[3]})"
        ),
        judge=ellipsoid,
        names=ANGLES,
        values=INERTIAS,
        stored=True,
    ),
    System(
        name="rattleback, paraboloid",
        source="PyDy rattleback: paraboloid_no_slip",
        compared="accelerations of the three angles",
        text="parameter a = 0.2 m^-1;\nparameter b = 0.3 m^-1;"
        + STONE.replace(
            "let Length contact[3] = place_of_the_contact;",
            "let Length rx = n[1]/n[3]/(2*a);\nlet Length ry = n[2]/n[3]/(2*b);\n"
            "let Length contact[3] = {rx, ry, 1 m - a*rx^2 - b*ry^2};",
        ),
        judge=paraboloid,
        names=ANGLES,
        values=INERTIAS,
        stored=True,
    ),
)

"""Exercises of Kane and Levinson (Dynamics: Theory and Applications, 1985), which PyDy works out."""

from __future__ import annotations

from typing import Any

from sympy import sqrt, symbols
from sympy.physics.mechanics import Particle, Point, ReferenceFrame, RigidBody, dynamicsymbols, inertia

from foreign.bodies import origin
from foreign.case import Judge, System
from foreign.judges import kane, kanes

T = dynamicsymbols._t


def rates(q: Any, u: Any) -> dict[Any, Any]:
    return dict(zip([s.diff(T) for s in q], u, strict=True))


def plain_kde(q: Any, u: Any) -> list[Any]:
    return [a.diff(T) - b for a, b in zip(q, u, strict=True)]


def in_turning_plane(edge: bool) -> Judge:
    """Two particles on a rod in a plane that turns about its vertical; ``edge``: the second slides along the rod only."""
    q, u = dynamicsymbols("q1:4"), dynamicsymbols("u1:4")
    g, L, m1, m2, omega = symbols("g L m1 m2 omega")
    A, O = origin()
    B = ReferenceFrame("B")
    B.orient(A, "Axis", [0, A.y])
    B.set_ang_vel(A, omega * A.y)
    E = B.orientnew("E", "Axis", [q[2], B.z])
    E.set_ang_vel(B, u[2] * B.z)
    first = O.locatenew("P1", q[0] * B.x + q[1] * B.y)
    first.set_vel(A, u[0] * B.x + u[1] * B.y + omega * B.y.cross(q[0] * B.x))
    second = first.locatenew("P2", L * E.x)
    second.v2pt_theory(first, A, E)
    bodies = [Particle("P1", first, m1), Particle("P2", second, m2)]
    loads = [(first, -m1 * g * B.y), (second, -m2 * g * B.y)]
    kde = plain_kde(q, u)
    if not edge:
        return kane(kanes(A, q, u, kde, bodies, loads))
    within = (u[0] * B.x + u[1] * B.y + u[2] * L * E.y).dot(E.y)
    return kane(kanes(A, q, u[:2], kde, bodies, loads, u_dependent=u[2:], velocity_constraints=[within]))


def free_rod() -> Judge:
    return in_turning_plane(edge=False)


def knife_edge() -> Judge:
    return in_turning_plane(edge=True)


def robot_arm() -> Judge:
    q, u = dynamicsymbols("q0:3"), dynamicsymbols("u1:4")
    LA, LB, LP, g, mA, mB, mC, mD = symbols("LA LB LP g mA mB mC mD")
    p = symbols("p1:4")
    a, b, c = symbols("A1:4"), symbols("B1:4"), symbols("C1:4")
    d = symbols("D11 D22 D33 D12 D23 D31")
    tau = symbols("tau1:4")
    E, O = origin()
    A = E.orientnew("A", "Axis", [q[0], E.x])
    B = A.orientnew("B", "Axis", [q[1], A.y])
    A.set_ang_vel(E, u[0] * A.x)
    B.set_ang_vel(A, u[1] * A.y)
    Ao, P = O.locatenew("Ao", LA * A.z), O.locatenew("P", LP * A.z)
    Ao.v2pt_theory(O, E, A)
    P.v2pt_theory(O, E, A)
    Bo = P.locatenew("Bo", LB * B.z)
    Bo.v2pt_theory(P, E, B)
    Co = Bo.locatenew("Co", q[2] * B.z)
    Do = Co.locatenew("Do", p[0] * B.x + p[1] * B.y + p[2] * B.z)
    for point in (Co, Do):
        point.set_vel(B, u[2] * B.z)
        point.v1pt_theory(Bo, E, B)
        point.set_vel(E, point.vel(E).subs(rates(q, u)))
    bodies = [
        RigidBody("A", Ao, A, mA, (inertia(A, *a), Ao)),
        RigidBody("B", Bo, B, mB, (inertia(B, *b), Bo)),
        RigidBody("C", Co, B, mC, (inertia(B, *c), Co)),
        RigidBody("D", Do, B, mD, (inertia(B, *d), Do)),
    ]
    weights = [(body.masscenter, -body.mass * g * E.x) for body in bodies]
    touching = Co.locatenew("touching", 0 * B.x)
    touching.v2pt_theory(P, E, B)
    loads = [
        *weights,
        (A, tau[0] * A.x - tau[1] * A.y),
        (B, tau[1] * A.y),
        (Co, tau[2] * B.z),
        (touching, -tau[2] * B.z),
    ]
    return kane(kanes(E, q, u, plain_kde(q, u), bodies, loads))


def crank() -> Judge:
    """Crank, connecting rod and piston."""
    q, u = dynamicsymbols("q1 q2"), dynamicsymbols("u1 u2")
    mA, mB, mC, JA, JB, a, away, b, near, alpha, Q = symbols("mA mB mC JA JB a away b near alpha Q")
    N, O = origin()
    A = N.orientnew("A", "Axis", [q[0], N.y])
    B = N.orientnew("B", "Axis", [-q[1], N.y])
    A.set_ang_vel(N, u[0] * N.y)
    B.set_ang_vel(N, -u[1] * N.y)
    Ao, P = O.locatenew("Ao", -away * A.z), O.locatenew("P", a * A.z)
    Bo, R = P.locatenew("Bo", (b - near) * B.z), P.locatenew("R", b * B.z)
    for point, base, frame in ((Ao, O, A), (P, O, A), (Bo, P, B), (R, P, B)):
        point.v2pt_theory(base, N, frame)
    bodies = [
        RigidBody("crank", Ao, A, mA, (inertia(A, 0, JA, 0), Ao)),
        RigidBody("rod", Bo, B, mB, (inertia(B, 0, JB, 0), Bo)),
        Particle("piston", R, mC),
    ]
    loads = [(A, alpha * N.y), (R, Q * N.z)]
    across = R.pos_from(O).dot(N.x)
    more = {
        "q_dependent": q[1:],
        "u_dependent": u[1:],
        "configuration_constraints": [across],
        "velocity_constraints": [across.diff(T).subs(rates(q, u))],
    }
    return kane(kanes(N, q[:1], u[:1], plain_kde(q, u), bodies, loads, **more))


def dragging_car() -> Judge:
    """The car of exercise 8.12 whose third support slides with friction: its normal force comes from a tilt that does not happen."""
    q1, q2, q3, u1, u2, u3, Q1 = dynamicsymbols("q1:4 u1:4 Q1")
    R, M, g, e, f, theta, mu = symbols("R M g e f theta mu")
    a, b, mA, mB, IA, J, K = symbols("a b mA mB IA J K")
    F = ReferenceFrame("F")
    P = F.orientnew("P", "Axis", [-theta, F.y])
    A = P.orientnew("A", "Axis", [q1, P.x])
    A.set_ang_vel(F, u1 * A.x + u3 * A.z)
    D = Point("D")
    D.set_vel(F, u2 * A.y)
    bodies = []
    for name, angle, side in (("B", q2, b), ("C", q3, -b)):
        wheel = ReferenceFrame(name)
        wheel.orient(A, "Axis", [angle, A.z])
        wheel.set_ang_vel(A, (u2 - side * u1) / R * A.z - u3 * A.z)
        centre = D.locatenew(f"{name}*", side * A.z)
        centre.v2pt_theory(D, F, A)
        bodies.append(RigidBody(name, centre, wheel, mB, (inertia(wheel, K, K, J), centre)))
    Ao, S, Q = D.locatenew("A*", a * A.y), D.locatenew("S", e * A.y), D.locatenew("Q", f * A.y - R * A.x)
    for point in (Ao, S, Q):
        point.v2pt_theory(D, F, A)
    bodies.append(RigidBody("A", Ao, A, mA, (inertia(A, IA, 1, 1), Ao)))
    speed = sqrt(u2**2 + f**2 * u1**2)
    friction = -mu * Q1 * (u2 * A.y + f * u1 * A.z) / speed
    loads = [(S, -M * g * F.x), (Q, Q1 * A.x + friction)]
    kde = [q1.diff(T) - u1, q2.diff(T) - (u2 - b * u1) / R, q3.diff(T) - (u2 + b * u1) / R]
    judge = kane(kanes(F, [q1, q2, q3], [u1, u2], kde, bodies, loads, u_auxiliary=[u3]), [Q1])
    normal = judge.reactions["Q1"]
    return Judge(
        q=judge.q,
        u=judge.u,
        kinematics=judge.kinematics,
        mass=judge.mass,
        forcing=judge.forcing.subs(Q1, normal),
        reactions={"Q1": normal},
    )


PLANE = """
parameter g = 9.81 m/s^2;
parameter L = 1 m;
parameter m1 = 1 kg;
parameter m2 = 1 kg;
parameter omega = 1 rad/s;
gravity {0, -g, 0};
coordinate Length q1 = 0 m;
coordinate Length q2 = 0 m;
coordinate q3 = 0.1 rad;
frame B = world * roty(omega*time);
point P1 = B * {q1, q2, 0};
frame E = B * trans({q1, q2, 0 m}) * rotz(q3);
point P2 = E * {L, 0, 0};
mass m1 at P1;
mass m2 at P2;
experiment(stop = 1 s);
"""

SYSTEMS = (
    System(
        name="two particles in a turning plane",
        source="PyDy Kane1985 Ex8.1_8.15, Ex11.1",
        compared="accelerations",
        text=PLANE,
        judge=free_rod,
    ),
    System(
        name="two particles in a turning plane, knife edge",
        source="PyDy Kane1985 Ex8.2_8.16, Ex11.2",
        compared="accelerations",
        text=PLANE + "constraint edge: vel(P2, B)[1]*sin(q3) = vel(P2, B)[2]*cos(q3);\n",
        judge=knife_edge,
    ),
    System(
        name="robot arm with three joints",
        source="PyDy Kane1985 Ex8.20_8.21, Ex11.7_11.8",
        compared="accelerations",
        text="""
import mech.spatial.*;
parameter LA = 1 m;
parameter LB = 1 m;
parameter LP = 1 m;
parameter g = 9.81 m/s^2;
parameter mA = 1 kg;
parameter mB = 1 kg;
parameter mC = 1 kg;
parameter mD = 1 kg;
parameter p[3] = {1, 1, 1} m;
parameter A[3] = {1, 1, 1} kg.m^2;
parameter B[3] = {1, 1, 1} kg.m^2;
parameter C[3] = {1, 1, 1} kg.m^2;
parameter D[6] = {3, 4, 5, 0, 0, 0} kg.m^2 "xx, yy, zz, xy, yz, zx";
parameter tau1 = 0 N.m;
parameter tau2 = 0 N.m;
parameter tau3 = 0 N;
gravity {-g, 0, 0};
Body upper(m = mA, com = {0, 0, LA}, J = diag(A));
Body fore(m = mB, com = {0, 0, LB}, J = diag(B));
Body slide(m = mC, J = diag(C));
Body load(m = mD, com = p, J = {{D[1], D[4], D[6]}, {D[4], D[2], D[5]}, {D[6], D[5], D[3]}});
Revolute shoulder(world -> upper.a, axis = {1, 0, 0});
Revolute elbow(upper.a * trans({0, 0, LP}) -> fore.a, axis = {0, 1, 0});
Prismatic reach(fore.a * trans({0, 0, LB}) -> slide.a, axis = {0, 0, 1});
Weld grip(slide.a -> load.a);
force tau1 on shoulder.angle;
force tau2 on elbow.angle;
force tau3 on reach.position;
experiment(stop = 1 s);
""",
        judge=robot_arm,
        stored=True,
        names={"q0": "shoulder.angle", "q1": "elbow.angle", "q2": "reach.position"}
        | {f"{a}{n}": f"{a}[{n}]" for a in "pABC" for n in (1, 2, 3)}
        | {f"D{a}": f"D[{n}]" for n, a in enumerate(("11", "22", "33", "12", "23", "31"), 1)},
        values={"D11": 3.0, "D22": 4.0, "D33": 5.0},
    ),
    System(
        name="crank, rod and piston",
        source="PyDy Kane1985 Ex11.10",
        compared="accelerations",
        text="""
import mech.planar.*;
parameter mA = 1 kg;
parameter mB = 1 kg;
parameter mC = 1 kg;
parameter JA = 1 kg.m^2;
parameter JB = 1 kg.m^2;
parameter a = 1 m;
parameter away = 0.5 m;
parameter b = 3 m;
parameter near = 1 m;
parameter alpha = 0 N.m;
parameter Q = 0 N;
Body crank(m = mA, J = JA, com = {-away, 0});
Body rod(m = mB, J = JB, com = {b - near, 0});
Particle piston(m = mC);
Revolute main(world -> crank.a, angle ~ 0.5 rad);
frame pin = crank.a * trans({a, 0});
coordinate lean ~ 0.2 rad;
Weld big(pin * rot(-main.angle - lean) -> rod.a);
Weld small(rod.a * trans({b, 0}) -> piston.a);
constraint cylinder: pos(piston.a)[2] = 0 m;
torque alpha on crank.a;
force {Q, 0} on piston.a;
experiment(stop = 1 s);
""",
        judge=crank,
        names={"q1": "main.angle", "q2": "lean"},
        values={"b": 3.0, "near": 1.0, "q1": 0.6, "q2": 0.2},
    ),
    System(
        name="car that drags its third support",
        source="PyDy Kane1985 Ex11.14",
        compared="accelerations, normal force of the support that slides",
        text="""
parameter R = 1 m;
parameter M = 1 kg;
parameter g = 9.81 m/s^2;
parameter Length e = 1 m;
parameter f = 1 m;
parameter theta = 10 deg;
parameter mu = 0.2;
parameter a = 1 m;
parameter b = 1 m;
parameter mA = 1 kg;
parameter mB = 1 kg;
parameter IA = 1 kg.m^2;
parameter J = 1 kg.m^2;
parameter K = 1 kg.m^2;
coordinate Length y = 0 m;
coordinate Length z = 0 m;
coordinate q1 = 0 rad;
coordinate q2 = 0 rad;
coordinate q3 = 0 rad;
coordinate tilt ~ 0 rad;
initial der(q2) = 1 rad/s;
frame plane = world * roty(-theta);
frame A = plane * trans({0 m, y, z}) * rotx(q1) * rotz(tilt);
frame B = A * rotz(q2);
frame C = A * rotz(q3);
mass mA at A * {0, a, 0};
inertia diag({IA, 1 kg.m^2, 1 kg.m^2}) on A;
frame B0 = A * trans({0, 0, b}) * rotz(q2);
frame C0 = A * trans({0, 0, -b}) * rotz(q3);
mass mB at B0;
inertia diag({K, K, J}) on B0;
mass mB at C0;
inertia diag({K, K, J}) on C0;
point Q = A * {-R, f, 0};
force {-M*g, 0, 0} on A * {0, e, 0};
frame heading = plane * trans({0 m, y, z}) * rotx(q1);
let left = components(heading, vel_at(B0, heading * {-R, 0, b}));
let right = components(heading, vel_at(C0, heading * {-R, 0, -b}));
constraint components(heading, vel(A))[3] = 0 m/s;
constraint left[2] = 0 m/s;
constraint right[2] = 0 m/s;
constraint support: local(heading, Q)[1] = -R;
let slip = components(heading, vel(Q));
force -mu*multiplier(support)*{0, slip[2], slip[3]}/sqrt(slip[2]^2 + slip[3]^2) on Q in heading;
output Q1 = multiplier(support);
experiment(stop = 1 s);
""",
        judge=dragging_car,
        stored=True,
        values={"u2": 0.9},
    ),
)

"""Rigid bodies in space and in closed loops."""

from __future__ import annotations

from typing import Any

import numpy as np
from sympy import cos, sin, symbols
from sympy.physics.mechanics import (
    Particle,
    Point,
    ReferenceFrame,
    RigidBody,
    dynamicsymbols,
    inertia,
)

import mechc
from foreign.case import STATES, Evaluated, Judge, Side, System
from foreign.judges import kane, kanes

T = dynamicsymbols._t


def origin() -> tuple[Any, Any]:
    N, O = ReferenceFrame("N"), Point("O")
    O.set_vel(N, 0)
    return N, O


def chaos_pendulum() -> Judge:
    theta, phi, omega, alpha = dynamicsymbols("theta phi omega alpha")
    mA, mB, lA, lB, IA, IBx, IBy, IBz, g = symbols("mA mB lA lB IA IBx IBy IBz g")
    N, O = origin()
    A = N.orientnew("A", "Axis", [theta, N.y])
    B = A.orientnew("B", "Axis", [phi, A.z])
    A.set_ang_vel(N, omega * N.y)
    B.set_ang_vel(A, alpha * A.z)
    rod_centre, plate_centre = O.locatenew("Ao", lA * A.z), O.locatenew("Bo", lB * A.z)
    for point in (rod_centre, plate_centre):
        point.v2pt_theory(O, N, A)
    rod = RigidBody("rod", rod_centre, A, mA, (inertia(A, IA, IA, 0), rod_centre))
    plate = RigidBody("plate", plate_centre, B, mB, (inertia(B, IBx, IBy, IBz), plate_centre))
    loads = [(rod_centre, mA * g * N.z), (plate_centre, mB * g * N.z)]
    kde = [theta.diff(T) - omega, phi.diff(T) - alpha]
    return kane(kanes(N, [theta, phi], [omega, alpha], kde, [rod, plate], loads))


def babyboot() -> Judge:
    qA, qB, uA, uB = dynamicsymbols("qA qB uA uB")
    LA, LB, mA, mB, IAx, IBx, IBy, IBz, g = symbols("LA LB mA mB IAx IBx IBy IBz g")
    N, O = origin()
    A = N.orientnew("A", "Axis", [qA, N.x])
    B = A.orientnew("B", "Axis", [qB, A.z])
    A.set_ang_vel(N, uA * N.x)
    B.set_ang_vel(A, uB * A.z)
    a, b = O.locatenew("Acm", -LA * A.z), O.locatenew("Bcm", -LB * A.z)
    for point in (a, b):
        point.v2pt_theory(O, N, A)
    bodies = [
        RigidBody("A", a, A, mA, (inertia(A, IAx, 0, 0), a)),
        RigidBody("B", b, B, mB, (inertia(B, IBx, IBy, IBz), b)),
    ]
    loads = [(a, -mA * g * N.z), (b, -mB * g * N.z)]
    return kane(kanes(N, [qA, qB], [uA, uB], [qA.diff(T) - uA, qB.diff(T) - uB], bodies, loads))


def astrobee() -> Judge:
    x, q = dynamicsymbols("x:3"), dynamicsymbols("q1:4")
    u, w = dynamicsymbols("v:3"), dynamicsymbols("u1:4")
    F, M = dynamicsymbols("F1:4"), dynamicsymbols("M1:4")
    m, Ix, Iy, Iz = symbols("m Ix Iy Iz")
    N, O = origin()
    B = N.orientnew("B", "Body", q, "XYZ")
    to_speeds = dict(zip([s.diff(T) for s in q], w, strict=True))
    B.set_ang_vel(N, B.ang_vel_in(N).subs(to_speeds))
    C = O.locatenew("C", x[0] * N.x + x[1] * N.y + x[2] * N.z)
    C.set_vel(N, u[0] * N.x + u[1] * N.y + u[2] * N.z)
    body = RigidBody("body", C, B, m, (inertia(B, Ix, Iy, Iz), C))
    loads = [(C, F[0] * N.x + F[1] * N.y + F[2] * N.z), (B, M[0] * B.x + M[1] * B.y + M[2] * B.z)]
    kde = [a.diff(T) - b for a, b in zip([*x, *q], [*u, *w], strict=True)]
    return kane(kanes(N, [*x, *q], [*u, *w], kde, [body], loads))


def sprung_block() -> Judge:
    """Block, compound and simple pendulum; the second speed is that of the mass centre of the compound pendulum."""
    q1, q2, q3, u1, u2, u3, F, M = dynamicsymbols("q1 q2 q3 u1 u2 u3 F M")
    k, c, ma, mb, mc, IB, l, kT, g = symbols("k c ma mb mc IB l kT g")
    N, O = origin()
    B = N.orientnew("B", "Axis", [q2, N.z])
    C = B.orientnew("C", "Axis", [q3, N.z])
    away = 2 * l / 3
    turning = (u2 - u1 * cos(q2)) / away
    B.set_ang_vel(N, turning * N.z)
    C.set_ang_vel(B, u3 * N.z)
    block = O.locatenew("block", q1 * N.x)
    block.set_vel(N, u1 * N.x)
    centre, joint = block.locatenew("centre", -away * B.y), block.locatenew("joint", -l * B.y)
    bob = joint.locatenew("bob", -l * C.y)
    centre.v2pt_theory(block, N, B)
    joint.v2pt_theory(block, N, B)
    bob.v2pt_theory(joint, N, C)
    bodies = [
        Particle("block", block, ma),
        RigidBody("pendulum", centre, B, mb, (inertia(B, 0, 0, IB), centre)),
        Particle("bob", bob, mc),
    ]
    loads = [
        (block, (F - k * q1 - c * u1) * N.x),
        (centre, -mb * g * N.y),
        (bob, -mc * g * N.y),
        (B, (M + kT * q3) * N.z),
        (C, -kT * q3 * N.z),
    ]
    kde = [q1.diff(T) - u1, q2.diff(T) - turning, q3.diff(T) - u3]
    return kane(kanes(N, [q1, q2, q3], [u1, u2, u3], kde, bodies, loads))


def ladder() -> Judge:
    q, u = dynamicsymbols("q u")
    m, l, g, Izz = symbols("m l g Izz")
    N = ReferenceFrame("N")
    L = N.orientnew("L", "Axis", [q, N.z])
    L.set_ang_vel(N, u * N.z)
    A = Point("A")
    A.set_vel(N, l / 2 * u * (sin(q) * N.x + cos(q) * N.y))
    body = RigidBody("ladder", A, L, m, (inertia(L, 0, 0, Izz), A))
    return kane(kanes(N, [q], [u], [q.diff(T) - u], [body], [(A, -m * g * N.y)]))


def scara() -> Judge:
    q1, q2, u1, u2 = dynamicsymbols("q1 q2 u1 u2")
    l1, r1, r2, m1, m2, I1, I2, tau1, tau2 = symbols("l1 r1 r2 m1 m2 I1 I2 tau1 tau2")
    N, O = origin()
    A = N.orientnew("A", "Axis", [q1, N.z])
    B = A.orientnew("B", "Axis", [q2, N.z])
    A.set_ang_vel(N, u1 * N.z)
    B.set_ang_vel(A, u2 * N.z)
    elbow, first = O.locatenew("elbow", l1 * A.x), O.locatenew("first", r1 * A.x)
    second = elbow.locatenew("second", r2 * B.x)
    elbow.v2pt_theory(O, N, A)
    first.v2pt_theory(O, N, A)
    second.v2pt_theory(elbow, N, B)
    bodies = [
        RigidBody("first", first, A, m1, (inertia(A, 0, 0, I1), first)),
        RigidBody("second", second, B, m2, (inertia(B, 0, 0, I2), second)),
    ]
    loads = [(A, tau1 * N.z), (B, tau2 * N.z)]
    return kane(kanes(N, [q1, q2], [u1, u2], [q1.diff(T) - u1, q2.diff(T) - u2], bodies, loads))


def four_bars() -> Judge:
    q, u = dynamicsymbols("q1:4"), dynamicsymbols("u1:4")
    l, rho = symbols("l1:5"), symbols("rho")
    N, O = origin()
    corner, frame, bodies, turned = O, N, [], 0
    loop = l[0] * N.x
    for n in range(3):
        turned += q[n]
        link = frame.orientnew(f"L{n}", "Axis", [q[n], N.z])
        link.set_ang_vel(frame, u[n] * N.z)
        length = l[n + 1]
        centre = corner.locatenew(f"c{n}", length / 2 * link.x)
        end = corner.locatenew(f"e{n}", length * link.x)
        centre.v2pt_theory(corner, N, link)
        end.v2pt_theory(corner, N, link)
        bodies.append(
            RigidBody(
                f"link{n}", centre, link, rho * length, (inertia(link, 0, 0, rho * length**3 / 12), centre)
            )
        )
        corner, frame, loop = end, link, loop + length * link.x
    config = [loop.dot(N.x), loop.dot(N.y)]
    to_speeds = dict(zip([s.diff(T) for s in q], u, strict=True))
    kde = [a.diff(T) - b for a, b in zip(q, u, strict=True)]
    more = {
        "q_dependent": q[1:],
        "u_dependent": u[1:],
        "configuration_constraints": config,
        "velocity_constraints": [e.diff(T).subs(to_speeds) for e in config],
    }
    return kane(kanes(N, q[:1], u[:1], kde, bodies, [], **more))


def conical_pendulum() -> Judge:
    """Three cylinders with bobs; each frame turned about z, then about the x of the one before, with its own angular velocity."""
    alpha, beta = dynamicsymbols("alpha:3"), dynamicsymbols("beta:3")
    omega, delta = dynamicsymbols("omega:3"), dynamicsymbols("delta:3")
    l, mb, ml, Ix, Iy, g = symbols("l mb ml Ix Iy g")
    N, O = origin()
    kde = [a.diff(T) - b for a, b in zip([*alpha, *beta], [*omega, *delta], strict=True)]
    frame, joint, bodies, loads = N, O, [], []
    for n in range(3):
        leaning = frame.orientnew(f"lean{n}", "Axis", [beta[n], frame.x])
        link = leaning.orientnew(f"link{n}", "Axis", [alpha[n], leaning.z])
        leaning.set_ang_vel(frame, delta[n] * frame.x)
        link.set_ang_vel(leaning, omega[n] * leaning.z)
        centre, bob = joint.locatenew(f"c{n}", -l / 2 * link.y), joint.locatenew(f"b{n}", -l * link.y)
        centre.v2pt_theory(joint, N, link)
        bob.v2pt_theory(joint, N, link)
        bodies += [
            RigidBody(f"rod{n}", centre, link, ml, (inertia(link, Ix, Iy, Ix), centre)),
            Particle(f"bob{n}", bob, mb),
        ]
        loads += [(centre, -ml * g * N.y), (bob, -mb * g * N.y)]
        frame, joint = link, bob
    return kane(kanes(N, [*alpha, *beta], [*omega, *delta], kde, bodies, loads))


def free_body() -> Judge:
    """Body axes for both speeds: what Kane's method gives without its kinematics, which SymPy leaves implicit."""
    v, w = dynamicsymbols("v:3"), dynamicsymbols("w:3")
    F, M = dynamicsymbols("F M")
    m, Jx, Jy, Jz, Jxz = symbols("m Jx Jy Jz Jxz")
    N, B, C = ReferenceFrame("N"), ReferenceFrame("B"), Point("C")
    s = dynamicsymbols("s:6")
    B.set_ang_vel(N, w[0] * B.x + w[1] * B.y + w[2] * B.z)
    C.set_vel(N, v[0] * B.x + v[1] * B.y + v[2] * B.z)
    body = RigidBody("body", C, B, m, (inertia(B, Jx, Jy, Jz, 0, 0, -Jxz), C))
    kde = [a.diff(T) - b for a, b in zip(s, [*v, *w], strict=True)]
    return kane(kanes(N, s, [*v, *w], kde, [body], [(C, F * B.z), (B, M * B.z)]))


def body_axes(system: System) -> float:
    """Turn speeds to the world and its accelerations back to the body: v' = R^T a - w x v, and gravity added there."""
    judge, model = Evaluated(free_body(), system.values), mechc.loads(system.text)
    rng = np.random.default_rng(41)
    worst = 0.0
    for _ in range(STATES):
        p = judge.parameters(rng)
        g = rng.uniform(5, 15)
        side = Side(model, system, p | {"g": g})
        f = side.functions
        quaternion = rng.normal(size=4)
        quaternion /= np.linalg.norm(quaternion)
        s, (x, y, z) = quaternion[0], quaternion[1:]
        hat = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        R = np.eye(3) + 2 * s * hat + 2 * hat @ hat
        v, w = rng.uniform(-1, 1, (2, 3))
        _, expected, _ = judge.motion([0.0] * 6, [*v, *w], p)
        there = f.start.copy()
        given = dict(zip([f"der(r[{n}])" for n in (1, 2, 3)], R @ v, strict=True))
        given |= dict(zip([f"R[{n}]" for n in (1, 2, 3, 4)], quaternion, strict=True))
        given |= dict(zip([f"der(R)[{n}]" for n in (1, 2, 3)], w, strict=True))
        there[[side.states.index(k) for k in given]] = list(given.values())
        a = f.accelerations(there, 0.0, side.u)
        found = [*(R.T @ (a[:3] - [0, 0, g]) - np.cross(w, v)), *a[3:]]
        worst = max(worst, float(np.abs(np.subtract(found, expected)).max() / max(1, *np.abs(expected))))
    return worst


SYSTEMS = (
    System(
        name="chaos pendulum",
        source="SymPy test_jointsmethod: test_chaos_pendulum; PyDy chaos_pendulum",
        compared="accelerations",
        text="""
import mech.spatial.*;
parameter mA = 1 kg;
parameter mB = 1 kg;
parameter lA = 1 m;
parameter lB = 1 m;
parameter IA = 1 kg.m^2;
parameter IBx = 1 kg.m^2;
parameter IBy = 1 kg.m^2;
parameter IBz = 1 kg.m^2;
parameter g = 9.81 m/s^2;
gravity {0, 0, g};
Body rod(m = mA, com = {0, 0, lA}, J = diag({IA, IA, 0 kg.m^2}));
Body plate(m = mB, J = diag({IBx, IBy, IBz}));
Revolute hinge(world -> rod.a, axis = {0, 1, 0});
Revolute pin(rod.a * trans({0, 0, lB}) -> plate.a, axis = {0, 0, 1});
experiment(stop = 1 s);
""",
        judge=chaos_pendulum,
        names={"theta": "hinge.angle", "phi": "pin.angle"},
        remark="the motion is chaotic: accelerations can be compared to all digits, motions cannot",
    ),
    System(
        name="babyboot",
        source="PyDy babyboot",
        compared="accelerations",
        text="""
parameter LA = 1 m;
parameter LB = 1 m;
parameter mA = 1 kg;
parameter mB = 1 kg;
parameter IAx = 1 kg.m^2;
parameter IBx = 1 kg.m^2;
parameter IBy = 1 kg.m^2;
parameter IBz = 1 kg.m^2;
parameter g = 9.81 m/s^2;
gravity {0, 0, -g};
coordinate qA = 10 deg;
coordinate qB = 1 deg;
frame A = world * rotx(qA);
frame B = A * trans({0, 0, -LB}) * rotz(qB);
mass mA at A * {0, 0, -LA};
inertia diag({IAx, 0 kg.m^2, 0 kg.m^2}) on A;
mass mB at B;
inertia diag({IBx, IBy, IBz}) on B;
experiment(stop = 1 s);
""",
        judge=babyboot,
    ),
    System(
        name="Astrobee",
        source="PyDy astrobee",
        compared="accelerations",
        text="""
parameter m = 7 kg;
parameter J[3] = {0.1, 0.1, 0.1} kg.m^2;
input Force F[3] = 0;
input Torque M[3] = 0;
coordinate Length x[3] = 0 m;
coordinate Angle q[3] = 0 rad;
frame B = world * trans(x) * rotx(q[1]) * roty(q[2]) * rotz(q[3]);
mass m at B;
inertia diag(J) on B;
force F on B;
torque M on B in B;
experiment(stop = 1 s);
""",
        judge=astrobee,
        names={"Ix": "J[1]", "Iy": "J[2]", "Iz": "J[3]"}
        | {f"x{n}": f"x[{n + 1}]" for n in range(3)}
        | {f"{a}{n}": f"{a}[{n}]" for a in "qFM" for n in (1, 2, 3)},
    ),
    System(
        name="free body, axes of the body",
        source="SymPy test_kane: test_implicit_kinematics",
        compared="rates of the speeds in the axes of the body",
        text="""
parameter m = 1 kg;
parameter Jx = 2 kg.m^2;
parameter Jy = 3 kg.m^2;
parameter Jz = 4 kg.m^2;
parameter Jxz = 0.1 kg.m^2;
parameter g = 9.81 m/s^2;
input Force F = 0;
input Torque M = 0;
gravity {0, 0, g};
coordinate Length r[3] = 0 m;
coordinate Rotation R = rotx(0 rad);
frame B = world * trans(r) * R;
mass m at B;
inertia {{Jx, 0, -Jxz}, {0, Jy, 0}, {-Jxz, 0, Jz}} on B;
force {0, 0, F} on B in B;
torque {0, 0, M} on B in B;
experiment(stop = 1 s);
""",
        values={"Jx": 2.0, "Jy": 3.0, "Jz": 4.0},
        compare=body_axes,
        remark="a quaternion in mechc as in SymPy, where the test is about how long its rates become",
    ),
    System(
        name="block, compound and simple pendulum",
        source="PyDy multidof-holonomic",
        compared="accelerations",
        text="""
import mech.planar.*;
parameter k = 60 N/m;
parameter c = 10 N.s/m;
parameter ma = 1 kg;
parameter mb = 2 kg;
parameter mc = 1 kg;
parameter IB = 2 kg.m^2;
parameter l = 2 m;
parameter kT = 10 N.m/rad;
parameter g = 9.81 m/s^2;
input Force F = 0;
input Torque M = 0;
gravity {0, -g};
Particle block(m = ma);
Body plate(m = mb, J = IB, com = {0, -2/3*l});
Body bob(m = mc, com = {0, -l});
Prismatic rail(world -> block.a);
Revolute upper(block.a -> plate.a);
Revolute lower(plate.a * trans({0, -l}) -> bob.a);
potential 1/2*k*rail.position^2 + 1/2*kT*lower.angle^2;
damping c on rail.position;
force F on rail.position;
torque M on plate.a;
experiment(stop = 1 s);
""",
        judge=sprung_block,
        names={"q1": "rail.position", "q2": "upper.angle", "q3": "lower.angle"},
    ),
    System(
        name="sliding ladder",
        source="PyDy sliding_ladder",
        compared="acceleration",
        text="""
import mech.planar.*;
parameter m = 1 kg;
parameter l = 1 m;
parameter g = 9.81 m/s^2;
parameter Izz = 1 kg.m^2;
gravity {0, -g};
coordinate Length x ~ -0.4 m;
coordinate Length y ~ 0.3 m;
coordinate q = 0.6 rad;
frame ladder = world * trans({x, y}) * rot(-q);
mass m at ladder;
inertia Izz on ladder;
constraint floor: pos(ladder * {l/2, 0})[2] = 0 m;
constraint wall: pos(ladder * {-l/2, 0})[1] + l*cos(q) = 0 m;
experiment(stop = 1 s);
""",
        judge=ladder,
        remark="PyDy writes the ladder in one angle; here in three coordinates with two contacts that hold",
    ),
    System(
        name="SCARA arm",
        source="PyDy scara_arm: Dynamics",
        compared="accelerations",
        text="""
import mech.planar.*;
parameter l1 = 1 m;
parameter r1 = 0.5 m;
parameter r2 = 0.5 m;
parameter m1 = 1 kg;
parameter m2 = 1 kg;
parameter I1 = 0.1 kg.m^2;
parameter I2 = 0.1 kg.m^2;
parameter tau1 = 0 N.m;
parameter tau2 = 0 N.m;
Body upper(m = m1, J = I1, com = {r1, 0});
Body fore(m = m2, J = I2, com = {r2, 0});
Revolute shoulder(world -> upper.a);
Revolute elbow(upper.a * trans({l1, 0}) -> fore.a);
torque tau1 on upper.a;
torque tau2 on fore.a;
experiment(stop = 1 s);
""",
        judge=scara,
        names={"q1": "shoulder.angle", "q2": "elbow.angle"},
        remark="PyDy turns both links with the inertia of the first and lets the torques act from the ground; here each has its own",
    ),
    System(
        name="four-bar linkage",
        source="SymPy test_jointsmethod: test_four_bar_linkage_with_manual_constraints",
        compared="accelerations",
        text="""
import mech.planar.*;
parameter Length l[4] = {0.13, 0.24, 0.21, 0.34} m;
parameter rho = 997 kg/m;
Bar link[3](m = {rho*l[i + 1] for i in 1:3}, l = {l[i + 1] for i in 1:3});
Revolute J1(world * trans({l[1], 0}) -> link[1].a, angle ~ 2.1 rad);
Revolute J2(link[1].b -> link[2].a, angle ~ 0.67 rad);
Revolute J3(link[2].b -> link[3].a, angle ~ 2.5 rad);
Revolute J4(link[3].b -> world);
experiment(stop = 1 s);
""",
        judge=four_bars,
        stored=True,
        names={f"l{n}": f"l[{n}]" for n in range(1, 5)} | {f"q{n}": f"J{n}.angle" for n in range(1, 4)},
        values={"l1": 0.13, "l2": 0.24, "l3": 0.21, "l4": 0.34, "q1": 2.1, "q2": 0.67, "q3": 2.5},
    ),
    System(
        name="three-link conical pendulum",
        source="PyDy three_link_conical_pendulum",
        compared="accelerations",
        text="""
import mech.spatial.*;
parameter l = 10 m;
parameter mb = 5 kg;
parameter ml = 10 kg;
parameter Ix = 84 kg.m^2;
parameter Iy = 2.5 kg.m^2;
parameter g = 9.8 m/s^2;
gravity {0, -g, 0};
coordinate Angle alpha[3] = 10 deg;
coordinate Angle beta[3] = 10 deg;
Body rod[3](m = ml, com = {0, -l/2, 0}, J = diag({Ix, Iy, Ix}));
Weld joint[n in 1:3]((if n == 1 then world else rod[n - 1].a * trans({0, -l, 0})) * rotx(beta[n]) * rotz(alpha[n]) -> rod[n].a);
for n in 1:3 loop
  mass mb at rod[n].a * {0, -l, 0};
end for;
experiment(stop = 1 s);
""",
        judge=conical_pendulum,
        names={f"{a}{n}": f"{a}[{n + 1}]" for a in ("alpha", "beta") for n in range(3)},
        stored=True,
        remark="PyDy sets angular velocities that its angles do not have: rates about the axes of the ground, for links that turn "
        "about axes of the link before. Compared with SymPy on those that follow from the angles",
    ),
)

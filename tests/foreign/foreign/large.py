"""The larger ones of PyDy's examples."""

from __future__ import annotations

from sympy import symbols
from sympy.physics.mechanics import Particle, ReferenceFrame, RigidBody, dynamicsymbols, inertia

from foreign.bodies import origin
from foreign.case import Judge, System
from foreign.judges import kane, kanes
from foreign.kane_levinson import plain_kde, rates

T = dynamicsymbols._t


def four_bars_and_edge() -> Judge:
    """A four-bar linkage of particles with a fifth one that moves along its own rod only."""
    q, u, M = dynamicsymbols("q1:5"), dynamicsymbols("u1:5"), dynamicsymbols("M")
    l, g = symbols("l1:6"), symbols("g")
    m2, m3, m5 = symbols("m2 m3 m5")
    N, P1 = origin()
    A = N.orientnew("A", "Axis", [q[0], N.z])
    B = A.orientnew("B", "Axis", [-q[1], A.z])
    C = B.orientnew("C", "Axis", [-q[2], B.z])
    D = B.orientnew("D", "Axis", [-q[3], B.z])
    A.set_ang_vel(N, u[0] * N.z)
    B.set_ang_vel(A, -u[1] * A.z)
    C.set_ang_vel(B, -u[2] * B.z)
    D.set_ang_vel(B, -u[3] * B.z)
    P2 = P1.locatenew("P2", l[0] * A.x)
    P3 = P2.locatenew("P3", l[1] * B.x)
    P4, P5 = P3.locatenew("P4", l[2] * C.x), P3.locatenew("P5", l[4] * D.x)
    for point, base, frame in ((P2, P1, A), (P3, P2, B), (P4, P3, C), (P5, P3, D)):
        point.v2pt_theory(base, N, frame)
    loop = P4.pos_from(P1) - l[3] * N.x
    config = [loop.dot(N.x), loop.dot(N.y)]
    held = [P5.vel(N).dot(D.y), *(e.diff(T).subs(rates(q, u)) for e in config)]
    bodies = [Particle("P2", P2, m2), Particle("P3", P3, m3), Particle("P5", P5, m5)]
    loads = [*((body.point, -body.mass * g * N.y) for body in bodies), (A, M * N.z)]
    return kane(
        kanes(
            N,
            [q[0], q[3]],
            u[:1],
            plain_kde(q, u),
            bodies,
            loads,
            q_dependent=q[1:3],
            u_dependent=u[1:],
            configuration_constraints=config,
            velocity_constraints=held,
        )
    )


def rocket_car() -> Judge:
    """A car with two axles, the front one steered, four rolling wheels, and a rocket of changing mass after."""
    q, u = dynamicsymbols("q1:9"), dynamicsymbols("u1:9")
    L, l, a, b, r1, r2, M1, M2, I1, I2, J1, J2, m, flow, C = symbols(
        "L l a b r1 r2 M1 M2 I1 I2 J1 J2 m flow C"
    )
    N, O = origin()
    body = N.orientnew("body", "Axis", [q[2], N.z])
    axle = body.orientnew("axle", "Axis", [q[3], body.z])
    body.set_ang_vel(N, u[2] * N.z)
    axle.set_ang_vel(body, u[3] * N.z)
    Q = O.locatenew("Q", q[0] * N.x + q[1] * N.y)
    Q.set_vel(N, u[0] * N.x + u[1] * N.y)
    P = Q.locatenew("P", -L * body.x)
    centre = P.locatenew("centre", l * body.x)
    P.v2pt_theory(Q, N, body)
    centre.v2pt_theory(P, N, body)
    bodies = [
        RigidBody("front", Q, axle, M1, (inertia(axle, 0, 0, I1), Q)),
        RigidBody("rear", centre, body, M2, (inertia(body, 0, 0, I2), centre)),
        Particle("rocket", P, m),
    ]
    held = []
    for n, (base, carrier, side, radius, J) in enumerate(
        ((Q, axle, a, r1, J1), (Q, axle, -a, r1, J1), (P, body, b, r2, J2), (P, body, -b, r2, J2))
    ):
        wheel = ReferenceFrame(f"W{n}")
        wheel.orient(carrier, "Axis", [0, carrier.y])
        wheel.set_ang_vel(carrier, u[4 + n] * carrier.y)
        hub = base.locatenew(f"hub{n}", side * carrier.y)
        hub.v2pt_theory(base, N, carrier)
        ground = hub.locatenew(f"ground{n}", -radius * carrier.z)
        velocity = hub.vel(N) + wheel.ang_vel_in(N).cross(ground.pos_from(hub))
        held += (
            [velocity.dot(carrier.x)]
            if side in (-a, -b)
            else [velocity.dot(e) for e in (carrier.x, carrier.y)]
        )
        bodies.append(RigidBody(f"wheel{n}", hub, wheel, 0, (inertia(carrier, 0, J, 0), hub)))
    loads = [(P, -C * flow * body.x)]
    more = {"u_dependent": [*u[:3], *u[5:]], "velocity_constraints": held}
    return kane(kanes(N, q, u[3:5], plain_kde(q, u), bodies, loads, **more))


def balls_on_rods() -> Judge:
    """Two rods in space with a ball that turns about each, a particle on each ball, and a spring where the balls overlap."""
    q, u = dynamicsymbols("q1:7"), dynamicsymbols("u1:7")
    m, m1, g, r, l, k, I = symbols("m m1 g r l k I")
    N, joint = origin()
    frame, kde, bodies, loads, centres = N, [], [], [], []
    for n in range(2):
        ball = frame.orientnew(f"A{n}", "Body", q[3 * n : 3 * n + 3], "123")
        turning = ball.ang_vel_in(N)
        w = u[3 * n : 3 * n + 3]
        ball.set_ang_vel(N, w[0] * ball.x + w[1] * ball.y + w[2] * ball.z)
        kde += [(turning - ball.ang_vel_in(N)).dot(e) for e in ball]
        centre = joint.locatenew(f"c{n}", l / 2 * ball.y)
        dot, end = centre.locatenew(f"d{n}", r * ball.z), joint.locatenew(f"e{n}", l * ball.y)
        for point in (centre, dot, end):
            point.v2pt_theory(joint, N, ball)
        bodies += [
            RigidBody(f"ball{n}", centre, ball, m, (inertia(ball, I, I, I), centre)),
            Particle(f"dot{n}", dot, m1),
        ]
        loads += [(centre, -m * g * N.y), (dot, -m1 * g * N.y)]
        centres.append(centre)
        frame, joint = ball, end
    apart = centres[1].pos_from(centres[0])
    push = k * (2 * r - apart.magnitude()) * apart.normalize()
    loads += [(centres[1], push), (centres[0], -push)]
    return kane(kanes(N, q, u, kde, bodies, loads))


SYSTEMS = (
    System(
        name="four-bar linkage with a knife edge",
        source="PyDy four_bar_linkage_with_motion_constrained_link",
        compared="accelerations",
        text="""
import mech.planar.*;
parameter Length l[5] = {0.8, 2, 1, 2, 3} m;
parameter g = 9.81 m/s^2;
parameter m2 = 1 kg;
parameter m3 = 1 kg;
parameter m5 = 1 kg;
input Torque M = 0;
gravity {0, -g};
frame A;
frame B;
frame C;
frame D;
Revolute first(world -> A, angle ~ 1.5 rad);
Revolute second(A * trans({l[1], 0}) -> B, angle ~ -1.4 rad);
Revolute third(B * trans({l[2], 0}) -> C, angle ~ -1.5 rad);
Revolute fourth(B * trans({l[2], 0}) -> D, angle ~ -0.5 rad);
mass m2 at A * {l[1], 0};
mass m3 at B * {l[2], 0};
mass m5 at D * {l[5], 0};
constraint pos(C * {l[3], 0}) = {l[4], 0};
constraint edge: components(D, vel(D * {l[5], 0}))[2] = 0 m/s;
torque M on A;
experiment(stop = 1 s);
""",
        judge=four_bars_and_edge,
        names={"q1": "first.angle", "q2": "-second.angle", "q3": "-third.angle", "q4": "-fourth.angle"}
        | {f"l{n}": f"l[{n}]" for n in range(1, 6)},
        stored=True,
        values={
            "l1": 0.8,
            "l2": 2.0,
            "l3": 1.0,
            "l4": 2.0,
            "l5": 3.0,
            "q1": 1.5,
            "q2": 1.4,
            "q3": 1.5,
            "q4": 0.5,
        },
    ),
    System(
        name="rocket car",
        source="PyDy rocket-car (Ge, Cheng 1982)",
        compared="accelerations",
        text="""
parameter L = 2 m;
parameter l = 1 m;
parameter a = 1 m;
parameter b = 1 m;
parameter r1 = 0.3 m;
parameter r2 = 0.4 m;
parameter M1 = 1 kg;
parameter M2 = 1 kg;
parameter I1 = 1 kg.m^2;
parameter I2 = 1 kg.m^2;
parameter J1 = 1 kg.m^2;
parameter J2 = 1 kg.m^2;
parameter m = 1 kg;
parameter flow = -0.1 kg/s;
parameter C = 1 m/s;
coordinate Length x = 0 m;
coordinate Length y = 0 m;
coordinate q3 = 0 rad;
coordinate q4 = 0.1 rad;
coordinate Angle wheel[4] = 0 rad;
frame body = world * trans({x, y, 0 m}) * rotz(q3);
frame axle = body * rotz(q4);
frame P = body * trans({-L, 0, 0});
mass M1 at axle;
inertia diag({0 kg.m^2, 0 kg.m^2, I1}) on axle;
mass M2 at P * {l, 0, 0};
inertia diag({0 kg.m^2, 0 kg.m^2, I2}) on P;
mass m + flow*time at P;
force {-C*flow, 0, 0} on P in P;
frame W1 = axle * trans({0, a, 0}) * roty(wheel[1]);
frame W2 = axle * trans({0, -a, 0}) * roty(wheel[2]);
frame W3 = P * trans({0, b, 0}) * roty(wheel[3]);
frame W4 = P * trans({0, -b, 0}) * roty(wheel[4]);
inertia diag({0 kg.m^2, J1, 0 kg.m^2}) on W1;
inertia diag({0 kg.m^2, J1, 0 kg.m^2}) on W2;
inertia diag({0 kg.m^2, J2, 0 kg.m^2}) on W3;
inertia diag({0 kg.m^2, J2, 0 kg.m^2}) on W4;
let s1 = components(axle, vel_at(W1, axle * {0, a, -r1}));
let s2 = components(axle, vel_at(W2, axle * {0, -a, -r1}));
let s3 = components(P, vel_at(W3, P * {0, b, -r2}));
let s4 = components(P, vel_at(W4, P * {0, -b, -r2}));
constraint {s1[1], s1[2], s2[1], s3[1], s3[2], s4[1]} = {0, 0, 0, 0, 0, 0};
experiment(stop = 1 s);
""",
        judge=rocket_car,
        names={"q1": "x", "q2": "y"} | {f"q{n}": f"wheel[{n - 4}]" for n in range(5, 9)},
        values={"L": 2.0, "flow": -0.1},
        stored=True,
        remark="PyDy writes the mass of the rocket as a function of time without saying which; here it falls evenly",
    ),
    System(
        name="balls on two rods in space",
        source="PyDy 3d-n-body-pendulum, for two bodies that overlap",
        compared="accelerations",
        text="""
parameter m = 1 kg;
parameter m1 = 0.2 kg;
parameter g = 9.8 m/s^2;
parameter r = 1.5 m;
parameter l = 1 m;
parameter k = 1000 N/m;
parameter I = 1 kg.m^2;
gravity {0, -g, 0};
coordinate Angle q[6] = 0.2 rad;
frame A = world * rotx(q[1]) * roty(q[2]) * rotz(q[3]);
frame B = A * trans({0, l, 0}) * rotx(q[4]) * roty(q[5]) * rotz(q[6]);
point a = A * {0, l/2, 0};
point b = B * {0, l/2, 0};
mass m at a;
mass m at b;
inertia diag({I, I, I}) on A;
inertia diag({I, I, I}) on B;
mass m1 at A * {0, l/2, r};
mass m1 at B * {0, l/2, r};
let d = norm(pos(b) - pos(a));
potential if d < 2*r then 1/2*k*(2*r - d)^2 else 0 J;
experiment(stop = 1 s);
""",
        judge=balls_on_rods,
        names={f"q{n}": f"q[{n}]" for n in range(1, 7)},
        values={"r": 1.5, "l": 1.0},
        stored=True,
        remark="a spring that only pushes; the balls' collisions are a matter of runs",
    ),
)

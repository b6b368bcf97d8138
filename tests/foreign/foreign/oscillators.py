"""Masses, springs and dampers, and the pathways of SymPy along which forces act."""

from __future__ import annotations

from sympy import Matrix, Rational, cos, exp, sign, sin, sqrt, symbols
from sympy.physics.mechanics import (
    DuffingSpring,
    Lagrangian,
    LinearDamper,
    LinearPathway,
    LinearSpring,
    ObstacleSetPathway,
    Particle,
    Point,
    ReferenceFrame,
    WrappingCylinder,
    WrappingPathway,
    WrappingSphere,
    dynamicsymbols,
)
from sympy.physics.mechanics.models import multi_mass_spring_damper

from foreign.case import Judge, System
from foreign.judges import kane, kanes, lagrange

T = dynamicsymbols._t


def one_mass() -> Judge:
    q, u = dynamicsymbols("q u")
    m, c, k = symbols("m c k")
    F = dynamicsymbols("F")
    N, O = ReferenceFrame("N"), Point("O")
    O.set_vel(N, 0)
    P = O.locatenew("P", q * N.x)
    P.set_vel(N, u * N.x)
    path = LinearPathway(O, P)
    loads = [(P, F * N.x), *LinearSpring(k, path).to_loads(), *LinearDamper(c, path).to_loads()]
    return kane(kanes(N, [q], [u], [q.diff(T) - u], [Particle("mass", P, m)], loads))


def two_masses() -> Judge:
    q1, q2, u1, u2 = dynamicsymbols("q1 q2 u1 u2")
    m, c1, c2, k1, k2 = symbols("m c1 c2 k1 k2")
    N, P1, P2 = ReferenceFrame("N"), Point("P1"), Point("P2")
    P1.set_vel(N, u1 * N.x)
    P2.set_vel(N, (u1 + u2) * N.x)
    between = k2 * q2 + c2 * u2
    loads = [(P1, (between - k1 * q1 - c1 * u1) * N.x), (P2, -between * N.x)]
    bodies = [Particle("first", P1, m), Particle("second", P2, m)]
    kde = [q1.diff(T) / 2 - u1 / 2, 2 * q2.diff(T) - 2 * u2]
    return kane(kanes(N, [q1, q2], [u1, u2], kde, bodies, loads))


def three_hanging() -> Judge:
    return kane(multi_mass_spring_damper(3, apply_gravity=True, apply_external_forces=True))


def two_in_series() -> Judge:
    q1, q2 = dynamicsymbols("q1 q2")
    m, k, nu = symbols("m k nu")
    N = ReferenceFrame("N")
    P1, P2 = Point("P1"), Point("P2")
    P1.set_vel(N, q1.diff(T) * N.x)
    P2.set_vel(N, q2.diff(T) * N.x)
    first, second = Particle("first", P1, m), Particle("second", P2, m)
    first.potential_energy, second.potential_energy = k * q1**2 / 2, k * (q1 - q2) ** 2 / 2
    drag = [(P1, -nu * q1.diff(T) * N.x), (P2, -nu * q2.diff(T) * N.x)]
    return lagrange(Lagrangian(N, first, second), [q1, q2], forcelist=drag, frame=N)


def pair_in_space() -> Judge:
    """Two particles in space with a hardening spring and a damper along the line between them."""
    x, u = dynamicsymbols("x1:7"), dynamicsymbols("u1:7")
    m1, m2, k, h, c, l0 = symbols("m1 m2 k h c l0")
    N, O = ReferenceFrame("N"), Point("O")
    O.set_vel(N, 0)
    points = []
    for n in (0, 3):
        P = O.locatenew(f"P{n}", x[n] * N.x + x[n + 1] * N.y + x[n + 2] * N.z)
        P.set_vel(N, u[n] * N.x + u[n + 1] * N.y + u[n + 2] * N.z)
        points.append(P)
    path = LinearPathway(*points)
    loads = [*DuffingSpring(k, h, path, l0).to_loads(), *LinearDamper(c, path).to_loads()]
    kde = [a.diff(T) - b for a, b in zip(x, u, strict=True)]
    loads = [(f.point, f.force.subs(dict(zip([a.diff(T) for a in x], u, strict=True)))) for f in loads]
    bodies = [Particle("first", points[0], m1), Particle("second", points[1], m2)]
    return kane(kanes(N, x, u, kde, bodies, loads))


def cable_over_corners() -> Judge:
    """A particle pulled by an elastic cable that passes two corners on its way to the wall."""
    x, y, u, v = dynamicsymbols("x y u v")
    m, k, l0 = symbols("m k l0")
    N, O = ReferenceFrame("N"), Point("O")
    O.set_vel(N, 0)
    P = O.locatenew("P", x * N.x + y * N.y)
    P.set_vel(N, u * N.x + v * N.y)
    corners = [O.locatenew("A", 2 * N.x + 3 * N.y), O.locatenew("B", 4 * N.x + Rational(5, 2) * N.y)]
    wall = O.locatenew("W", 5 * N.x)
    for point in (*corners, wall):
        point.set_vel(N, 0)
    path = ObstacleSetPathway(P, *corners, wall)
    spring = [(f.point, f.force) for f in LinearSpring(k, path, l0).to_loads()]
    kde = [x.diff(T) - u, y.diff(T) - v]
    return kane(kanes(N, [x, y], [u, v], kde, [Particle("bead", P, m)], spring))


def wrapped() -> Judge:
    """A bead on a cylinder, pulled by a string that lies on the cylinder from the bead to a fixed place."""
    q, u = dynamicsymbols("q u")
    m, r, F = symbols("m r F")
    N, O = ReferenceFrame("N"), Point("O")
    O.set_vel(N, 0)
    start = O.locatenew("start", r * N.x)
    start.set_vel(N, 0)
    bead = O.locatenew("bead", r * cos(q) * N.x + r * sin(q) * N.y)
    bead.set_vel(N, r * u * (cos(q) * N.y - sin(q) * N.x))
    path = WrappingPathway(start, bead, WrappingCylinder(r, O, N.z))
    loads = [(f.point, f.force) for f in path.to_loads(F)]
    return kane(kanes(N, [q], [u], [q.diff(T) - u], [Particle("bead", bead, m)], loads))


def wrapped_on_sphere() -> Judge:
    """A bead on a sphere at its longitude and latitude, pulled along the shortest way on the sphere to a fixed place."""
    a, b, u, v = dynamicsymbols("a b u v")
    m, r, F = symbols("m r F")
    N, O = ReferenceFrame("N"), Point("O")
    O.set_vel(N, 0)
    start = O.locatenew("start", r * N.x)
    start.set_vel(N, 0)
    place = r * cos(b) * cos(a) * N.x + r * cos(b) * sin(a) * N.y + r * sin(b) * N.z
    bead = O.locatenew("bead", place)
    bead.set_vel(N, place.dt(N).subs({a.diff(T): u, b.diff(T): v}))
    path = WrappingPathway(start, bead, WrappingSphere(r, O))
    load = [(f.point, f.force) for f in path.to_loads(F)]
    kde = [a.diff(T) - u, b.diff(T) - v]
    return kane(kanes(N, [a, b], [u, v], kde, [Particle("bead", bead, m)], load))


def stribeck() -> Judge:
    """A block that slides with SymPy's kinetic friction: Coulomb, Stribeck and viscous shares."""
    q, u = dynamicsymbols("q u")
    m, g, mu_k, mu_s, v_s, sigma, F = symbols("m g mu_k mu_s v_s sigma F")
    N, O = ReferenceFrame("N"), Point("O")
    P = O.locatenew("P", q * N.x)
    P.set_vel(N, u * N.x)
    normal = m * g
    dry = mu_k * normal + (mu_s - mu_k) * normal * exp(-((u / v_s) ** 2))
    load = [(P, (F - dry * sign(u) - sigma * u) * N.x)]
    return kane(kanes(N, [q], [u], [q.diff(T) - u], [Particle("block", P, m)], load))


def box_on_ground() -> Judge:
    """A box that is pushed over ground with friction; the auxiliary speed gives the normal force."""
    q, u, up, N, F = dynamicsymbols("q u up N F")
    m, g, mu = symbols("m g mu")
    frame, P = ReferenceFrame("frame"), Point("P")
    P.set_vel(frame, u * frame.x + up * frame.y)
    loads = [(P, -m * g * frame.y), (P, N * frame.y), (P, (F - mu * m * g) * frame.x)]
    method = kanes(frame, [q], [u], [q.diff(T) - u], [Particle("box", P, m)], loads, u_auxiliary=[up])
    return kane(method, [N])


def accelerated_frame() -> Judge:
    """One mass written out, as the plain matrices of SymbolicSystem: a pendulum in x and y with its multiplier."""
    x, y, u, v, lam = dynamicsymbols("x y u v lambda")
    m, l, g = symbols("m l g")
    mass = Matrix([[1, 0, -x / m], [0, 1, -y / m], [x, y, 0]])
    forcing = Matrix([0, -g, -(u**2) - v**2])
    return Judge(
        q=[x, y],
        u=[u, v],
        kinematics=[u, v],
        mass=mass,
        forcing=forcing,
        config=[sqrt(x**2 + y**2) - l],
        velocity=[x * u + y * v],
        multipliers=[lam],
        reactions={"push": lam * l},
    )


SYSTEMS = (
    System(
        name="mass, spring, damper and force",
        source="SymPy test_kane: test_one_dof, test_input_format; test_actuator: TestForcedMassSpringDamperModel; "
        "PyDy mass-spring-damper",
        compared="acceleration",
        text="""
parameter m = 1 kg;
parameter c = 1 N.s/m;
parameter k = 1 N/m;
input Force F = 0;
coordinate Length x = 1 m;
kinetic 1/2*m*der(x)^2;
potential 1/2*k*x^2;
damping c on x;
force F on x;
experiment(stop = 1 s);
""",
        judge=one_mass,
        names={"q": "x"},
        values={"q": 0.7},
        remark="SymPy's path has the length |q|, so that its spring and damper act along sign(q)",
    ),
    System(
        name="two masses, relative coordinate",
        source="SymPy test_kane: test_two_dof, test_input_format; test_jointsmethod: test_two_dof_joints",
        compared="accelerations",
        text="""
import mech.planar.*;
parameter m = 1 kg;
parameter c1 = 1 N.s/m;
parameter c2 = 1 N.s/m;
parameter k1 = 1 N/m;
parameter k2 = 1 N/m;
Particle first(m = m);
Particle second(m = m);
Prismatic rail(world -> first.a);
Prismatic coupling(first.a -> second.a);
potential 1/2*k1*rail.position^2 + 1/2*k2*coupling.position^2;
damping c1 on rail.position;
damping c2 on coupling.position;
experiment(stop = 1 s);
""",
        judge=two_masses,
        names={"q1": "rail.position", "q2": "coupling.position"},
    ),
    System(
        name="three hanging masses",
        source="SymPy test_models: test_multi_mass_spring_damper_inputs, _higher_order; PyDy models.multi_mass_spring_damper",
        compared="accelerations",
        text="""
parameter Mass m[3] = 1 kg;
parameter Stiffness k[3] = 1 N/m;
parameter c[3] = {1, 1, 1} N.s/m;
parameter g = 9.81 m/s^2;
input Force F[3] = 0;
coordinate Length s[3] = 0 m "of each mass below the one above it";
let Length x[3] = {sum(s[j] for j in 1:i) for i in 1:3};
kinetic sum(1/2*m[i]*der(x[i])^2 for i in 1:3);
potential sum(1/2*k[i]*s[i]^2 - m[i]*g*x[i] for i in 1:3);
for i in 1:3 loop
  damping c[i] on s[i];
  force F[i] on x[i];
end for;
experiment(stop = 1 s);
""",
        judge=three_hanging,
        names={
            f"{a}{n}": f"{b}[{n + 1}]"
            for n in range(3)
            for a, b in (("m", "m"), ("k", "k"), ("c", "c"), ("f", "F"), ("x", "s"))
        },
    ),
    System(
        name="two springs in series with drag",
        source="SymPy test_lagrange2: test_lagrange_2forces",
        compared="accelerations",
        text="""
parameter m = 1 kg;
parameter k = 1 N/m;
parameter nu = 1 N.s/m;
coordinate Length q1 = 0 m;
coordinate Length q2 = 0 m;
kinetic 1/2*m*(der(q1)^2 + der(q2)^2);
potential 1/2*k*q1^2 + 1/2*k*(q1 - q2)^2;
force -nu*der(q1) on q1;
force -nu*der(q2) on q2;
experiment(stop = 1 s);
""",
        judge=two_in_series,
    ),
    System(
        name="spring and damper between two particles",
        source="SymPy test_pathway: TestLinearPathway; test_actuator: TestLinearSpring, TestLinearDamper, TestDuffingSpring",
        compared="accelerations",
        text="""
parameter m1 = 1 kg;
parameter m2 = 1 kg;
parameter k = 1 N/m;
parameter h = 1 N/m^3;
parameter c = 1 N.s/m;
parameter l0 = 1 m;
coordinate Length x[6] = {0, 0, 0, 1, 2, 3} m;
point P1 = world * {x[1], x[2], x[3]};
point P2 = world * {x[4], x[5], x[6]};
mass m1 at P1;
mass m2 at P2;
let l = norm(pos(P2) - pos(P1));
potential 1/2*k*(l - l0)^2 + 1/4*h*(l - l0)^4;
damping c on l;
experiment(stop = 1 s);
""",
        judge=pair_in_space,
        names={f"x{n}": f"x[{n}]" for n in range(1, 7)},
    ),
    System(
        name="cable over two corners",
        source="SymPy test_pathway: TestObstacleSetPathway",
        compared="accelerations",
        text="""
parameter m = 1 kg;
parameter k = 1 N/m;
parameter l0 = 1 m;
coordinate Length x = 0 m;
coordinate Length y = 0 m;
mass m at world * {x, y};
let Length A[2] = {2, 3} m;
let Length B[2] = {4, 2.5} m;
let Length W[2] = {5, 0} m;
let l = norm(A - {x, y}) + norm(B - A) + norm(W - B);
potential 1/2*k*(l - l0)^2;
experiment(stop = 1 s);
""",
        judge=cable_over_corners,
    ),
    System(
        name="string around a cylinder",
        source="SymPy test_pathway: TestWrappingPathway (2D on a cylinder)",
        compared="acceleration",
        text="""
parameter m = 1 kg;
parameter r = 1 m;
parameter F = 1 N;
coordinate q = 0.5 rad;
mass m at world * {r*cos(q), r*sin(q)};
force -F on r*q;
experiment(stop = 1 s);
""",
        judge=wrapped,
        values={"q": 0.6},
    ),
    System(
        name="string around a sphere",
        source="SymPy test_pathway: TestWrappingPathway (on a sphere)",
        compared="accelerations",
        text="""
parameter m = 1 kg;
parameter r = 1 m;
parameter F = 1 N;
coordinate a = 0.5 rad;
coordinate b = 0.3 rad;
mass m at world * {r*cos(b)*cos(a), r*cos(b)*sin(a), r*sin(b)};
force -F on r*acos(cos(b)*cos(a));
experiment(stop = 1 s);
""",
        judge=wrapped_on_sphere,
    ),
    System(
        name="block with Stribeck's friction",
        source="SymPy test_actuator: TestCoulombKineticFriction",
        compared="acceleration while it slides",
        text="""
parameter m = 1 kg;
parameter g = 9.81 m/s^2;
parameter mu_k = 0.3;
parameter mu_s = 0.5;
parameter v_s = 1 m/s;
parameter sigma = 1 N.s/m;
parameter F = 1 N;
coordinate Length q = 0 m;
initial der(q) = 1 m/s;
kinetic 1/2*m*der(q)^2;
friction (mu_k + (mu_s - mu_k)*exp(-(der(q)/v_s)^2))*m*g on q;
damping sigma on q;
force F on q;
experiment(stop = 1 s);
""",
        judge=stribeck,
        values={"u": 0.8},
        remark="most of mechc's time is that of the kernel, which friction needs and which is compiled once for all models",
    ),
    System(
        name="box on ground with friction",
        source="SymPy test_system_class: TestSystemExamples.test_box_on_ground",
        compared="acceleration, normal force",
        text="""
parameter m = 1 kg;
parameter g = 9.81 m/s^2;
parameter mu = 0.3;
input Force F = 0;
gravity {0, -g};
coordinate Length q = 0 m;
coordinate Length height ~ 0 m;
mass m at world * {q, height};
constraint ground: height = 0 m;
force F - mu*multiplier(ground) on q;
output N = multiplier(ground);
experiment(stop = 1 s);
""",
        judge=box_on_ground,
    ),
    System(
        name="pendulum in x and y, matrices by hand",
        source="SymPy test_system: test_form_1 to 3",
        compared="accelerations, force along the string",
        text="""
parameter m = 1 kg;
parameter l = 1 m;
parameter g = 9.81 m/s^2;
coordinate Length x ~ 0.6 m;
coordinate Length y ~ -0.8 m;
kinetic 1/2*m*(der(x)^2 + der(y)^2);
potential m*g*y;
constraint string: sqrt(x^2 + y^2) = l;
output push = multiplier(string);
experiment(stop = 1 s);
""",
        judge=accelerated_frame,
        remark="SymPy only stores the matrices that are given to it; with the sign of gravity and the row of the constraint as in "
        "Newton's equations",
    ),
)

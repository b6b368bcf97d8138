"""Pendulums: of one mass and of several, on carts, in space, and in more coordinates than they need."""

from __future__ import annotations

from sympy import atan, cos, sin, sqrt, symbols
from sympy.physics.mechanics import (
    Lagrangian,
    Particle,
    Point,
    ReferenceFrame,
    RigidBody,
    dynamicsymbols,
    inertia,
)
from sympy.physics.mechanics.models import n_link_pendulum_on_cart

from foreign.case import Judge, System
from foreign.judges import kane, kanes, lagrange

T = dynamicsymbols._t


def simple() -> Judge:
    q, u = dynamicsymbols("q u")
    m, l, g = symbols("m l g")
    N, P = ReferenceFrame("N"), Point("P")
    P.set_vel(N, -l * u * sin(q) * N.x + l * u * cos(q) * N.y)
    return kane(kanes(N, [q], [u], [q.diff(T) - u], [Particle("bob", P, m)], [(P, m * g * N.x)]))


def in_two_coordinates() -> Judge:
    x, y = dynamicsymbols("x y")
    m, l, g = symbols("m l g")
    N, P = ReferenceFrame("N"), Point("P")
    P.set_vel(N, x.diff(T) * N.x + y.diff(T) * N.y)
    length = x**2 + y**2 - l**2
    lam = dynamicsymbols("lam1")
    return lagrange(
        Lagrangian(N, Particle("bob", P, m)),
        [x, y],
        config=[length],
        reactions={"tension": -2 * lam * l},
        forcelist=[(P, m * g * N.x)],
        frame=N,
    )


def in_two_coordinates_by_kane() -> Judge:
    """The speed of the first coordinate depends on that of the second; the velocity constraint is along the string."""
    x, y, u, v = dynamicsymbols("x y u v")
    m, l, g = symbols("m l g")
    N = ReferenceFrame("N")
    A = N.orientnew("A", "Axis", [atan(y / x), N.z])
    P = Point("P")
    P.set_vel(N, u * N.x + v * N.y)
    return kane(
        kanes(
            N,
            [y],
            [v],
            [x.diff(T) - u, y.diff(T) - v],
            [Particle("bob", P, m)],
            [(P, m * g * N.x)],
            q_dependent=[x],
            u_dependent=[u],
            configuration_constraints=[sqrt(x**2 + y**2) - l],
            velocity_constraints=[P.vel(N).dot(A.x)],
        )
    )


def double_absolute() -> Judge:
    q1, q2 = dynamicsymbols("q1 q2")
    l, m, g = symbols("l m g")
    N, O = ReferenceFrame("N"), Point("O")
    O.set_vel(N, 0)
    A, B = N.orientnew("A", "Axis", [q1, N.z]), N.orientnew("B", "Axis", [q2, N.z])
    P = O.locatenew("P", l * A.x)
    R = P.locatenew("R", l * B.x)
    P.v2pt_theory(O, N, A)
    R.v2pt_theory(P, N, B)
    bobs = Particle("first", P, m), Particle("second", R, m)
    for bob in bobs:
        bob.potential_energy = -m * g * bob.point.pos_from(O).dot(N.x)
    return lagrange(Lagrangian(N, *bobs), [q1, q2])


def double_with_spring(cubic: bool) -> Judge:
    """A torsional spring and damper between two rods without gravity; rates stand in the torque, speeds are sums of rates."""
    q1, q2, u1, u2 = dynamicsymbols("q1 q2 u1 u2")
    l, m, sigma, delta = symbols("l m sigma delta")
    N, O = ReferenceFrame("N"), Point("O")
    O.set_vel(N, 0)
    A = N.orientnew("A", "Axis", [q1, N.z])
    B = A.orientnew("B", "Axis", [q2, N.z])
    P = O.locatenew("P", l * A.x)
    Q = P.locatenew("Q", l * B.x)
    P.v2pt_theory(O, N, A)
    Q.v2pt_theory(P, N, B)
    torque = (sigma * q2 + delta * q2.diff(T) ** (3 if cubic else 1)) * N.z
    kde = [u1 - q1.diff(T), u2 - q1.diff(T) - q2.diff(T)]
    bobs = [Particle("first", P, m), Particle("second", Q, m)]
    return kane(kanes(N, [q1, q2], [u1, u2], kde, bobs, [(A, torque), (B, -torque)]))


def double_cubic() -> Judge:
    return double_with_spring(cubic=True)


def double_linear() -> Judge:
    return double_with_spring(cubic=False)


def relative_double() -> Judge:
    q1, q2, u1, u2 = dynamicsymbols("q1 q2 u1 u2")
    m, l, g = symbols("m l g")
    N, O = ReferenceFrame("N"), Point("O")
    O.set_vel(N, 0)
    A = N.orientnew("A", "Axis", [q1, N.z])
    B = A.orientnew("B", "Axis", [q2, N.z])
    A.set_ang_vel(N, u1 * N.z)
    B.set_ang_vel(A, u2 * N.z)
    P = O.locatenew("P", l * A.x)
    R = P.locatenew("R", l * B.x)
    P.v2pt_theory(O, N, A)
    R.v2pt_theory(P, N, B)
    bobs = [Particle("first", P, m), Particle("second", R, m)]
    loads = [(point, m * g * N.x) for point in (P, R)]
    return kane(kanes(N, [q1, q2], [u1, u2], [q1.diff(T) - u1, q2.diff(T) - u2], bobs, loads))


def on_cart(n: int) -> Judge:
    return kane(n_link_pendulum_on_cart(n, cart_force=True, joint_torques=True))


def four_on_cart() -> Judge:
    return on_cart(4)


def three_on_cart() -> Judge:
    return on_cart(3)


def inertia_about_hinge() -> Judge:
    q1, q2, u1, u2, F = dynamicsymbols("q1 q2 u1 u2 F")
    g, k, ls, a, mA, mC, Iz = symbols("g k ls a mA mC Iz")
    N, O = ReferenceFrame("N"), Point("O")
    O.set_vel(N, 0)
    A = N.orientnew("A", "Axis", [-q2, N.z])
    A.set_ang_vel(N, -u2 * N.z)
    C = O.locatenew("C", q1 * N.x)
    Ao = C.locatenew("Ao", a * A.y)
    C.set_vel(N, u1 * N.x)
    Ao.v2pt_theory(C, N, A)
    bodies = [Particle("cart", C, mC), RigidBody("pole", Ao, A, mA, (inertia(A, 0, 0, Iz), C))]
    loads = [(Ao, -g * mA * N.y), (C, (F - k * (q1 - ls)) * N.x)]
    return kane(kanes(N, [q1, q2], [u1, u2], [q1.diff(T) - u1, q2.diff(T) - u2], bodies, loads))


def spring_on_cart(held: bool) -> Judge:
    """A cart with a pendulum and a torque k q between them; ``held`` keeps the bob above one place of the rail."""
    qc, qp, uc, up, F = dynamicsymbols("qc qp uc up F")
    g, l, mc, mp, k = symbols("g l mc mp k")
    N, O = ReferenceFrame("N"), Point("O")
    O.set_vel(N, 0)
    A = N.orientnew("A", "Axis", [qp, N.z])
    A.set_ang_vel(N, up * N.z)
    C = O.locatenew("C", qc * N.x)
    C.set_vel(N, uc * N.x)
    B = C.locatenew("B", -l * A.y)
    B.v2pt_theory(C, N, A)
    bodies = [Particle("cart", C, mc), Particle("bob", B, mp)]
    loads = [(C, F * N.x), (B, -mp * g * N.y), (A, k * qp * N.z)]
    kde = [qc.diff(T) - uc, qp.diff(T) - up]
    if not held:
        return kane(kanes(N, [qc, qp], [uc, up], kde, bodies, loads))
    along = qc + l * sin(qp)
    more = {
        "q_dependent": [qc],
        "u_dependent": [uc],
        "configuration_constraints": [along],
        "velocity_constraints": [uc + l * up * cos(qp)],
    }
    return kane(kanes(N, [qp], [up], [kde[1], kde[0]], bodies, loads, **more))


def free_on_cart() -> Judge:
    return spring_on_cart(held=False)


def held_on_cart() -> Judge:
    return spring_on_cart(held=True)


CART = """
parameter g = 9.81 m/s^2;
parameter l = 1 m;
parameter mc = 1 kg;
parameter mp = 1 kg;
parameter k = 1 N.m/rad;
input Force F = 0;
gravity {0, -g};
import mech.planar.*;
Particle cart(m = mc);
Prismatic rail(world -> cart.a, position ~ 0.5 m);
frame rod;
Revolute pin(cart.a -> rod, angle ~ -0.3 rad);
mass mp at rod * {0, -l};
force F on rail.position;
torque k*pin.angle on rod from cart.a;
experiment(stop = 1 s);
"""

DOUBLE = """
import mech.planar.*;
parameter m = 1 kg;
parameter l = 1 m;
parameter sigma = 1 N.m/rad;
DAMPER
frame A;
frame B;
Revolute shoulder(world -> A);
Revolute elbow(A * trans({l, 0}) -> B);
mass m at A * {l, 0};
mass m at B * {l, 0};
potential 1/2*sigma*elbow.angle^2;
experiment(stop = 1 s);
"""

DOUBLE_NAMES = {"q1": "shoulder.angle", "q2": "elbow.angle"}

STRING = """
parameter m = 1 kg;
parameter l = 1 m;
parameter g = 9.81 m/s^2;
coordinate Length x ~ 0.8 m;
coordinate Length y ~ 0.6 m;
kinetic 1/2*m*(der(x)^2 + der(y)^2);
potential -m*g*x;
constraint string: l = sqrt(x^2 + y^2);
output tension = multiplier(string);
experiment(stop = 1 s);
"""

ON_CART = """
structural parameter Integer n = N;
parameter Mass m[n + 1] = 1 kg "of the cart, then of the bobs";
parameter Length l[n] = 1 m;
parameter g = 9.81 m/s^2;
input Force F = 0;
input Torque M[n] = 0 "of each link from the one before";
coordinate Length x = 0 m;
coordinate Angle q[n] = 0.3 rad "counter-clockwise from upright";
kinetic 1/2*m[1]*der(x)^2;
for i in 1:n loop
  mass m[i + 1] at world * {x - sum(l[j]*sin(q[j]) for j in 1:i), sum(l[j]*cos(q[j]) for j in 1:i)};
end for;
gravity {0, -g};
force F on x;
force M[1] on q[1];
for i in 2:n loop
  force M[i] on q[i] - q[i - 1];
end for;
experiment(stop = 1 s);
"""


def on_cart_names(n: int) -> dict[str, str]:
    names = {"q0": "x", "m0": "m[1]"}
    for i in range(n):
        names |= {f"m{i + 1}": f"m[{i + 2}]", f"l{i}": f"l[{i + 1}]"}
        names |= {f"q{i + 1}": f"q[{i + 1}]", f"T{i + 1}": f"M[{i + 1}]"}
    return names


SYSTEMS = (
    System(
        name="simple pendulum",
        source="SymPy test_kane: test_pend; test_lagrange: test_simp_pen; test_jointsmethod: test_simple_pedulum; "
        "PyDy simple_pendulum",
        compared="acceleration",
        text="""
parameter m = 1 kg;
parameter l = 1 m;
parameter g = 9.81 m/s^2;
coordinate theta = 30 deg;
kinetic 1/2*m*l^2*der(theta)^2;
potential -m*g*l*cos(theta);
experiment(stop = 1 s);
""",
        judge=simple,
        names={"q": "theta"},
    ),
    System(
        name="pendulum in x and y, Lagrange",
        source="SymPy test_lagrange: test_nonminimal_pendulum",
        compared="accelerations, tension",
        text=STRING,
        judge=in_two_coordinates,
    ),
    System(
        name="pendulum in x and y, Kane",
        source="SymPy test_linearize: test_linearize_pendulum_kane_nonminimal",
        compared="accelerations",
        text=STRING,
        judge=in_two_coordinates_by_kane,
        values={"x": 0.9},
    ),
    System(
        name="double pendulum, absolute angles",
        source="SymPy test_lagrange: test_dub_pen; PyDy double_pendulum",
        compared="accelerations",
        text="""
parameter m = 1 kg;
parameter l = 1 m;
parameter g = 9.81 m/s^2;
gravity {g, 0};
coordinate q1 = 10 deg;
coordinate q2 = 20 deg;
point P = world * rot(q1) * {l, 0};
mass m at P;
mass m at world * (pos(P) + l*{cos(q2), sin(q2)});
experiment(stop = 1 s);
""",
        judge=double_absolute,
    ),
    System(
        name="double pendulum, joints",
        source="SymPy test_jointsmethod: test_complete_simple_double_pendulum",
        compared="accelerations",
        text="""
import mech.planar.*;
parameter m = 1 kg;
parameter l = 1 m;
parameter g = 9.81 m/s^2;
gravity {g, 0};
Body P(m = m, com = {l, 0});
Body R(m = m, com = {l, 0});
Revolute J1(world -> P.a);
Revolute J2(P.a * trans({l, 0}) -> R.a);
experiment(stop = 1 s);
""",
        judge=relative_double,
        names={"q1": "J1.angle", "q2": "J2.angle"},
    ),
    System(
        name="two rods with spring and damper",
        source="SymPy test_kane4: test_replace_qdots_in_force (Kane, Levinson 1985, 4.7)",
        compared="accelerations",
        text=DOUBLE.replace("DAMPER", "parameter delta = 1 N.m.s/rad;\ndamping delta on elbow.angle;"),
        judge=double_linear,
        names=DOUBLE_NAMES,
    ),
    System(
        name="two rods with spring and cubic damper",
        source="SymPy test_kane4: test_replace_qdots_in_force",
        compared="accelerations",
        text=DOUBLE.replace(
            "DAMPER", "parameter delta = 1 N.m.s^3/rad^3;\ndissipation 1/4*delta*der(elbow.angle)^4;"
        ),
        judge=double_cubic,
        names=DOUBLE_NAMES,
        remark="SymPy's test compares the generalised forces only",
    ),
    System(
        name="three links on a cart",
        source="SymPy test_models: test_n_link_pendulum_on_cart_inputs, _higher_order; PyDy models",
        compared="accelerations",
        text=ON_CART.replace("N;", "3;"),
        judge=three_on_cart,
        names=on_cart_names(3),
    ),
    System(
        name="four links on a cart",
        source="PyDy npendulum (n-pendulum-control), without its controller",
        compared="accelerations",
        text=ON_CART.replace("N;", "4;"),
        judge=four_on_cart,
        names=on_cart_names(4),
        stored=True,
    ),
    System(
        name="inverted pendulum, inertia about its hinge",
        source="SymPy test_kane: test_parallel_axis",
        compared="accelerations",
        text="""
parameter g = 9.81 m/s^2;
parameter k = 1 N/m;
parameter ls = 1 m;
parameter a = 1 m;
parameter mA = 1 kg;
parameter mC = 1 kg;
parameter Iz = 3 kg.m^2;
input Force F = 0;
gravity {0, -g};
coordinate Length q1 = 0 m;
coordinate q2 = 10 deg;
frame cart = world * trans({q1, 0});
frame pole = cart * rot(-q2);
mass mC at cart;
mass mA at pole * {0, a};
inertia Iz - mA*a^2 on pole;
potential 1/2*k*(q1 - ls)^2;
force F on q1;
experiment(stop = 1 s);
""",
        judge=inertia_about_hinge,
        values={"Iz": 4.0},
    ),
    System(
        name="cart with a sprung pendulum",
        source="SymPy test_system_class: test_cart_pendulum_kanes, test_cart_pendulum_lagrange",
        compared="accelerations",
        text=CART,
        judge=free_on_cart,
        names={"qc": "rail.position", "qp": "pin.angle"},
    ),
    System(
        name="cart whose bob keeps its place",
        source="SymPy test_system_class: test_cart_pendulum_kanes, test_cart_pendulum_lagrange, with the constraint",
        compared="accelerations",
        text=CART + "constraint rail.position + l*sin(pin.angle) = 0 m;\n",
        judge=held_on_cart,
        names={"qc": "rail.position", "qp": "pin.angle"},
    ),
)

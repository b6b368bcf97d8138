"""Accelerations, energies and momenta of ten models equal those of SymPy's LagrangesMethod."""

from __future__ import annotations

import random
from collections.abc import Callable

import pytest
import sympy as sp
from compiled import compiled, outcome
from msgspec import Struct
from slow_params import slow_among
from sympy.physics.mechanics import LagrangesMethod, dynamicsymbols

TOLERANCE = 1e-12
"""Relative to the largest acceleration; both sides round some hundred operations."""

STATES = 5

t = sp.Symbol("t")


class Case(Struct, frozen=True):
    """A model text and its Lagrangian written independently; ``forces`` are generalised forces."""

    name: str
    text: str
    coordinates: tuple[str, ...]
    lagrangian: Callable[..., sp.Expr]
    forces: Callable[..., tuple[sp.Expr, ...]] = lambda *q: ()


def rate(x: sp.Expr) -> sp.Expr:
    return sp.diff(x, t)


def square(*components: sp.Expr) -> sp.Expr:
    return sum(rate(c) ** 2 for c in components)


def double_pendulum(a: sp.Expr, b: sp.Expr) -> sp.Expr:
    m1, m2, l1, l2, g = 1.3, 0.7, 0.9, 1.2, 9.81
    x1, y1 = l1 * sp.sin(a), -l1 * sp.cos(a)
    x2, y2 = x1 + l2 * sp.sin(b), y1 - l2 * sp.cos(b)
    return m1 / 2 * square(x1, y1) + m2 / 2 * square(x2, y2) - g * (m1 * y1 + m2 * y2)


def bars(a: sp.Expr, b: sp.Expr) -> sp.Expr:
    m1, m2, l1, l2, g = 1.0, 0.5, 1.0, 0.8, 9.81
    c = a + b
    x1, y1 = l1 / 2 * sp.cos(a), l1 / 2 * sp.sin(a)
    x2 = l1 * sp.cos(a) + l2 / 2 * sp.cos(c)
    y2 = l1 * sp.sin(a) + l2 / 2 * sp.sin(c)
    kinetic = m1 / 2 * square(x1, y1) + m2 / 2 * square(x2, y2)
    kinetic += m1 * l1**2 / 24 * rate(a) ** 2 + m2 * l2**2 / 24 * rate(c) ** 2
    return kinetic - g * (m1 * y1 + m2 * y2)


def heavy_top(phi: sp.Expr, theta: sp.Expr, psi: sp.Expr) -> sp.Expr:
    m, d, jt, js, g = 0.5, 0.08, 4e-4, 6e-4, 9.81
    kinetic = (jt + m * d**2) / 2 * (rate(theta) ** 2 + rate(phi) ** 2 * sp.sin(theta) ** 2)
    kinetic += js / 2 * (rate(psi) + rate(phi) * sp.cos(theta)) ** 2
    return kinetic - m * g * d * sp.cos(theta)


def rod_and_particle(q1: sp.Expr, q2: sp.Expr, q3: sp.Expr) -> sp.Expr:
    m, l, g = 1.0, 1.0, 9.8
    r1 = sp.rot_axis2(-q1)
    r2 = sp.rot_axis1(-q2)
    r3 = sp.rot_axis2(-q3)
    hinge = r1 * sp.Matrix([0, 0, -l])
    particle = hinge + r1 * r2 * r3 * sp.Matrix([0, 0, -l])
    kinetic = m * l**2 / 6 * rate(q1) ** 2 + m / 2 * square(*particle)
    return kinetic - m * g * (hinge[2] / 2 + particle[2])


CASES = [
    Case(
        "point masses in absolute angles",
        """
        parameter m1 = 1.3 kg; parameter m2 = 0.7 kg; parameter l1 = 0.9 m; parameter l2 = 1.2 m;
        gravity {0, -9.81 m/s^2};
        coordinate a = 1 rad; coordinate b = 1 rad;
        point p1 = world * {l1*sin(a), -l1*cos(a)};
        point p2 = world * {l1*sin(a) + l2*sin(b), -l1*cos(a) - l2*cos(b)};
        mass m1 at p1; mass m2 at p2;
        """,
        ("a", "b"),
        double_pendulum,
    ),
    Case(
        "the same written as energies",
        """
        parameter m1 = 1.3 kg; parameter m2 = 0.7 kg; parameter l1 = 0.9 m; parameter l2 = 1.2 m;
        parameter g = 9.81 m/s^2;
        coordinate a = 1 rad; coordinate b = 1 rad;
        kinetic 1/2*(m1 + m2)*l1^2*der(a)^2 + 1/2*m2*l2^2*der(b)^2 + m2*l1*l2*der(a)*der(b)*cos(a - b);
        potential -(m1 + m2)*g*l1*cos(a) - m2*g*l2*cos(b);
        """,
        ("a", "b"),
        double_pendulum,
    ),
    Case(
        "bars on hinges of the library",
        """
        import mech.planar.*;
        gravity {0, -9.81 m/s^2};
        Bar upper(m = 1 kg, l = 1 m); Bar lower(m = 0.5 kg, l = 80 cm);
        Revolute a(world -> upper.a); Revolute b(upper.b -> lower.a);
        """,
        ("a.angle", "b.angle"),
        bars,
    ),
    Case(
        "heavy top in Euler angles",
        """
        parameter m = 0.5 kg; parameter d = 8 cm; parameter Jt = 4e-4 kg.m^2; parameter Js = 6e-4 kg.m^2;
        gravity {0, 0, -9.81 m/s^2};
        coordinate phi = 0 rad; coordinate theta = 30 deg; coordinate psi = 0 rad;
        frame body = world * rotz(phi) * rotx(theta) * rotz(psi);
        mass m at body * {0, 0, d};
        inertia diag({Jt, Jt, Js}) on body;
        """,
        ("phi", "theta", "psi"),
        heavy_top,
    ),
    Case(
        "rod and particle in space",
        """
        parameter m = 1 kg; parameter l = 1 m; parameter g = 9.8 m/s^2;
        gravity {0, 0, -g};
        coordinate q1 = 1 rad; coordinate q2 = 1 rad; coordinate q3 = 1 rad;
        frame A = world * roty(q1);
        frame C = A * trans({0, 0, -l}) * rotx(q2) * roty(q3);
        mass m at A * {0, 0, -l/2};
        inertia m*l^2/12*diag({1, 1, 0}) on A;
        mass m at C * {0, 0, -l};
        """,
        ("q1", "q2", "q3"),
        rod_and_particle,
    ),
    Case(
        "Kepler's problem",
        """
        coordinate r = 1 m; coordinate phi = 0 rad;
        kinetic 1/2*1 kg*(der(r)^2 + r^2*der(phi)^2);
        potential -1 N.m^2/r;
        """,
        ("r", "phi"),
        lambda r, phi: (rate(r) ** 2 + r**2 * rate(phi) ** 2) / 2 + 1 / r,
    ),
    Case(
        "pendulum on a driven support",
        """
        parameter l = 0.7 m; parameter A = 0.2 m; parameter w = 3 rad/s;
        gravity {0, -9.81 m/s^2};
        coordinate th = 1 rad;
        mass 1 kg at world * trans({A*cos(w*time), 0}) * rot(th) * {0, -l};
        """,
        ("th",),
        lambda th: (
            square(sp.Rational(1, 5) * sp.cos(3 * t) + 0.7 * sp.sin(th), -0.7 * sp.cos(th)) / 2
            + 9.81 * 0.7 * sp.cos(th)
        ),
    ),
    Case(
        "damped oscillator with a force",
        """
        coordinate x = 1 m;
        kinetic 1/2*2 kg*der(x)^2; potential 1/2*3 N/m*x^2; damping 0.4 N.s/m on x;
        force 1.5 N*cos(2 rad/s*time) on x;
        """,
        ("x",),
        lambda x: rate(x) ** 2 - 1.5 * x**2,
        lambda x: (-0.4 * rate(x) + 1.5 * sp.cos(2 * t),),
    ),
    Case(
        "charge in a magnetic field",
        """
        coordinate x = 1 m; coordinate y = 0 m;
        parameter B = 0.5 kg/s;
        kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
        potential -B*(x*der(y) - y*der(x))/2;
        """,
        ("x", "y"),
        lambda x, y: square(x, y) / 2 + 0.25 * (x * rate(y) - y * rate(x)),
    ),
    Case(
        "relativistic particle",
        """
        dimensionless;
        coordinate x = 0; coordinate y = 0;
        lagrangian -sqrt(1 - (der(x)^2 + der(y)^2)) + 0.3*x*y;
        """,
        ("x", "y"),
        lambda x, y: -sp.sqrt(1 - square(x, y)) + 0.3 * x * y,
    ),
]


@pytest.mark.parametrize(
    "case",
    slow_among([c for c in CASES if c.name == "rod and particle in space"], CASES),
    ids=lambda c: c.name,
)
def test_equals_lagranges_method(case: Case) -> None:
    q = [dynamicsymbols(f"q{k}") for k in range(len(case.coordinates))]
    lagrangian = case.lagrangian(*q)
    method = LagrangesMethod(lagrangian, q)
    method.form_lagranges_equations()
    v = [rate(x) for x in q]
    symbols = [*q, *v]
    plain = sp.symbols(f"s0:{len(symbols)}")
    exchange = dict(zip(reversed(symbols), reversed(plain), strict=True))

    def number(expression: sp.Expr) -> Callable[..., sp.Expr]:
        function: Callable[..., sp.Expr] = sp.lambdify(
            [*plain, t], sp.sympify(expression).subs(exchange), "mpmath"
        )
        return function

    matrix = number(method.mass_matrix)
    forces = case.forces(*q) or (0,) * len(q)
    forcing = number(sp.Matrix(method.forcing) + sp.Matrix(forces))
    momenta = [sp.diff(lagrangian, x) for x in v]
    energy = number(sum(p * x for p, x in zip(momenta, v, strict=True)) - lagrangian)
    model = compiled(case.text)
    numbers = random.Random(case.name)
    for _ in range(STATES):
        values = [numbers.uniform(0.2, 0.6) for _ in symbols]
        time = numbers.uniform(0, 1)
        expected = sp.Matrix(matrix(*values, time)).LUsolve(sp.Matrix(forcing(*values, time)))
        names = [*case.coordinates, *(f"der({n})" for n in case.coordinates)]
        state = dict(zip(names, values, strict=True)) | {"time": time}
        found = outcome(model, "rhs", state)
        scale = max(1.0, *(abs(float(a)) for a in expected))
        for name, a in zip(case.coordinates, expected, strict=True):
            assert abs(found[f"der({name})"] - float(a)) <= TOLERANCE * scale
        total = outcome(model, "outputs", state)["energy.total"]
        reference = float(energy(*values, time))
        assert abs(total - reference) <= TOLERANCE * max(1.0, abs(reference))

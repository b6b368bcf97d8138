"""Linear systems near a state: against SymPy's Linearizer on further models, and the governor of Watt against its cubic."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import scipy.linalg
import sympy as sp
from msgspec import Struct
from sympy.physics.mechanics import (
    KanesMethod,
    LagrangesMethod,
    Point,
    ReferenceFrame,
    RigidBody,
    dot,
    dynamicsymbols,
    inertia,
)

import mechc
from mechc.runtime.local.zeros import poles as poles_of
from mechc.runtime.studies.kinds.linearize import Linearization

G = 9.81


class Twin(Struct, frozen=True):
    """A model in both notations: text, Lagrangian and generalised forces (by q, their rates and the input), and its rest."""

    text: str
    lagrangian: Callable[..., Any]
    forces: Callable[..., tuple[Any, Any]]
    rest: tuple[float, float]


TWINS = {
    "elastic pendulum": Twin(
        "input Force u = 0 N; coordinate Length r = 1.2 m; coordinate Angle th = 0 rad;"
        "kinetic 1/2*(2 kg)*(der(r)^2 + r^2*der(th)^2);"
        "potential -(2 kg)*(9.81 m/s^2)*r*cos(th) + 1/2*(40 N/m)*(r - 1 m)^2;"
        "damping 0.3 N.s/m on r; damping 0.2 N.m.s on th; force u on r;",
        lambda r, th, dr, dth: dr**2 + r**2 * dth**2 + 2 * G * r * sp.cos(th) - 20 * (r - 1) ** 2,
        lambda r, th, dr, dth, u: (u - 0.3 * dr, -0.2 * dth),
        (1 + 2 * G / 40, 0.0),
    ),
    "double pendulum": Twin(
        "input Torque u = 0 N.m; coordinate Angle a = 0 rad; coordinate Angle b = 0 rad;"
        "kinetic 1/2*(3 kg.m^2)*der(a)^2 + 1/2*(1 kg.m^2)*der(b)^2 + (1 kg.m^2)*cos(a - b)*der(a)*der(b);"
        "potential -(30 J)*cos(a) - (10 J)*cos(b); damping 0.5 N.m.s on a; force u on b;",
        lambda a, b, da, db: (
            1.5 * da**2 + db**2 / 2 + sp.cos(a - b) * da * db + 30 * sp.cos(a) + 10 * sp.cos(b)
        ),
        lambda a, b, da, db, u: (-0.5 * da, u),
        (0.0, 0.0),
    ),
    "bead on a turning hoop, with a spring": Twin(
        "input Torque u = 0 N.m; coordinate Angle th = 1 rad; coordinate Length x = 0 m;"
        "kinetic 1/2*(1 kg.m^2)*(der(th)^2 + sin(th)^2*(5 rad/s)^2) + (0.4 kg.m)*cos(th)*der(th)*der(x) + 1/2*(3 kg)*der(x)^2;"
        "potential -(1 kg)*(9.81 m/s^2)*(1 m)*cos(th) + 1/2*(50 N/m)*x^2; damping 0.7 N.s/m on x; force u on th;",
        lambda th, x, dth, dx: (
            (dth**2 + 25 * sp.sin(th) ** 2) / 2
            + 0.4 * sp.cos(th) * dth * dx
            + 1.5 * dx**2
            + G * sp.cos(th)
            - 25 * x**2
        ),
        lambda th, x, dth, dx, u: (u, -0.7 * dx),
        (float(np.arccos(G / 25)), 0.0),
    ),
}


@pytest.mark.parametrize("name", TWINS)
def test_against_the_linearizer_of_sympy(name: str) -> None:
    twin = TWINS[name]
    q, u = dynamicsymbols("q1 q2"), dynamicsymbols("u")
    rates = [x.diff(dynamicsymbols._t) for x in q]
    frame = ReferenceFrame("N")
    loads = []
    for k, (x, force) in enumerate(zip(rates, twin.forces(*q, *rates, u), strict=True)):
        # its angular velocity is the rate, so a torque on it is the generalised force
        turning = ReferenceFrame(f"T{k}")
        turning.set_ang_vel(frame, x * frame.z)
        loads.append((turning, force * frame.z))
    method = LagrangesMethod(twin.lagrangian(*q, *rates), q, forcelist=loads, frame=frame)
    method.form_lagranges_equations()
    still = [*rates, *(x.diff(dynamicsymbols._t) for x in rates)]
    rest = {**dict(zip(q, twin.rest, strict=True)), **dict.fromkeys(still, 0), u: 0}
    a, b, _ = method.linearize(q_ind=q, qd_ind=rates, A_and_B=True, op_point=rest)
    model = mechc.loads(twin.text)
    place = ", ".join(f"{c.name} = {x!r} {c.unit}" for c, x in zip(model.coordinates, twin.rest, strict=True))
    found = model.study("linearize", at=place)
    assert isinstance(found, Linearization)
    assert not any("not an equilibrium" in remark for remark in found.remarks)
    a, b = (np.array(x, dtype=float) for x in (a, b))
    np.testing.assert_allclose(found.A, a, atol=1e-13 * np.abs(a).max())
    np.testing.assert_allclose(found.B, b, atol=1e-13 * np.abs(b).max())


GOVERNOR = """
model Governor "balls that rise as the engine runs faster, and let in less steam"
  parameter m = 3 kg "of both balls";
  parameter l = 0.4 m;
  parameter J = 2 kg.m^2 "of engine and spindle, without the balls";
  parameter k = 30 N.m "of the steam, per cosine";
  parameter load = 15 N.m;
  parameter b = 1 N.m.s;
  coordinate Angle phi = 60 deg;
  coordinate Angle psi = 0 rad;
  kinetic 1/2*m*l^2*(der(phi)^2 + sin(phi)^2*der(psi)^2) + 1/2*J*der(psi)^2;
  potential -m*(9.81 m/s^2)*l*cos(phi);
  damping b on phi;
  force k*cos(phi) - load on psi;
end Governor;
"""


@pytest.mark.parametrize("damping", [0.3, 1.0, 3.0])
def test_the_governor_of_watt(damping: float) -> None:
    """cos phi = load/k, omega^2 = g/(l cos phi); with s, c of phi and Je = J + m l^2 s^2 (Pontryagin, Ordinary Differential
    Equations, 27, with the inertia of the balls about the spindle):

        z (z^2 + b/(m l^2) z + omega^2 s^2) + 2 omega s c (k s + 2 m l^2 s c omega z)/Je = 0.
    """
    poles = governor_poles(2.0, damping)
    np.testing.assert_allclose(poles, governor_cubic(2.0, damping), atol=1e-12 * np.abs(poles).max())


def test_the_criterion_of_vyshnegradsky() -> None:
    """With an engine much heavier than the balls: stable where b J > 2 m l^2 load/omega, to the share m l^2/J = 5e-6."""
    omega, inertia = np.sqrt(G / (0.4 * 0.5)), 1e5
    critical = 2 * 3 * 0.4**2 * 15 / (omega * inertia)
    stable = [governor_poles(inertia, critical * share).real.max() < 0 for share in (0.999, 1.001)]
    assert stable == [False, True]


def governor_poles(inertia: float, damping: float) -> Any:
    """Return the poles but that of the angle of the spindle, on which nothing depends."""
    omega = float(np.sqrt(G / (0.4 * 0.5)))
    model = mechc.loads(GOVERNOR).with_values({"J": inertia, "b": damping})
    found = model.study("linearize", at=f"phi = 60 deg, der(phi) = 0, der(psi) = {omega!r}")
    assert isinstance(found, Linearization)
    values = sorted(found.poles, key=abs)
    assert abs(values[0]) < 1e-12
    return np.sort_complex(np.array(values[1:]))


def governor_cubic(inertia: float, damping: float) -> Any:
    return np.sort_complex(np.roots(_cubic(inertia, damping)))


def _cubic(inertia: float, damping: float) -> list[float]:
    m, l, k, c = 3.0, 0.4, 30.0, 0.5
    s, omega = np.sqrt(0.75), np.sqrt(G / (l * c))
    whole = inertia + m * l**2 * s**2
    turn = 2 * omega * s * c / whole
    return [
        1,
        damping / (m * l**2),
        omega**2 * s**2 + turn * 2 * m * l**2 * s * c * omega,
        turn * k * s,
    ]


WHEEL = """
model Wheel "a wheel, thicker at its rim than a disk, that rolls on a table"
  parameter r = 0.5 m;
  parameter m = 2 kg;
  coordinate Length x = 0 m; coordinate Length y = 0 m;
  coordinate yaw = 0 rad; coordinate lean = 0 rad; coordinate roll = 0 rad;
  kinetic 1/2*m*(der(x)^2 + der(y)^2 + (r*sin(lean)*der(lean))^2)
    + 1/2*m*r^2*(0.4*der(lean)^2 + 0.4*(der(yaw)*cos(lean))^2 + 0.7*(der(roll) + der(yaw)*sin(lean))^2);
  potential m*(9.81 m/s^2)*r*cos(lean);
  constraint der(x) = r*(der(roll)*cos(yaw) + der(lean)*cos(lean)*sin(yaw) + der(yaw)*sin(lean)*cos(yaw));
  constraint der(y) = r*(der(roll)*sin(yaw) - der(lean)*cos(lean)*cos(yaw) + der(yaw)*sin(lean)*sin(yaw));
end Wheel;
"""


@pytest.mark.parametrize("rate", [7.0, 1.5])
def test_a_rolling_wheel_against_the_linearizer_of_kanes_method(rate: float) -> None:
    """SymPy's rolling disc (its page on Kane's method) with other inertias; it has angles and their rates alone."""
    q, u = dynamicsymbols("q1 q2 q3"), dynamicsymbols("u1 u2 u3")
    ground, (r, m) = ReferenceFrame("N"), (sp.Rational(1, 2), 2)
    yaw = ground.orientnew("Y", "Axis", [q[0], ground.z])
    lean = yaw.orientnew("L", "Axis", [q[1], yaw.x])
    wheel = lean.orientnew("R", "Axis", [q[2], lean.y])
    by_angles = wheel.ang_vel_in(ground)
    wheel.set_ang_vel(ground, sum((s * e for s, e in zip(u, lean, strict=True)), start=0 * lean.x))
    contact = Point("C")
    contact.set_vel(ground, 0)
    centre = contact.locatenew("D", r * lean.z)
    centre.v2pt_theory(contact, ground, wheel)
    central = inertia(lean, *(sp.Rational(k, 10) * m * r**2 for k in (4, 7, 4)))
    body = RigidBody("wheel", centre, wheel, m, (central, centre))
    equations = [dot(wheel.ang_vel_in(ground) - by_angles, e) for e in lean]
    method = KanesMethod(ground, q_ind=q, u_ind=u, kd_eqs=equations)
    method.kanes_equations([body], [(centre, -m * sp.Float(G) * yaw.z)])
    still = dict.fromkeys([*q, u[0], u[2], *(x.diff() for x in (q[0], q[1], *u))], 0)
    a, _ = method.linearize(A_and_B=True, op_point=[{**still, u[1]: rate, q[2].diff(): rate}])[:2]
    expected = np.linalg.eigvals(np.array(a, dtype=float))
    found = mechc.loads(WHEEL).study("linearize", at=f"der(roll) = {rate}, der(x) = {0.5 * rate}")
    assert isinstance(found, Linearization)
    for poles in (expected, found.poles):
        assert (np.abs(poles) > 0.1).sum() == 2
    np.testing.assert_allclose(
        np.sort_complex(found.poles[np.abs(found.poles) > 0.1]),
        np.sort_complex(expected[np.abs(expected) > 0.1]),
        atol=1e-12 * np.abs(expected).max(),
    )


def test_entries_of_rounding_bring_no_warning() -> None:
    """A disc that rolls along x: the place across, the yaw, its rate and that of the lean, with rounding in one entry.

    Balanced, the scales of such a matrix go beyond whole numbers, to which SciPy casts them. Poles: 0, 0, +- i sqrt(0.4*0.24).
    """
    a = np.array([[5e-17, 0.14, 0, 0], [0, 0, 1, 0], [0, 0, 0, -0.4], [0, 0, 0.24, 0]])
    _, (scales, _) = quietly_balanced(a)
    assert scales.max() > 2.0**63
    found, _ = poles_of(a)
    np.testing.assert_allclose(
        found[np.argsort(found.imag)], [-(0.096**0.5) * 1j, 0, 0, 0.096**0.5 * 1j], atol=1e-15
    )


def quietly_balanced(a: Any) -> Any:
    with np.errstate(invalid="ignore"):
        return scipy.linalg.matrix_balance(a, permute=False, separate=True)

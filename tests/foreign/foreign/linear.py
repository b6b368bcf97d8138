"""Linear systems near a state, which SymPy's Linearizer forms."""

from __future__ import annotations

from typing import Any

import numpy as np
from sympy import symbols
from sympy.physics.mechanics import KanesMethod, Particle, Point, ReferenceFrame, dynamicsymbols

import mechc
from foreign.case import System
from foreign.pendulums import STRING
from foreign.rolling import DISC
from mechc.runtime.studies.kinds.linearize import Linearization

T = dynamicsymbols._t


def nonzero(poles: Any) -> Any:
    """Poles that are not those of ignorable coordinates, which are zero but for rounding."""
    return poles[np.abs(poles) > 1e-5]


def poles_apart(found: Any, expected: Any) -> float:
    """The largest difference, each from the nearest, as a share of the largest pole; infinite if the numbers differ."""
    if len(found) != len(expected):
        return np.inf
    apart = np.abs(np.subtract.outer(np.asarray(found), np.asarray(expected)))
    return float(max(apart.min(axis=0).max(), apart.min(axis=1).max()) / np.abs(expected).max())


def linearized(text: str, **settings: Any) -> Linearization:
    found = mechc.loads(text).study("linearize", **settings)
    assert isinstance(found, Linearization)
    return found


def pendulum(system: System) -> float:
    """The matrix A of SymPy's Linearizer away from the rest."""
    q, u = dynamicsymbols("q u")
    m, l, g = symbols("m l g")
    N, O = ReferenceFrame("N"), Point("O")
    O.set_vel(N, 0)
    A = N.orientnew("A", "Axis", [q, N.z])
    A.set_ang_vel(N, u * N.z)
    P = O.locatenew("P", l * A.x)
    P.v2pt_theory(O, N, A)
    method = KanesMethod(N, q_ind=[q], u_ind=[u], kd_eqs=[q.diff(T) - u])
    method.kanes_equations([Particle("bob", P, m)], [(P, m * g * N.x)])
    matrix, _, _ = method.linearize(A_and_B=True)
    expected = np.array(matrix.subs({q: 0.4, u: 0, m: 2, l: 0.7, g: 9.8}), dtype=float)
    return float(np.abs(linearized(system.text).A - expected).max() / np.abs(expected).max())


def hanging(system: System) -> float:
    """At rest straight down: poles +- i sqrt(g/l)."""
    expected = np.array([1j, -1j]) * np.sqrt(9.8 / 0.7)
    return poles_apart(linearized(system.text).poles, expected)


def upright_disc(system: System) -> float:
    """SymPy's matrix at upright rolling has the poles s^2 = 4/5 g/r - 12/5 w^2, and zeros; w is the rate of spin."""
    worst = 0.0
    for spin in (0.2, 3.0):
        expected = np.sqrt(complex(4 / 5 * 9.81 / 0.7 - 12 / 5 * spin**2)) * np.array([1, -1])
        found = linearized(system.text, set={"r": 0.7, "w": spin})
        worst = max(worst, poles_apart(nonzero(found.poles), expected))
    return worst


SYSTEMS = (
    System(
        name="pendulum, linearised",
        source="SymPy test_linearize: test_linearize_pendulum_kane_minimal, test_linearize_pendulum_lagrange_minimal",
        compared="matrix A at 0.4 rad",
        text="""
coordinate theta = 0.4 rad;
kinetic 1/2*2 kg*(0.7 m)^2*der(theta)^2;
potential -2 kg*9.8 m/s^2*0.7 m*cos(theta);
experiment(stop = 1 s);
""",
        compare=pendulum,
    ),
    System(
        name="pendulum in x and y, linearised",
        source="SymPy test_linearize: test_linearize_pendulum_kane_nonminimal, test_linearize_pendulum_lagrange_nonminimal",
        compared="poles at rest",
        text=STRING.replace("x ~ 0.8 m", "x ~ 0.7 m")
        .replace("y ~ 0.6 m", "y = 0 m")
        .replace("l = 1 m", "l = 0.7 m")
        .replace("9.81", "9.8"),
        compare=hanging,
    ),
    System(
        name="rolling disc, linearised",
        source="SymPy test_linearize: test_linearize_rolling_disc_kane; test_kane: test_rolling_disc",
        compared="poles of upright rolling at two speeds",
        text=DISC.replace("0.1 rad", "0 rad").replace("0.2 rad", "0 rad")
        + "parameter w = 1 rad/s;\ninitial der(spin) = w;\ninitial der(lean) = 0 rad/s;\ninitial der(yaw) = 0 rad/s;\n",
        compare=upright_disc,
    ),
)

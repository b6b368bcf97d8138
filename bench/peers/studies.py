"""The same questions as the studies', put to SymPy, scipy and MechanicsDSL: each gives a number, or says why it has none.

Formulas that a tool does not derive itself are written here by hand, as its users would.
"""

from __future__ import annotations

import logging
import math
import warnings
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import sympy as sp
from scipy.integrate import quad, solve_ivp
from scipy.linalg import eigh
from scipy.optimize import brentq, fsolve

Answer = float | int
CHAIN, SPRINGS = 20, 1.0


class Missing(Exception):
    """The tool is not installed, or has nothing for the question."""


# ---------------------------------------------------------------- SymPy


def sympy_pair() -> Answer:
    """LagrangesMethod, its Linearizer, and NumPy's eigenvalues of what it gives."""
    from sympy.physics.mechanics import LagrangesMethod, dynamicsymbols

    a, b = q = dynamicsymbols("a b")
    t = dynamicsymbols._t
    m1, m2, l, k, g = 1, 3, 1, 6, sp.Rational(981, 100)
    kinetic = l**2 * (m1 * a.diff(t) ** 2 + m2 * b.diff(t) ** 2) / 2
    spring = k * l**2 * (sp.sin(a) - sp.sin(b)) ** 2 / 2
    return _linearized(
        LagrangesMethod(kinetic - spring + g * l * (m1 * sp.cos(a) + m2 * sp.cos(b)), q), list(q), 1
    )


def sympy_chain() -> Answer:
    from sympy.physics.mechanics import LagrangesMethod, dynamicsymbols

    q = list(dynamicsymbols(f"q:{CHAIN}"))
    t = dynamicsymbols._t
    ends = [0, *q, 0]
    kinetic = sum(c.diff(t) ** 2 for c in q) / 2
    springs = sum((ends[i + 1] - ends[i]) ** 2 for i in range(CHAIN + 1)) / 2
    return _linearized(LagrangesMethod(kinetic - springs, q), q, 0)


def _linearized(method: Any, q: list[Any], index: int) -> float:
    from sympy.physics.mechanics import dynamicsymbols

    method.form_lagranges_equations()
    rates = [c.diff(dynamicsymbols._t) for c in q]
    point = dict.fromkeys([*q, *rates], 0)
    matrix = method.linearize(q_ind=q, qd_ind=rates, A_and_B=True, op_point=point)[0]
    values = np.linalg.eigvals(np.array(matrix.tolist(), dtype=float)).imag
    return float(sorted(v for v in values if v > 1e-12)[index])


def sympy_hoop() -> Answer:
    theta = sp.Symbol("theta", real=True)
    potential = -sp.Rational(981, 100) * sp.cos(theta) - sp.Rational(25, 2) * sp.sin(theta) ** 2
    found = {float(sp.N(s)) for s in sp.solve(potential.diff(theta), theta)}
    return len({round(math.remainder(x, 2 * math.pi) % (2 * math.pi), 9) for x in found})


# ---------------------------------------------------------------- scipy


def scipy_pair() -> Answer:
    m1, m2, k, g = 1.0, 3.0, 6.0, 9.81
    values = eigh(np.array([[m1 * g + k, -k], [-k, m2 * g + k]]), np.diag([m1, m2]), eigvals_only=True)
    return float(np.sqrt(values[1]))


def scipy_chain() -> Answer:
    stiffness = 2 * np.eye(CHAIN) - np.eye(CHAIN, k=1) - np.eye(CHAIN, k=-1)
    return float(np.sqrt(eigh(stiffness, np.eye(CHAIN), eigvals_only=True)[0]))


def scipy_hoop() -> Answer:
    random, found = np.random.default_rng(0), set()
    for guess in random.uniform(-math.pi, math.pi, 64):
        root, _, status, _ = fsolve(
            lambda x: 9.81 * np.sin(x) - 25 * np.sin(x) * np.cos(x), guess, full_output=True
        )
        if status == 1:
            found.add(round(float(root[0]) % (2 * math.pi), 6) % round(2 * math.pi, 6))
    return len(found)


def scipy_van_der_pol() -> Answer:
    """The time between crossings, by events of DOP853 at its tightest tolerance."""

    def up(t: float, y: Any) -> float:
        return float(y[0])

    up.direction = 1.0  # type: ignore[attr-defined]
    found = solve_ivp(
        lambda t, y: [y[1], (1 - y[0] ** 2) * y[1] - y[0]], (0, 100), [2, 0], method="DOP853",
        rtol=3e-14, atol=1e-14, events=up,
    )  # fmt: skip
    times = found.t_events[0]
    return float(times[-1] - times[-2])


def scipy_pendulum() -> Answer:
    """The integral between the turning points, where it is infinite, as quad takes it."""
    found = quad(lambda x: 4 / math.sqrt(2 * (math.cos(x) - math.cos(math.pi / 3))), 0, math.pi / 3)
    return float(found[0])


def scipy_rutherford() -> Answer:
    """The integral over the distance, by quad."""
    nearest = brentq(lambda r: 1 - 1 / r**2 - 2 / r, 1e-3, 1e3, xtol=1e-15)
    found = quad(lambda r: 1 / (r**2 * math.sqrt(max(1 - 1 / r**2 - 2 / r, 1e-300))), nearest, math.inf)
    return float(math.pi - 2 * found[0])


def scipy_lorenz() -> Answer:
    """Benettin's method with the tangent equations written by hand, for the time that mechc takes too."""
    s, r, b = 10.0, 28.0, 8 / 3

    def rates(t: float, y: Any) -> Any:
        x, w = y[:3], y[3:]
        return [
            s * (x[1] - x[0]), x[0] * (r - x[2]) - x[1], x[0] * x[1] - b * x[2],
            s * (w[1] - w[0]), (r - x[2]) * w[0] - w[1] - x[0] * w[2], x[1] * w[0] + x[0] * w[1] - b * w[2],
        ]  # fmt: skip

    y, grown = np.array([1.0, 1, 1, 1, 0, 0]), 0.0
    for k in range(2200):
        y = solve_ivp(rates, (0, 1), y, method="DOP853", rtol=1e-8, atol=1e-8).y[:, -1]
        size = float(np.linalg.norm(y[3:]))
        grown += math.log(size) if k >= 200 else 0.0
        y[3:] /= size
    return grown / 2000


# ---------------------------------------------------------------- MechanicsDSL


def _dsl() -> Any:
    try:
        from mechanics_dsl.domains import classical
    except ImportError:
        raise Missing("not installed") from None
    logging.disable(logging.CRITICAL)
    warnings.filterwarnings("ignore", module="mechanics_dsl")
    return classical


def _symbols(analyzer: Any, names: str) -> list[Any]:
    return [analyzer.get_symbol(name) for name in names.split()]


def dsl_pair() -> Answer:
    made = _dsl().NormalModeAnalyzer()
    a, b, va, vb = _symbols(made, "a b a_dot b_dot")
    lagrangian = (
        (va**2 + 3 * vb**2) / 2 - 3 * (sp.sin(a) - sp.sin(b)) ** 2
        + sp.Rational(981, 100) * (sp.cos(a) + 3 * sp.cos(b))
    )  # fmt: skip
    return float(sorted(mode.frequency for mode in made.analyze(lagrangian, ["a", "b"]).modes)[1])


def dsl_chain() -> Answer:
    made = _dsl().NormalModeAnalyzer()
    names = [f"q{k}" for k in range(CHAIN)]
    q, v = [made.get_symbol(n) for n in names], [made.get_symbol(f"{n}_dot") for n in names]
    ends = [0, *q, 0]
    springs = sum((ends[i + 1] - ends[i]) ** 2 for i in range(CHAIN + 1)) / 2
    return float(min(m.frequency for m in made.analyze(sum(x**2 for x in v) / 2 - springs, names).modes))


def dsl_hoop() -> Answer:
    from mechanics_dsl.domains.classical.stability import StabilityAnalyzer

    made = StabilityAnalyzer()
    (theta,) = _symbols(made, "theta")
    potential = -sp.Rational(981, 100) * sp.cos(theta) - sp.Rational(25, 2) * sp.sin(theta) ** 2
    found = made.find_equilibria(potential, ["theta"])
    return len({round(one.coordinates["theta"] % (2 * math.pi), 9) for one in found})


def dsl_rutherford() -> Answer:
    return float(
        _dsl().ScatteringAnalyzer().compute_scattering_angle(lambda r: 1 / r, 0.5, 1.0, 1.0).scattering_angle
    )


def dsl_inverse_square() -> Answer:
    found = _dsl().ScatteringAnalyzer().compute_scattering_angle(lambda r: 1 / r**2, 0.5, 1.0, 1.0)
    return float(found.scattering_angle)


def dsl_action() -> Answer:
    from mechanics_dsl.domains.classical.canonical import ActionAngleVariables

    made = ActionAngleVariables()
    q, p = _symbols(made, "q p_q")
    return float(made.compute_action(p**2 / 2 + 2 * q**2, "q", 5.0, {}))


def dsl_two_bodies() -> Answer:
    from mechanics_dsl.domains.classical.symmetry import NoetherAnalyzer

    made = NoetherAnalyzer()
    names = ["x1", "y1", "x2", "y2"]
    x1, y1, x2, y2 = (made.get_symbol(n) for n in names)
    v = [made.get_symbol(f"{n}_dot") for n in names]
    kinetic = (v[0] ** 2 + v[1] ** 2) / 2 + v[2] ** 2 + v[3] ** 2
    lagrangian = kinetic - 3 / sp.sqrt((x1 - x2) ** 2 + (y1 - y2) ** 2)
    return len(made.find_symmetries(lagrangian, names))


PEERS: Mapping[str, Mapping[str, Callable[[], Answer]]] = {
    "pair": {"SymPy": sympy_pair, "scipy": scipy_pair, "MechanicsDSL": dsl_pair},
    "chain": {"SymPy": sympy_chain, "scipy": scipy_chain, "MechanicsDSL": dsl_chain},
    "hoop": {"SymPy": sympy_hoop, "scipy": scipy_hoop, "MechanicsDSL": dsl_hoop},
    "pendulum": {"scipy": scipy_pendulum},
    "action": {"MechanicsDSL": dsl_action},
    "van der Pol": {"scipy": scipy_van_der_pol},
    "Lorenz": {"scipy": scipy_lorenz},
    "Rutherford": {"scipy": scipy_rutherford, "MechanicsDSL": dsl_rutherford},
    "inverse square": {"MechanicsDSL": dsl_inverse_square},
    "two bodies": {"MechanicsDSL": dsl_two_bodies},
}

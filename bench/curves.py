"""Curves against ``scipy.integrate.solve_bvp`` on Euler-Lagrange equations written by hand: error over time."""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from scipy.integrate import quad, solve_bvp

import mechc

from .machine import table, write

RUNS = 5


def _integral(f: Callable[[float], float], a: float, b: float) -> float:
    return float(quad(f, a, b, epsabs=1e-13, epsrel=1e-13, limit=200)[0])


def film(tolerance: float, *, waist: float = 0.85) -> float:
    """r r'' = 1 + r'^2 between two rings."""
    b = 0.5

    def rhs(x: Any, y: Any) -> Any:
        return np.vstack([y[1], (1 + y[1] ** 2) / y[0]])

    x = np.linspace(-b, b, 11)
    guess = waist + (1 - waist) * (x / b) ** 2
    found = solve_bvp(
        rhs,
        lambda ya, yb: np.array([ya[0] - 1, yb[0] - 1]),
        x,
        np.vstack([guess, 2 * (1 - waist) * x / b**2]),
        tol=tolerance,
        max_nodes=100_000,
    )
    return (
        2 * math.pi * _integral(lambda s: float(found.sol(s)[0] * math.sqrt(1 + found.sol(s)[1] ** 2)), -b, b)
    )


def line(tolerance: float) -> float:
    """(w z + lam) z'' = w (1 + z'^2), the multiplier a parameter, the length a state of its own."""

    def rhs(x: Any, y: Any, p: Any) -> Any:
        root = np.sqrt(1 + y[1] ** 2)
        return np.vstack([y[1], 10 * (1 + y[1] ** 2) / (10 * y[0] + p[0]), root])

    x = np.linspace(0, 1, 11)
    start = np.vstack([-x * (1 - x), 2 * x - 1, 1.5 * x])
    found = solve_bvp(
        rhs,
        lambda ya, yb, p: np.array([ya[0], yb[0], ya[2], yb[2] - 1.5]),
        x,
        start,
        p=np.array([8.0]),
        tol=tolerance,
        max_nodes=100_000,
    )
    return _integral(lambda s: float(10 * found.sol(s)[0] * math.sqrt(1 + found.sol(s)[1] ** 2)), 0, 1)


def circle(tolerance: float) -> float:
    """y y'' + 1 + y'^2 = 0 in the half plane."""

    def rhs(x: Any, y: Any) -> Any:
        return np.vstack([y[1], -(1 + y[1] ** 2) / y[0]])

    x = np.linspace(-1, 1, 11)
    found = solve_bvp(
        rhs,
        lambda ya, yb: np.array([ya[0] - 1, yb[0] - 1]),
        x,
        np.vstack([1 + 0.4 * (1 - x**2), -0.8 * x]),
        tol=tolerance,
        max_nodes=100_000,
    )
    return _integral(lambda s: float(math.sqrt(1 + found.sol(s)[1] ** 2) / found.sol(s)[0]), -1, 1)


def _example(name: str) -> str:
    return (Path(__file__).parents[1] / "examples" / "curves" / f"{name}.mech").read_text(encoding="utf-8")


PROBLEMS = (
    ("soap film", "soap_film", film, 5.99179697580228),
    ("hanging line of given length", "clothesline", line, -4.5403406367024646),
    ("geodesic of the half plane", "half_plane_geodesic", circle, 2 * math.log(1 + math.sqrt(2))),
)


def timed(action: Callable[[], Any]) -> tuple[Any, float]:
    """Return what an action gives, and the median of the processor seconds that it takes."""
    times = []
    found = None
    for _ in range(RUNS):
        begun = time.process_time()
        found = action()
        times.append(time.process_time() - begun)
    return found, statistics.median(times)


def main(*, quick: bool = False) -> None:
    """Measure and write the page."""
    rows = []
    for name, example, by_hand, exact in PROBLEMS:
        text = _example(example)
        found, whole = timed(lambda text=text: mechc.loads(text).solve())
        model = mechc.loads(text)
        model.solve()
        _, alone = timed(model.solve)
        steps = found.statistics()
        rows.append(
            [name, "mechc", f"{abs(found.stationary / exact - 1):.1e}", f"{found.error / abs(exact):.1e}",
             f"{1e3 * alone:.0f} ms", f"{1e3 * whole:.0f} ms", f"{steps['unknowns']}", f"{steps['newton_steps']}"]
        )  # fmt: skip
        for tolerance in (1e-6, 1e-9, 1e-12)[: 2 if quick else 3]:
            value, seconds = timed(lambda t=tolerance, f=by_hand: f(t))
            rows.append(
                [name, f"solve_bvp, {tolerance:g}", f"{abs(value / exact - 1):.1e}", "-", f"{1e3 * seconds:.0f} ms", "", "", ""]
            )  # fmt: skip
    write(
        "curves",
        "Curves against boundary-value problems written by hand",
        [
            "What is stationary, its true and its claimed relative error, processor seconds. `solve_bvp` gets the Euler-Lagrange "
            "equations, their multiplier and the length as a further state by hand, and its integral by quadrature; mechc the "
            "text of the example, which the last time includes.",
            table(
                [
                    "problem",
                    "method",
                    "error",
                    "claimed",
                    "solving",
                    "text to curve",
                    "unknowns",
                    "Newton steps",
                ],
                rows,
            ),
        ],
    )

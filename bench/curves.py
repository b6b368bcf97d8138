"""Curves against ``scipy.integrate.solve_bvp`` on Euler-Lagrange equations written by hand: error over time."""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import mpmath as mp
import numpy as np
from scipy.integrate import solve_bvp

import mechc

from .machine import table, write

RUNS = 5
LONG = 1.0
"""Processor seconds after which an action is measured once."""
TOLERANCES = (1e-6, 1e-9, 1e-12)
G = 9.81


class Hand(NamedTuple):
    """A boundary-value problem of first order: ``ends(ya, yb, *p)`` vanish; ``value`` of what is found, from a mean of the integrand."""

    a: float
    b: float
    rhs: Callable[..., list[Any]]
    ends: Callable[..., list[Any]]
    guess: Callable[[Any], list[Any]]
    value: Callable[[Callable[[Callable[..., Any]], float], Any], float]
    p: tuple[float, ...] = ()


PLACES, WEIGHTS = np.polynomial.legendre.leggauss(8)


def solved(problem: Hand, tolerance: float) -> float:
    """Return what is stationary, by Gauss's rule on the mesh of the solution."""
    x = np.linspace(problem.a, problem.b, 11)
    found = solve_bvp(
        lambda x, y, *p: np.vstack([np.broadcast_to(r, x.shape) for r in problem.rhs(x, y, *p)]),
        lambda ya, yb, *p: np.array(problem.ends(ya, yb, *p)),
        x,
        np.vstack([np.broadcast_to(g, x.shape) for g in problem.guess(x)]),
        p=np.array(problem.p) if problem.p else None,
        tol=tolerance,
        max_nodes=100_000,
    )
    half, middle = np.diff(found.x) / 2, (found.x[1:] + found.x[:-1]) / 2
    s = (middle[:, None] + half[:, None] * PLACES).ravel()
    w = (half[:, None] * WEIGHTS).ravel()
    y = found.sol(s)
    return problem.value(lambda f: float(np.sum(w * f(s, y))), found)


def slope(x: Any, p: Any) -> Any:
    """Return x' where x'/sqrt(1 + x'^2) = p."""
    with np.errstate(invalid="ignore"):  # on the way
        return p / np.sqrt(1 - p**2)


DESCENT = Hand(  # x'/sqrt(1 + x'^2)/sqrt(depth) is the same all along
    0, 1,
    lambda d, y: [slope(d, y[1] * np.sqrt(d)), 0 * d],
    lambda ya, yb: [ya[0], yb[0] - 1],
    lambda d: [d, 0.7 + 0 * d],
    lambda mean, _: mean(lambda d, y: np.sqrt((1 + slope(d, y[1] * np.sqrt(d)) ** 2) / (2 * G * d))),
)  # fmt: skip
BAND = Hand(  # k (S - S0) (z'/sqrt(1 + z'^2))' = load, the tension a parameter
    0, 1,
    lambda x, y, t: [slope(x, y[1] / t[0]), 3 * (1 + x), 1 / np.sqrt(1 - (y[1] / t[0]) ** 2)],
    lambda ya, yb, t: [ya[0], yb[0] - 0.2, ya[2], 50 * (yb[2] - 1) - t[0]],
    lambda x: [0.2 * x - 0.3 * x * (1 - x), -1.5 + 3 * x, 1.1 * x],
    lambda mean, found: 25 * (found.p[0] / 50) ** 2 + mean(lambda x, y: 3 * (1 + x) * y[0]),
    (5.0,),
)  # fmt: skip
LINE = Hand(  # (w z + lam) z'' = w (1 + z'^2), the multiplier a parameter, the length a state of its own
    0, 1,
    lambda x, y, p: [y[1], 10 * (1 + y[1] ** 2) / (10 * y[0] + p[0]), np.sqrt(1 + y[1] ** 2)],
    lambda ya, yb, p: [ya[0], yb[0], ya[2], yb[2] - 1.5],
    lambda x: [-x * (1 - x), 2 * x - 1, 1.5 * x],
    lambda mean, _: mean(lambda x, y: 10 * y[0] * np.sqrt(1 + y[1] ** 2)),
    (8.0,),
)  # fmt: skip
RAY = Hand(  # n x'/sqrt(1 + x'^2) is the same all along; both media side by side over 0 .. 1
    0, 1,
    lambda s, y: [slope(s, y[1] / 1.5), 0 * s, slope(s, y[3]), 0 * s],
    lambda ya, yb: [ya[0], yb[0] - ya[2], yb[1] - ya[3], yb[2] - 1],
    lambda s: [s / 2, 0.6 + 0 * s, 0.5 + s / 2, 0.6 + 0 * s],
    lambda mean, _: mean(lambda s, y: 1.5 * np.sqrt(1 + slope(s, y[1] / 1.5) ** 2) + np.sqrt(1 + slope(s, y[3]) ** 2)),
)  # fmt: skip
FILM = Hand(  # r r'' = 1 + r'^2
    -0.5, 0.5,
    lambda x, y: [y[1], (1 + y[1] ** 2) / y[0]],
    lambda ya, yb: [ya[0] - 1, yb[0] - 1],
    lambda x: [0.85 + 0.6 * x**2, 1.2 * x],
    lambda mean, _: 2 * math.pi * mean(lambda x, y: y[0] * np.sqrt(1 + y[1] ** 2)),
)  # fmt: skip
STONE = Hand(
    0, 2,
    lambda t, y: [y[2], y[3], 0 * t, -G + 0 * t],
    lambda ya, yb: [ya[0], ya[1], yb[0] - 3, yb[1] - 4],
    lambda t: [1.5 * t, 2 * t, 1.5 + 0 * t, 2 + 0 * t],
    lambda mean, _: mean(lambda t, y: (y[2] ** 2 + y[3] ** 2) / 2 - G * y[1]),
)  # fmt: skip
CIRCLE = Hand(  # y y'' + 1 + y'^2 = 0
    -1, 1,
    lambda x, y: [y[1], -(1 + y[1] ** 2) / y[0]],
    lambda ya, yb: [ya[0] - 1, yb[0] - 1],
    lambda x: [1.4 - 0.4 * x**2, -0.8 * x],
    lambda mean, _: mean(lambda x, y: np.sqrt(1 + y[1] ** 2) / y[0]),
)  # fmt: skip
TWO = Hand(
    0, 1,
    lambda x, y: [y[2], y[3], y[1], y[0]],
    lambda ya, yb: [ya[0], ya[1], yb[0] - 1, yb[1]],
    lambda x: [x, 0 * x, 1 + 0 * x, 0 * x],
    lambda mean, _: mean(lambda x, y: (y[2] ** 2 + y[3] ** 2) / 2 + y[0] * y[1]),
)  # fmt: skip


def _descent() -> Any:
    a = mp.findroot(lambda a: (a - mp.sin(a)) / (1 - mp.cos(a)) - 1, 2.4)
    return a / mp.sqrt((1 - mp.cos(a)) * mp.mpf("9.81"))


def _band() -> Any:
    def carried(x: Any) -> Any:
        return 3 * (x + x**2 / 2)

    def steep(x: Any, v: Any, t: Any) -> Any:
        return (v + carried(x)) / mp.sqrt(t**2 - (v + carried(x)) ** 2)

    def off(v: Any, t: Any) -> list[Any]:
        length = mp.quad(lambda x: mp.sqrt(1 + steep(x, v, t) ** 2), [0, 1])
        return [mp.quad(lambda x: steep(x, v, t), [0, 1]) - mp.mpf("0.2"), 50 * (length - 1) - t]

    v, t = mp.findroot(off, (-1.5, 4.2))
    return t**2 / 100 + carried(mp.mpf(1)) / 5 - mp.quad(lambda x: carried(x) * steep(x, v, t), [0, 1])


def _line() -> Any:
    c = mp.findroot(lambda c: 2 * c * mp.sinh(1 / (2 * c)) - mp.mpf("1.5"), 0.3)
    return 10 * (c / 2 + c**2 / 2 * mp.sinh(1 / c) - c * mp.cosh(1 / (2 * c)) * mp.mpf("1.5"))


def _ray() -> Any:
    c = mp.findroot(lambda x: mp.mpf("1.5") * x / mp.sqrt(1 + x**2) - (1 - x) / mp.sqrt(1 + (1 - x) ** 2), 0.4)  # fmt: skip
    return mp.mpf("1.5") * mp.sqrt(1 + c**2) + mp.sqrt(1 + (1 - c) ** 2)


def _film() -> Any:
    c = mp.findroot(lambda c: c * mp.cosh(mp.mpf("0.5") / c) - 1, 0.85)
    return 2 * mp.pi * c * (mp.mpf("0.5") + c / 2 * mp.sinh(1 / c))


def _stone() -> Any:
    t, g = mp.mpf(2), mp.mpf("9.81")
    return mp.mpf(25) / (2 * t) - 2 * g * t - g**2 * t**3 / 24


PROBLEMS: tuple[tuple[str, str, Hand, Callable[[], Any]], ...] = (
    ("fastest descent (U59)", "brachistochrone", DESCENT, _descent),
    ("elastic band under a load (U60)", "rubber_band", BAND, _band),
    ("hanging line of given length (U61)", "clothesline", LINE, _line),
    ("light through two media (U63)", "fermat", RAY, _ray),
    ("soap film (U64)", "soap_film", FILM, _film),
    ("action of a thrown stone (U65)", "thrown", STONE, _stone),
    ("geodesic of the half plane (U71)", "half_plane_geodesic", CIRCLE, lambda: 2 * mp.log(1 + mp.sqrt(2))),
    ("two dependent variables (P5)", "two_variables", TWO, lambda: (mp.coth(1) + mp.cot(1)) / 4),
)


def timed(action: Callable[[], Any]) -> tuple[Any, float]:
    """Return what an action gives, and the median of the processor seconds that it takes."""
    times: list[float] = []
    found = None
    while len(times) < RUNS and sum(times) < LONG:
        begun = time.process_time()
        found = action()
        times.append(time.process_time() - begun)
    return found, statistics.median(times)


def main(*, quick: bool = False) -> None:
    """Measure and write the page."""
    mp.mp.dps = 30
    rows = []
    for name, example, hand, exactly in PROBLEMS:
        exact = float(exactly())
        text = (Path(__file__).parents[1] / "examples" / "curves" / f"{example}.mech").read_text("utf-8")
        mechc.loads(text).solve()
        texts = iter(f"{text}\n// {k}" for k in range(2 * RUNS))  # no text is compiled twice
        found, seconds = timed(lambda texts=texts: mechc.loads(next(texts)).solve())
        steps = found.statistics()
        row = [name, f"{abs(found.stationary / exact - 1):.0e}, claimed {found.error / abs(exact):.0e}, {1e3 * seconds:.0f} ms",
               f"{steps['unknowns']}", f"{steps['newton_steps']}"]  # fmt: skip
        for tolerance in TOLERANCES[: 2 if quick else 3]:
            value, seconds = timed(lambda t=tolerance, hand=hand: solved(hand, t))
            row.append(f"{abs(value / exact - 1):.0e}, {1e3 * seconds:.0f} ms")
        rows.append(row)
    head = ["problem", "mechc", "unknowns", "Newton steps"]
    head += [f"solve_bvp, {t:g}" for t in TOLERANCES[: 2 if quick else 3]]
    write(
        "curves",
        "Curves against boundary-value problems written by hand",
        [
            "Relative error of what is stationary against closed forms, processor time in a warm process with one thread of linear "
            "algebra. mechc: from the text of the example to the curve, with its claimed error. `solve_bvp` gets the "
            "Euler-Lagrange equations, multipliers and lengths as further unknowns, both media side by side, and what is the same "
            "along the curve in place of a second derivative, all by hand, and claims no error of the value.",
            table(head, rows),
        ],
    )

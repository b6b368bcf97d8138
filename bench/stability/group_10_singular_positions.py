"""Linkages through positions in which their loops lose rank."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from mechc.solution import Solution

from .case import Array, Case, Followed, Formula, Known, Measured

NUMBER = 10
TITLE = "Change points and dead centres"

PARALLELOGRAM = """
import mech.planar.*;
parameter l = 1 m;
Bar crank(m = 1 kg, l = l);
Bar coupler(m = 2 kg, l = 2*l);
Bar rocker(m = 3 kg, l = l);
frame pivot = world * trans({2*l, 0 m});
Revolute a(world -> crank.a, angle = 30 deg, der(angle) = 1 rad/s);
Revolute b(crank.b -> coupler.a, angle ~ -30 deg);
Revolute d(pivot -> rocker.a, angle ~ 30 deg);
cut Revolute c(coupler.b -> rocker.b);
output turned = heading(coupler.a);
experiment(stop = 30 s, tolerance = 1e-10);
"""

CRANK = """
import mech.planar.*;
Bar crank(m = 1 kg, l = 0.5 m);
Bar rod(m = 1 kg, l = 0.5 m);
Body piston(m = 2 kg);
Revolute main(world -> crank.a, angle = 30 deg, der(angle) = 2 rad/s);
Revolute big_end(crank.b -> rod.a, angle ~ -60 deg);
Prismatic guide(world -> piston.a, axis = {1, 0}, position ~ 0.8 m);
cut Revolute small_end(rod.b -> piston.a);
experiment(stop = 10 s, tolerance = 1e-10);
"""


def uniform(t: Array) -> Any:
    return np.radians(30) + t


def piston(s: Solution) -> float:
    """Distance from x = 2 r cos(angle), and the change of the energy as a function of the angle, both relative."""
    a, w, r = s["main.angle"], s["der(main.angle)"], 0.5
    inertia = r * r * (1 / 3 + 2.25 * np.sin(a) ** 2 + 0.25 * np.cos(a) ** 2 + 1 / 12 + 8 * np.sin(a) ** 2)
    energy = inertia * w * w
    off = np.abs(s["guide.position"] - 2 * r * np.cos(a)).max()
    return float(max(off, np.ptp(energy) / energy[0]))


def row(n: int) -> Formula:
    """n + 1 posts and n couplers that stay parallel are one pendulum: I a'' = -V g cos(a)."""
    inertia, weight = (n + 1) / 3 + n, (n + 1) / 2 + n

    def angle(t: Array) -> Any:
        def rates(_: float, y: Array) -> list[float]:
            return [y[1], -weight / inertia * 9.81 * np.cos(y[0])]

        start = [np.pi / 2, -1.0]
        return solve_ivp(rates, (0, t[-1]), start, "DOP853", np.unique(t), rtol=1e-13, atol=1e-13).y[0]

    return angle


def chain(n: int, bound: float, full: bool = False) -> Case:
    text = ROW.replace("n = 2", f"n = {n}")
    return Case(
        f"row of {n} four-bars",
        f"{n} loops lose rank at once, twice a turn, five times",
        text,
        Known(f"goes on as {n} parallelograms, the angle to {bound:g}", {"foot[1].angle": row(n)}, bound),
        fault="sign",
        seconds=300 if full else 100,
        full=full,
    )


ROW = """
import mech.planar.*;
structural parameter Integer n = 2;
gravity {0, -9.81 m/s^2};
Bar post[n + 1](m = 1 kg, l = 1 m);
Bar coupler[n](m = 1 kg, l = 1 m);
Revolute foot[i in 1:n+1](world * trans({(i - 1)*1 m, 0 m}) -> post[i].a, angle ~ 90 deg,
                          der(angle) ~ -1 rad/s);
Revolute knee[i in 1:n](post[i].b -> coupler[i].a, angle ~ -90 deg, der(angle) ~ 1 rad/s);
cut Revolute pin[i in 1:n](coupler[i].b -> post[i+1].b);
experiment(stop = 8 s, tolerance = 1e-10);
"""

CASES = (
    Case(
        "parallelogram",
        "flat twice a turn: there it could go on as an antiparallelogram",
        PARALLELOGRAM,
        Known("turns evenly for 30 rad, to 1e-7", {"a.angle": uniform}, 1e-7),
        fault="no projection",
    ),
    Case(
        "slider-crank with equal lengths",
        "the piston can stay in the centre while the crank turns",
        CRANK,
        Measured("the piston passes the centre: x and energy to 1e-7", piston, 1e-7),
        fault="no projection",
    ),
    Case(
        "slider-crank through its dead centres",
        "idle for 20 s",
        "examples/slider_crank.mech",
        Followed("follows the reference to 1e-7", 1e-7),
        fault="loose",
        options={"experiment": "idle", "stop": 20, "set": {"der(main.angle)": 20.0}},
    ),
    chain(2, 1e-8),
    chain(10, 1e-8),
    chain(40, 1e-8, full=True),
)

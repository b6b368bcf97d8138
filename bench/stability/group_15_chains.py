"""Long chains, and heavy bobs on light ones."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.linalg import eigh

from .case import Array, Case, Formula, Known, Measured, energy_drift

NUMBER = 15
TITLE = "Long chains"

POINTS = """
import mech.planar.*;
model Swing
  frame from;
  frame to;
  parameter l = 1 m;
  coordinate Angle angle ~ 0 rad;
  place to = from * trans({{l*sin(angle), -l*cos(angle)}});
end Swing;
model Chain
  structural parameter Integer n = {n};
  parameter light = 1 kg;
  parameter heavy = {heavy} kg;
  gravity {{0, -9.81 m/s^2}};
  Particle bob[i in 1:n](m = if i == n then heavy else light);
  Swing rod[i in 1:n]((if i == 1 then world else bob[i-1].a) -> bob[i].a, l = 1 m, angle = {angle});
  output Length tip[2] = pos(bob[n].a);
  experiment(stop = {stop} s, tolerance = 1e-10);
end Chain;
"""

BARS = """
import mech.planar.*;
structural parameter Integer n = {n};
gravity {{0, -9.81 m/s^2}};
Bar link[i in 1:n](m = 1 kg, l = 1 m);
Revolute joint[i in 1:n]((if i == 1 then world else link[i-1].b) -> link[i].a,
                         angle = if i == 1 then -60 deg else 0 deg);
experiment(stop = {stop} s, tolerance = 1e-10);
"""


def small(n: int, heavy: float, start: Array, which: int) -> Formula:
    """Small oscillations: M a'' = -K a with the masses below each link; exact but for (angle)^2."""
    masses = np.ones(n)
    masses[-1] = heavy
    below = np.cumsum(masses[::-1])[::-1]
    m = np.array([[below[max(i, j)] for j in range(n)] for i in range(n)])
    squares, modes = eigh(np.diag(9.81 * below), m)
    weights = modes.T @ m @ start

    def angle(t: Array) -> Any:
        return (modes[which - 1] * weights) @ np.cos(np.sqrt(squares)[:, None] * t)

    return angle


def tilted(n: int, heavy: float, stop: float, bound: float, full: bool = False) -> Case:
    text = POINTS.format(n=n, heavy=heavy, angle="1e-6 rad", stop=stop)
    names = {f"rod[{i}].angle": small(n, heavy, np.full(n, 1e-6), i) for i in (1, n)}
    return Case(
        f"{n} links, the last bob {heavy:g} times heavier",
        "all links 1e-6 rad off the vertical: every mode swings",
        text,
        Known(f"small oscillations, to {bound:g}", names, bound),
        fault="loose",
        full=full,
        seconds=600 if full else 60,
    )


def falling(n: int, stop: float, full: bool = False) -> Case:
    return Case(
        f"{n} bars let go at 60 deg",
        "large rotations, waves along the chain",
        BARS.format(n=n, stop=stop),
        Measured("keeps its energy to 1e-12", energy_drift, 1e-12),
        fault="loose",
        full=full,
        seconds=900 if full else 120,
    )


CASES = (
    tilted(10, 1e6, 5, 3e-8),
    tilted(100, 1, 5, 1e-6),
    tilted(100, 1e3, 0.5, 1e-8),
    tilted(100, 1e6, 0.5, 1e-5, full=True),
    falling(100, 3),
    falling(1000, 1, full=True),
)

"""Long chains, and heavy bobs on light ones."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from .case import Array, Case, Formula, Known, Measured, energy_drift

NUMBER = 15
DIGITS = 25
"""Of closed solutions."""

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


@cache
def oscillations(n: int, heavy: float) -> tuple[Array, Array, Array]:
    """Return mu = 1/omega^2, the modes q and the roots r of the stiffnesses: angles are q/r times normal coordinates."""
    below = np.arange(n, 0, -1) - 1 + heavy  # masses that each link carries
    roots = np.sqrt(9.81 * below)
    scaled = np.minimum.outer(below, below) / np.outer(roots, roots)
    if heavy <= 1e3:
        mu, modes = np.linalg.eigh(scaled)
        return mu, modes, roots
    import mpmath  # doubles lose as many digits as the masses differ by

    with mpmath.workdps(DIGITS):
        exact = [mpmath.mpf(b) for b in below]
        matrix = mpmath.matrix(n, n)
        for i in range(n):
            for j in range(n):
                matrix[i, j] = min(exact[i], exact[j]) / mpmath.sqrt(exact[i] * exact[j]) / mpmath.mpf("9.81")
        found, vectors = mpmath.eigsy(matrix)
        return np.array([float(x) for x in found]), np.array(vectors.tolist(), dtype=float), roots


def small(n: int, heavy: float, start: Array, which: int) -> Formula:
    """Small oscillations: M a'' = -K a with the masses below each link; exact but for (angle)^2."""

    def angle(t: Array) -> Any:
        mu, modes, roots = oscillations(n, heavy)
        amplitudes = modes[which - 1] / roots[which - 1] * (modes.T @ (roots * start))
        return amplitudes @ np.cos(np.asarray(t) / np.sqrt(mu)[:, None])

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

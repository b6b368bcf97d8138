"""Pendulums that are driven fast, or at the edge of a resonance."""

from __future__ import annotations

import numpy as np
from scipy.special import mathieu_a, mathieu_b, mathieu_cem, mathieu_sem

from mechc.solution import Solution

from .case import Array, Case, Followed, Known, Measured

NUMBER = 17
TITLE = "Fast drives and parametric resonance"

KAPITZA = """
parameter l = 1 m;
parameter A = {a!r} m;
parameter w = {w!r} rad/s;
gravity {{0, -9.81 m/s^2}};
coordinate Angle th = 0.1 rad;
mass 1 kg at world * trans({{0 m, A*cos(w*time)}}) * rot(th) * {{0 m, l}};
experiment(stop = {stop} s, tolerance = 1e-9);
"""

MATHIEU = """
dimensionless;
parameter a = {a!r};
parameter q = {q!r};
coordinate x = {x!r};
initial der(x) = {v!r};
kinetic 1/2*der(x)^2;
potential 1/2*(a - 2*q*cos(2*time))*x^2;
experiment(stop = {stop!r}, tolerance = 1e-12);
"""


def widest(s: Solution) -> float:
    return float(np.abs(s["th"]).max())


def crossings(s: Solution) -> int:
    """Count how often it passes the upright position, or 0."""
    return int(np.count_nonzero(np.diff(np.sign(s["th"]))))


def mathieu(kind: str, q: float, periods: int, bound: float) -> Case:
    """On the edge of the first tongue Mathieu's equation has a periodic solution; errors grow linearly."""
    even = kind == "ce"
    characteristic = float(mathieu_a(1, q) if even else mathieu_b(1, q))
    function = mathieu_cem if even else mathieu_sem

    def value(t: Array) -> Array:
        return np.asarray(function(1, q, np.degrees(np.mod(t, 2 * np.pi)))[0])

    x, v = (float(f) for f in function(1, q, 0.0))
    text = MATHIEU.format(a=characteristic, q=q, x=x, v=v if not even else 0.0, stop=2 * np.pi * periods)
    return Case(
        f"edge of the tongue, {kind}1, q = {q:g}",
        f"between growth and beat: {periods} periods",
        text,
        Known(f"the periodic Mathieu function, to {bound:g}", {"x": value}, bound),
        fault="loose",
    )


def growth(s: Solution) -> float:
    """Deviation of the measured exponent from Hill's: for small q at the middle of the tongue it is q/2."""
    x, v, t = s["x"], s["der(x)"], s.time
    size = np.log(np.hypot(x, v))
    late = t > t[-1] / 2
    turns = np.round(t[late] / np.pi) * np.pi
    at = [np.argmin(np.abs(t - turn)) for turn in np.unique(turns)]
    slope = np.polyfit(t[at], size[at], 1)[0]
    return float(abs(slope / (0.01 / 2) - 1))


CASES = (
    Case(
        "Kapitza's pendulum, upright",
        "driven at 1e4 rad/s with 1 mm: A^2 w^2 = 100 > 2 g l; 16 000 periods of the drive",
        KAPITZA.format(a=1e-3, w=1e4, stop=10),
        Measured(
            "swings about the upright position 20 times in 10 s, as sqrt(A^2 w^2/2 - g l) says",
            lambda s: abs(crossings(s) - 20),
            1,
            (("within 0.11 rad", lambda s: widest(s) < 0.11),),
        ),
        fault="sign",
    ),
    Case(
        "Kapitza's pendulum, followed",
        "the same for 0.05 s",
        KAPITZA.format(a=1e-3, w=1e4, stop=0.05),
        Followed("follows the reference to 1e-6", 1e-6, seconds=15),
        fault="loose",
    ),
    Case(
        "Kapitza's pendulum, too slow",
        "A^2 w^2 = 17.6 < 2 g l = 19.6",
        KAPITZA.format(a=4.2e-4, w=1e4, stop=10),
        Measured("falls over: turns by more than pi/2", lambda s: -widest(s), -np.pi / 2),
        fault="sign",
    ),
    mathieu("ce", 1.0, 100, 1e-6),
    mathieu("se", 1.0, 100, 1e-6),
    mathieu("ce", 25.0, 20, 1e-3),
    Case(
        "inside the tongue",
        "a = 1, q = 0.01: grows by e every 200 time units",
        MATHIEU.format(a=1.0, q=0.01, x=1.0, v=1.0, stop=1000 * np.pi),
        Measured("the exponent q/2, to 1e-2", growth, 1e-2),
        fault="sign",
    ),
)

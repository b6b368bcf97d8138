"""The same motion in astronomical, atomic and scaled units."""

from __future__ import annotations

import math

import numpy as np

from mechc.solution import Solution

from .case import Case, Known, Measured, within
from .group_03_close_orbits import anomaly

NUMBER = 19
TITLE = "Units and sizes"

SUN, AU, G = 1.989e30, 1.496e11, 6.6743e-11
YEAR = 2 * math.pi * math.sqrt(AU**3 / (G * SUN))
ECCENTRICITY = 0.6

ASTRONOMICAL = f"""
parameter m = 5.97e24 kg;
parameter M = {SUN} kg;
parameter a = {AU} m;
parameter e = {ECCENTRICITY};
parameter G = {G} m^3/kg/s^2;
coordinate Length x = a*(1 - e);
coordinate Length y = 0 m;
initial der(y) = sqrt(G*M/a*(1 + e)/(1 - e));
kinetic 1/2*m*(der(x)^2 + der(y)^2);
potential -G*m*M/sqrt(x^2 + y^2);
experiment(stop = {10.3 * YEAR!r} s, tolerance = 1e-10);
"""


def place(turns: float) -> tuple[float, float]:
    at = float(anomaly(np.array([2 * np.pi * turns]), ECCENTRICITY)[0])
    return math.cos(at) - ECCENTRICITY, math.sqrt(1 - ECCENTRICITY**2) * math.sin(at)


X, Y = place(10.3)

BOND = """
parameter m = 1.5e-26 kg;
parameter k = 500 N/m;
parameter c = {c} kg/s;
coordinate Length x = 1e-12 m;
coordinate Length y = -2e-12 m;
kinetic 1/2*m*(der(x)^2 + 4*der(y)^2);
potential 1/2*k*(x - y)^2 + 1/2*k*x^2;
experiment(stop = 2e-12 s, tolerance = 1e-10);
"""


def bond(t: float) -> tuple[float, float]:
    squares, modes = np.linalg.eigh(np.array([[2.0, -0.5], [-0.5, 0.25]]) * 500 / 1.5e-26)
    start = modes.T @ np.array([1e-12, -4e-12])
    x, y = modes @ (start * np.cos(np.sqrt(squares) * t))
    return float(x), float(y / 2)


def quiet(s: Solution) -> float:
    """Relative deviation from a parabola of 1e-20 m."""
    expected = 0.5 * 1e-20 * s.time**2
    return float(np.abs(s["x"] - expected).max() / expected.max())


CASES = (
    Case(
        "planet in SI",
        "masses of 1e30 kg, lengths of 1e11 m, times of 1e8 s",
        ASTRONOMICAL,
        Known("the place after 10.3 years, to 1e-6", {"x": AU * X, "y": AU * Y}, 1e-6, (within(450),)),
        fault="loose",
    ),
    Case(
        "planet in scaled units",
        "the same orbit with a = 1 and a year of 2 pi",
        "examples/kepler.mech",
        Known(
            "the place after 10.3 years, to 1e-6, in as many steps", {"x": X, "y": Y}, 1e-6, (within(450),)
        ),
        fault="loose",
        options={"set": {"e": ECCENTRICITY}, "stop": 10.3 * 2 * math.pi, "tolerance": 1e-10},
    ),
    Case(
        "bond of two atoms in SI",
        "masses of 1e-26 kg, lengths of 1e-12 m, times of 1e-14 s",
        BOND.format(c=0),
        Known("both places, to 1e-7", dict(zip("xy", bond(2e-12), strict=True)), 1e-7),
        fault="loose",
    ),
    Case(
        "motion of 1e-20 m",
        "everything starts at zero; the only size is that of a force",
        "coordinate Length x = 0 m;\nkinetic 1/2*1 kg*der(x)^2;\nforce 1e-20 N on x;\nexperiment(stop = 1 s);",
        Measured("the parabola to 1e-9", quiet, 1e-9),
        fault="sign",
    ),
    Case(
        "swing of 1e-20 m",
        "a millionth of the diameter of a nucleus",
        "coordinate Length x = 1e-20 m;\nkinetic 1/2*1 kg*der(x)^2;\npotential 1/2*1 N/m*x^2;\nexperiment(stop = 20 s);",
        Known("the place, to 1e-6 of the swing", {"x": lambda t: 1e-20 * np.cos(t)}, 1e-6),
        fault="no nominal",
    ),
    Case(
        "large beside small",
        "one coordinate of 1e6 m beside one of 1e-4 m that swings 100 times faster",
        """
parameter a = 1e6 m;
parameter b = 1e-4 m;
coordinate Length x = a;
coordinate Length y = b;
kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
potential 1/2*1 N/m*x^2 + 1/2*1e4 N/m*y^2;
experiment(stop = 10 s, tolerance = 1e-10);
""",
        Known("both to 1e-7", {"x": lambda t: 1e6 * np.cos(t), "y": lambda t: 1e-4 * np.cos(100 * t)}, 1e-7),
        fault="loose",
    ),
)

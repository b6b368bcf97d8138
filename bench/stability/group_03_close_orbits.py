"""Kepler's problem with eccentricities near one, and a collision."""

from __future__ import annotations

import numpy as np

from .case import Array, Case, Followed, Known, Refusal

NUMBER = 3
TITLE = "Kepler orbits of high eccentricity"


def anomaly(mean: Array, e: float) -> Array:
    """Solve Kepler's equation by bisection, which no eccentricity disturbs, then Newton's method."""
    turns = np.round(mean / (2 * np.pi))
    m = mean - 2 * np.pi * turns
    low, high = np.full_like(m, -np.pi), np.full_like(m, np.pi)
    for _ in range(60):
        middle = (low + high) / 2
        above = middle - e * np.sin(middle) > m
        high, low = np.where(above, middle, high), np.where(above, low, middle)
    return (low + high) / 2 + 2 * np.pi * turns


def orbit(e: float, periods: float) -> dict[str, float]:
    """Return the place after so many periods and a half: at the apocentre, where the clock does not matter much."""
    at = anomaly(np.array([2 * np.pi * periods]), e)[0]
    root = np.sqrt((1 - e) * (1 + e))
    return {"x": float(np.cos(at) - e), "y": float(root * np.sin(at))}


def case(e: float, bound: float, periods: float = 10.5, full: bool = False) -> Case:
    return Case(
        f"e = {e:g}, {periods:g} periods",
        f"speed and force grow by {(1 + e) / (1 - e):.0g} and {((1 + e) / (1 - e)) ** 2:.0g} at each pericentre",
        "examples/kepler.mech",
        Known(f"the place to {bound:g}", orbit(e, periods), bound, sizes={"y": 1.0}),
        fault="loose",
        options={"set": {"e": e}, "stop": 2 * np.pi * periods, "tolerance": 1e-12},
        full=full,
    )


FALL = """
dimensionless;
coordinate r = 1;
kinetic 1/2*der(r)^2;
potential -1/r;
experiment(stop = 2, tolerance = 1e-10);
"""
COLLISION = np.pi / (2 * np.sqrt(2))


def falling(t: Array) -> Array:
    """The radial orbit r = (1 + cos s)/2, t = (s + sin s)/(2 sqrt 2)."""
    low, high = np.zeros_like(t), np.full_like(t, np.pi)
    for _ in range(60):
        middle = (low + high) / 2
        late = (middle + np.sin(middle)) / (2 * np.sqrt(2)) > t
        high, low = np.where(late, middle, high), np.where(late, low, middle)
    return (1 + np.cos((low + high) / 2)) / 2


CASES = (
    case(0.9, 1e-8),
    case(0.99, 1e-7),
    case(0.999, 1e-5),
    case(0.9999, 1e-4),
    case(0.999, 1e-3, periods=1000.5, full=True),
    Case(
        "collision course",
        "no angular momentum: the force is infinite at t = pi/(2 sqrt 2)",
        FALL,
        Refusal(f"stops at t = {COLLISION:.7f} and names r; right until then", ("r",),
                (COLLISION - 1e-6, COLLISION + 1e-6), {"r": falling}, 1e-6),
        fault="no refusal",
    ),
    Case(
        "collision course in the plane",
        "the same with two coordinates, of which one stays zero",
        "examples/kepler.mech",
        Refusal("stops at the collision", ("t =",), (COLLISION - 1e-5, COLLISION + 1e-5)),
        fault="no refusal",
        options={"set": {"x": 1.0, "der(y)": 0.0}, "stop": 2.0},
    ),
    Case(
        "near collision",
        "angular momentum 1e-6: the pericentre is at 5e-13",
        "examples/kepler.mech",
        Followed("follows the reference to 1e-2, or says that it does not", 1e-2),
        fault="loose",
        options={"set": {"x": 1.0, "der(y)": 1e-4}, "stop": 2.0, "tolerance": 1e-13},
    ),
)  # fmt: skip

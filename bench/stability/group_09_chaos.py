"""Motions whose errors grow exponentially: what is reported must own up to it."""

from __future__ import annotations

import numpy as np

from mechc.solution import Solution

from .case import Array, Case, Known, Measured, energy_drift

NUMBER = 9
TITLE = "Separatrix and chaos"

SEPARATRIX = """
dimensionless;
coordinate Angle th = 0 rad;
initial der(th) = 2;
kinetic 1/2*der(th)^2;
potential -cos(th);
experiment(stop = {stop}, tolerance = 1e-12);
"""
DOUBLE = "examples/double_pendulum.mech"
THROWN = {"c": 0.0, "shoulder.angle": 2.0, "elbow.angle": 1.0, "der(elbow.angle)": 0.0}


def rising(t: Array) -> Array:
    """The pendulum that comes to rest upside down: th = 4 atan(exp(t)) - pi."""
    return 4 * np.arctan(np.exp(t)) - np.pi


def unclaimed(s: Solution) -> float:
    """Return the digits that a run claims: minus the logarithm of its estimated error."""
    estimate = s.accuracy.error
    return 16.0 if estimate is None else float(-np.log10(estimate.largest))


CASES = (
    Case(
        "separatrix, 10 time units",
        "an error at the start has grown by exp(10)",
        SEPARATRIX.format(stop=10),
        Known("the angle to 1e-7", {"th": rising}, 1e-7),
        fault="sign",
    ),
    Case(
        "separatrix, 25 time units",
        "an error has grown by exp(25) = 7e10: a few digits are left",
        SEPARATRIX.format(stop=25),
        Known("the angle to 0.3, as the estimate says", {"th": rising}, 0.3),
        fault="understated",
    ),
    Case(
        "separatrix, beyond the horizon",
        "at t = 60 not a digit is left",
        SEPARATRIX.format(stop=60),
        Measured("claims less than one digit", unclaimed, 1.0),
        fault="understated",
    ),
    Case(
        "chaotic double pendulum, beyond the horizon",
        "100 s, errors grow by exp(1.5 t) or more",
        DOUBLE,
        Measured("claims less than one digit", unclaimed, 1.0),
        fault="understated",
        options={"stop": 100, "set": THROWN},
    ),
    Case(
        "chaotic double pendulum, what is kept",
        "the same for 1000 s: the energy does not know of chaos",
        DOUBLE,
        Measured("energy to 1e-8", energy_drift, 1e-8),
        fault="loose",
        options={"stop": 1000, "tolerance": 1e-12, "set": THROWN},
    ),
)

"""A free body that turns over again and again."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.special import ellipj, ellipk

from mechc.solution import Solution

from .case import Array, Case, Formula, Known, Measured, drift

NUMBER = 7
TITLE = "Flips of the intermediate axis"

J = np.array([1.0, 2.0, 3.0])
BODY = """
dimensionless;
coordinate Rotation R;
initial der(R) = {{{w}, 0, {w}}};
frame body = world * R;
inertia diag({{1, 2, 3}}) on body;
output L = direction(body, {{1*der(R)[1], 2*der(R)[2], 3*der(R)[3]}});
experiment(stop = {stop!r}, tolerance = {tolerance});
"""
"""It starts where the rate about the middle axis is zero, with equal rates about the others."""


def rates(w: float) -> tuple[float, float, float]:
    """Rate and squared modulus of the elliptic functions, and the size of the middle rate.

    w1 = w cn or dn, w2 = B sn, w3 = w dn or cn; from Euler's equations with J = 1, 2, 3:
    w1' = -w2 w3, w2' = w3 w1, w3' = -w1 w2 / 3.
    """
    # w2'^2 = (w^2 - w2^2)(w^2 - w2^2/3): B = w, modulus^2 = 1/3, rate w
    return w, 1 / 3, w


def middle(w: float) -> Formula:
    rate, m, size = rates(w)

    def value(t: Array) -> Any:
        quarter = ellipk(m)
        return size * ellipj(np.mod(rate * t, 4 * quarter), m)[0]

    return value


def flips(count: int, w: float) -> float:
    """Return the time of so many flips: half periods of the middle rate."""
    return float(2 * count * ellipk(1 / 3) / w)


NEAR = """
dimensionless;
coordinate Rotation R;
initial der(R) = {{1e-8, 1, 1e-8}};
frame body = world * R;
inertia diag({{1, 2, 3}}) on body;
output L = direction(body, {{1*der(R)[1], 2*der(R)[2], 3*der(R)[3]}});
experiment(stop = {stop}, tolerance = 1e-13);
"""

TURNING = """
dimensionless;
coordinate Rotation R = rotx(0.5 rad);
initial der(R) = {0.3, 0.2, 1};
frame body = world * R;
inertia diag({1, 1.3, 1.7}) on body;
output axis = direction(body, {0, 0, 1});
experiment(stop = 1000, tolerance = 1e-3);
"""


def stretched(s: Solution) -> float:
    """How far the length of a unit vector of the body is from 1."""
    length = np.sqrt(sum(s[f"axis[{k}]"] ** 2 for k in (1, 2, 3)))
    return float(np.abs(length - 1).max())


CASES = (
    Case(
        "rotation at a loose tolerance",
        "1000 rad at a tolerance of 1e-3",
        TURNING,
        Measured("stays a rotation: unit vectors to 1e-14", stretched, 1e-14),
        fault="not normalised",
    ),
    Case(
        "1000 flips",
        "a long periodic motion in space",
        BODY.format(w=1, stop=flips(1000, 1), tolerance=1e-12),
        Known("the middle rate to 1e-7", {"der(R)[2]": middle(1)}, 1e-7),
        fault="loose",
    ),
    Case(
        "1000 flips, what is kept",
        "the angular momentum in space",
        BODY.format(w=1, stop=flips(1000, 1), tolerance=1e-12),
        Measured(
            "L and energy to 1e-8",
            lambda s: max(drift(s), *(float(np.ptp(s[f"L[{k}]"])) for k in (1, 2, 3))),
            1e-8,
        ),
        fault="loose",
    ),
    Case(
        "spin about the middle axis",
        "1e-8 off the unstable axis: errors grow by exp(0.58 t) between flips, over 30 flips",
        NEAR.format(stop=2000),
        Measured(
            "L and energy to 1e-9, whatever becomes of the phase",
            lambda s: max(drift(s), *(float(np.ptp(s[f"L[{k}]"])) for k in (1, 2, 3))),
            1e-9,
        ),
        fault="loose",
    ),
    Case(
        "100 000 flips",
        "a very long periodic motion",
        BODY.format(w=1, stop=flips(100_000, 1), tolerance=1e-13),
        Known("the middle rate to 1e-4", {"der(R)[2]": middle(1)}, 1e-4),
        fault="loose",
        full=True,
        seconds=300,
    ),
)

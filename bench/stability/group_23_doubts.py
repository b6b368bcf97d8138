"""Runs whose own checks contradict what they claim, and runs whose checks look as if they did."""

from __future__ import annotations

import math

import numpy as np

from mechc.runtime.outcome import Outcome

from .case import Case, Known, Measured, energy_drift

NUMBER = 23
TITLE = "Checks beside estimates"

SPRING = """
parameter c = 0.5 N.s/m;
coordinate Length x = 1 m;
kinetic 1/2*1 kg*der(x)^2;
potential 1/2*4 N/m*x^2;
{more}
experiment(stop = 3 s, tolerance = {tolerance});
"""
ROOF = """
coordinate Length x = -1 m;
coordinate Length y = -0.5 m;
initial der(x) = 3 m/s;
initial der(y) = 1.5 m/s;
kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
potential 1 kg*9.81 m/s^2*y;
contact c: y + 0.5*abs(x);
experiment(stop = 0.6 s);
"""
TOP = math.sqrt(9 - 2 * 0.4 * 9.81)
FLIGHT = 0.6 - (3 - TOP) / (0.4 * 9.81)
BENT = """
coordinate Length x = 0 m;
initial der(x) = 1 m/s;
kinetic 1/2*1 kg*der(x)^2;
force 0.1 N*(abs(x - 1/3*(1 m)) - x)/(1 m) on x;
experiment(stop = 1 s, method = "gauss4", step = 10 ms);
"""


def bent(t: np.ndarray) -> np.ndarray:
    """x'' = 0.1 (1/3 - 2 x) up to x = 1/3, -1/30 after."""
    w = np.sqrt(0.2)

    def before(t: np.ndarray) -> np.ndarray:
        return 1 / 6 - np.cos(w * t) / 6 + np.sin(w * t) / w

    low, high = 0.0, 1.0
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if before(np.array(middle)) < 1 / 3 else (low, middle)
    speed = np.sin(w * low) * w / 6 + np.cos(w * low)
    behind = 1 / 3 + speed * (t - low) - (t - low) ** 2 / 60
    return np.where(t < low, before(t), behind)


DOUBTFUL = Known("ends as doubtful", {}, 1.0, ends=Outcome.DOUBTFUL)

CASES = (
    Case(
        "closed solution off by 1e-4",
        "a slip of the pen in the model's own check",
        SPRING.format(more="exact x = 1.0001 m*cos(2 rad/s*time);", tolerance=1e-8).replace(
            "parameter c = 0.5 N.s/m;\n", ""
        ),
        DOUBTFUL,
        fault="checks silent",
    ),
    Case(
        "loose and right",
        "an energy that is off by 1e-4 at a tolerance of 1e-4",
        SPRING.format(more="damping c on x;", tolerance=1e-4),
        Measured("keeps its energy to 1e-3, without a doubt", energy_drift, 1e-3),
        fault="understated",
    ),
    Case(
        "over a roof",
        "a closed contact bends: half of the energy would go",
        ROOF,
        Known(
            "flies from the ridge, to 1e-9",
            {"x": TOP * FLIGHT, "y": TOP / 2 * FLIGHT - 9.81 / 2 * FLIGHT**2},
            1e-9,
        ),
        fault="missed events",
    ),
    Case(
        "fixed steps over a bend",
        "gauss4 with a kink within a step",
        BENT,
        Known("the place, to 1e-4, and no claim 100 times less", {"x": bent}, 1e-4),
        fault="understated",
    ),
)

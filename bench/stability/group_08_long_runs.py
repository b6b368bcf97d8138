"""A pendulum for very many periods, by every method."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.special import ellipj, ellipk

from .case import Array, Case, Known, Measured, energy_drift

NUMBER = 8
TITLE = "Long runs"

PENDULUM = "examples/pendulum.mech"
PERIOD = float(4 * ellipk(np.sin(0.5) ** 2) / np.sqrt(9.81))


def angle(t: Array) -> Any:
    k, w = np.sin(0.5), np.sqrt(9.81)
    quarter = ellipk(k * k)
    return 2 * np.arcsin(k * ellipj(np.mod(quarter - w * t, 4 * quarter), k * k)[0])


def adaptive(method: str, tolerance: float, bound: float, periods: int = 10_000) -> Case:
    return Case(
        f"{method}, tolerance {tolerance:g}",
        f"{periods} periods",
        PENDULUM,
        Known(f"the angle to {bound:g}", {"theta": angle}, bound),
        fault="loose",
        options={"method": method, "tolerance": tolerance, "stop": periods * PERIOD},
        seconds=120,
    )


def fixed(
    method: str, steps: int, bound: float, periods: int, full: bool = False, long: bool = False
) -> Case:
    """``long``: the run without its companion, and no output but its ends and a few points."""
    return Case(
        f"{method}, {steps} steps a period, {periods:.0e} periods",
        f"{periods:.0e} periods",
        PENDULUM,
        Measured(f"the energy within {bound:g} all along", energy_drift, bound),
        fault="loose",
        options={
            "method": method,
            "step": PERIOD / steps,
            "stop": periods * PERIOD,
            "estimate_error": not long,
        },
        seconds=600 if full else 120,
        full=full,
    )


METHODS = (
    ("verlet", 100, 2e-3),
    ("gauss2", 100, 2e-3),
    ("gauss4", 50, 1e-5),
    ("gauss6", 30, 1e-7),
    ("gauss8", 30, 1e-8),
    ("lobatto4", 60, 1e-5),
    ("lobatto6", 40, 1e-7),
    ("rattle", 100, 2e-3),
    ("rk4", 200, 1e-3),
)

CASES = (
    adaptive("dop853", 1e-12, 1e-5),
    adaptive("radau5", 1e-11, 1e-2, 1000),
    *(fixed(method, steps, bound, 1000) for method, steps, bound in METHODS),
    *(fixed(m, n, b, 1_000_000, full=True, long=True) for m, n, b in METHODS if m != "rk4"),
)

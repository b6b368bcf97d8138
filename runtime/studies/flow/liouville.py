"""The determinant of the linear map of an orbit by Liouville's formula: exp of the integral of the divergence of the rates.

It uses rates at places of the orbit alone, and no derivative of the motion, so that it checks the multipliers independently.
"""

from __future__ import annotations

import math

import numpy as np

from ...case import inputs_at
from ...problem import Array
from ...tangent.coordinates import basis
from .linearised import Linearised, determinant
from .shooting import ShootingOrbit

PLACES = 256
"""Equally spaced on the orbit: the rule of the trapezoid converges exponentially for what is periodic."""
DIFFERENCE = 1e-3
"""Of nominal values: for derivatives of rates, by the rule of fourth order."""
LOOSE = 1e-7
"""Relative differences that count as those of the rule."""


def liouville(linear: Linearised, orbit: ShootingOrbit) -> tuple[float, float] | None:
    """Give the determinant and how far it may be off; None with constraints, rotations, or what switches."""
    problem, case = linear.problem, linear.tangents.case
    if problem.constraints or problem.rotations or problem.nq != problem.nv or problem.hybrid is not None:
        return None
    times = case.begin + orbit.period * np.arange(1, PLACES + 1) / PLACES
    flow = linear.tangents.flow(case.begin, orbit.start, basis(problem, orbit.start) * linear.scale, times)
    if flow.short:
        return None
    values = np.array([_divergence(linear, t, y) for t, y in zip(times, flow.states, strict=True)])
    whole, half = (float(values[::k].mean()) * orbit.period for k in (1, 2))
    size = float(np.abs(values).mean()) * orbit.period
    return math.exp(whole), math.exp(whole) * (abs(whole - half) + LOOSE * size)


def _divergence(linear: Linearised, t: float, y: Array) -> float:
    case, problem = linear.tangents.case, linear.problem
    u, total = inputs_at(case, t), 0.0
    for k in (k for k in problem.own if k >= problem.nq):
        h = DIFFERENCE * float(linear.tangents.nominal[k])
        found = []
        for share in (1, -1, 2, -2):
            moved = y.copy()
            moved[k] += share * h
            found.append(case.functions.rhs(t, moved, u, case.z, case.p)[k])
        total += (8 * (found[0] - found[1]) - (found[2] - found[3])) / (12 * h)
    return total


def contradicted(linear: Linearised, orbit: ShootingOrbit) -> str:
    """Say that the product of the multipliers is not what Liouville's formula gives; nothing where it is, or there is none."""
    known = liouville(linear, orbit)
    if known is None:
        return ""
    value, error = determinant(orbit.map)
    # the determinant is small beside the map where motions shrink: it is known relative to the map's size then
    noise = float(np.linalg.norm(orbit.map.error)) * max(float(np.linalg.norm(orbit.map.matrix)), 1.0)
    if abs(value - known[0]) <= 10 * (error + noise + known[1]) + 1e-9:
        return ""
    return (
        f"the product of the multipliers is {value:.6g}, and {known[0]:.6g} by Liouville's formula: the multipliers "
        "cannot be trusted"
    )

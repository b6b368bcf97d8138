"""The sizes that the errors of derivatives are measured against: those that a direction has early in the motion.

As derivatives grow, their relative tolerance bounds them; what they are at the start must not be lost meanwhile.
"""

from __future__ import annotations

import numpy as np

from ..case import inputs_at
from ..integrate.nominal_run import pilot_rows
from ..problem import Array
from .augmented import Augmented

NOISE = 1e-15
"""Of the size of a state over that of a parameter: what rounding makes of a derivative that is zero."""

LOOKS = 8
"""States along the motion at which is looked for an effect, where the start shows none."""


def tangent_nominals(
    augmented: Augmented, nominal: Array, w: Array, tolerance: float, looks: Array | None = None
) -> Array:
    """Give the nominal size [ny, k] of each derivative: that of a state times how far a direction moves it.

    ``w`` [ny, k]: the derivatives at the start. ``looks`` [m, 1 + ny]: times and states farther on. No size asks for
    digits that rounding does not leave.
    """
    case = augmented.case
    far = np.abs(w / nominal[:, None]).max(axis=0)
    span = _time_scale(augmented, nominal)
    rows = np.concatenate([[case.begin], case.y0])[None, :] if looks is None else looks
    for row in rows:
        if (far > 0).all():
            break
        pushed = _pushes(augmented, float(row[0]), row[1:], nominal) * span
        far = np.where(far > 0, far, np.where(np.isfinite(pushed), pushed, 0.0))
    if not (far > 0).all() and looks is None:
        return tangent_nominals(augmented, nominal, w, tolerance, _along(augmented, nominal))
    far = np.maximum(far, NOISE / tolerance / own_sizes(augmented))
    sizes: Array = nominal[:, None] * np.where(far > 0, far, 1.0)
    return sizes


def own_sizes(augmented: Augmented) -> Array:
    """Give the sizes [k] of the parameters that directions change; infinite where there is none."""
    case, asked = augmented.case, augmented.directions
    sizes = np.full(augmented.count, np.inf)
    for k, i in enumerate(asked.parameters, start=asked.states):
        quantity = case.problem.parameters[i]
        sizes[k] = abs(float(case.p[i])) or abs(quantity.nominal or 0.0) or np.inf
    return sizes


def _pushes(augmented: Augmented, t: float, y: Array, nominal: Array) -> Array:
    """Give the rates with which the directions [k] themselves move the state, over its sizes."""
    row = augmented.joined(y, np.zeros((y.size, augmented.count)))
    z = augmented.discretes(augmented.case.z)
    rates = augmented.functions.rhs(t, row, augmented.inputs(t), z, augmented.p)
    _, changes = augmented.split(rates, y.size)
    pushed: Array = np.abs(changes / nominal[:, None]).max(axis=0)
    return pushed


def _time_scale(augmented: Augmented, nominal: Array) -> float:
    """Give the time in which the state changes by its size, at most the duration."""
    case = augmented.case
    rates = np.abs(case.functions.rhs(case.begin, case.y0, inputs_at(case, case.begin), case.z, case.p))
    with np.errstate(divide="ignore", invalid="ignore"):
        times = nominal / rates
    duration = case.stop - case.begin
    return float(min([t for t in times if np.isfinite(t) and t > 0] + [duration])) or 1.0


def _along(augmented: Augmented, nominal: Array) -> Array:
    """Give times and states along a cheap run."""
    return pilot_rows(augmented.case, nominal, LOOKS)

"""What the results of a run show, and its report says: that nothing moves, that energy is fed in where it ought to be lost."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..interface import Quantity
from .accuracy import Accuracy
from .extents import Extent

if TYPE_CHECKING:
    from .solution import Solution

ROUNDING = 1e-12
"""Of the largest kinetic energy: what may be negative for rounding alone."""

FINE_INTEGRAL = 1e-9
"""Estimated relative error of a definite integral that is not worth a word."""

FED = 0.01
"""Of the largest energy: what is worth a word when it is fed in where energy ought to be lost."""


def shown_remarks(solution: Solution, listed: Sequence[Quantity], met: Mapping[str, Extent]) -> list[str]:
    """Give the remarks on a run with these quantities, of which ``met`` are the extents."""
    return [
        *_stillness(listed, len(solution.time), met),
        *_creeps(listed, met),
        *_coarse_integrals(listed, met, solution.accuracy),
        *_negative_inertia(solution, met),
        *_feeding(solution, met),
    ]


def _negative_inertia(solution: Solution, met: Mapping[str, Extent]) -> list[str]:
    """Tell where kinetic energy is negative: bodies of negative mass move, but not as anything does."""
    if "energy.kinetic" not in met:
        return []
    lowest = min(met["energy.kinetic"].lowest, 0.0)
    if not lowest < -ROUNDING * met["energy.kinetic"].largest:
        return []
    amount = f"{lowest:.3g} {solution.unit('energy.kinetic')}".rstrip()
    return [
        f"the kinetic energy falls to {amount}: a mass or an inertia is negative, if this is not meant so"
    ]


def _feeding(solution: Solution, met: Mapping[str, Extent]) -> list[str]:
    """Tell where what ought to dissipate feeds energy in all the time."""
    name = "energy.dissipated"
    if name not in met or len(solution.time) < 2:
        return []
    lost = met[name]
    scale = max((met[n].largest for n in met if n.startswith("energy.")), default=0.0)
    if not lost.last < lost.first - FED * scale or _rises(solution, name, ROUNDING * scale):
        return []
    amount = f"{lost.first - lost.last:.3g} {solution.unit('energy.dissipated')}".rstrip()
    return [f"nothing dissipates: damping, or forces that depend on velocities, feed in {amount}"]


def _rises(solution: Solution, name: str, by: float) -> bool:
    """Whether an output rises between two rows by more than that."""
    index = solution.motion.columns.index(name)
    before = np.empty(0)
    for _, outputs in solution.motion.columns.parts():
        values = np.concatenate([before, outputs[:, index]])
        if np.any(np.diff(values) > by):
            return True
        before = values[-1:]
    return False


def _stillness(listed: Sequence[Quantity], count: int, met: Mapping[str, Extent]) -> list[str]:
    """Tell where nothing moves: often initial values were forgotten."""
    moving = [quantity for quantity in listed if quantity.kind in ("coordinate", "rate")]
    states = [quantity for quantity in listed if quantity.kind == "state"]
    if not moving or count < 2 or not all(met[quantity.name].constant for quantity in moving + states):
        return []
    if any(met[quantity.name].first != 0 for quantity in moving if quantity.kind == "rate"):
        return []
    return ["nothing moves: it starts at rest in equilibrium"]


def _creeps(listed: Sequence[Quantity], met: Mapping[str, Extent]) -> list[str]:
    """Tell how fast regularized frictions moved where they ought to stick."""
    found = []
    for quantity in listed:
        fastest = max(met[quantity.name].highest, 0.0) if quantity.kind == "creep" else 0.0
        if fastest > 0:
            name, unit = quantity.name.removeprefix("creep(")[:-1], quantity.unit
            found.append(f"'{name}' creeps where it ought to stick, at up to {fastest:.3g} {unit}".rstrip())
    return found


def _coarse_integrals(listed: Sequence[Quantity], met: Mapping[str, Extent], accuracy: Accuracy) -> list[str]:
    """Tell which definite integrals are less accurate than the motion is said to be."""
    claimed = accuracy.error.largest if accuracy.error is not None else FINE_INTEGRAL
    found = []
    for quantity in listed:
        off = max(met[quantity.name].highest, 0.0) if quantity.kind == "quadrature" else 0.0
        if off > max(claimed, FINE_INTEGRAL):
            name = quantity.name.removeprefix("error(")[:-1]
            found.append(
                f"'{name}' is known to about {off:.1e} of its size only, and so is what follows from it"
            )
    return found

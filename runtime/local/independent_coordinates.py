"""Independent coordinates near a state: of the displacements that constraints allow, as many as describe all others."""

from __future__ import annotations

import numpy as np
import scipy.linalg
from msgspec import Struct
from numpy.typing import NDArray

from ..numerics.rank import POSITIONS, condition, decomposed, singular_values
from ..outcome import SimulationError
from ..problem import Array
from .chart import Chart
from .operating_point import Derivatives


class IndependentDisplacements(Struct, frozen=True, eq=False):
    """``chosen``: the displacements that are independent; ``tangent`` [n][s]: all displacements by these;
    ``condition`` of the choice: what it multiplies rounding errors by."""

    chosen: NDArray[np.intp]
    tangent: Array
    condition: float


def independent(
    chart: Chart, found: Derivatives, before: NDArray[np.intp] | None = None
) -> IndependentDisplacements:
    """Choose independent displacements: of the positions first, then of the velocities, those of the same coordinates
    where that can be; or keep those that were chosen ``before``. Raises SimulationError where the constraints depend on
    each other, and where those from before do.
    """
    n, nd = chart.size, chart.nd
    if not len(found.rate):
        return IndependentDisplacements(np.arange(n), np.eye(n), 1.0)
    if before is not None:
        return _kept(found, before)
    n_position = len(found.position)
    positions = null_space(found.position[:, :nd], n_position)
    chosen = _pivots(positions, ())
    nv = chart.problem.nv
    velocities = null_space(found.rate[:, nd : nd + nv], len(found.rate))
    same = [j for j in chosen if j < nv] if nd == nv else []
    chosen_velocities = _pivots(velocities, same)
    states = np.arange(nd + nv, n)
    everything = np.concatenate([chosen, nd + chosen_velocities, states]).astype(np.intp)
    held = np.vstack([found.position, found.rate])
    basis = null_space(held, len(held))
    part = basis[everything]
    return IndependentDisplacements(everything, basis @ np.linalg.inv(part), condition(part))


def _kept(found: Derivatives, chosen: NDArray[np.intp]) -> IndependentDisplacements:
    """Express all displacements by those that were chosen at another state."""
    held = np.vstack([found.position, found.rate])
    basis = null_space(held, len(held))
    part = basis[chosen]
    if not condition(part) < 1 / POSITIONS:
        raise SimulationError(
            "the independent coordinates of the start do not describe the motion everywhere",
            help="begin elsewhere, or end before",
        )
    return IndependentDisplacements(chosen, basis @ np.linalg.inv(part), condition(part))


def null_space(rows: Array, rank: int) -> Array:
    """Return an orthonormal basis [n][n - rank] of what rows send to zero; each row counts as much as the others.

    Raises SimulationError where their rank is lower: a singular position.
    """
    if not len(rows):
        return np.eye(rows.shape[1])
    sizes = np.linalg.norm(rows, axis=1, keepdims=True)
    if not (sizes > 0).all():
        raise _singular()
    found = decomposed(rows / sizes)
    if found.rank(POSITIONS) < rank:
        raise _singular()
    return found.right[rank:].T


def _singular() -> SimulationError:
    return SimulationError(
        "the constraints depend on each other at this state: a singular position has no independent coordinates",
        help="look at a state beside it",
    )


def _pivots(basis: Array, preferred: list[int] | tuple[()]) -> NDArray[np.intp]:
    """Choose rows of a basis that are independent of each other: the preferred ones if they are, else well-conditioned ones."""
    count = basis.shape[1]
    if len(preferred) == count and count and singular_values(basis[list(preferred)])[-1] > 1e-3:
        return np.sort(np.array(preferred, dtype=np.intp))
    order = scipy.linalg.qr(basis.T, pivoting=True, mode="r")[1]
    found: NDArray[np.intp] = np.sort(order[:count]).astype(np.intp)
    return found

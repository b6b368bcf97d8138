"""Inequalities at every place: which nodes lie on their bound, found together with the curve (primal-dual active sets,
Hintermueller, Ito, Kunisch 2003)."""

from __future__ import annotations

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from ..problem import Array
from . import slope_bounds
from .discrete import DiscreteCurve
from .newton import Solved
from .unknowns import Unknowns, local

MOST_SETS = 40
NARROWEST = 2e-6
"""Elements in which a bound begins to hold are halved down to this share of the range: the second derivative jumps there."""


def begin(discrete: DiscreteCurve, start: Unknowns) -> Unknowns:
    """Let a bound hold at first where the start violates it, or presses; return from where to go on."""
    discrete.leaps = slope_bounds.leaps(discrete, start)
    for active, which, residuals, densities in _bounds(discrete, start):
        for m, bound in which:
            if bound:
                active[:, :, m] = (residuals[m] < -_rounding(residuals[m])) | (densities[m] < 0)
    _agree(discrete)
    return slope_bounds.begun(discrete, start) if discrete.leaps else start


def settled(discrete: DiscreteCurve, unknowns: Unknowns) -> Unknowns | None:
    """Let go where a bound pulls, hold where it is violated; return from where to go on, None if nothing changed."""
    changed = False
    for active, which, residuals, densities in _bounds(discrete, unknowns):
        for m, bound in which:
            if not bound:
                continue
            now = np.where(active[:, :, m], densities[m] < 0, residuals[m] < -_rounding(residuals[m]))
            changed |= bool(np.any(now != active[:, :, m]))
            active[:, :, m] = now
    _agree(discrete)
    moved = slope_bounds.settled(discrete, unknowns) if discrete.leaps else None
    return moved or (unknowns if changed else None)


def _rounding(residuals: Array) -> float:
    return float(1e-13 * np.max(np.abs(residuals)))


def has_bounds(discrete: DiscreteCurve) -> bool:
    return any(row.bound for row in discrete.curve.points)


def borders(discrete: DiscreteCurve) -> NDArray[np.bool_]:
    """Return the elements in which a bound begins or ends to hold, and that are not narrow yet."""
    marked = slope_bounds.corners(discrete) if discrete.leaps else np.zeros(discrete.mesh.count, dtype=bool)
    layout, curve = discrete.layout, discrete.curve
    for active, which in ((discrete.active_nodes, layout.positions), (discrete.active_rates, layout.rates)):
        for m, k in enumerate(which):
            if curve.points[k].bound:
                held = active[:, :, m]
                marked |= held.any(axis=1) & ~held.all(axis=1)
    return marked & (np.diff(discrete.mesh.nodes) > NARROWEST)


def solved_with_bounds(discrete: DiscreteCurve, first: Solved, again) -> Solved:  # type: ignore[no-untyped-def]
    """Solve again until the nodes at their bounds stay the same. ``again(unknowns)`` solves for the present ones."""
    solved: Solved = first
    steps = solved.steps
    for _ in range(MOST_SETS):
        rates = discrete.active_rates.copy()
        start = settled(discrete, solved.at) if solved.converged else None
        if start is None:
            break
        found: Solved = again(start)
        steps += found.steps
        if discrete.leaps and not found.converged:  # the corner moved too far: smaller elements first
            discrete.active_rates[:] = rates
            break
        solved = found
    else:
        return replace(solved, steps=steps, why="the places that touch do not settle")
    return replace(solved, steps=steps)


def _bounds(discrete: DiscreteCurve, unknowns: Unknowns):  # type: ignore[no-untyped-def]
    layout, curve = discrete.layout, discrete.curve
    block = local(unknowns)
    found = []
    for active, indices, places, where in (
        (discrete.active_nodes, layout.positions, discrete.nodes, layout.node_place),
        (discrete.active_rates, layout.rates, discrete.rate_nodes, layout.rate_place),
    ):
        if not indices:
            continue
        if discrete.leaps and indices is layout.rates:  # other rules hold for these
            continue
        y = discrete.rows(unknowns, places)
        values = discrete.call("points", places.s, y, discrete._z(unknowns))
        which = [(m, curve.points[k].bound) for m, k in enumerate(indices)]
        residuals = [values[k] for k in indices]
        densities = [block[:, where[:, m]] for m in range(len(indices))]
        found.append((active, which, residuals, densities))
    return found


def _agree(discrete: DiscreteCurve) -> None:
    """A node between two elements is one node."""
    nodes = discrete.active_nodes
    if nodes.size and len(nodes) > 1:
        both = nodes[:-1, -1] | nodes[1:, 0]
        nodes[:-1, -1] = both
        nodes[1:, 0] = both

"""Moves of the coordinates that leave the equations of motion as they are: shifts, turns of two coordinates, and sums of these.

They are the null space of what each shift and each turn changes of accelerations and constraints at random states.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
from msgspec import Struct

from ...local.operating_point import Site
from ...problem import Array
from ..formulas.null_space import null_space, sparse_basis
from ..formulas.sampling import Sampler

KEPT = 1e-9
"""Largest rate of a momentum, relative to the sizes of what it is the sum of, that is rounding."""
WHOLE = 1e-9
"""How near a share of a shift or a turn comes to a whole number that it is."""
ROUNDING = 1e-13
"""Of the terms of which the change of an acceleration is the sum."""
MOST = 400
"""Shifts and turns that are looked at."""


class Move(Struct, frozen=True, eq=False):
    """Coordinates move at the rates A q + b where it goes on at the rate 1; ``name`` of that rate, ``axis`` of the momentum that
    belongs to it. ``kept``: whether this momentum is constant."""

    name: str
    axis: str
    unit: str
    A: Array
    b: Array
    kept: bool = False

    def at(self, q: Array) -> Array:
        """Return the rates of the coordinates."""
        return self.A @ q + self.b


def moves_of(site: Site) -> tuple[list[Move], bool]:
    """Return the moves that leave equations and constraints as they are, and whether the energy is constant."""
    problem, n = site.problem, site.problem.nq
    listed = _listed(site)
    sampler = Sampler(site.case, seed=11)
    sample = sampler.states(3 * len(listed) // max(n, 1) + 8)
    rows = np.vstack([_changes(site, y, listed) for y in sample.y])
    sizes = np.array([float(sampler.width[:n][one.b != 0].max(initial=1.0)) for one in listed])
    strengths = np.abs(rows).max(axis=1)
    rows = rows[strengths > 0] / strengths[strengths > 0, None]
    found = null_space(rows * sizes, np.ones(len(listed))).vectors if len(rows) else np.eye(len(listed))
    costs = np.array([1.0 if one.b.any() else 1.5 for one in listed])
    basis = sparse_basis(found * sizes, costs, np.ones(len(listed)))
    momenta = [k for k, q in enumerate(problem.phase) if q.kind == "momentum"]
    moves = []
    for vector in basis:
        vector = vector / vector[np.abs(vector).argmax()]
        vector = np.where(np.abs(vector - np.round(vector)) < WHOLE, np.round(vector), vector)
        parts = [(one, float(c)) for one, c in zip(listed, vector, strict=True) if c]
        A = sum((c * one.A for one, c in parts), np.zeros((n, n)))
        b = sum((c * one.b for one, c in parts), np.zeros(n))
        changes, scale = [], []
        for y, p, rate in zip(sample.y, sample.phase[:, momenta], sample.phase_rate[:, momenta], strict=True):
            terms = np.r_[rate * (A @ y[:n] + b), p * (A @ y[n : 2 * n])]
            changes.append(abs(terms.sum()))
            scale.append(np.abs(rate).sum() * np.abs(A @ y[:n] + b).max() + np.abs(terms).sum())
        kept = max(changes) <= KEPT * max(max(scale), 1e-300)
        axis = _text([(one.axis, c) for one, c in parts])
        name = parts[0][0].name if len(parts) == 1 else f"turn({axis})"
        moves.append(Move(name, axis, parts[0][0].unit, A, b, kept))
    energy = next(k for k, q in enumerate(problem.phase) if q.kind == "energy")
    lost = np.abs(sample.phase_rate[:, energy])
    work = np.abs(sample.rate[:, n : 2 * n] * sample.phase[:, momenta]).sum(axis=1)
    return moves, bool((lost <= KEPT * np.maximum(work.max(), 1e-300)).all())


def _listed(site: Site) -> list[Move]:
    """Return the shift of each coordinate and the turn of each two of one unit."""
    problem, n = site.problem, site.problem.nq
    states, per = problem.states, f"/{problem.time.unit}" if problem.time.unit else ""
    found = [
        Move(states[n + k].name, states[k].name, states[n + k].unit, np.zeros((n, n)), np.eye(n)[k])
        for k in range(n)
    ]
    for i, j in combinations(range(n), 2):
        if states[i].measure == states[j].measure and states[i].unit != "rad" and len(found) < MOST:
            A = np.zeros((n, n))
            A[j, i], A[i, j] = 1.0, -1.0
            axis = f"{states[i].name}, {states[j].name}"
            found.append(Move(f"turn({axis})", axis, f"rad{per}" if per else "", A, np.zeros(n)))
    return found


def _text(parts: list[tuple[str, float]]) -> str:
    words = [axis if c == 1 else f"{c:.6g} {axis}" for axis, c in parts]
    return "; ".join(words)


def _changes(site: Site, y: Array, moves: list[Move]) -> Array:
    """Return how each move [.., n] changes accelerations, but for turning them along, and constraints."""
    n = site.problem.nq
    q, v = y[:n], y[n : 2 * n]
    found, here = site.derivatives(y), site.rates(y)[n : 2 * n]
    along = np.array([np.r_[one.at(q), one.A @ v] for one in moves]).T
    turned = np.array([one.A @ here for one in moves]).T
    size = np.abs(found.rates[n : 2 * n, : 2 * n]) @ np.abs(along) + np.abs(turned)
    change = found.rates[n : 2 * n, : 2 * n] @ along - turned
    change = np.where(np.abs(change) <= ROUNDING * size, 0.0, change)
    return np.vstack([change, found.position[:, : 2 * n] @ along, found.rate[:, : 2 * n] @ along])

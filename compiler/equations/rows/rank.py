"""Which constraint rows are independent, decided from numbers at a few consistent states.

The rows K of all constraints are evaluated on the constraint manifold: at the initial state with the default
parameters and at disturbed ones, each projected by Newton's method. Rows that depend on earlier ones at all of them
are dropped from the dynamics.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from msgspec import Struct
from msgspec.structs import replace
from numpy.typing import NDArray

from mechc.runtime.numerics.rank import independent_rows

from ...graph import Graph, Node
from ...graph.differentiate import jacobian
from ...graph.evaluate import FLOATS, Tape, evaluate
from ...mechanics.system import MechanicalSystem
from .constraints import Row

SAMPLES = 4
"""Consistent states tried; the first is the assembled initial state itself."""

TOLERANCE = 1e-9
"""A row is dependent if its part orthogonal to the earlier ones is smaller than this share of it."""

VANISHED = 1e-11
"""A row below this share of what it is off the manifold is rounding: it says there what others imply."""

ROUNDED, FINER, NOISE = 1e-12, 1e-14, 0.01
"""A row that changes by more than the last share of it where all numbers change by the first is what rounding leaves of zero; the second: beside numbers that are 1e12 times as large."""

REACHED = 1e-6
"""A residual below this, in SI units, counts as none."""

Vector = NDArray[np.float64]


class RankPlace(Struct, frozen=True):
    """A state on the constraint manifold: ``values`` of everything there, ``matrix`` K of all rows."""

    values: Mapping[Node, float]
    matrix: Vector


class Rank(Struct, frozen=True):
    """``independent`` rows by index; ``supports``: for each row the velocities it depends on; ``places``: where the rows
    were looked at.

    Seen on the manifold, a loop depends on its own joints only: those of the bodies that carry it drop out.
    """

    independent: tuple[int, ...]
    supports: tuple[frozenset[int], ...]
    unfulfilled: frozenset[int]
    """Rows that hold at none of the samples: they contradict others, or the mechanism does not reach."""
    places: tuple[RankPlace, ...]


def rank(
    system: MechanicalSystem, rows: Sequence[Row], free: Sequence[int], start: Mapping[Node, float]
) -> Rank:
    """Return the independent rows, later ones depending on earlier ones.

    ``start``: values of parameters, inputs, time, coordinates and velocities.
    """
    graph = system.graph
    velocities = [system.v[i].node for i in free]
    rates = [row.rate for row in rows]
    entries = jacobian(graph, rates, velocities)
    flat = _flat(entries)
    seeds = np.random.default_rng(20)
    touched = np.zeros((len(rows), len(velocities)), dtype=bool)
    chosen: tuple[int, ...] = ()
    unfulfilled = set(range(len(rows)))
    positions = [graph.zero if row.position is None else row.position for row in rows]
    shape = (len(rows), len(velocities))
    away = np.zeros(len(rows))
    places: list[RankPlace] = []
    for sample in range(SAMPLES):
        values = dict(start)
        if sample:
            values |= {s.node: values[s.node] + 0.3 * seeds.standard_normal() for s in system.q}
        norms = np.linalg.norm(_matrix(graph, flat, shape, values), axis=1)
        away = np.maximum(away, np.where(np.isfinite(norms), norms, 0.0))
        values = _assembled(system, rows, entries, velocities, values)
        residuals = evaluate(graph, positions, values)
        unfulfilled = {k for k in unfulfilled if not abs(residuals[k]) <= REACHED}
        matrix = _matrix(graph, flat, shape, values)
        places.append(RankPlace(values, matrix))
        sizes = np.abs(matrix).max(axis=1, keepdims=True, initial=0.0)
        touched |= np.abs(matrix) > TOLERANCE * sizes
        changes = np.linalg.norm(_matrix(graph, flat, shape, values, ROUNDED) - matrix, axis=1)
        least = np.maximum(VANISHED * away, np.where(np.isfinite(changes), changes / NOISE, 0.0))
        independent = tuple(independent_rows(matrix, TOLERANCE, least))
        if len(independent) > len(chosen):
            chosen = independent
    beside = touched[list(chosen)].any(axis=0)
    alone = [
        k for k in range(len(rows)) if k not in chosen and touched[k].any() and not touched[k][beside].any()
    ]
    for place in (
        places if alone else ()
    ):  # small beside its numbers, yet no rounding, where no other row says anything
        changes = np.linalg.norm(_matrix(graph, flat, shape, place.values, FINER) - place.matrix, axis=1)
        alone = [k for k in alone if np.linalg.norm(place.matrix[k]) > 10 * changes[k]]
    chosen = tuple(sorted({*chosen, *alone}))
    supports = tuple(frozenset(int(j) for j in np.flatnonzero(row)) for row in touched)
    return Rank(chosen, supports, frozenset(unfulfilled), tuple(places))


def _flat(entries: Sequence[Mapping[int, Node]]) -> list[tuple[int, int, Node]]:
    return [(i, j, n) for i, row in enumerate(entries) for j, n in row.items()]


def _matrix(
    graph: Graph, flat: Sequence[tuple[int, int, Node]], shape: tuple[int, int], values: Mapping[Node, float],
    rounded: float = 0.0,
) -> Vector:  # fmt: skip
    """Return the entries as numbers; ``rounded``: of values and constants that all differ by up to this share."""
    matrix = np.zeros(shape)
    numbers = FLOATS
    if rounded:
        share = np.random.default_rng(21)

        def other(x: float) -> float:
            return float(x) * (1 + rounded * share.uniform(-1, 1))

        values = {n: other(x) for n, x in values.items()}
        numbers = replace(FLOATS, constant=lambda c: float(c) if c.denominator == 1 else other(float(c)))
    found = evaluate(graph, [n for *_, n in flat], values, numbers)
    for (i, j, _), value in zip(flat, found, strict=True):
        matrix[i, j] = value
    return matrix


def _assembled(
    system: MechanicalSystem,
    rows: Sequence[Row],
    entries: Sequence[Mapping[int, Node]],
    velocities: Sequence[Node],
    values: dict[Node, float],
) -> dict[Node, float]:
    """Return ``values`` with the coordinates moved onto the position constraints (damped Gauss-Newton).

    ``entries``: of K, for each of the ``rows``.
    """
    graph = system.graph
    located = [(row.position, k) for row, k in zip(rows, entries, strict=True) if row.position is not None]
    if not located:
        return values
    residuals = [position for position, _ in located]
    flat = _flat([k for _, k in located])
    shape = (len(located), len(velocities))
    constraints = Tape(graph, [*residuals, *(n for *_, n in flat)], values)
    motion = Tape(graph, system.qdot, {**values, **dict.fromkeys(velocities, 0.0)})
    before = np.inf
    for _ in range(60):
        found = constraints(values)
        phi = np.array([found[n] for n in residuals])
        size = float(np.abs(phi).max())
        if not np.isfinite(size) or size < 1e-13 or (size < 1e-9 and size > 0.5 * before):
            break  # on the constraints, or as close as rounding allows
        before = size
        matrix = np.zeros(shape)
        for i, j, n in flat:
            matrix[i, j] = found[n]
        step = -_least_change(matrix, phi)
        length = float(np.abs(step).max())
        step *= min(1.0, 0.5 / length) if length > 0 else 1.0
        moved = dict(values) | dict(zip(velocities, step, strict=True))
        rates = motion(moved)
        values = values | {
            s.node: values[s.node] + rates[r] for s, r in zip(system.q, system.qdot, strict=True)
        }
        values |= _normalised(system, values)
    return values


def _least_change(matrix: Vector, phi: Vector) -> Vector:
    """Return the smallest x with ``matrix @ x = phi``; rows may repeat each other.

    The damping only stands in for the missing pivots of such rows: the iteration that calls this removes its effect.
    """
    gram = matrix @ matrix.T
    damping = 1e-14 * (float(np.trace(gram)) or 1.0)
    result: Vector = matrix.T @ np.linalg.solve(gram + damping * np.eye(len(phi)), phi)
    return result


def _normalised(system: MechanicalSystem, values: Mapping[Node, float]) -> dict[Node, float]:
    result: dict[Node, float] = {}
    for first, _ in system.rotations:
        nodes = [s.node for s in system.q[first : first + 4]]
        size = float(np.sqrt(sum(values[n] ** 2 for n in nodes)))
        result |= {n: values[n] / size for n in nodes}
    return result

"""Weights of constraint rows, for a singular mass matrix with constraints that determine the accelerations all the same.

A massless rod in a loop, or a moment of inertia of zero, leaves M singular at some states or at all of them, while the
matrix [[M, -K^T], [K, 0]] of accelerations and multipliers is regular. Pivots are chosen once for all states, so they must
not vanish at any. Each multiplier lam is therefore replaced by mu - w K a with w > 0 and mu = lam - w gamma: the solution stays
the same, as K a + gamma = 0, and M is replaced by M + K^T w K. This is positive definite exactly where the problem is well
posed, and then no pivot vanishes, whatever their order (augmented Lagrangian; G. H. Golub, C. Greif, On solving
block-structured indefinite linear systems, SIAM J. Sci. Comput. 24, 2003; in mechanics E. Bayo et al. 1988).

The price of a weight is a rounding error of about w |K|^2 / M times that of a double. Each weight is the effective inertia of its row, and
follows the masses when parameters change.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from fractions import Fraction

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from mechc.runtime.numerics.rank import inverse

from ...graph import Graph, Node
from ...graph.differentiate import jacobian, jvp
from ...graph.evaluate import FLOATS, Numbers, evaluate
from ...graph.operations import DIV
from ...graph.rewrite import substitute
from ...mechanics.system import MechanicalSystem
from .constraints import Row
from .rank import RankPlace

SINGULAR = 1e-12
"""Smallest share of a direction's inertia in that of the single coordinates; below it the mass matrix counts as singular."""

NOTHING = 1e-18
"""Share of the largest inertia of a coordinate below which another has none."""

HELD = 1e-9
"""Share of the terms of a row below which their sum is rounding."""

LITTLE = 1e-18
"""Share of the inertia that weights keep where parameters take all of it, in SI units where there is none. Forces that ought
to be zero are rounding beside the weights, so these are small then."""

WORK = 300_000
"""Operations on arrays that a look at the mass matrix may cost; of larger models fewer states are looked at, or none: a
run that meets a singular mass matrix begins again with weights."""

Array = NDArray[np.float64]


def give_weights(
    system: MechanicalSystem,
    residual: Sequence[Node],
    rows: Sequence[Row],
    free: Sequence[int],
    places: Sequence[RankPlace],
    always: bool = False,
) -> tuple[Row, ...]:
    """Return the rows that hold what M leaves open at one of the places with weights, unless something is left open even so;
    the others as they are. ``places`` have the matrix of these rows. ``always``: a run has met a singular mass matrix; then
    all rows get weights."""
    inertias = _inertias(system, residual, free, places)
    looked_at = [(m, place) for m, place in zip(inertias, places, strict=False) if _finite(m, place.matrix)]
    if not looked_at:
        return tuple(rows)
    seen = [(m, place.matrix) for m, place in looked_at]
    holding = np.any([always | _moved(k, _motions_without_inertia(m)) for m, k in seen], axis=0)
    if not holding.any():
        return tuple(rows)
    sizes = np.where(holding, _weights(seen), 0.0)
    if all(_motions_without_inertia(m + (k.T * sizes) @ k).size for m, k in seen):
        return tuple(rows)  # some motion moves no mass and is not held: whoever solves the equations names it
    graph = system.graph
    total, unit = _total_inertia(system, residual, free, looked_at[0][1].values)
    return tuple(
        replace(row, weight=graph.mul(graph.constant(_power_of_two(w / unit)), total)) if w else row
        for row, w in zip(rows, sizes, strict=True)
    )


def _inertias(
    system: MechanicalSystem, residual: Sequence[Node], free: Sequence[int], places: Sequence[RankPlace]
) -> list[Array]:
    """Return M at the places, as far as the work allows."""
    fork = system.graph.fork()  # what is formed here must not change the order of nodes
    along = {system.a[i]: fork.symbol(f"#unit {i}") for i in free}
    inertia = jvp(fork, [residual[i] for i in free], along)
    cost = fork.count_operations(inertia) * math.ceil(len(free) / BLOCK)
    count = min(len(places), WORK // max(1, cost))
    units = list(along.values())
    return [slopes(fork, inertia, units, place.values) for place in places[:count]]


def _finite(*matrices: Array) -> bool:
    return all(np.isfinite(matrix).all() for matrix in matrices)


def _scales(matrix: Array) -> Array:
    """Return the factor of each coordinate so that its own inertia is one; zero where it has none."""
    own = np.diag(matrix)
    has = own > NOTHING * own.max(initial=0.0)
    return np.where(has, 1.0 / np.sqrt(np.where(has, own, 1.0)), 0.0)


def _motions_without_inertia(matrix: Array) -> Array:
    """Return a basis of the motions, in columns, along which a positive semidefinite matrix vanishes."""
    scales = _scales(matrix)
    values, vectors = np.linalg.eigh(matrix * np.outer(scales, scales))
    found: Array = np.where(scales > 0, scales, 1.0)[:, None] * vectors[:, values < SINGULAR * len(matrix)]
    return found


def _moved(k: Array, motions: Array) -> NDArray[np.bool_]:
    """Tell which rows of K the motions change."""
    changes = np.abs(k @ motions)
    return np.asarray(np.any(changes > HELD * np.abs(k) @ np.abs(motions), axis=1))


BLOCK = 64
"""Columns of a matrix that are evaluated at once."""

ARRAYS = Numbers(
    FLOATS.constant, {**FLOATS.functions, DIV: lambda a, b: a / b if b else float("nan")}, FLOATS.interpolate
)
"""Floats, and arrays of them in what is affine."""


def slopes(
    graph: Graph, outputs: Sequence[Node], symbols: Sequence[Node], values: Mapping[Node, float]
) -> NDArray[np.float64]:
    """Return the derivatives of outputs that are affine in the symbols: by unit changes, without new nodes."""
    known = dict.fromkeys(graph.support(*outputs), 0.0) | {n: float(x) for n, x in values.items()}
    base = evaluate(graph, outputs, known)
    found = np.zeros((len(outputs), len(symbols)))
    for begin in range(0, len(symbols), BLOCK):
        block = symbols[begin : begin + BLOCK]
        units = zip(block, np.eye(len(block)), strict=True)
        moved = evaluate(graph, outputs, known | {n: known.get(n, 0.0) + unit for n, unit in units}, ARRAYS)
        for i, (x, y) in enumerate(zip(moved, base, strict=True)):
            found[i, begin : begin + len(block)] = x - y
    return found


def _weights(seen: Sequence[tuple[Array, Array]]) -> Array:
    """Return the inertia that each row moves by itself, 1/(K M^-1 K^T), the least at the places.

    Directions without inertia do not count. A row that moves nothing with mass is weighed as if everything had the mean
    inertia.
    """
    mobility = np.max([np.einsum("ij,ji->i", k, _inverse(m) @ k.T) for m, k in seen], axis=0)
    squares = np.max([np.square(k).sum(axis=1) for _, k in seen], axis=0)
    first, _ = seen[0]
    mean = float(np.trace(first)) / len(first)
    plain = (mean if mean > 0 else LITTLE) / np.where(squares > 0, squares, 1.0)
    known = mobility > 0
    return np.where(known, 1.0 / np.where(known, mobility, 1.0), plain)


def _inverse(matrix: Array) -> Array:
    """Return the inverse in the directions that have inertia, zero in the others."""
    scales = np.outer(_scales(matrix), _scales(matrix))
    found: Array = scales * inverse(scales * matrix, SINGULAR * len(matrix), symmetric=True)
    return found


def _total_inertia(
    system: MechanicalSystem, residual: Sequence[Node], free: Sequence[int], values: Mapping[Node, float]
) -> tuple[Node, float]:
    """Return the trace of M at one state, with a little more so that it does not vanish with the parameters, as a formula of
    these, and its value."""
    graph = system.graph
    entries = jacobian(graph, [residual[i] for i in free], [system.a[i] for i in free])
    own = [row.get(k, graph.zero) for k, row in enumerate(entries)]
    varying, still = {s.node for s in system.symbols.parameters}, list[Node]()
    for n in graph.reach(own):
        if not varying.isdisjoint(graph.args(n)):
            varying.add(n)
        elif n not in varying and not graph.is_constant(n):
            still.append(n)
    # all that depends on the state alone, not its symbols only: sin^2 + cos^2 of a number would be those of the symbol again
    there = dict(zip(still, evaluate(graph, still, values), strict=True))
    rounded = {n: graph.constant(Fraction(f"{x:.3g}")) for n, x in there.items() if math.isfinite(x)}
    total = graph.zero
    for n in substitute(graph, own, rounded):
        total = graph.add(total, n)
    (size,) = evaluate(graph, [total], values)
    if not size > 0:
        total, size = graph.zero, 0.0
    least = _power_of_two(LITTLE * (size or 1.0))
    return graph.add(total, graph.constant(least)), size + float(least)


def _power_of_two(x: float) -> Fraction:
    """Return the power of two nearest to a number: rounding of the numbers that led to it does not change it."""
    return Fraction(2) ** round(math.log2(x))

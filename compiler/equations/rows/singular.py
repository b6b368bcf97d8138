"""Singular positions on the path of a mechanism: found in advance by following its motion, and regularised.

Where loops lie flat or a linkage changes its branch, rows of K are linearly dependent for an instant, and the forces
of the constraints are determined only by the states before and after. A mechanism that meets such a position gets
multipliers with a small compliance: K a + gamma + eps (lam - lam') = 0, where lam' is the solution of the same
equations before, three times (``settle``). At a distance s from singular positions the forces change by the share
(eps/(s^2 + eps))^3; closer than sqrt(eps), the solution is the damped least-squares one, which stays bounded.

Projections are regularised in the same way and more strongly: the residual of a position has rounding errors, which a projection
amplifies as 1/s in the coordinates, 1/s^2 in their rates and 1/s^3 in the accelerations.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from mechc.lang.units import BASE, parse_unit
from mechc.runtime.numerics.rank import inverse

from ...flat.model import Kind
from ...flat.types import LENGTH
from ...graph import Node
from ...graph.differentiate import jacobian
from ...graph.evaluate import Tape, evaluate
from ...graph.rewrite import substitute
from ...mechanics.system import MechanicalSystem
from .constraints import Compliance, Row, give_way
from .weights import slopes

SHARE, PROJECTED_SHARE = 1e-9, 1e-7
"""Shares of the diagonal of K M^-1 K^T, of accelerations and of projections. Rounding in a vanishing pivot, 1e-16 of
the largest, must be far below them. Measured with rows of 2 to 40 four-bars and tolerances of 1e-6 to 1e-12."""

METRE = BASE.index("m")

STEP = 0.1
STEPS = 64
"""The walk: about one turn of a crank."""

CLOSE, SINGULAR = 0.15, 0.02
"""Ratio of the smallest to the largest singular value at which a walk looks closer, and at which a position counts
as singular: within about a degree of it."""

ROUNDING = 1e-6
"""A ratio that rises by less has no minimum: that of gears is the same everywhere, and as small as they make it."""

WORK = 300_000
"""Operations that a walk may cost; larger mechanisms are searched for fewer steps."""

Array = NDArray[np.float64]


def soften(
    system: MechanicalSystem,
    residual: Sequence[Node],
    rows: Sequence[Row],
    free: Sequence[int],
    values: Mapping[Node, float],
    always: bool = False,
) -> tuple[Row, ...]:
    """Return the rows with a compliance where the mechanism meets singular positions, else as they are.

    ``values``: parameters, inputs, time and a state close to a consistent one. ``always``: a run has met one.
    """
    if not always and not _Walk(system, rows, free, values).meets_singular_position():
        return tuple(rows)
    sizes = _inverse_inertias(system, residual, rows, free, values)
    scales = _with_parameters(system, residual, rows, free, values)
    graph = system.graph
    softened = []
    for row, size, scale in zip(rows, sizes, scales, strict=True):
        previous = graph.symbol(f"#previous {graph.name(row.multiplier)}")
        share, projected = (
            graph.mul(graph.constant(Fraction(f"{s * size:.2g}")), scale) for s in (SHARE, PROJECTED_SHARE)
        )
        soft = replace(row, give=Compliance(share, projected, previous))
        softened.append(replace(soft, equation=give_way(graph, row.equation, soft, share)))
    return tuple(softened)


class _Walk:
    """Steps along the motion that the constraints leave, each with one Newton correction back onto them."""

    def __init__(
        self, system: MechanicalSystem, rows: Sequence[Row], free: Sequence[int], values: Mapping[Node, float]
    ) -> None:
        self.system, self.rows = system, rows
        self.values = dict(values)
        self.velocities = [system.v[i].node for i in free]
        graph = system.graph
        entries = jacobian(graph, [row.rate for row in rows], self.velocities)
        self.places = [(i, j) for i, row in enumerate(entries) for j in row]
        self.outputs = [n for row in entries for n in row.values()]
        self.outputs += [graph.zero if row.position is None else row.position for row in rows]
        kinds = [system.v[i].variable.type for i in free]
        self.turning = np.array([kind.angle or kind.kind is Kind.ROTATION for kind in kinds])
        self.tape = Tape(graph, self.outputs, self.values)
        self.steps = min(STEPS, WORK // max(1, graph.count_operations(self.outputs)))

    def meets_singular_position(self) -> bool:
        """Walk along one motion; where the singular values become small, repeat with smaller steps."""
        if self.steps < 16 or len(self.rows) >= len(self.velocities):
            return False
        direction = None
        before: tuple[dict[Node, float], Array | None] = (dict(self.values), None)
        for _ in range(12):  # onto the constraints
            self._step(None, 0.0)
        ratios = [1.0, 1.0]
        states = [before, before]
        for _ in range(self.steps):
            state = dict(self.values), direction
            ratio, direction = self._step(direction, STEP)
            if (
                ratios[-1] < CLOSE
                and ratios[-2] >= ratios[-1] < (1 - ROUNDING) * ratio
                and _lowest(ratios[-2], ratios[-1], ratio) < CLOSE / 2
                and self._closest(states[-2]) < SINGULAR
            ):
                return True
            ratios.append(ratio)
            states.append(state)
        return False

    def _closest(self, state: tuple[dict[Node, float], Array | None]) -> float:
        kept = self.values
        self.values, direction = dict(state[0]), state[1]
        smallest = 1.0
        for _ in range(31):
            ratio, direction = self._step(direction, STEP / 10)
            smallest = min(smallest, ratio)
        self.values = kept
        return smallest

    def _step(self, direction: Array | None, length: float) -> tuple[float, Array]:
        """Go on and return the ratio of singular values where the step began, and the direction taken."""
        found = self.tape(self.values)
        numbers = [found[n] for n in self.outputs]
        count = len(self.velocities)
        matrix = np.zeros((len(self.rows), count))
        for (i, j), value in zip(self.places, numbers, strict=False):
            matrix[i, j] = value
        residuals = np.array(numbers[len(self.places) :])
        if not (np.isfinite(matrix).all() and np.isfinite(residuals).all()):
            return 1.0, np.zeros(count)
        lengths = float(np.abs(matrix[:, self.turning]).max(initial=0.0)) or 1.0
        weights = np.where(self.turning, 1.0, lengths)
        scaled = matrix * weights
        sizes = np.abs(scaled).max(initial=0.0)
        sizes = sizes if sizes > 0 else 1.0
        scaled /= sizes
        squares, basis = np.linalg.eigh(scaled @ scaled.T)  # of the singular values, in ascending order
        if direction is None:
            direction = np.cos(np.arange(1, count + 1))
        along = direction - scaled.T @ _solve(squares, basis, 1e-12, scaled @ direction)
        along /= np.abs(along).max(initial=0.0) or 1.0
        step = -scaled.T @ _solve(squares, basis, 1e-6, residuals / sizes)
        step *= min(1.0, 0.5 / max(float(np.abs(step).max(initial=0.0)), 1e-300))
        self._move((step + length * along) * weights)
        ratio = float(np.sqrt(max(squares[0], 0.0) / squares[-1])) if squares[-1] > 0 else 1.0
        return ratio, along

    def _move(self, d: Array) -> None:
        system = self.system
        moved = self.values | dict(zip(self.velocities, map(float, d), strict=True))
        moved |= {s.node: 0.0 for s in system.v if s.node not in moved}
        rates = evaluate(system.graph, list(system.qdot), moved)
        fixed = {k for row in system.drives for k in row.q}
        for k, (s, rate) in enumerate(zip(system.q, rates, strict=True)):
            if k not in fixed:
                self.values[s.node] += rate
        for first, _ in system.rotations:
            nodes = [s.node for s in system.q[first : first + 4]]
            size = float(np.sqrt(sum(self.values[n] ** 2 for n in nodes)))
            self.values |= {n: self.values[n] / size for n in nodes}


def _lowest(before: float, lowest: float, after: float) -> float:
    """Return the smallest value between three equidistant ones: near its minimum the square is a parabola."""
    a, b, c = before**2, lowest**2, after**2
    curvature = a - 2 * b + c
    smallest = b - (c - a) ** 2 / (8 * curvature) if curvature > 0 else b
    return float(np.sqrt(max(smallest, 0.0)))


def _solve(squares: Array, basis: Array, threshold: float, right: Array) -> Array:
    """Solve with a matrix given by eigenvalues and eigenvectors, leaving out values below a share of the largest."""
    kept = squares > threshold * squares[-1]
    inverse = np.divide(1.0, squares, out=np.zeros_like(squares), where=kept)
    result: Array = basis @ (inverse * (basis.T @ right))
    return result


def _with_parameters(
    system: MechanicalSystem,
    residual: Sequence[Node],
    rows: Sequence[Row],
    free: Sequence[int],
    values: Mapping[Node, float],
) -> list[Node]:
    """Return for each row how its K M^-1 K^T changes with the parameters, by the diagonal of M at this state, and by the size of lengths
    where K has some: 1 for those that the model states. A row with a weight is scaled by that already."""
    graph = system.graph
    k = slopes(graph, [row.rate for row in rows], [system.v[i].node for i in free], values)
    entries = jacobian(graph, [residual[i] for i in free], [system.a[i] for i in free])
    inertia = [row.get(j, graph.zero) for j, row in enumerate(entries)]
    fixed = {s.node for s in system.symbols.parameters}
    moving = [n for n in graph.support(*inertia) if n in values and n not in fixed]
    still = substitute(graph, inertia, {n: graph.constant(Fraction(values[n])) for n in moving})
    now = evaluate(graph, still, values)
    grown = _growth_of_lengths(system, values)
    scales = []
    for row, slope in zip(rows, k, strict=True):
        places = [j for j in range(len(free)) if slope[j] and np.isfinite(slope[j]) and now[j] > 0]
        if row.weight is not None or not places:
            scales.append(graph.one)
            continue
        stated = sum(float(slope[j]) ** 2 / now[j] for j in places)
        parts = [
            graph.mul(
                graph.div(graph.constant(Fraction(float(slope[j]) ** 2 / stated)), still[j]),
                graph.power(grown, 2 * _degree(system, row, free[j])),
            )
            for j in places
        ]
        scales.append(graph.sum(parts))
    return scales


def _degree(system: MechanicalSystem, row: Row, coordinate: int) -> Fraction:
    """Return the power of lengths in the derivative of a row by a coordinate."""
    residual = parse_unit(row.constraint.units[row.component] or "1").dimension
    return Fraction((residual / system.v[coordinate].variable.type.dimension).exponents[METRE])


def _growth_of_lengths(system: MechanicalSystem, values: Mapping[Node, float]) -> Node:
    """Return the geometric mean of what parameters that are lengths have grown by."""
    graph = system.graph
    lengths = [
        s.node
        for s in system.symbols.parameters
        if s.variable.type.dimension == LENGTH and values.get(s.node, 0.0) > 0
    ]
    ratios = [graph.div(graph.abs(n), graph.constant(Fraction(values[n]))) for n in lengths]
    return graph.power(graph.product(ratios), Fraction(1, len(ratios))) if ratios else graph.one


def _inverse_inertias(
    system: MechanicalSystem,
    residual: Sequence[Node],
    rows: Sequence[Row],
    free: Sequence[int],
    values: Mapping[Node, float],
) -> Array:
    """Return the diagonal of K M^-1 K^T: by how much each row gives way to a unit of its multiplier.

    Where rows have weights w, M is M + K^T w K, as it is solved with.
    """
    graph = system.graph
    inertia = slopes(graph, [residual[i] for i in free], [system.a[i] for i in free], values)
    k = slopes(graph, [row.rate for row in rows], [system.v[i].node for i in free], values)
    if not (np.isfinite(inertia).all() and np.isfinite(k).all()):
        return np.ones(len(rows))  # undefined where it starts, as the run will tell
    weights = evaluate(graph, [graph.zero if row.weight is None else row.weight for row in rows], values)
    inertia += (k.T * weights) @ k
    sizes: Array = np.einsum("ij,ji->i", k, inverse(inertia) @ k.T)
    return np.where(np.isfinite(sizes) & (sizes > 0), sizes, 1.0)

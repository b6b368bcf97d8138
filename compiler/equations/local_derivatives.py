"""Derivatives of rates, outputs and constraints at a state, by everything that may be displaced there.

A displacement of the positions has one number for each coordinate, three for a rotation: its turn about the body
axes, as angular velocities have them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from ..graph import Graph, Node
from ..graph.differentiate import jacobian
from ..graph.rewrite import substitute
from ..graph.vector import cross
from ..mechanics.system import MechanicalSystem
from .hybrid.delays import in_order
from .model import Function, Slot
from .reported.entries import Layout
from .solve.shares import undefined
from .solve.solved import Solved

NAME, SECOND_ORDER, BIAS = "local_derivatives", "second_order", "bias"

ROW_VALUES = 8
"""Of the function ``row_values``, for each row that switches; gap and rate are the first two."""

Row = dict[int, Node]


def local_derivatives(
    system: MechanicalSystem, solved: Solved, layout: Layout, functions: Sequence[Function]
) -> tuple[Function, tuple[tuple[int, int], ...]]:
    """Return the function of the derivatives that can differ from zero, and their (row, column).

    Rows: rates of the displacement, accelerations, rates of states, outputs, residuals of position constraints, K v + b; of
    each row that switches its gap and its rate.
    Columns: displacements, velocities, states, inputs, time, what is delayed in the order of the delay plan. The displacement
    of a rotation with angular velocity w by a turn d has the rate d' = dw - w x d.
    """
    graph = system.graph
    named = {f.name: f.outputs for f in functions}
    rhs = named["rhs"]
    turns = {q: _Turn(system, solved, layout, k, i) for q, k, i in _rotations(system, layout)}
    gone = {first + k for first in turns for k in range(4)}
    plain = [i for i in range(layout.nq) if i not in gone]
    rows = [rhs[i] for i in plain]
    rows += [*rhs[layout.nq :], *named["outputs"], *named.get("constraints", ())]
    switching = named.get("row_values", ())
    rows += [n for k in range(0, len(switching), ROW_VALUES) for n in switching[k : k + 2]]
    places = {slot: n for n, slot in layout.slots.items()}
    ny, nu = layout.nq + layout.nv + layout.nx, len(layout.inputs)
    slots = [Slot("y", i) for i in range(ny)] + [Slot("u", i) for i in range(nu)] + [Slot("t", 0)]
    slots += [layout.slots[n] for n in in_order(system.lowering.delays.found)]
    found = jacobian(graph, rows, [places[slot] for slot in slots])
    shares = {share.beside: share.rests for share in solved.shared.values()}
    for row, formula in zip(found, rows, strict=True):
        none = undefined(graph, shares, formula)
        if none != graph.zero:
            row |= {j: graph.add(n, none) for j, n in row.items()}
    if layout.without_effect:
        still = {j for j, slot in enumerate(slots) if places[slot] in layout.without_effect}
        found = [{j: n for j, n in row.items() if j not in still} for row in found]
    displaced = [_displaced(graph, row, layout.nq, turns) for row in found]
    by_coordinate = dict(zip(plain, displaced, strict=False))
    first_velocity = sum(3 if i in turns else 1 for i in range(layout.nq) if i in turns or i not in gone)
    ordered: list[Row] = []
    for i in range(layout.nq):
        if i in turns:
            ordered += turns[i].rates(graph, len(ordered), first_velocity)
        elif i not in gone:
            ordered.append(by_coordinate[i])
    ordered += displaced[len(plain) :]
    entries = [(i, j, n) for i, row in enumerate(ordered) for j, n in sorted(row.items())]
    function = Function(
        NAME, "derivatives of rates, outputs and constraints at a state", tuple(n for *_, n in entries)
    )
    return function, tuple((i, j) for i, j, _ in entries)


class _Turn:
    """A rotation that is displaced: ``along`` [4][3], what a turn about each body axis does to its four numbers."""

    def __init__(
        self, system: MechanicalSystem, solved: Solved, layout: Layout, first_q: int, first_v: int
    ) -> None:
        graph = system.graph
        velocities = [s.node for s in system.v[first_v : first_v + 3]]
        by_rates = jacobian(graph, system.qdot[first_q : first_q + 4], velocities)
        self.along = [[row.get(j, graph.zero) for j in range(3)] for row in by_rates]
        self.spin = solved.resolve(velocities)
        self.places = [
            layout.v_indices.index(i) if i in layout.v_indices else None for i in range(first_v, first_v + 3)
        ]

    def rates(self, graph: Graph, column: int, first_velocity: int) -> Iterator[Row]:
        """Yield the rows of the rate of a turn, whose columns begin at ``column``."""
        zero, one = graph.zero, graph.one
        units = [tuple(one if k == j else zero for k in range(3)) for j in range(3)]
        by_turn = [cross(graph, unit, self.spin) for unit in units]
        for k in range(3):
            row = {column + j: by_turn[j][k] for j in range(3)}
            place = self.places[k]
            if place is not None:
                row[first_velocity + place] = one
            yield {j: n for j, n in row.items() if n != zero}


def _rotations(system: MechanicalSystem, layout: Layout) -> Iterator[tuple[int, int, int]]:
    """Yield each rotation that is not prescribed: its place in y, its first coordinate and its first velocity."""
    for first_q, first_v in system.rotations:
        if first_q in layout.q_indices:
            yield layout.q_indices.index(first_q), first_q, first_v


def _displaced(graph: Graph, row: Row, nq: int, turns: Mapping[int, _Turn]) -> Row:
    """Return derivatives by displacements instead of those by coordinates."""
    found: Row = {}
    column = i = 0
    while i < nq:
        if i not in turns:
            if i in row:
                found[column] = row[i]
            column, i = column + 1, i + 1
            continue
        for j in range(3):
            total = graph.zero
            for k in range(4):
                if i + k in row:
                    total = graph.add(total, graph.mul(row[i + k], turns[i].along[k][j]))
            if total != graph.zero:
                found[column + j] = total
        column, i = column + 3, i + 4
    return found | {j - nq + column: n for j, n in row.items() if j >= nq}


def second_order(
    system: MechanicalSystem, solved: Solved, layout: Layout
) -> tuple[Function, tuple[tuple[int, int], ...]]:
    """Return the derivatives of the equations of motion r(q, v, a) - K^T lam = 0, as they are before they are solved, and
    their (row, column): by accelerations (the mass matrix), by velocities, by displacements, with the multipliers
    held. They are those at rest: with accelerations of zero."""
    graph = system.graph
    turns = {q: _Turn(system, solved, layout, k, i) for q, k, i in _rotations(system, layout)}
    accelerations = [system.a[i] for i in solved.free]
    velocities = [system.v[i].node for i in solved.free]
    coordinates = [system.q[k].node for k in layout.q_indices]
    equations = [solved.residual[i] for i in solved.free]
    found = jacobian(graph, equations, [*coordinates, *accelerations, *velocities])
    rows = [_displaced(graph, row, layout.nq, turns) for row in found]
    nd, nv = layout.nq - len(turns), len(solved.free)
    at_rest = {**solved.replace, **dict.fromkeys(accelerations, graph.zero)}
    entries = [
        (i, j - nd if j >= nd else j + 2 * nv, n) for i, row in enumerate(rows) for j, n in row.items()
    ]
    entries.sort(key=lambda entry: entry[:2])
    nodes = substitute(graph, [n for *_, n in entries], at_rest)
    kept = [(i, j, n) for (i, j, _), n in zip(entries, nodes, strict=True) if n != graph.zero]
    function = Function(
        SECOND_ORDER,
        "derivatives of the equations of motion by accelerations, velocities and displacements, at rest",
        tuple(n for *_, n in kept),
    )
    return function, tuple((i, j) for i, j, _ in kept)


def bias(system: MechanicalSystem, solved: Solved) -> Function:
    """Return what the equations of motion are without accelerations and without the forces of constraints: M a + bias is
    K^T lam."""
    still = dict.fromkeys(system.a, system.graph.zero) | {
        row.multiplier: system.graph.zero for row in solved.rows
    }
    equations = [solved.residual[i] for i in solved.free]
    nodes = substitute(system.graph, equations, {**solved.replace, **still})
    return Function(
        BIAS, "the equations of motion without accelerations and forces of constraints", tuple(nodes)
    )

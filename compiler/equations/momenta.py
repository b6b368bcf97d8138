"""Momenta, forces and the mass matrix as functions, for methods that preserve structure."""

from __future__ import annotations

from collections.abc import Sequence

from ..graph import Node
from ..graph.differentiate import jacobian, vjp
from ..mechanics.system import MechanicalSystem
from .model import Function
from .rows.constraints import Row
from .solve.solved import Solved


def momentum_functions(system: MechanicalSystem, solved: Solved) -> list[Function]:
    """Return p = dL/dv, dL/dq + Q without the forces of constraints, and dp/dv."""
    graph = system.graph
    values = [p for p in solved.energies.momenta if p is not None]
    velocities = [system.v[i].node for i in solved.free]
    rubbing = vjp(
        graph, [(row.rate, row.multiplier) for row in solved.switched if _is_smooth(row)], velocities
    )
    given = [solved.energies.forces[i] for i in solved.free]
    forces = solved.resolve([graph.add(q, f) for q, f in zip(given, rubbing, strict=True)])
    return [
        Function("momentum", "dL/dv", tuple(values)),
        Function("force", "dL/dq + Q, without the forces of constraints", forces),
        Function("mass", "d(dL/dv)/dv, row by row", tuple(dense(system, values, velocities))),
    ]


def _is_smooth(row: Row) -> bool:
    """Whether a row is that of a friction whose law is smooth: its force is known, as that of a load is."""
    mode = row.constraint.mode
    return mode is not None and mode.smooth is not None


def dense(system: MechanicalSystem, rows: Sequence[Node], wrt: Sequence[Node]) -> list[Node]:
    """Return a Jacobian with its zeros, row by row."""
    zero = system.graph.zero
    return [row.get(j, zero) for row in jacobian(system.graph, rows, wrt) for j in range(len(wrt))]

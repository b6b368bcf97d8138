"""What impulses do: velocities jump at once, with all constraints respected."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ...graph import Node
from ...graph.differentiate import jvp
from ...graph.elimination.eliminate import solve
from ...mechanics.system import MechanicalSystem
from ..rows.constraints import weighted
from .solved import Solved


def velocity_jumps(system: MechanicalSystem, solved: Solved, impulses: Sequence[Node]) -> tuple[Node, ...]:
    """Return d with M d - K^T mu = impulses and K d = 0, for the constraints that are never switched."""
    graph = system.graph
    free = [system.a[i] for i in solved.free]
    jumps = [graph.symbol(f"#jump {i}") for i in solved.free]
    residual = [solved.residual[i] for i in solved.free]
    inertia = jvp(graph, residual, dict(zip(free, jumps, strict=True)))
    forces = jvp(graph, residual, {row.multiplier: row.multiplier for row in solved.rows})
    along: Mapping[Node, Node] = {system.v[i].node: d for i, d in zip(solved.free, jumps, strict=True)}
    held = jvp(graph, [row.rate for row in solved.rows], along)
    equations = [graph.sub(graph.add(m, f), p) for m, f, p in zip(inertia, forces, impulses, strict=True)]
    equations = weighted(graph, equations, solved.rows, held, jumps)
    unknowns = [*jumps, *(row.multiplier for row in solved.rows)]
    found = solve(graph, [*equations, *held], unknowns)
    return found.solutions[: len(jumps)]

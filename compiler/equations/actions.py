"""What a branch does, as one function: new y, new z, and whether its assertions hold."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import assert_never

from ..graph import Node
from ..graph.differentiate import jvp, vjp
from ..graph.eliminate import solve
from ..graph.rewrite import substitute
from ..mechanics.modes import BranchRow, CheckAction, EndAction, ImpulseAction, SetAction
from ..mechanics.system import MechanicalSystem
from .solve import Solved


def branch_results(
    system: MechanicalSystem,
    solved: Solved,
    branch: BranchRow,
    y: Sequence[Node],
    z: Sequence[Node],
) -> tuple[Node, ...]:
    """Return new y, new z and the assertions of a branch; its actions run from top to bottom.

    A right-hand side sees what the actions above it have set; ``pre(x)`` is the value before the branch.
    """
    graph = system.graph
    now: dict[Node, Node] = {}
    originals = list(system.lowering.previous)
    before = dict(zip(system.lowering.previous.values(), solved.resolve(originals), strict=True))

    def present(nodes: Sequence[Node]) -> list[Node]:
        return substitute(graph, substitute(graph, solved.resolve(nodes), now), before)

    checks: list[Node] = []
    for action in branch.actions:
        match action:
            case SetAction(targets=targets, values=values):
                now |= dict(zip(targets, present(values), strict=True))
            case ImpulseAction(pairs=pairs):
                changes = _jumps(system, solved, pairs)
                velocities = [system.v[i].node for i in solved.free]
                moved = present([graph.add(v, d) for v, d in zip(velocities, changes, strict=True)])
                now |= dict(zip(velocities, moved, strict=True))
            case CheckAction(condition=condition):
                checks += present([condition])
            case EndAction():
                pass
            case _:
                assert_never(action)
    return (*(now.get(n, n) for n in (*y, *z)), *checks)


def _jumps(system: MechanicalSystem, solved: Solved, pairs: Sequence[tuple[Node, Node]]) -> list[Node]:
    """Return the jumps of the velocities by impulses, with all constraints respected."""
    graph = system.graph
    velocities = [system.v[i].node for i in solved.free]
    efforts = vjp(graph, [(rate, effort) for rate, effort in pairs], velocities)
    return list(velocity_jumps(system, solved, efforts))


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
    unknowns = [*jumps, *(row.multiplier for row in solved.rows)]
    found = solve(graph, [*equations, *held], unknowns)
    return found.solutions[: len(jumps)]

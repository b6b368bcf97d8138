"""What a branch does, as one function: new y, new z, and whether its assertions hold."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import assert_never

from mechc.lang.diagnostics import Reporter

from ...graph import Node
from ...graph.differentiate import jvp, vjp
from ...graph.elimination.eliminate import ZeroPivot, solve
from ...graph.rewrite import substitute
from ...mechanics.modes import BranchRow, CheckAction, EndAction, ImpulseAction, SetAction
from ...mechanics.system import MechanicalSystem
from ..rows.constraints import Row, weighted
from ..solve.impulses import velocity_jumps
from ..solve.solved import Solved


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
    if _holding(solved):
        set_here = {target for a in branch.actions if isinstance(a, SetAction) for target in a.targets}
        velocities, moved = _others(system, solved, set_here)
        now |= dict(zip(velocities, present(moved), strict=True))
    return (*(now.get(n, n) for n in (*y, *z)), *checks)


def check_positions(system: MechanicalSystem, solved: Solved, reporter: Reporter) -> None:
    """Report coordinates that events set though constraints tie them to others, which would have to follow."""
    tied = [row for row in _holding(solved) if row.position is not None]
    for branch in system.branches:
        all_set = {target for a in branch.actions if isinstance(a, SetAction) for target in a.targets}
        for action in branch.actions:
            if not isinstance(action, SetAction):
                continue
            places = system.symbols.positions.intersection(action.targets)
            for row in tied:
                assert row.position is not None
                involved = system.symbols.positions.intersection(system.graph.support(row.position))
                if places.isdisjoint(involved) or involved <= all_set:
                    continue
                reporter.error(
                    "E0719",
                    "constraints tie this coordinate to others, so an event cannot set it alone",
                    action.origin.span,
                    caption=f"'{row.title}' would not hold any more",
                    help="set its rate, 'reinit(der(q), ..)': the rates of the others follow; "
                    "or begin another run there, with its initial values",
                )
                break


def check_masses(system: MechanicalSystem, reporter: Reporter) -> None:
    """Report what events set or push though it has no mass: the balance of forces decides it at all times."""
    rows = [row for row in system.drives if row.balanced]
    decided = {system.q[k].node: row for row in rows for k in row.q}
    rates = {system.v[i].node: row for row in rows for i in row.v}
    for branch in system.branches:
        for action in branch.actions:
            if isinstance(action, SetAction):
                found = next((n for n in action.targets if n in decided or n in rates), None)
                word = "set"
            elif isinstance(action, ImpulseAction):
                touched = set(system.graph.support(*(rate for rate, _ in action.pairs)))
                found = next((n for n in rates if n in touched), None)
                word = "pushed"
            else:
                continue
            if found is not None:
                name = (decided.get(found) or rates[found]).names[0]
                reporter.error(
                    "E0713",
                    f"'{name}' has no mass, so it cannot be {word}",
                    action.origin.span,
                    caption="the balance of forces decides it at all times",
                    help="let the event change a force, or give a mass to what moves with it",
                )


def _holding(solved: Solved) -> list[Row]:
    """Return the rows of constraints that hold, or may hold, those that can be released last."""
    released = [
        row for row in solved.switched if row.constraint.mode and row.constraint.mode.kind == "constraint"
    ]
    return [*solved.rows, *released]


def _others(
    system: MechanicalSystem, solved: Solved, set_here: Collection[Node]
) -> tuple[list[Node], list[Node]]:
    """Return the velocities that are not set, and what they become so that all constraints hold.

    They change as little as kinetic energy allows. Where constraints leave them no room, nothing: those that are set are
    taken to fit.
    """
    graph = system.graph
    held = [i for i in solved.free if system.v[i].node in set_here]
    others = [i for i in solved.free if i not in held]
    velocities = [system.v[i].node for i in others]
    if not held or not others:
        return [], []
    jumps = [graph.symbol(f"#jump {i}") for i in others]
    rows = [row for row in _holding(solved) if not set(velocities).isdisjoint(graph.support(row.rate))]
    multipliers = [row.multiplier for row in rows]
    residual = [solved.residual[i] for i in others]
    inertia = jvp(graph, residual, {system.a[i]: d for i, d in zip(others, jumps, strict=True)})
    forces = jvp(graph, residual, {m: m for m in multipliers})
    along = jvp(graph, [row.rate for row in rows], dict(zip(velocities, jumps, strict=True)))
    balance = [graph.add(m, f) for m, f in zip(inertia, forces, strict=True)]
    conditions: list[Node] = []
    after: dict[int, range] = {}
    for k, (row, d) in enumerate(zip(rows, along, strict=True), start=len(jumps)):
        rate, mode = graph.add(row.rate, d), row.constraint.mode
        if mode is not None:  # released: no impulse; its pivot is known when those of all others are
            rate, after[k] = graph.select(mode.flag, rate, row.multiplier), range(k)
        conditions.append(rate)
    equations = [*weighted(graph, balance, rows, conditions), *conditions]
    try:
        found = solve(graph, equations, [*jumps, *multipliers], after=after or None)
    except ZeroPivot:
        return [], []
    return velocities, [graph.add(v, d) for v, d in zip(velocities, found.solutions, strict=False)]


def _jumps(system: MechanicalSystem, solved: Solved, pairs: Sequence[tuple[Node, Node]]) -> list[Node]:
    """Return the jumps of the velocities by impulses, with all constraints respected."""
    graph = system.graph
    velocities = [system.v[i].node for i in solved.free]
    efforts = vjp(graph, [(rate, effort) for rate, effort in pairs], velocities)
    return list(velocity_jumps(system, solved, efforts))

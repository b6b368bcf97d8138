"""What an initial state must fulfil: constraints, and ``initial e = v`` for expressions; with their Jacobians.

All rows of constraints are listed, those that repeat others too: with other parameters they may contradict.
Rows of the first stage depend on coordinates alone; those of the second on velocities. A constraint between
positions has a row in both.
"""

from __future__ import annotations

from collections.abc import Sequence

from mechc.lang.diagnostics import Reporter
from mechc.runtime.interface import AssemblyRow

from ...graph import Node
from ...graph.differentiate import jacobian, jvp
from ...mechanics.system import InitialRow, MechanicalSystem
from ..model import Function, origin
from ..rows.constraints import Row
from ..rows.residual import constraint_rates
from ..solve.solved import Solved
from .entries import Layout
from .initial_unknowns import InitialUnknowns, StartCondition


def assembly(
    system: MechanicalSystem, solved: Solved, layout: Layout, found: InitialUnknowns, reporter: Reporter
) -> tuple[tuple[AssemblyRow, ...], tuple[Function, ...]]:
    """Return the rows and the functions ``assembly`` (residuals) and ``assembly_jacobian``; none without rows.

    The Jacobian of a row of the first stage is its gradient times N, of the second stage that by v: one column
    for each velocity of the state, row by row.
    """
    resolve = solved.resolve
    conditions = found.conditions
    entries: list[AssemblyRow] = []
    residuals: list[Node] = []
    gradients: list[dict[int, Node]] = []
    velocities = [system.v[i].node for i in layout.v_indices]
    coordinates = {system.q[k].node for k in layout.q_indices}

    def add(entry: AssemblyRow, residual: Node, gradient: dict[int, Node]) -> None:
        entries.append(entry)
        residuals.append(residual)
        gradients.append(gradient)

    held = tuple(
        row
        for row in solved.switched
        if (mode := row.constraint.mode)
        and mode.kind == "constraint"
        and (mode.begins or mode.unless is not None)
    )

    def wanted(row: Row, nodes: Sequence[Node]) -> tuple[Node, ...]:
        """Return residuals that nobody wants where something opens the constraint at the start."""
        mode = row.constraint.mode
        if mode is None or mode.unless is None:
            return resolve(nodes)
        graph = system.graph
        return resolve([graph.select(mode.unless, graph.zero, n) for n in nodes])

    guessed = [n for n, start in zip(velocities, found.starts[layout.nq :], strict=False) if not start.known]
    free = {
        system.q[k].node for k, start in zip(layout.q_indices, found.starts, strict=False) if not start.known
    }

    def stage(condition: StartCondition) -> int:
        depend, residual = system.graph.depend, [condition.residual]
        if not depend(residual, velocities):
            if not depend(residual, coordinates):
                _no_coordinate(system, condition, reporter)
            return 1
        if not condition.late or not depend(residual, free):
            return 2
        if loose := [n for n in guessed if depend(residual, [n])]:
            _rate_is_open(system, condition.row, loose[0], reporter)
        return 1

    followed = _followed(system)
    for row in (*solved.all_rows, *held):
        if row.position is not None:
            residual, rate = wanted(row, [row.position, row.rate])
            name, unit = row.title, row.constraint.units[row.component]
            entry = AssemblyRow(name, 1, "constraint", True, unit, origin(row.constraint.origin.shown))
            if row.constraint.name in followed:
                add(entry, residual, _displaced(system, residual, layout))
            else:
                add(entry, residual, *jacobian(system.graph, [rate], velocities))
    stages = [stage(condition) for condition in conditions]
    for condition, number in zip(conditions, stages, strict=True):
        if number == 1:
            add(_entry(condition.row, 1), condition.residual, _displaced(system, condition.residual, layout))
    for row in (*solved.all_rows, *held):
        (residual,) = wanted(row, [row.rate])
        unit = row.constraint.units[row.component]
        unit = f"{unit or '1'}/s" if row.position is not None and not layout.dimensionless else unit
        entry = AssemblyRow(row.title, 2, "constraint", True, unit, origin(row.constraint.origin.shown))
        (gradient,) = jacobian(system.graph, [residual], velocities)
        held_by = followed.get(row.constraint.name, ())
        moved = {j: n for j, n in gradient.items() if velocities[j] in held_by}
        add(entry, residual, moved or gradient)
    for condition, number in zip(conditions, stages, strict=True):
        if number == 2:
            add(
                _entry(condition.row, 2),
                condition.residual,
                *jacobian(system.graph, [condition.residual], velocities),
            )
    if not entries:
        return (), ()
    dense = [row.get(j, system.graph.zero) for row in gradients for j in range(len(velocities))]
    return tuple(entries), (
        Function("assembly", "residuals of what an initial state must fulfil", tuple(residuals)),
        Function("assembly_jacobian", "their derivatives by the velocities, row by row", tuple(dense)),
    )


def _followed(system: MechanicalSystem) -> dict[str, set[Node]]:
    """Return the velocities in each constraint on what balances of forces move: a start fulfils it by these, and leaves alone the
    velocities of masses on which the forces depend."""
    balanced = {system.v[i].node for drive in system.drives if drive.balanced for i in drive.v}
    found = {}
    for rows in system.constraints if balanced else ():
        support = set(system.graph.support(*constraint_rates(system, rows)))
        if balanced & support:
            found[rows.name] = support & system.symbols.velocities
    return found


def _displaced(system: MechanicalSystem, residual: Node, layout: Layout) -> dict[int, Node]:
    """Return how a residual changes where the coordinates move along each velocity, while velocities stay."""
    graph = system.graph
    velocities = [system.v[i].node for i in layout.v_indices]
    if not graph.depend([residual], velocities):
        along = {system.q[k].node: n for k, n in enumerate(system.qdot)}
        return jacobian(graph, jvp(graph, [residual], along), velocities)[0]
    gradient = {}
    for j, i in enumerate(layout.v_indices):
        along = dict(
            zip(
                (s.node for s in system.q),
                jvp(graph, list(system.qdot), {system.v[i].node: graph.one}),
                strict=True,
            )
        )
        moves = {q: n for q, n in along.items() if not graph.is_zero(n)}
        gradient[j] = jvp(graph, [residual], moves)[0]
    return {j: n for j, n in gradient.items() if not graph.is_zero(n)}


def _entry(row: InitialRow, stage: int) -> AssemblyRow:
    return AssemblyRow(row.name, stage, "initial", row.known, row.unit, origin(row.origin.shown))


def _rate_is_open(system: MechanicalSystem, row: InitialRow, rate: Node, reporter: Reporter) -> None:
    name = system.graph.name(rate)
    reporter.error(
        "E0612",
        f"the initial condition on '{row.name}' depends on '{name}', which is not given",
        row.origin.shown,
        caption="coordinates are found by it, at given rates",
        help=f"add 'initial {name} = 0;', or whatever the rate is at the start",
    )


def _no_coordinate(system: MechanicalSystem, condition: StartCondition, reporter: Reporter) -> None:
    row = condition.row
    if condition.late:
        reporter.error(
            "E0609",
            f"the initial condition on '{row.name}' cannot hold",
            row.origin.shown,
            caption="nothing that may move at the start changes it",
            help="in the equations of a start contacts are open and dry friction has no force: what they hold is not stationary by itself",
        )
        return
    balanced = {k for drive in system.drives if drive.balanced for k in drive.q}
    support = set(system.graph.support(row.residual))
    massless = [system.q[k].name for k in sorted(balanced) if system.q[k].node in support]
    if massless:
        reporter.error(
            "E0603",
            f"the initial condition on '{row.name}' is not free: '{massless[0]}' has no inertia",
            row.origin.shown,
            caption="the balance of forces alone determines it",
            help=f"'{massless[0]} ~ ...' is a guess, from which the balance is solved",
        )
        return
    reporter.error(
        "E0603",
        f"the initial condition on '{row.name}' contains nothing that could be adjusted",
        row.origin.shown,
        caption="no coordinate or velocity in it",
    )

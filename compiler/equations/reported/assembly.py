"""What an initial state must fulfil: constraints, and ``initial e = v`` for expressions; with their Jacobians.

All rows of constraints are listed, those that repeat others too: with other parameters they may contradict.
Rows of the first stage depend on coordinates alone; those of the second on velocities. A constraint between
positions has a row in both.
"""

from __future__ import annotations

from mechc.lang.diagnostics import Reporter

from ...graph import Node
from ...graph.differentiate import jacobian, jvp
from ...mechanics.system import InitialRow, MechanicalSystem
from ..model import AssemblyEntry, Function
from ..solve.solved import Solved
from .entries import Layout


def assembly(
    system: MechanicalSystem, solved: Solved, layout: Layout, reporter: Reporter
) -> tuple[tuple[AssemblyEntry, ...], tuple[Function, ...]]:
    """Return the rows and the functions ``assembly`` (residuals) and ``assembly_jacobian``; none without rows.

    The Jacobian of a row of the first stage is its gradient times N, of the second stage that by v: one column
    for each velocity of the state, row by row.
    """
    resolve = solved.resolve
    conditions = [(row, resolve([row.residual])[0]) for row in system.initials]
    entries: list[AssemblyEntry] = []
    residuals: list[Node] = []
    gradients: list[dict[int, Node]] = []
    velocities = [system.v[i].node for i in layout.v_indices]
    coordinates = {system.q[k].node for k in layout.q_indices}

    def add(entry: AssemblyEntry, residual: Node, gradient: dict[int, Node]) -> None:
        entries.append(entry)
        residuals.append(residual)
        gradients.append(gradient)

    held = tuple(
        row
        for row in solved.switched
        if (mode := row.constraint.mode) and mode.kind == "constraint" and mode.begins
    )
    support = {row: set(system.graph.support(n)) for row, n in conditions}
    for row in (*solved.all_rows, *held):
        if row.position is not None:
            residual, rate = resolve([row.position, row.rate])
            name, unit = row.title, row.constraint.units[row.component]
            entry = AssemblyEntry(name, 1, "constraint", True, unit, row.constraint.origin.shown)
            add(entry, residual, *jacobian(system.graph, [rate], velocities))
    along = {system.q[k].node: n for k, n in enumerate(system.qdot)}
    for condition, residual in conditions:
        if not support[condition].intersection(velocities):
            if not support[condition].intersection(coordinates):
                _no_coordinate(condition, reporter)
            (rate,) = resolve(jvp(system.graph, [residual], along))
            add(_entry(condition, 1), residual, *jacobian(system.graph, [rate], velocities))
    for row in (*solved.all_rows, *held):
        (residual,) = resolve([row.rate])
        unit = row.constraint.units[row.component]
        unit = _per_second(unit) if row.position is not None and not layout.dimensionless else unit
        entry = AssemblyEntry(row.title, 2, "constraint", True, unit, row.constraint.origin.shown)
        add(entry, residual, *jacobian(system.graph, [residual], velocities))
    for condition, residual in conditions:
        if support[condition].intersection(velocities):
            add(_entry(condition, 2), residual, *jacobian(system.graph, [residual], velocities))
    if not entries:
        return (), ()
    dense = [row.get(j, system.graph.zero) for row in gradients for j in range(len(velocities))]
    return tuple(entries), (
        Function("assembly", "residuals of what an initial state must fulfil", tuple(residuals)),
        Function("assembly_jacobian", "their derivatives by the velocities, row by row", tuple(dense)),
    )


def _entry(row: InitialRow, stage: int) -> AssemblyEntry:
    return AssemblyEntry(row.name, stage, "initial", row.known, row.unit, row.origin.shown)


def _per_second(unit: str) -> str:
    return f"{unit or '1'}/s"


def _no_coordinate(row: InitialRow, reporter: Reporter) -> None:
    reporter.error(
        "E0603",
        f"the initial condition on '{row.name}' contains nothing that could be adjusted",
        row.origin.shown,
        caption="no coordinate or velocity in it",
    )

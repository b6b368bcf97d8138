"""What the kernel is told of branches and rows, as plain data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from mechc.lang.diagnostics import Reporter
from mechc.runtime.interface import AssertionEntry, ContactLine, Hybrid, HybridBranch, SwitchedRow

from ...graph import Node
from ...graph.rewrite import substitute
from ...mechanics.modes import BranchRow, CheckAction, EndAction
from ...mechanics.system import MechanicalSystem
from ..model import BranchPlan, HybridPlan, RowPlan, SharePlan, origin
from ..rows.constraints import Row
from ..solve.shares import Share
from ..solve.solved import Solved
from .actions import tied_values
from .energy_jumps import EnergyStep


def one_line(text: str) -> str:
    """Return a condition as written, without line breaks."""
    return " ".join(text.split())


def impulse_of(row: Row) -> Node:
    """Return the symbol of the impulse along a row."""
    assert row.constraint.mode is not None
    return row.constraint.mode.impulses[row.component]


def branch_plans(system: MechanicalSystem, solved: Solved) -> tuple[BranchPlan, ...]:
    """Return what the kernel knows of each branch; ``act_1``, ``act_2`` ... are their functions."""
    return tuple(
        BranchPlan(
            branch.event,
            f"act_{k + 1}",
            HybridBranch(
                one_line(branch.text),
                _checks(system, solved, branch),
                next((a.message for a in branch.actions if isinstance(a, EndAction)), None),
                origin(branch.origin.span),
                _sampled(system, branch.condition),
            ),
        )
        for k, branch in enumerate(system.branches)
    )


def _checks(system: MechanicalSystem, solved: Solved, branch: BranchRow) -> tuple[AssertionEntry, ...]:
    """Return the assertions of a branch, then the constraints that what it sets has to fit."""
    stated = [a for a in branch.actions if isinstance(a, CheckAction)]
    return (
        *(AssertionEntry(a.message, origin(a.origin.span)) for a in stated),
        *(
            AssertionEntry(
                f"'{tied.row.title}' cannot hold "
                + (
                    "at the rates that this event sets: leave one out, and it follows; as it was before the event, "
                    "a rate is pre(der(..))"
                    if tied.rates
                    else "where this event sets its coordinates"
                ),
                origin(branch.origin.span),
                stated=False,
            )
            for tied in tied_values(system, solved, branch)
        ),
    )


def _sampled(system: MechanicalSystem, condition: Node) -> bool:
    """Tell whether a condition never holds between the ticks of its clocks."""
    graph, clocks = system.graph, system.lowering.clocks.values()
    between = substitute(graph, [condition], {clock.pulse: graph.zero for clock in clocks})[0]
    return between != condition and between == graph.zero


def row_plans(
    rows: Sequence[Row], steps: Sequence[EnergyStep], place: Mapping[Node, int]
) -> tuple[RowPlan, ...]:
    """Return what the kernel knows of rows and steps; ``place``: the index of each symbol in z."""
    names = [row.constraint.name for row in rows]
    plans: list[RowPlan] = []
    for row in rows:
        mode = row.constraint.mode
        assert mode is not None
        name = mode.contact if mode.kind == "friction" and mode.contact else row.constraint.name
        plans.append(
            RowPlan(
                mode.kind,
                name,
                names.index(mode.contact) if mode.contact else -1,
                place[mode.flag],
                -1 if mode.sign is None else place[mode.sign],
                place[impulse_of(row)],
                -1 if mode.enabled is None else place[mode.enabled],
                row.constraint.origin.shown,
            )
        )
    plans += [RowPlan("step", "potential", s.switch, -1, -1, place[s.impulse], -1) for s in steps]
    return tuple(plans)


def share_plans(
    rows: Sequence[Row], steps: Sequence[EnergyStep], shared: Mapping[Node, Share], place: Mapping[Node, int]
) -> tuple[SharePlan, ...]:
    """Return what each row and step may share; nothing where none does."""
    sorts = list(dict.fromkeys(share.sort for share in shared.values()))
    none = SharePlan()
    plans = [
        none if (share := shared.get(row.multiplier)) is None
        else SharePlan(place[share.rests], place[share.beside], sorts.index(share.sort))
        for row in rows
    ]  # fmt: skip
    return (*plans, *(none for _ in steps)) if shared else ()


def impacts_are_simultaneous(system: MechanicalSystem, reporter: Reporter) -> bool:
    """Tell whether a contact asks for simultaneous impacts, which all contacts then have; report what cannot be."""
    laws: set[str] = set()
    for contact in system.model.contacts:
        option = contact.options.get("impacts")
        law = getattr(option, "value", "sequential") if option is not None else "sequential"
        if law not in ("sequential", "simultaneous"):
            reporter.error(
                "E0717",
                f'impacts are "sequential" or "simultaneous", not "{law}"',
                contact.origin.shown,
            )
        laws.add(str(law))
    return "simultaneous" in laws


def names_of(plan: HybridPlan) -> Hybrid:
    """Return what switches, branches and rows are called; the contacts of a crowd by lines."""
    rows = [SwitchedRow(row.name, row.kind, origin(row.span)) for row in plan.rows]
    lines: list[ContactLine] = []
    labels: tuple[tuple[str, ...], ...] = ()
    if plan.crowd is not None:
        labels = tuple(columns.labels for columns in plan.crowd.columns)
        for line in plan.crowd.lines:
            names = (line.head, line.columns, line.start, line.stop, line.end)
            lines.append(ContactLine(line.first, *names, origin(line.span)))
    return Hybrid(
        tuple(s.text for s in plan.switches),
        tuple(b.shown for b in plan.branches),
        tuple(rows),
        () if plan.delays is None else plan.delays.delays,
        tuple(lines),
        labels,
    )

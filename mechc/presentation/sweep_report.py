"""The report of the runs of an experiment that sweeps values: one row each."""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING

from msgspec.structs import replace

from .numbers import count, number, with_unit
from .report import first_and_asked, is_own, left_out, title
from .style import PLAIN, Style, width

if TYPE_CHECKING:
    from ..runtime.interface import Quantity
    from ..runtime.studies.kinds.sweep import Runs
    from ..solution import Solution

MOST_COLUMNS = 6
"""Last values in the table; outputs of the model itself are never left out."""


def sweep_report(sweep: Runs[Solution], style: Style = PLAIN, of: Collection[str] = ()) -> str:
    """Return one row for each run: swept values, outcome, steps, last values, largest error.

    ``of``: quantities that the table must hold.
    """
    first = sweep.solutions[0]
    shown, more = _shown(first, of)
    units = [first.shown_unit(q.name)[0] for q in shown]
    problem = first.problem
    si = {q.name: q.unit for q in (*problem.parameters, *problem.states, *problem.inputs)}
    head = [_column(name, si.get(name, "")) for name in sweep.points[0]]
    head += ["outcome", "steps", *(_column(q.name, unit) for q, unit in zip(shown, units, strict=True))]
    table = [[*head, "error"]]
    for point, solution in zip(sweep.points, sweep.solutions, strict=True):
        row = [number(value) if isinstance(value, float) else str(value) for value in point.values()]
        row += [solution.outcome.value, count(solution.statistics.steps)]
        row += [
            number(float(solution.shown(quantity.name)[-1])) if quantity.name in solution.quantities else "-"
            for quantity in shown  # of the first run: those of other structural values may have others
        ]
        estimate = solution.accuracy.error
        table.append([*row, f"{estimate.largest:.1e}" if estimate else "-"])
    widths = [max(width(row[i]) for row in table) for i in range(len(table[0]))]
    rows = [
        "  " + "  ".join(" " * (w - width(cell)) + cell for cell, w in zip(row, widths, strict=True))
        for row in table
    ]
    head_line = f"{style.bold(title(first))}: {len(sweep.solutions)} runs, last values"
    if more:
        rows.append(left_out(more, "quantities", style))
    notes = [f"  note: {text}" for text in _branches_of_runs(sweep)]
    return "\n".join([head_line, "", style.dim(rows[0]), *rows[1:], *([""] if notes else []), *notes])


def _shown(first: Solution, of: Collection[str]) -> tuple[list[Quantity], int]:
    """Return the quantities of the table, and how many others there are."""
    problem = first.problem
    listed = [q for q in (*problem.states, *problem.outputs) if q.kind in ("coordinate", "state", "output")]
    listed += [q for n, q in first.quantities.items() if n in of and q not in listed]
    asked = {q.name for q in listed if q.name in of or (q.kind == "output" and is_own(q.name))}
    shown = first_and_asked(listed, MOST_COLUMNS, lambda q: q.name in asked)
    return shown, len(listed) - len(shown)


def _branches_of_runs(sweep: Runs[Solution]) -> list[str]:
    """What the first run says of solutions of equations for outputs, and the first one in which such an output jumps."""
    noted: dict[str, str] = {}
    for point, solution in zip(sweep.points, sweep.solutions, strict=True):
        found = solution.branches
        at = ", ".join(f"{n} = {number(v) if isinstance(v, float) else v}" for n, v in point.items())
        for kind, count_of in (("several", len(found.several)), ("jumps", len(found.jumps))):
            if count_of and kind not in noted:
                told = replace(found, **{other: () for other in ("several", "jumps") if other != kind})
                noted[kind] = f"{next(iter(told.remarks(solution.problem)))} (first with {at})"
    return list(noted.values())


def _column(name: str, unit: str) -> str:
    return f"{name} [{unit}]" if with_unit(unit) else name

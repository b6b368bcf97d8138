"""The text of ``mechc init MODEL``: the state in which a run begins, and how it came about."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..runtime.case import Case, SimulationOptions, prepare, start_remarks
from ..runtime.functions import load_functions
from .numbers import number
from .style import PLAIN, Style, pad, width

if TYPE_CHECKING:
    from ..model import CompiledModel
    from ..runtime.problem import Problem


def initial_text(
    model: CompiledModel,
    experiment: str | None,
    *,
    explain: bool,
    style: Style = PLAIN,
) -> str:
    """Return the consistent initial state; with ``explain`` what was wanted, and by how much it was moved.

    Raises SimulationError where there is none, CompilerMissing, BuildError.
    """
    model = model.for_experiment(experiment)
    problem = model.problem(quick=True)
    options = SimulationOptions(experiment=experiment, values=model.settings, start=0.0, stop=0.0)
    case = prepare(problem, load_functions(problem), options)
    title = style.bold(problem.name + (f", {case.experiment}" if case.experiment else ""))
    rows = [f"{title}: initial state", "", *_states(problem, case, explain, style)]
    if explain:
        rows += _equations(problem, case, style)
    if remarks := start_remarks(case):
        rows += ["", *(f"note: {remark}" for remark in remarks)]
    return "\n".join(rows).rstrip()


def _states(problem: Problem, case: Case, explain: bool, style: Style) -> list[str]:
    table = [["", "wanted", "got", "moved by", ""] if explain else ["", "", ""]]
    for i, quantity in enumerate(problem.states):
        if quantity.kind == "account":
            continue
        got, wanted = float(case.y0[i]), float(case.wanted[i])
        if explain:
            sign = "=" if case.known[i] else "~"
            moved = "-" if case.known[i] else f"{got - wanted:.2e}"
            table.append([quantity.name, f"{sign} {number(wanted)}", number(got), moved, quantity.unit])
        else:
            table.append([quantity.name, number(got), quantity.unit])
    rows = _aligned(table)
    return [style.dim(rows[0]), *rows[1:]] if explain else rows[1:]


def _equations(problem: Problem, case: Case, style: Style) -> list[str]:
    """What was off before, row by row."""
    if case.assembled is None:
        return ["", "  nothing constrains it"]
    table = [["before the assembly", "off by", ""]]
    for row, residual in zip(problem.assembly, case.assembled.residuals, strict=True):
        rate = "rate of " if row.stage == 2 and row.kind == "constraint" and row.unit.endswith("/s") else ""
        table.append([f"{rate}{row.name}", f"{float(residual):.2e}", row.unit])
    rows = _aligned(table)
    steps = case.assembled.steps
    return [
        "",
        style.dim(rows[0]),
        *rows[1:],
        "",
        f"  steps: {steps[0]} for positions, {steps[1]} for velocities",
    ]


def _aligned(table: list[list[str]]) -> list[str]:
    """Names and units to the left, numbers to the right."""
    widths = [max(width(row[c]) for row in table) for c in range(len(table[0]))]
    last = len(widths) - 1
    return [
        "  "
        + "   ".join(
            pad(cell, widths[c]) if c in (0, last) else " " * (widths[c] - width(cell)) + cell
            for c, cell in enumerate(row)
        ).rstrip()
        for row in table
    ]

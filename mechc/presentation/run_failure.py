"""Why a run stopped early, or cannot begin: told like a diagnostic of the compiler."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..lang.diagnostics import Severity
from .numbers import number, with_unit
from .render import Mark, ShownLine, heading, line_rows, note_rows, place_row
from .style import PLAIN, Style, width

if TYPE_CHECKING:
    from ..runtime.interface import Origin
    from ..runtime.outcome import SimulationError
    from ..solution import Solution

MOST_STATES = 12
"""States of the point where a run stopped that are shown."""


def render_failure(solution: Solution, style: Style = PLAIN) -> str:
    """Return why a run stopped early, with the line of the model that is to blame and the state there."""
    failure = solution.failure
    if failure is None:
        return solution.message
    rows = render_message(failure.message, failure.origin, style).split("\n")
    units = {q.name: q.unit for q in solution.problem.states if q.kind != "account"}
    known = [(name, value) for name, value in failure.state.items() if name in units]
    shown = known[:MOST_STATES]
    state = ", ".join(f"{name} = {number(value)}{with_unit(units[name])}" for name, value in shown)
    more = len(known) - len(shown)
    rows += note_rows("state", state + (f", and {more} more" if more else ""), 2, style)
    return "\n".join(rows)


def render_error(error: SimulationError, style: Style = PLAIN) -> str:
    """Return why a run cannot begin, like a diagnostic."""
    rows = render_message(error.message, error.origin, style, error.code).split("\n")
    for note in error.notes:
        rows += note_rows("note", note, 2, style)
    if error.help:
        rows += note_rows("help", error.help, 2, style)
    return "\n".join(rows)


def render_message(message: str, origin: Origin | None, style: Style = PLAIN, code: str = "") -> str:
    """Return a message of the runtime like a diagnostic, with its source line where one is known."""
    rows = [heading(Severity.ERROR, code, message, style)]
    if origin is not None:
        gutter = len(str(origin.line)) + 1
        rows.append(place_row(origin.file, origin.line, origin.column, gutter, first=True, style=style))
        start = width(origin.text[: origin.column - 1])
        mark = Mark(start, max(width(origin.text.rstrip()), start + 1), "", True)
        rows += line_rows(ShownLine(origin.line, origin.text, (mark,)), gutter, Severity.ERROR, style)
    return "\n".join(rows)

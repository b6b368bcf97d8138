"""The events of a run in its report: clocks in one line each, the first of all others, and how often the rest happened."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from ..runtime.integrate.events import Events
from .numbers import number, plural, with_unit
from .style import Style, pad, width

if TYPE_CHECKING:
    from ..solution import Solution

MOST_EVENTS = 8


def event_list(solution: Solution, style: Style) -> list[str]:
    """Return the rows; none where nothing happened."""
    if not isinstance(solution.events, Events) or not solution.events:
        return []
    clocks, events = solution.events.condensed()
    unit = with_unit(solution.problem.time.unit)
    rows = [style.dim(f"  {plural(len(solution.events), 'event')}")]
    names = max((width(clock.name) for clock in clocks), default=0)
    rows += [
        f"  {pad(clock.name, names)}  {clock.count} times, from {number(clock.first)}{unit} to {number(clock.last)}{unit}"
        for clock in clocks
    ]
    shown = events[:MOST_EVENTS]
    names = max((width(event.name) for event in shown), default=0)
    rows += [f"  {e.time:>14.9g}{unit}  {pad(e.name, names)}  {style.dim(e.kind)}" for e in shown]
    if len(events) > MOST_EVENTS:
        met = Counter(f"{event.name} {event.kind}" for event in events)
        said = "in all" if len(met) <= MOST_EVENTS else "of all most often"
        counts = ", ".join(f"{count} {kind}" for kind, count in met.most_common(MOST_EVENTS))
        rows.append(style.dim(f"  ... and {len(events) - MOST_EVENTS} more; {said}: {counts}"))
        last = events[-1]
        rows.append(
            f"  {last.time:>14.9g}{unit}  {pad(last.name, names)}  {style.dim(last.kind + ', the last')}"
        )
    return rows

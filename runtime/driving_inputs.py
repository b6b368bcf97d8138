"""Inputs that drive coordinates: their derivatives are inputs of their own, and follow from the same tables."""

from __future__ import annotations

from collections.abc import Mapping

from .inputs import Signal, Table, derivatives
from .interface import derived_among
from .memo import once
from .outcome import SimulationError
from .problem import Array, Problem

SLACK = 1e-12
"""Of the times of a table: what counts as one of its ends."""


@once
def derived(problem: Problem) -> dict[int, tuple[int, int]]:
    """Return the indices of the derivatives of each input that drives, by its own."""
    return derived_among([q.name for q in problem.inputs])


def check_set(problem: Problem, index: int) -> None:
    """Refuse a value or a table of a derivative. Raises ``SimulationError``."""
    for k, following in derived(problem).items():
        if index in following:
            name = problem.inputs[k].name
            raise SimulationError(
                f"'{problem.inputs[index].name}' follows from '{name}'", help=f"give a table of '{name}'"
            )


def with_derivatives(
    problem: Problem, tables: Mapping[int, Table], begin: float, stop: float
) -> dict[int, Table]:
    """Return the tables with those of the derivatives. Raises ``SimulationError`` for a motion with jumps."""
    found = dict(tables)
    for k, (first, second) in derived(problem).items():
        if k not in tables:
            continue
        table, name = tables[k], problem.inputs[k].name
        if table.times.size > 1:
            if table.ends is not None:
                raise SimulationError(
                    f"'{name}' drives a coordinate, and its two derivatives are not known of a function",
                    help="give a table, or state the formula in the model",
                )
            if table.interpolation != "spline":
                raise SimulationError(f"the table of '{name}' drives a coordinate, so it has to be a spline")
            _check_reach(name, table.times, begin, stop)
        found[first], found[second] = derivatives(table)
    return found


def _check_reach(name: str, times: Array, begin: float, stop: float) -> None:
    """Refuse a run beyond the ends of a table, where the value is held and its rate would jump."""
    slack = SLACK * max(abs(times[0]), abs(times[-1]))
    ways = [("begin", "start", times[0])] if begin < times[0] - slack else []
    ways += [("end", "stop", times[-1])] if stop > times[-1] + slack else []
    if not ways:
        return
    options = " ".join(f'--{option} "{time:.10g} s"' for _, option, time in ways)
    raise SimulationError(
        f"the table of '{name}' reaches from {times[0]:g} s to {times[-1]:g} s, the run from {begin:g} s to {stop:g} s: "
        "beyond its ends what it drives would stand still at once",
        help=f"give rows for the whole run, or let the motion {' and '.join(verb for verb, _, _ in ways)} "
        f"with the table: {options}",
    )


def begin_of(problem: Problem, tables: Mapping[str, Table | Signal], start: float) -> float:
    """Return when the motion begins whose first output is at ``start``: at 0, or at a negative start.

    It begins at the start, too, where a table does: within a row of it, or anywhere after if it drives a coordinate, which has
    no motion before. Measured times may count from when a logger was switched on.
    """
    driving = {problem.inputs[k].name for k in derived(problem)} if tables else set()
    for name, table in tables.items():
        if isinstance(table, Signal) or table.times.size < 2:
            continue
        first, row = table.times[0], table.times[1] - table.times[0]
        behind = start >= first * (1 - SLACK)
        if first > 0 and behind and (name in driving or (row < first and start - first <= row)):
            return start
    return min(0.0, start)

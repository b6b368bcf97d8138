"""The points of a section, and their picture."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from msgspec import Struct

from ...outcome import Outcome, SimulationError
from ...problem import Array, Problem
from ...results.solution import Solution
from ...settings import FormulaSurface
from ..findings import Curve, Panel
from ..flow.pieces import periodic
from ..runs.simulate import Plan

WRAPPED = 2 * math.pi
NUMBER = "start number"
"""What arrays call it: no quantity can have this name."""
ASKED = ("asked_where", "asked_every")
"""Outputs that only stand for a formula in the question."""
MOST_NAMED = 12
"""Starts that the picture tells apart, by colours and names; of more, it is one cloud, as a bifurcation diagram."""


class Strand(Struct, frozen=True, eq=False):
    """The section of one start: ``values`` that were swept, times [n] and states [n, ny] of its points, how many
    of the first ones a tighter motion was compared with, how many of them agree, the ``errors`` [ny] of those, and the
    largest drifts of what is conserved, by name; ``outputs`` [n, m] at the points."""

    values: dict[str, float]
    t: Array
    y: Array
    outputs: Array
    outcome: Outcome
    message: str
    compared: int
    agreeing: int
    errors: Array
    drifts: dict[str, float]
    plan: Plan
    runs: tuple[Solution, ...] = ()


def arrays_of(problem: Problem, strands: Sequence[Strand], of: Sequence[str]) -> dict[str, Array]:
    """Give everything at the points of all starts: the number of the start, from 0, the values that were swept, the time, states,
    and the outputs that the model declares or that the picture is ``of``."""
    counts = [len(strand.t) for strand in strands]
    found: dict[str, Array] = {NUMBER: np.repeat(np.arange(len(strands)), counts)}
    for name in strands[0].values:
        found[name] = np.repeat([strand.values[name] for strand in strands], counts)
    found["time"] = np.concatenate([strand.t for strand in strands])
    for k, q in enumerate(problem.states):
        if q.kind != "account":
            found[q.name] = np.concatenate([strand.y[:, k] for strand in strands])
    for k, q in enumerate(problem.outputs):
        if (q.kind == "output" and q.name not in ASKED) or q.name in of:
            found[q.name] = np.concatenate([strand.outputs[:, k] for strand in strands])
    return found


def picture(
    problem: Problem,
    of: Sequence[str],
    where: FormulaSurface | None,
    strands: Sequence[Strand],
    arrays: dict[str, Array],
) -> Panel:
    """Draw two quantities against each other, the first one across: those of the picture that were asked for, else a coordinate that
    the surface leaves free and its rate. Raises SimulationError for more than two, and for an input."""
    quantities = {q.name: q for q in (*problem.states, *problem.outputs) if q.name in arrays}
    if len(of) > 2:
        raise SimulationError(f"a section is drawn in two quantities, not in {len(of)}: {', '.join(of)}")
    if missing := [name for name in of if name not in quantities]:
        raise SimulationError(
            f"'{missing[0]}' is an input, and points are drawn in states and outputs",
            help=f"declare an output for it: output {missing[0]}_there = {missing[0]};",
        )
    names = list(of) or _usual(problem, where)
    if len(names) == 1:
        names += [q.name for q in problem.states if q.name in arrays and q.name not in names][:1] or names
    x, y = (quantities[name] for name in names)
    many = len(strands) > MOST_NAMED
    columns = {name: _wrapped(problem, strands, arrays, name) for name in names}
    curves = []
    for k, strand in enumerate(strands):
        mine = arrays[NUMBER] == k
        label = "" if many else ", ".join(f"{name} = {value:g}" for name, value in strand.values.items())
        curves.append(Curve(label, columns[x.name][mine], columns[y.name][mine], "dots", 0 if many else None))
    title = where.text if where is not None else "once in every interval"
    title += f", {len(strands)} starts" if many else ""
    return Panel(title, x.name, x.unit, y.name, y.unit, tuple(curves), tall=True)


def _usual(problem: Problem, where: FormulaSurface | None) -> list[str]:
    """Give a coordinate that the surface leaves free and its rate; one name where there is no such pair."""
    names = [q.name for q in problem.states if q.kind != "account"]
    fixed = where.name if where is not None else ""
    free = [name for name in names if name not in (fixed, f"der({fixed})")]
    first = next((name for name in free if f"der({name})" in free), free[0] if free else names[0])
    return [first, f"der({first})"] if f"der({first})" in names else [first]


def _wrapped(problem: Problem, strands: Sequence[Strand], arrays: dict[str, Array], name: str) -> Array:
    """Give the values of a quantity at the points; an angle of the state within half a turn of zero, where it has turned in a
    motion by more."""
    column = arrays[name].copy()
    places = [k for k, q in enumerate(problem.states) if q.name == name]
    for number, strand in enumerate(strands):
        mine = arrays[NUMBER] == number
        if places and mine.any() and np.ptp(column[mine]) > WRAPPED and periodic(strand.plan.case, places[0]):
            column[mine] = (column[mine] + WRAPPED / 2) % WRAPPED - WRAPPED / 2
    return column

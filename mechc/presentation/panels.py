"""Which panels a picture of a motion has: chosen from the quantities of the solution."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from msgspec import Struct

from ..runtime.results.sensitivity import Sensitivity
from .painting import GAUGES
from .stillness import Stillness

if TYPE_CHECKING:
    from ..runtime.interface import Quantity
    from ..runtime.problem import Array
    from ..solution import Solution

MOST_CURVES = 8
"""Curves in one panel; of more, as many are drawn evenly spread, and the title says so."""
MOST_PORTRAITS = 2
"""Coordinates that move in a model that gets phase portraits: one for each, or none."""
MOST_PATHS = 6
VISIBLE = 1e-5
"""Relative error of the energy balance from which on it has a panel; below, a line says it."""
NOISE = 1e-9
"""Relative size below which a change is an error of the computation and no motion."""


class TimePanel(Struct, frozen=True):
    """A panel of quantities of one unit over time; ``left_out``: how many more there are."""

    title: str
    unit: str
    names: tuple[str, ...]
    left_out: int = 0


class PhasePanel(Struct, frozen=True):
    """A panel of one coordinate against its rate."""

    name: str
    rate: str


class Paths(Struct, frozen=True):
    """A panel of the trajectories of points; ``dimension`` is 2 or 3, ``left_out``: how many more there are."""

    names: tuple[str, ...]
    dimension: int
    left_out: int = 0


class EnergyPanel(Struct, frozen=True):
    """A panel of the energies, or of the error of their balance."""

    names: tuple[str, ...]
    balance: bool


class Changes(Struct, frozen=True):
    """A panel of derivatives of one unit in one direction over time; ``left_out``: how many more there are."""

    to: str
    unit: str
    curves: tuple[Sensitivity, ...]
    left_out: int = 0


class Scenery(Struct, frozen=True):
    """A panel of what is drawn at the start and the end, with the paths of points; ``left_out``: how many more there are."""

    names: tuple[str, ...]
    left_out: int = 0


Panel = Changes | TimePanel | PhasePanel | Paths | EnergyPanel | Scenery


def panels_of(solution: Solution) -> list[Panel]:
    """Choose the panels: what is drawn, coordinates, phase portraits, further quantities, energies.

    Quantities of one kind and unit share a panel. What stays constant, and what another curve shows already, has none.
    """
    problem, still = solution.problem, Stillness(solution)
    coordinates = [q for q in problem.states if q.kind == "coordinate"]
    states = [q for q in problem.states if q.kind == "state"]
    outputs = [q for q in problem.outputs if q.kind == "output"]
    points = matrix_rows(coordinates) | point_names(outputs)
    most = 2 if _in_plane(solution) else 3
    points = {name: d for name, d in points.items() if d <= most and _travels(solution, name, d)}
    in_paths = {element(name, i) for name, dimension in points.items() for i in range(1, dimension + 1)}
    moving = [q for q in coordinates if not still.constant(q.name)]
    panels: list[Panel] = _pictures(solution, points)
    panels += _by_unit("coordinates", moving)
    rates = {q.name: q for q in problem.states if q.kind == "rate"}
    pictured = bool(panels) and isinstance(panels[0], Scenery)
    if len(moving) <= MOST_PORTRAITS:
        inside = _places(solution) if pictured else []
        panels += [
            PhasePanel(q.name, f"der({q.name})")
            for q in moving
            if f"der({q.name})" in rates
            and not still.steady(f"der({q.name})")
            and not still.among(q.name, inside)
        ]
    elif not pictured:  # shafts and slides, of which a picture shows nothing
        speeds = [rates[name] for q in moving if (name := f"der({q.name})") in rates]
        panels += _by_unit("speeds", [q for q in speeds if not still.constant(q.name)])
    panels += _by_unit("states", [q for q in states if not still.constant(q.name)])
    further = [q for q in outputs if q.name not in in_paths and not still.constant(q.name)]
    panels += _by_unit("outputs", [q for q in further if still.twin(q.name) is None])
    panels += _by_unit("inputs", [q for q in problem.inputs if not still.constant(q.name)])
    discretes = [q for q in problem.discretes if q.kind == "discrete" and not still.constant(q.name)]
    panels += _by_unit("discrete variables", discretes)
    panels += _energies(solution, still)
    panels += _changes(solution, [q.name for q in (*coordinates, *states)] or [q.name for q in outputs])
    return panels or _by_unit("coordinates", coordinates or states or outputs)


def _pictures(solution: Solution, points: Mapping[str, int]) -> list[Panel]:
    """Return the panel of what is drawn, else those of the paths of points."""
    staged = solution.staged()
    found: list[Panel] = []
    if staged is not None and any(shape.kind not in GAUGES for shape in staged[0].shapes):
        pure = not solution.problem.time.unit
        places = [n for n in points if pure or solution.quantities[element(n, 1)].unit == "m"]
        drawn = _spread(places, MOST_PATHS)
        found.append(Scenery(tuple(drawn), len(places) - len(drawn)))
        points = {name: d for name, d in points.items() if name not in places}
    for dimension in (2, 3):
        chosen = [name for name, d in points.items() if d == dimension]
        if chosen:
            drawn = _spread(chosen, MOST_PATHS)
            found.append(Paths(tuple(drawn), dimension, len(chosen) - len(drawn)))
    return found


def _in_plane(solution: Solution) -> bool:
    """Tell a motion that is drawn in the plane, where three lengths are not a place."""
    staged = solution.staged()
    return staged is not None and staged[0].size == 2 and any(s.kind not in GAUGES for s in staged[0].shapes)


def _places(solution: Solution) -> list[Array]:
    """Return the numbers of places along the paths that are drawn."""
    staged = solution.staged()
    if staged is None:
        return []
    rows = staged[1](solution.time)
    return [rows[:, k] for shape in staged[0].shapes if shape.kind == "trail" for k in shape.numbers]


def _energies(solution: Solution, still: Stillness) -> list[Panel]:
    """Return the panel of energies that change, and of the error of their balance where it can be seen."""
    names = [q.name for q in solution.problem.outputs if q.kind == "energy"]
    changing = [n for n in names if not still.constant(n)]
    total = [n for n in names if n.endswith(".total") and n not in changing]
    panels: list[Panel] = []
    if len(changing) > 1 or (changing and not total):
        panels.append(EnergyPanel((*changing, *total), balance=False))
    drift = solution.accuracy.energy
    if drift is not None and drift.relative is not None and drift.relative > VISIBLE:
        panels.append(EnergyPanel(tuple(names), balance=True))
    return panels


def curves_of(solution: Solution, names: Sequence[str]) -> list[Panel]:
    """Panels for chosen quantities only: all of them, however many; ``a:b`` is one over another."""
    units: dict[str, list[str]] = {}
    chosen: list[Panel] = []
    for name in names:
        across, colon, up = name.partition(":")
        if colon:
            chosen.append(PhasePanel(across, up))
        else:
            units.setdefault(solution.quantities[name].unit, []).append(name)
    chosen += [
        TimePanel("", unit, tuple(group[i : i + MOST_CURVES]))
        for unit, group in units.items()
        for i in range(0, len(group), MOST_CURVES)
    ]
    return chosen + _changes(solution, [name for name in names if ":" not in name])


def _changes(solution: Solution, names: Sequence[str]) -> list[Panel]:
    """Panels of the derivatives of quantities, one for each direction and unit."""
    found = solution.motion.sensitivities
    groups: dict[tuple[str, str], list[Sensitivity]] = {}
    for one in found.listed(names) if found else ():
        groups.setdefault((one.to, one.unit), []).append(one)
    return [
        Changes(to, unit, tuple(group[:MOST_CURVES]), max(0, len(group) - MOST_CURVES))
        for (to, unit), group in groups.items()
    ]


def point_names(outputs: Sequence[Quantity]) -> dict[str, int]:
    """Find outputs that are points: two or three lengths ``name[1]``, ``name[2]``; gives their dimension."""
    sizes: dict[str, list[Quantity]] = {}
    for quantity in outputs:
        if match := re.fullmatch(r"(.*)\[(\d+)\]", quantity.name):
            sizes.setdefault(match[1], []).append(quantity)
    return {
        name: len(parts)
        for name, parts in sizes.items()
        if len(parts) in (2, 3) and (all(p.unit == "m" for p in parts) or all(p.unit == "" for p in parts))
    }


def matrix_rows(coordinates: Sequence[Quantity]) -> dict[str, int]:
    """Find the rows of matrices of coordinates that are points: ``r[1,1]``, ``r[1,2]`` are the point ``r[1,]``."""
    sizes: dict[str, int] = {}
    for quantity in coordinates:
        match = re.fullmatch(r"(.*\[\d+,)(\d+)\]", quantity.name)
        if match and quantity.unit in ("m", ""):
            sizes[match[1]] = int(match[2])
    return {name: size for name, size in sizes.items() if size in (2, 3)}


def element(name: str, index: int) -> str:
    """Name a component of a point: ``tip[2]``, or ``r[1,2]`` for the row ``r[1,``."""
    return f"{name}{index}]" if name.endswith(",") else f"{name}[{index}]"


def _travels(solution: Solution, name: str, dimension: int) -> bool:
    """Say whether a point moves by more than rounding errors of the coordinates."""
    sizes = [float(np.abs(solution[q.name]).max()) for q in solution.problem.states if q.kind == "coordinate"]
    extent = max(float(np.ptp(solution[element(name, i)])) for i in range(1, dimension + 1))
    return extent > NOISE * max(sizes, default=1.0)


def _by_unit(title: str, quantities: Sequence[Quantity]) -> list[Panel]:
    units: dict[str, list[str]] = {}
    for quantity in quantities:
        units.setdefault(quantity.unit, []).append(quantity.name)
    return [
        TimePanel(title, unit, tuple(_spread(names, MOST_CURVES)), max(0, len(names) - MOST_CURVES))
        for unit, names in units.items()
    ]


def _spread(names: Sequence[str], most: int) -> list[str]:
    """Choose at most so many, evenly spread, with the first and the last."""
    if len(names) <= most:
        return list(names)
    return [names[round(i * (len(names) - 1) / (most - 1))] for i in range(most)]

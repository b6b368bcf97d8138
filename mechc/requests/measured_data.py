"""Measured motions from files and from arrays: names and units to SI."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ..runtime.fitting.measured import Measured, measured
from ..runtime.inputs import Table, make_table, time_column
from ..runtime.interface import Quantity
from ..runtime.outcome import SimulationError
from ..runtime.problem import Array, Problem
from ..runtime.sheets import Sheet
from ..suggest import closest
from .input_tables import bare_angle, factor_of
from .parse_values import UsageMistake, shown, unknown_name
from .tables import sheet_of

Place = Callable[[int], str]
"""Where a row stands, by its index."""


def measured_motion(what: Any, problem: Problem) -> Measured:
    """Read a measured motion: a CSV file with the header ``time [s],theta [deg],F [N]``, a mapping from names to arrays, or
    a pandas.DataFrame with such heads.

    Columns of inputs drive the model, the others are compared with it; an empty cell was not measured. Columns that the model
    has not are left out, with a remark. Raises UsageMistake and SimulationError for units that do not fit.
    """
    sheet = sheet_of(what, "data")
    if sheet is None or isinstance(what, (tuple, list, np.ndarray)):
        raise UsageMistake(f"measured motions are files, frames or columns by their names, not {shown(what)}")
    return _motion(sheet.without_repeats(), problem)


def _motion(sheet: Sheet, problem: Problem) -> Measured:
    source = sheet.path.name
    compared = {q.name: q for q in (*problem.states, *problem.outputs)}
    driving = {q.name: q for q in problem.inputs}
    names = [name for name, _ in sheet.heads]
    clock = time_column(sheet, names, {**compared, **driving})
    times = np.array(sheet.columns[clock]) * factor_of(
        source, "time", problem.time.unit, sheet.heads[clock][1]
    )
    values: dict[str, Array] = {}
    inputs: dict[str, Array] = {}
    units: dict[str, str] = {"time": sheet.heads[clock][1]}
    remarks = list(sheet.remarks)
    unknown: list[str] = []
    for k, (name, unit) in enumerate(sheet.heads):
        quantity = compared.get(name) or driving.get(name)
        if k == clock:
            continue
        if quantity is None:
            unknown.append(name)
            continue
        into = values if name in compared else inputs
        if name in into:
            raise UsageMistake(f"{source} has two columns '{name}'")
        units[name] = unit
        into[name] = np.array(sheet.columns[k]) * factor_of(source, name, quantity.unit, unit)
        remarks += bare_angle(source, name, quantity.unit, unit, into[name])
    remarks += _left_out(sheet, unknown, {**compared, **driving}, none_known=not values)
    tables = {n: _driving(driving[n], times, u, sheet.place) for n, u in inputs.items()}
    return measured(source, times, values, tables, place=sheet.place, units=units, remarks=tuple(remarks))


def _left_out(
    sheet: Sheet, unknown: list[str], known: Mapping[str, Quantity], *, none_known: bool
) -> list[str]:
    """Say which columns the model has not. Raises UsageMistake where one may be meant, and where none is left."""
    source = sheet.path.name
    for name in unknown:
        near = closest(name, list(known))
        if near or (none_known and len(unknown) == 1) or not sheet.from_file:
            mistake = unknown_name(
                f"coordinate, state, output or input for a column of {source}:", name, known
            )
            raise UsageMistake(
                mistake.message,
                mistake.help
                + (f'; if it is called so in the file, --columns "{name} = {near}"' if near else ""),
            )
    if none_known and unknown:
        listed = ", ".join(f"'{name}'" for name in unknown)
        raise UsageMistake(
            f"none of the columns of {source} is called as a quantity of the model: {listed}",
            f'say what they are, as in --columns "{unknown[0]} = {next(iter(known), "x")}"',
        )
    return [f"columns of {source} that the model has not: {', '.join(unknown)}"] if unknown else []


def _driving(quantity: Quantity, times: Array, values: Array, place: Place) -> Table:
    """Return the table of a measured input. Raises SimulationError where it has gaps."""
    if not np.isfinite(values).all():
        row = int(np.argmin(np.isfinite(values)))
        raise SimulationError(
            f"{place(row)} has no value of '{quantity.name}', which drives the model",
            help="fill the gap, or leave its line out",
        )
    return make_table(times, values, quantity.interpolation, place)

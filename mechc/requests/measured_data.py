"""Measured motions from files and from arrays: names and units to SI."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..runtime.fitting.measured import Measured, measured
from ..runtime.inputs import Table, make_table
from ..runtime.outcome import SimulationError
from ..runtime.problem import Array, Problem, Quantity
from ..runtime.sheets import header_of, read_sheet
from .input_tables import bare_angle, factor_of
from .parse_values import UsageMistake, unknown_name

Column = tuple[str, str, Array]
"""Name, unit as written (empty: SI), values."""
_TIMES = ("t", "time", "times", "zeit", "temps", "tid")
"""What people call the time in a table."""


Place = Callable[[int], str]
"""Where a row stands, by its index."""


def measured_motion(what: Any, problem: Problem) -> Measured:
    """Read a measured motion: a CSV file with the header ``time [s],theta [deg],F [N]``, a mapping from names to arrays, or
    a pandas.DataFrame with such heads.

    Columns of inputs drive the model, the others are compared with it; an empty cell was not measured. Raises UsageMistake
    and SimulationError for names and units that the model has not.
    """
    if isinstance(what, (str, Path)):
        sheet = read_sheet(Path(what))
        columns = [(n, u, np.array(v)) for (n, u), v in zip(sheet.heads, sheet.columns, strict=True)]
        return _motion(sheet.path.name, columns, problem, sheet.place)
    names = list(what.columns if hasattr(what, "columns") else what)
    columns = [(*header_of(str(name)), np.asarray(what[name], dtype=np.float64)) for name in names]
    return _motion("the data", columns, problem, lambda row: f"row {row + 1} of the data")


def _motion(source: str, columns: Sequence[Column], problem: Problem, place: Place) -> Measured:
    compared = {q.name: q for q in (*problem.states, *problem.outputs)}
    driving = {q.name: q for q in problem.inputs}
    times: Array | None = None
    values: dict[str, Array] = {}
    inputs: dict[str, Array] = {}
    remarks: list[str] = []
    for name, unit, column in columns:
        if name == "time":
            if times is not None:
                raise UsageMistake(f"{source} has two columns 'time'")
            times = column * factor_of(source, "time", problem.time.unit, unit)
            continue
        quantity = compared.get(name) or driving.get(name)
        if quantity is None and name.casefold() in _TIMES and "time" not in (n for n, _, _ in columns):
            raise UsageMistake(
                f"{source} has no column 'time'", f"the time column is called 'time [s]', not '{name}'"
            )
        if quantity is None:
            raise unknown_name(
                f"coordinate, state, output or input for a column of {source}:", name, {**compared, **driving}
            )
        into = values if name in compared else inputs
        if name in into:
            raise UsageMistake(f"{source} has two columns '{name}'")
        into[name] = column * factor_of(source, name, quantity.unit, unit)
        remarks += bare_angle(source, name, quantity.unit, unit, into[name])
    if times is None:
        raise UsageMistake(f"{source} has no column 'time'", "its header is 'time [s],theta [rad],...'")
    units = {name: unit for name, unit, _ in columns}
    tables = {n: _driving(driving[n], times, u, place) for n, u in inputs.items()}
    return measured(source, times, values, tables, place=place, units=units, remarks=tuple(remarks))


def _driving(quantity: Quantity, times: Array, values: Array, place: Place) -> Table:
    """Return the table of a measured input. Raises SimulationError where it has gaps."""
    if not np.isfinite(values).all():
        row = int(np.argmin(np.isfinite(values)))
        raise SimulationError(
            f"{place(row)} has no value of '{quantity.name}', which drives the model",
            help="fill the gap, or leave its line out",
        )
    return make_table(times, values, quantity.interpolation, place)

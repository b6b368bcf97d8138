"""Measured motions from files and from arrays: names and units to SI."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..lang.units import UnitError, parse_unit
from ..runtime.fitting.measured import Measured, measured
from ..runtime.inputs import Table, header_of, make_table
from ..runtime.outcome import SimulationError
from ..runtime.problem import Array, Problem, Quantity
from .given_values import UsageMistake, tidy, unknown_name

Column = tuple[str, str, Array]
"""Name, unit as written (empty: SI), values."""
_TIMES = ("t", "time", "times", "zeit", "temps", "tid")
"""What people call the time in a table."""


def measured_motion(what: Any, problem: Problem) -> Measured:
    """Read a measured motion: a CSV file with the header ``time [s],theta [deg],F [N]``, a mapping from names to arrays, or
    a pandas.DataFrame with such heads.

    Columns of inputs drive the model, the others are compared with it; an empty cell was not measured. Raises UsageMistake
    and SimulationError for names and units that the model has not.
    """
    if isinstance(what, (str, Path)):
        source, columns = str(Path(what).name), columns_of(Path(what))
    else:
        heads = [header_of(str(name)) for name in (what.columns if hasattr(what, "columns") else what)]
        arrays = [
            np.asarray(what[name], dtype=np.float64)
            for name in (what.columns if hasattr(what, "columns") else what)
        ]
        source = "the data"
        columns = [(name, unit, values) for (name, unit), values in zip(heads, arrays, strict=True)]
    return _motion(source, columns, problem)


def _motion(source: str, columns: Sequence[Column], problem: Problem) -> Measured:
    compared = {q.name: q for q in (*problem.states, *problem.outputs)}
    driving = {q.name: q for q in problem.inputs}
    times: Array | None = None
    values: dict[str, Array] = {}
    inputs: dict[str, Array] = {}
    for name, unit, column in columns:
        if name == "time":
            times = column * _factor(source, problem.time, unit)
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
        into[name] = column * _factor(source, quantity, unit)
    if times is None:
        raise UsageMistake(f"{source} has no column 'time'", "its header is 'time [s],theta [rad],...'")
    return measured(
        source, times, values, {n: _driving(source, driving[n], times, u) for n, u in inputs.items()}
    )


def _driving(source: str, quantity: Quantity, times: Array, values: Array) -> Table:
    """Return the table of a measured input. Raises SimulationError where it has gaps."""
    if not np.isfinite(values).all():
        row = int(np.argmin(np.isfinite(values))) + 2
        raise SimulationError(
            f"row {row} of {source} has no value of '{quantity.name}', which drives the model",
            help="fill the gap, or leave its row out",
        )
    return make_table(times, values, quantity.interpolation)


def _factor(source: str, quantity: Quantity, unit: str) -> float:
    """Return the factor to SI. Raises UsageMistake for a unit of another dimension."""
    if not unit:
        return 1.0
    try:
        given, wanted = parse_unit(unit), parse_unit(quantity.unit or "1")
    except UnitError as error:
        raise UsageMistake(f"{source}: {error}") from None
    if given.dimension != wanted.dimension:
        raise UsageMistake(
            f"the column '{quantity.name}' of {source} is in {unit}, the model has it in {quantity.unit or '1'}"
        )
    return float(given.factor)


def columns_of(path: Path) -> list[Column]:
    """Read a CSV file; empty cells are not-a-number. Raises SimulationError with file and line."""
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            rows = [row for row in csv.reader(file) if any(cell.strip() for cell in row)]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        help = "" if path.suffix == ".csv" else "several names are one text, with commas: --vary A,B"
        raise SimulationError(f"cannot read the data {path}: {reason}", help=help) from error
    if len(rows) < 2:
        raise SimulationError(f"the data {path} have no rows")
    if len(rows[0]) == 1 and ";" in rows[0][0]:
        raise SimulationError(f"the columns of {path} are separated by commas, not by semicolons")
    heads = [header_of(cell) for cell in rows[0]]
    cells = np.empty((len(rows) - 1, len(heads)))
    for line, row in enumerate(rows[1:], start=2):
        if len(row) != len(heads):
            raise SimulationError(f"row {line} of {path} has {len(row)} cells, not {len(heads)}")
        for index, cell in enumerate(row):
            cells[line - 2, index] = _number(path, line, cell)
    return [(tidy(name), unit, cells[:, k]) for k, (name, unit) in enumerate(heads)]


def _number(path: Path, line: int, cell: str) -> float:
    if not cell.strip():
        return float("nan")
    try:
        return float(cell)
    except ValueError:
        raise SimulationError(f"row {line} of {path} holds '{cell.strip()}', which is no number") from None

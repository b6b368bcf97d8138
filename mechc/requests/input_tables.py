"""Tables of inputs from CSV files, and what units of columns are told by: in SI, or with a remark."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from pathlib import Path

from msgspec.structs import replace

from ..lang.units import UnitError, parse_unit
from ..runtime.inputs import Table, read_tables
from ..runtime.outcome import SimulationError
from ..runtime.problem import Problem
from ..runtime.sheets import units_apart
from .parse_values import UsageMistake, elements_of, tidy, unknown_name

LARGEST_ANGLE = 2 * math.pi
"""An angle beyond it that has no unit may be meant in degrees."""


def factor_of(source: str, name: str, wanted: str, unit: str) -> float:
    """Return the factor to the SI unit ``wanted`` of a column's unit. Raises UsageMistake for one of another dimension."""
    if not unit:
        return 1.0
    column = f"the column '{name}'" + (f" of {source}" if source else "")
    try:
        given, known = parse_unit(unit), parse_unit(wanted or "1")
    except UnitError as error:
        help = f"degrees are headed '{name} [deg]'" if unit == "°" else ""
        raise UsageMistake(f"{column} is in {unit}: {error}", help) from None
    if given.dimension != known.dimension:
        raise UsageMistake(f"{column} is in {unit}, the model has it in {wanted or '1'}")
    return float(given.factor)


def bare_angle(source: str, name: str, wanted: str, unit: str, values: Iterable[float]) -> list[str]:
    """Say that an angle without a unit is read in radians, where its values look like degrees."""
    largest = max((abs(float(v)) for v in values if v == v), default=0.0)
    if unit or wanted != "rad" or largest <= LARGEST_ANGLE:
        return []
    return [
        f"the column '{name}' of {source} has no unit, so it is read in rad, and it reaches {largest:g} rad; degrees are headed "
        f"'{name} [deg]'"
    ]


def input_tables(problem: Problem, files: Mapping[str, str | Path]) -> dict[str, Table]:
    """Read the CSV file of each input. Raises UsageMistake, SimulationError."""
    quantities = {q.name: q for q in problem.inputs}
    tables: dict[str, Table] = {}
    units: list[tuple[str, dict[str, str]]] = []
    for given, path in files.items():
        elements = elements_of(tidy(given), quantities)
        if not elements:
            raise unknown_name("input", given, quantities)
        written: dict[str, str] = {}

        def convert(name: str, unit: str, written: dict[str, str] = written) -> float:
            written[name] = unit
            try:
                return factor_of(
                    "", name, problem.time.unit if name == "time" else quantities[name].unit, unit
                )
            except UsageMistake as mistake:
                raise SimulationError(mistake.message, help=mistake.help) from None

        interpolations = {name: quantities[name].interpolation for name in elements}
        alone = elements[0] if len(elements) == 1 else None
        found = read_tables(Path(path), interpolations, convert, column=alone)
        if missing := [name for name in elements if name not in found]:
            raise SimulationError(
                f"the table {path} has no column '{missing[0]}', which '{given}' stands for too"
            )
        for name, table in found.items():
            remarks = bare_angle(str(path), name, quantities[name].unit, written[name], table.values)
            tables[name] = replace(table, remarks=tuple(remarks))
        units.append((str(path), {"time": written["time"]}))
    if remarks := units_apart(units):
        name, table = next(iter(tables.items()))
        tables[name] = replace(table, remarks=(*table.remarks, *remarks))
    return tables

"""Inputs that tables, arrays or functions give, and what units of columns are told by: in SI, or with a remark."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

from msgspec.structs import replace

from ..lang.units import UnitError, may_count_turns, parse_unit, parse_written_unit
from ..runtime.inputs import Signal, Table, read_tables, time_column
from ..runtime.outcome import SimulationError
from ..runtime.problem import Problem
from ..runtime.sheets import Sheet, units_apart
from .parse_values import UsageMistake, elements_of, shown, tidy, unknown_name
from .tables import sheet_of

LARGEST_ANGLE = 2 * math.pi
"""An angle beyond it that has no unit may be meant in degrees."""


def factor_of(source: str, name: str, wanted: str, unit: str) -> float:
    """Return the factor to the SI unit ``wanted`` of a column's unit. Raises UsageMistake for one of another dimension."""
    if not unit:
        return 1.0
    column = f"the column '{name}'" + (f" of {source}" if source else "")
    try:
        given, known = parse_written_unit(unit), parse_unit(wanted or "1")
    except UnitError as error:
        help = f"did you mean {error.suggestion}?" if error.suggestion else ""
        raise UsageMistake(f"{column} is in {unit}: {error}", help) from None
    if given.dimension != known.dimension:
        raise UsageMistake(f"{column} is in {unit}, the model has it in {wanted or '1'}")
    if may_count_turns(given, known):
        raise UsageMistake(
            f"{column} is in {unit}, the model has it in {wanted}, of an angle: a turn is 2 pi rad",
            f"head it '{name} [rpm]' or '{name} [rev/s]' where it counts turns, '{name} [rad/s]' where it is an angular frequency",
        )
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


def other_head(sheet: Sheet, wanted: str) -> list[str]:
    """Say that the only column beside the time is taken for an input, where it is headed otherwise."""
    names = [name for name, _ in sheet.heads]
    if len(names) != 2 or wanted in names:
        return []
    (head,) = [name for k, name in enumerate(names) if k != time_column(sheet, names, [wanted])]
    return [f"'{wanted}' is read from the column '{head}' of {sheet.path}, the only one beside the time"]


def input_tables(
    problem: Problem, given: Mapping[str, Any], *, functions: bool = True
) -> dict[str, Table | Signal]:
    """Read what is given of each input: a file, a frame, arrays or, if ``functions`` may be, a function of the time. Raises
    UsageMistake, SimulationError."""
    quantities = {q.name: q for q in problem.inputs}
    tables: dict[str, Table | Signal] = {}
    remarks: list[str] = []
    units: list[tuple[str, dict[str, str]]] = []
    for name, what in given.items():
        elements = elements_of(tidy(name), quantities)
        if not elements:
            raise unknown_name("input", name, quantities)
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
        sheet = sheet_of(what, elements[0])
        if sheet is None:
            if not callable(what) or alone is None:
                raise UsageMistake(
                    f"the input '{name}' comes from a table or a function of the time, not from {shown(what)}"
                    if alone
                    else f"'{name}' has {len(elements)} elements: give a function for each, as in '{elements[0]}'",
                    f"a value that stays is set, as in set={{'{name}': 3}}",
                )
            if not functions:
                raise UsageMistake(
                    f"the input '{name}' is a function of Python, which an ensemble cannot keep with its members",
                    "give its values: (times, values)",
                )
            tables[alone] = Signal(what)
            continue
        sheet = sheet.without_repeats()
        found = read_tables(sheet, interpolations, convert, column=alone)
        if missing := [name for name in elements if name not in found]:
            raise SimulationError(f"{sheet.path} has no column '{missing[0]}', which '{name}' stands for too")
        source = str(sheet.path)
        remarks += sheet.remarks
        if alone and sheet.from_file:
            remarks += other_head(sheet, alone)
        for one, table in found.items():
            remarks += bare_angle(source, one, quantities[one].unit, written[one], table.values)
            if table.times.size == 1:
                remarks.append(
                    f"the table of '{one}' has one row, whose value stays for the whole run; a value that stays is set: --set {one}=.."
                )
            tables[one] = table
        if sheet.from_file:
            units.append((source, {"time": written["time"]}))
    remarks += units_apart(units)
    return _remarked(tables, remarks)


def _remarked(tables: dict[str, Table | Signal], remarks: list[str]) -> dict[str, Table | Signal]:
    """Let the first table tell how all of them were read."""
    for name, table in tables.items():
        if isinstance(table, Table) and remarks:
            return {**tables, name: replace(table, remarks=tuple(dict.fromkeys(remarks)))}
    return tables

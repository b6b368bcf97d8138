"""Tables in text files: what heads their columns and the numbers below, each refused with its line of the file."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from io import StringIO
from pathlib import Path

from msgspec import Struct

from .outcome import SimulationError


class Sheet(Struct, frozen=True):
    """``heads``: name and unit ("": none is written) of each column; ``columns``: its numbers, not-a-number where a cell is empty;
    ``lines``: the line of the file on which each row stands."""

    path: Path
    heads: tuple[tuple[str, str], ...]
    columns: tuple[list[float], ...]
    lines: list[int]

    def place(self, row: int) -> str:
        return f"line {self.lines[row]} of {self.path}"

    def complete(self, column: int, name: str) -> list[float]:
        """Return a column whose cells all hold a number. Raises SimulationError."""
        values = self.columns[column]
        for row, value in enumerate(values):
            if value != value:
                raise SimulationError(
                    f"{self.place(row)} has no value of '{name}'", help="fill the gap, or leave its line out"
                )
        return values


def read_sheet(path: Path) -> Sheet:
    """Read a table: names and units in the first line, columns separated by commas. Raises SimulationError with file and line."""
    rows = _rows(path)
    if not rows:
        raise SimulationError(f"{path} is empty: it begins with a line such as 'time [s],x [mm]'")
    (first, names), *rows = rows
    _check_head(path, first, names)
    heads = tuple(_head(path, first, cell) for cell in names)
    if unnamed := [k for k, (name, _) in enumerate(heads, start=1) if not name]:
        trailing = "; the line ends with a comma" if unnamed == [len(heads)] else ""
        raise SimulationError(f"line {first} of {path} has no name for column {unnamed[0]}{trailing}")
    if not rows:
        raise SimulationError(f"{path} has no rows below its first line")
    for line, row in rows:
        if len(row) != len(heads):
            raise SimulationError(f"line {line} of {path} has {len(row)} cells, not {len(heads)}")
    if not any(unit for _, unit in heads) and not any(
        not cell.strip() or _value(cell.strip()) is not None for cell in rows[0][1]
    ):
        line, row = rows[0]
        raise SimulationError(
            f"line {line} of {path} holds no number but '{','.join(row)}'; units stand behind the names, in the first line",
            help="as in 'time [s],x [mm]'",
        )
    columns = tuple([_number(path, line, row[k]) for line, row in rows] for k in range(len(heads)))
    return Sheet(path, heads, columns, [line for line, _ in rows])


def _rows(path: Path) -> list[tuple[int, list[str]]]:
    """Return the cells of all lines that are not blank, with the numbers of these lines."""
    import csv

    try:
        text = path.read_bytes().decode("utf-8-sig")
    except OSError as error:
        help = "" if path.suffix == ".csv" else "several names are one text, with commas: --vary A,B"
        raise SimulationError(f"cannot read {path}: {error.strerror}", help=help) from error
    except UnicodeDecodeError as error:
        wide = error.object[:2] in (b"\xff\xfe", b"\xfe\xff")
        line = error.object.count(b"\n", 0, error.start) + 1
        raise SimulationError(
            f"cannot read {path}: "
            + ("it is written in UTF-16" if wide else f"line {line} holds a character that is not UTF-8"),
            help="save it as UTF-8",
        ) from error
    if "\0" in text:
        raise SimulationError(f"cannot read {path}: it is no text")
    reader = csv.reader(StringIO(text, newline=""), strict=True)
    found: list[tuple[int, list[str]]] = []
    line = 1
    try:
        for row in reader:
            if any(cell.strip() for cell in row):
                found.append((line, row))
            line = reader.line_num + 1
    except csv.Error as error:
        raise SimulationError(f"cannot read line {line} of {path}: {error}") from error
    return found


def _check_head(path: Path, line: int, names: Sequence[str]) -> None:
    """Refuse what is no line of names, and columns that other signs separate."""
    begin = names[0].strip()
    for sign, called in ((";", "semicolons"), ("\t", "tabs")):
        if len(names) == 1 and sign in begin:
            raise SimulationError(
                f"line {line} of {path} is '{begin}': columns are separated by commas, not by {called}",
                help="write commas between columns, and points in numbers: 0.5,1.25",
            )
    if begin[:1] in "#%" or all(_value(cell.strip()) is not None for cell in names):
        what = f"begins with '{begin}'" if begin[:1] in "#%" else "holds numbers alone"
        raise SimulationError(
            f"line {line} of {path} {what}: the first line names the columns, as in 'time [s],x [mm]'"
        )


_UNIT = re.compile(r"(.*?)\s*\[(?![0-9, ]+\])([^\[\]]*)\]")
"""A name and its unit; what holds numbers only is an index."""


def header_of(cell: str) -> tuple[str, str]:
    """Take ``torque [N.m]`` and ``u[1] [N]`` apart, as results are headed; a unit need not follow a blank."""
    text = cell.strip()
    match = _UNIT.fullmatch(text)
    if match is None and text.count("[") != text.count("]"):
        raise SimulationError(f"a column is headed 'name [unit]', not '{text}'")
    name, unit = match.groups() if match else (text, "")
    return "".join(name.split()), unit.strip()


def _head(path: Path, line: int, cell: str) -> tuple[str, str]:
    try:
        name, unit = header_of(cell)
    except SimulationError as error:
        raise SimulationError(f"line {line} of {path}: {error.message}") from None
    if not unit and (match := _PARENTHESES.fullmatch(cell.strip())):
        raise SimulationError(
            f"line {line} of {path} heads a column '{cell.strip()}'; a unit stands in brackets: '{match[1]} [{match[2]}]'"
        )
    return name, unit


_PARENTHESES = re.compile(r"(?!der\b)(\S.*?)\s+\(([^()]+)\)")


def _value(text: str) -> float | None:
    """Return the number that a cell holds, not-a-number for 'nan'; None for anything else, as for the ``1_0`` of Python."""
    try:
        value = float(text)
    except ValueError:
        return None
    return None if "_" in text or not text.isascii() or abs(value) == float("inf") else value


def _number(path: Path, line: int, cell: str) -> float:
    """Return the number of a cell, not-a-number for an empty one. Raises SimulationError."""
    text = cell.strip()
    value = _value(text) if text else float("nan")
    if value is None:
        raise SimulationError(f"line {line} of {path} holds '{text}', which is no finite number")
    return value


def units_apart(units: Sequence[tuple[str, Mapping[str, str]]]) -> list[str]:
    """Say which columns have a unit in one file and none in another. ``units``: those of each file, by column."""
    found: list[str] = []
    for name in dict.fromkeys(name for _, columns in units for name in columns):
        having = [(source, columns[name]) for source, columns in units if name in columns]
        stated = [(source, unit) for source, unit in having if unit]
        bare = [source for source, unit in having if not unit]
        if stated and bare:
            source, unit = stated[0]
            found.append(
                f"the column '{name}' is in {unit} in {source}; {bare[0]} gives it no unit and is read in SI"
            )
    return found

"""Tables that people give: files, frames, arrays; names, units and numbers of their columns."""

from __future__ import annotations

import re
from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from msgspec import Struct

from ..lang.units import is_written_unit
from ..runtime.sheets import PLAIN, NamedColumn, Sheet, SheetReading, header_of, read_sheet
from .parse_values import UsageMistake, tidy

_SEPARATORS = {"tab": "\t", "\\t": "\t", "blank": "", " ": "", "comma": ",", "semicolon": ";", "bar": "|"}
_SEPARATORS |= {sign: sign for sign in ",;\t|"}
_DECIMALS = {"point": ".", "comma": ",", ".": ".", ",": ","}


class TableFile(Struct, frozen=True):
    """A file with what is said of how to read it: stands wherever the path of a table does."""

    path: Path
    reading: SheetReading

    def __fspath__(self) -> str:
        return str(self.path)

    def __str__(self) -> str:
        return str(self.path)


def table_file(
    path: str | PathLike[str],
    *,
    columns: str | Mapping[str, str] = "",
    skip: int = 0,
    separator: str | None = None,
    decimal: str | None = None,
) -> TableFile:
    """Say how the table of a file is read, where that is not to be recognised.

    ``columns`` says what columns are, ``"Kraft [kN] = force, Zeit = time"``: the head in the file, or the number of the column
    from 1 on, with its unit if the file has none; others keep their heads. ``skip``: lines to leave out at the top.
    ``separator``: ``,`` ``;`` ``|``, ``tab`` or ``blank``; ``decimal``: ``.`` or ``,``. Raises UsageMistake.
    """
    if separator is not None and separator not in _SEPARATORS:
        raise UsageMistake(f"columns are separated by , ; | tab or blank, not by '{separator}'")
    if decimal is not None and decimal not in _DECIMALS:
        raise UsageMistake(f"before decimals stands . or , and not '{decimal}'")
    if isinstance(skip, bool) or not isinstance(skip, int) or skip < 0:
        raise UsageMistake(f"'skip' is a number of lines, not {skip!r}")
    return TableFile(
        Path(path),
        SheetReading(
            tuple(_named(columns)),
            skip,
            None if separator is None else _SEPARATORS[separator],
            None if decimal is None else _DECIMALS[decimal],
        ),
    )


_NEXT = re.compile(r",(?=[^=,\[\]]*(?:\[[^\]]*\][^=,\[\]]*)*=)")
"""The comma before the next head."""


def _named(columns: str | Mapping[str, str]) -> list[NamedColumn]:
    if isinstance(columns, str):
        parts = [part.rpartition("=") for part in _NEXT.split(columns) if part.strip()]
        pairs = [(head, name) for head, _, name in parts]
    else:
        pairs = list(columns.items())
    found = []
    for head, name in pairs:
        if not head.strip() or not name.strip():
            raise UsageMistake(
                f"columns are named as in \"Kraft [kN] = force, Zeit = time\", not '{columns}'",
                "the head in the file stands left, the name in the model right",
            )
        plain, unit = header_of(head, is_written_unit)
        if header_of(name, is_written_unit)[1]:
            raise UsageMistake(
                f"the unit of '{tidy(name)}' stands beside the head of the file: '{head.strip()} [unit] = ...'"
            )
        found.append(NamedColumn(plain, unit, tidy(name)))
    if twice := [n for n in {one.name for one in found} if sum(one.name == n for one in found) > 1]:
        raise UsageMistake(f"two columns are called '{twice[0]}'")
    return found


def absolute(file: str | PathLike[str]) -> str | TableFile:
    """Return a file by its whole path, for another process."""
    if isinstance(file, TableFile):
        return TableFile(file.path.absolute(), file.reading)
    return str(Path(file).absolute())


def sheet_of_file(file: str | PathLike[str]) -> Sheet:
    """Read the table of a file. Raises SimulationError."""
    if isinstance(file, TableFile):
        return read_sheet(file.path, file.reading, is_written_unit)
    return read_sheet(Path(file), PLAIN, is_written_unit)


def sheet_of(what: Any, name: str) -> Sheet | None:
    """Read a table: of a file, a mapping from heads to columns, a DataFrame, times with values, or an array of such rows.
    None for what is none of these. ``name``: what columns without a head are called. Raises SimulationError, UsageMistake.
    """
    if isinstance(what, (str, PathLike)):
        return sheet_of_file(what)
    if isinstance(what, Mapping) or hasattr(what, "columns"):
        names = list(what.columns if hasattr(what, "columns") else what)
        return _sheet(
            name, [header_of(str(one), is_written_unit) for one in names], [what[one] for one in names]
        )
    if hasattr(what, "index") and hasattr(what, "to_numpy"):  # a Series of pandas
        return _sheet(name, [("time", ""), (name, "")], [what.index, what])
    if isinstance(what, (tuple, list)) and len(what) == 2:
        return _sheet(name, [("time", ""), (name, "")], list(what))
    if isinstance(what, np.ndarray):
        if what.ndim != 2 or what.shape[1] != 2:
            raise UsageMistake(
                f"an array for '{name}' has two columns, time and value, not the shape {what.shape}",
                "or give the times and the values: (times, values)",
            )
        return _sheet(name, [("time", ""), (name, "")], [what[:, 0], what[:, 1]])
    return None


def _sheet(name: str, heads: list[tuple[str, str]], columns: list[Any]) -> Sheet:
    for (head, _), column in zip(heads, columns, strict=True):
        if (kind := np.asarray(column).dtype.kind) in "mM":
            raise UsageMistake(
                f"'{head}' holds {'dates' if kind == 'M' else 'spans of time'}, and a table has numbers",
                "the time is in seconds, as of pandas in (t - t[0]).total_seconds()",
            )
        if kind == "c":
            raise UsageMistake(f"'{head}' holds complex numbers")
    try:
        arrays = [np.asarray(column, dtype=np.float64) for column in columns]
    except (TypeError, ValueError) as error:
        raise UsageMistake(f"the data hold what is not a number: {error}") from None
    sizes = {array.shape for array in arrays}
    if len(sizes) > 1 or any(array.ndim != 1 for array in arrays):
        listed = ", ".join(f"'{head}' {array.shape}" for (head, _), array in zip(heads, arrays, strict=True))
        raise UsageMistake(f"the columns of a table have one number for each row: {listed}")
    rows = arrays[0].size if arrays else 0
    return Sheet(
        Path("the data"),
        tuple(heads),
        tuple(a.tolist() for a in arrays),
        list(range(1, rows + 1)),
        from_file=False,
    )

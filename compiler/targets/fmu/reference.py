"""Reference results: what a model does in its default experiment, as a table that comes with its FMU.

``documentation/reference.csv``: names in the first row as in the model description, then one row for each time, SI
units. Files of the drafted standard for references (``extra/org.fmi-standard.fmi-ls-ref/*.csv``) are read as well.
"""

from __future__ import annotations

import csv
import io
import zipfile
from collections.abc import Collection, Mapping
from pathlib import Path

import numpy as np
import numpy.typing as npt
from msgspec import Struct

from mechc.runtime.problem import Array

OWN = "documentation/reference.csv"
SMALL = 1e-3
"""Part of the largest value of a unit below which other variables of the unit are small."""
DRAFT = "extra/org.fmi-standard.fmi-ls-ref/"


class FmuReference(Struct, frozen=True):
    """``columns``: values over ``time``, by the name of the variable."""

    file: str
    time: Array
    columns: Mapping[str, Array]


class Deviation(Struct, frozen=True):
    """The largest difference to a reference, over the largest value of the variable."""

    size: float
    name: str
    time: float


def write_reference(time: Array, columns: Mapping[str, Array]) -> str:
    """Return the text of a table, with twelve digits: more are not the same on another machine."""
    lines = [",".join(["time", *(_cell(name) for name in columns)])]
    for row in zip(time, *columns.values(), strict=True):
        lines.append(",".join(f"{value:.12g}" for value in row))
    return "\n".join(lines) + "\n"


def _cell(name: str) -> str:
    return '"' + name.replace('"', '""') + '"' if "," in name or '"' in name else name


def read_reference(path: Path, numbers: Collection[str] | None = None) -> FmuReference | None:
    """Return the reference that an FMU holds; None if it holds none. ``numbers``: variables that can be compared; without
    it, all are. Raises ValueError for a table that is wrong."""
    with zipfile.ZipFile(path) as archive:
        names = archive.namelist()
        found = [n for n in names if n == OWN or (n.startswith(DRAFT) and n.endswith(".csv"))]
        if not found:
            return None
        return parse_reference(found[0], archive.read(found[0]).decode("utf-8"), numbers)


def parse_reference(file: str, text: str, numbers: Collection[str] | None = None) -> FmuReference:
    """Read a table; of others than ``numbers`` and the time only the head. Raises ValueError."""
    rows = [row for row in csv.reader(io.StringIO(text)) if row]
    if len(rows) < 2:
        raise ValueError(f"{file}: there are no rows")
    if any(len(row) != len(rows[0]) for row in rows[1:]):
        raise ValueError(f"{file}: the rows are not as long as the head")
    columns: dict[str, Array] = {}
    for i, name in enumerate(rows[0]):
        if numbers is not None and name.strip() not in ("time", *numbers):
            continue
        try:
            values = np.array([[_number(one) for one in row[i].split()] for row in rows[1:]])
        except ValueError as error:
            raise ValueError(f"{file}: {error}") from error
        if values.shape[1] == 1:
            columns[name.strip()] = values[:, 0]
        else:  # all elements of an array in one cell
            columns |= {f"{name.strip()}[{k + 1}]": values[:, k] for k in range(values.shape[1])}
    time = columns.pop("time", None)
    if time is None or np.any(np.diff(time) < 0):
        raise ValueError(f"{file}: there is no column 'time' that rises")
    return FmuReference(file, time, columns)


def _number(text: str) -> float:
    """Return the number of a cell; Booleans are 1 and 0. Raises ValueError."""
    return (
        {"true": 1.0, "false": 0.0}[text.casefold()] if text.casefold() in ("true", "false") else float(text)
    )


def sizes(columns: Mapping[str, Array], units: Mapping[str, str], duration: float = 0.0) -> dict[str, float]:
    """Return the size that differences of each variable are measured by: its largest value.

    What is small beside others of its unit, such as the sum of energies that cancel, counts by those; a rate counts at
    least by its coordinate over ``duration``, as one at rest has nothing but errors of rounding. Where all of a unit are
    zero there is nothing to compare with, and differences count as they are.
    """
    largest = {name: float(np.max(np.abs(values), initial=0.0)) for name, values in columns.items()}
    if duration > 0:
        for name in [name for name in largest if name.startswith("der(")]:
            coordinate = largest.get(name.removeprefix("der(").replace(")", "", 1), 0.0)
            largest[name] = max(largest[name], SMALL * coordinate / duration)
    groups: dict[str, float] = {}
    for name, size in largest.items():
        unit = units.get(name, "")
        groups[unit] = max(groups.get(unit, 0.0), SMALL * size)
    return {name: max(size, groups[units.get(name, "")]) or 1.0 for name, size in largest.items()}


def deviation(
    reference: FmuReference, time: Array, columns: Mapping[str, Array], units: Mapping[str, str]
) -> Deviation | None:
    """Compare results with a reference at its times; None if they have nothing in common.

    Rows of one time, which are both sides of an event, are left out: the other tool may be at either.
    """
    inside = (reference.time >= time[0]) & (reference.time <= time[-1]) & ~_jumps(reference.time)
    scale = sizes(reference.columns, units, float(np.ptp(reference.time)))
    worst = None
    for name in reference.columns:
        if name not in columns or not inside.any():
            continue
        found = np.interp(reference.time, time, columns[name])
        error = np.where(inside, np.abs(found - reference.columns[name]) / scale[name], 0.0)
        k = int(np.argmax(error))  # the first of those that are not numbers, if there are such
        if worst is None or not error[k] <= worst.size:
            worst = Deviation(float(error[k]), name, float(reference.time[k]))
    return worst


def _jumps(time: Array) -> npt.NDArray[np.bool_]:
    """Mark rows whose time stands in several rows: both sides of an event."""
    same = np.zeros(len(time), dtype=np.bool_)
    same[1:] |= np.diff(time) == 0
    same[:-1] |= np.diff(time) == 0
    return same

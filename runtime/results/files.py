"""Results in files: CSV, NPZ and JSON, with units in the headers (``theta [rad]``), and back.

Each format gives the same numbers back, bit for bit. CSV holds the numbers only; NPZ and JSON also hold the
report of the run. A file appears whole or not at all. Columns are looked at in slices: they may lie in files (``rows.py``).
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, BinaryIO, TextIO

import numpy as np
from msgspec import Struct

from ..problem import Array
from ..rows import slices
from .quantities import Display, Results, header

REPORT = "report"
FORMATS = (".csv", ".npz", ".json")


class ResultsFileError(ValueError):
    """A file that holds no results, or whose name tells no format."""


def write_results(
    path: Path,
    columns: Mapping[str, tuple[str, Array]],
    report: Mapping[str, Any] | None,
    display: Display | None = None,
) -> None:
    """Write columns by name, with their units; in those of ``display`` where that is given."""
    check_format(path)
    headed: dict[str, _Column] = {}
    for name, (unit, values) in columns.items():
        shown, factor = display(name, unit) if display else (unit, 1.0)
        headed[header(name, shown)] = _Column(values, factor)
    partial = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        if path.suffix.lower() == ".npz":
            with partial.open("xb") as binary:
                _write_npz(binary, headed, report)
        else:
            with partial.open("x", newline="", encoding="utf-8") as file:
                _write_csv(file, headed) if path.suffix.lower() == ".csv" else _write_json(
                    file, headed, report
                )
        os.replace(partial, path)
    except OSError as error:
        if error.filename == str(partial):
            error.filename = str(path)
        raise
    finally:
        partial.unlink(missing_ok=True)


def read_results(path: Path | str) -> Results:
    """Read what ``save`` wrote. Raises ``ResultsFileError`` and ``OSError``."""
    path = Path(path)
    check_format(path)
    try:
        headed, report = {".csv": _read_csv, ".npz": _read_npz, ".json": _read_json}[path.suffix.lower()](
            path
        )
        names_units = [_split(text) for text in headed]
        if not names_units or names_units[0][0] != "time":
            raise ValueError("its first column is not the time")
        arrays = list(headed.values())
        if any(array.shape != arrays[0].shape for array in arrays):
            raise ValueError("its columns differ in length")
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise ResultsFileError(f"{path} holds no results: {error}") from error
    names = [name for name, _ in names_units]
    units = dict(names_units)
    return Results(arrays[0], dict(zip(names[1:], arrays[1:], strict=True)), units, report)


def json_number(value: float) -> float | None:
    """JSON knows neither infinity nor not-a-number."""
    return float(value) if math.isfinite(value) else None


def check_format(path: Path) -> None:
    if path.suffix.lower() not in FORMATS:
        raise ResultsFileError(f"results are written as {', '.join(FORMATS)}, not '{path.name}'")


def _split(text: str) -> tuple[str, str]:
    """Take "R[1] [rad/s]" apart: the unit follows a blank, an index does not."""
    name, blank, unit = text.rpartition(" [")
    return (name, unit.removesuffix("]")) if blank else (text, "")


class _Column(Struct, frozen=True, eq=False):
    """Values, and the factor to the unit in which they are written."""

    values: Array
    factor: float

    def slices(self) -> Iterator[Array]:
        for rows in slices(len(self.values), self.values):
            yield self.rows(rows)

    def rows(self, rows: slice) -> Array:
        return self.values[rows] if self.factor == 1.0 else self.values[rows] * self.factor


def _write_csv(file: TextIO, headed: Mapping[str, _Column]) -> None:
    import csv

    csv.writer(file, lineterminator="\n").writerow(headed)
    columns = list(headed.values())
    for rows in slices(len(columns[0].values), *(column.values for column in columns)):
        file.writelines(csv_lines(np.column_stack([column.rows(rows) for column in columns])))


def csv_lines(block: Array) -> Iterator[str]:
    """Give a line for each row of numbers; ``repr`` gives the same bits back."""
    return (",".join(map(repr, row)) + "\n" for row in block.tolist())


def _write_npz(file: BinaryIO, headed: Mapping[str, _Column], report: Mapping[str, Any] | None) -> None:
    """Write what ``numpy.savez_compressed`` would."""
    import json
    from zipfile import ZIP_DEFLATED, ZipFile

    with ZipFile(file, "w", compression=ZIP_DEFLATED, allowZip64=True) as archive:
        for text, column in headed.items():
            with archive.open(f"{text}.npy", "w", force_zip64=True) as member:
                described = {"descr": "<f8", "fortran_order": False, "shape": (len(column.values),)}
                np.lib.format.write_array_header_1_0(member, described)
                for values in column.slices():
                    member.write(np.ascontiguousarray(values, dtype="<f8").tobytes())
        with archive.open(f"{REPORT}.npy", "w", force_zip64=True) as member:
            np.lib.format.write_array(member, np.array(json.dumps(report)), allow_pickle=False)


def _read_csv(path: Path) -> tuple[dict[str, Array], None]:
    import csv

    with path.open(newline="", encoding="utf-8-sig") as file:
        rows = [row for row in csv.reader(file) if row]
    if not rows:
        raise ValueError("it is empty")
    data = np.array([[float(cell) for cell in row] for row in rows[1:]]).reshape(-1, len(rows[0]))
    return {text.strip(): data[:, index].copy() for index, text in enumerate(rows[0])}, None


def _read_npz(path: Path) -> tuple[dict[str, Array], dict[str, Any] | None]:
    import json

    with np.load(path, allow_pickle=False) as file:
        headed = {name: np.asarray(file[name], dtype=np.float64) for name in file.files if name != REPORT}
        report: dict[str, Any] | None = json.loads(str(file[REPORT]))
    return headed, report


def _write_json(file: TextIO, headed: Mapping[str, _Column], report: Mapping[str, Any] | None) -> None:
    """Write the object {report, values} as ``json.dump`` would."""
    import json

    def text(what: object) -> str:
        return json.dumps(what, allow_nan=False, ensure_ascii=False)

    file.write(f'{{"{REPORT}": {text(report)}, "values": {{')
    for k, (head, column) in enumerate(headed.items()):
        file.write(f"{', ' if k else ''}{text(head)}: [")
        for i, values in enumerate(column.slices()):
            file.write((", " if i else "") + text([json_number(value) for value in values.tolist()])[1:-1])
        file.write("]")
    file.write("}}\n")


def _read_json(path: Path) -> tuple[dict[str, Array], dict[str, Any] | None]:
    with path.open(encoding="utf-8") as file:
        import json

        data = json.load(file)
    numbers = {
        text: np.array([math.nan if value is None else value for value in values], dtype=np.float64)
        for text, values in data["values"].items()
    }
    return numbers, data[REPORT]

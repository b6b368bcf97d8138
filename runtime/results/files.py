"""Results in files: CSV, NPZ and JSON, with units in the headers (``theta [rad]``), and back.

Each format gives the same numbers back, bit for bit. CSV holds the numbers only; NPZ and JSON also hold the
report of the run. A file appears whole or not at all.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TextIO

from ..arrays.choice import np
from ..problem import Array
from .quantities import Results, header

REPORT = "report"
FORMATS = (".csv", ".npz", ".json")


class ResultsFileError(ValueError):
    """A file that holds no results, or whose name tells no format."""


def write_results(
    path: Path, columns: Mapping[str, tuple[str, Array]], report: Mapping[str, Any] | None
) -> None:
    _check_format(path)
    headed = {header(name, unit): values for name, (unit, values) in columns.items()}
    partial = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        if path.suffix.lower() == ".npz":
            import json

            with partial.open("xb") as binary:
                text = np.array(json.dumps(report))
                np.savez_compressed(binary, allow_pickle=False, **{**headed, REPORT: text})
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
    _check_format(path)
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


def _check_format(path: Path) -> None:
    if path.suffix.lower() not in FORMATS:
        raise ResultsFileError(f"results are written as {', '.join(FORMATS)}, not '{path.name}'")


def _split(text: str) -> tuple[str, str]:
    """Take "R[1] [rad/s]" apart: the unit follows a blank, an index does not."""
    name, blank, unit = text.rpartition(" [")
    return (name, unit.removesuffix("]")) if blank else (text, "")


def _write_csv(file: TextIO, headed: Mapping[str, Array]) -> None:
    import csv

    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(headed)
    for row in np.column_stack(list(headed.values())).tolist():
        writer.writerow([repr(value) for value in row])


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


def _write_json(file: TextIO, headed: Mapping[str, Array], report: Mapping[str, Any] | None) -> None:
    import json

    values = {text: [json_number(value) for value in array.tolist()] for text, array in headed.items()}
    json.dump({REPORT: report, "values": values}, file, allow_nan=False, ensure_ascii=False)
    file.write("\n")


def _read_json(path: Path) -> tuple[dict[str, Array], dict[str, Any] | None]:
    with path.open(encoding="utf-8") as file:
        import json

        data = json.load(file)
    numbers = {
        text: np.array([math.nan if value is None else value for value in values], dtype=np.float64)
        for text, values in data["values"].items()
    }
    return numbers, data[REPORT]

"""Ensembles in files, whole or in pieces, and back."""

from __future__ import annotations

import csv
import json
import os
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..results.files import ResultsFileError
from ..results.quantities import header
from .members import Axis, Listed, Members
from .result import ENDINGS, Column, Ensemble
from .result_buffer import Piece

if TYPE_CHECKING:
    import xarray

FORMATS = (".npz", ".csv", ".json", ".nc", ".zarr", ".parquet")
QUESTION = "question"
PIECE = re.compile(r"(\d+)-(\d+)\.npz")
REPORT = "report"


def columns_of(runs: Ensemble) -> dict[str, Any]:
    """Give the varied values, what was kept, errors, outcomes and reasons: columns of n rows, series [n, times]."""
    values = runs.members.values(0, len(runs))
    names = zip(runs.members.names, runs.members.units, strict=True)
    found: dict[str, Any] = {header(name, unit): values[:, k] for k, (name, unit) in enumerate(names)}
    for k, column in enumerate(runs.scalars):
        found[header(column.name, column.unit)] = runs.numbers[:, k]
    for k, column in enumerate(runs.scalars):
        found[header(f"error of {column.name}", column.unit)] = runs.number_errors[:, k]
    found["error of states"] = runs.errors
    found[header("end", runs.time.unit)] = runs.ends
    found["outcome"] = np.array(ENDINGS)[runs.outcomes]
    found["reason"] = np.array([*runs.texts, ""])[runs.reasons]
    for k, column in enumerate(runs.series):
        found[header(column.name, column.unit)] = runs.rows[:, k]
    if runs.series:
        found[header("time", runs.time.unit)] = runs.times
    return found


def write(runs: Ensemble, path: Path) -> None:
    """Write an ensemble by the ending of a file; it appears whole or not at all. Raises ResultsFileError, ImportError."""
    ending = path.suffix.lower()
    if ending not in FORMATS:
        raise ResultsFileError(f"ensembles are written as {', '.join(FORMATS)}, not as '{path.name}'")
    partial = path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")
    try:
        match ending:
            case ".npz":
                np.savez_compressed(partial, allow_pickle=False, **_packed(runs))
            case ".csv":
                _write_csv(runs, partial)
            case ".json":
                text = json.dumps(runs.summary(), indent=1, ensure_ascii=False)
                partial.write_text(text + "\n", encoding="utf-8")
            case ".nc":
                _write_netcdf(runs, partial)
            case ".zarr":
                named = dataset(runs).rename(_named_for_files(runs))
                named.to_zarr(partial, mode="w", consolidated=False)
                if path.exists():
                    shutil.rmtree(path)
            case ".parquet":
                runs.to_dataframe().to_parquet(partial)
        os.replace(partial, path)
    finally:
        if partial.is_dir():
            shutil.rmtree(partial)
        partial.unlink(missing_ok=True)


def _write_csv(runs: Ensemble, path: Path) -> None:
    """Write a row for each member; with series a row for each time of each member."""
    columns = columns_of(runs)
    time = columns.pop(header("time", runs.time.unit)) if runs.series else None
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        flat = {name: values for name, values in columns.items() if values.ndim == 1}
        series = [values for values in columns.values() if values.ndim == 2]
        heads = [name for name, values in columns.items() if values.ndim == 2]
        # repr of numbers gives the same bits back
        if time is None:
            writer.writerow(flat)
            for k in range(len(runs)):
                writer.writerow([_cell(values[k]) for values in flat.values()])
            return
        writer.writerow([*flat, header("time", runs.time.unit), *heads])
        for k in range(len(runs)):
            own = [_cell(values[k]) for values in flat.values()]
            for i, t in enumerate(time):
                writer.writerow([*own, _cell(t), *(_cell(values[k, i]) for values in series)])


def _cell(value: Any) -> str:
    if isinstance(value, str):
        return value
    return repr(float(value)) if np.isfinite(value) else ""


def _packed(runs: Ensemble) -> dict[str, Any]:
    """Give all that makes an ensemble again, as arrays."""
    report = {
        "model": runs.model,
        "experiment": runs.experiment,
        "time": [runs.time.name, runs.time.unit],
        "scalars": [[c.name, c.unit] for c in runs.scalars],
        "series": [[c.name, c.unit] for c in runs.series],
        "axes": [[a.name, a.unit] for a in runs.members.axes],
        "cloud": [list(runs.members.cloud.names), list(runs.members.cloud.units)]
        if runs.members.cloud
        else None,
        "texts": runs.texts,
        "method": runs.method,
        "tolerance": runs.tolerance,
        "seconds": runs.seconds,
        "threads": runs.threads,
        "build": runs.build,
        "remarks": runs.remarks,
        "summary": runs.summary(),
    }
    arrays = {f"axis_{k}": axis.values for k, axis in enumerate(runs.members.axes)}
    if runs.members.cloud is not None:
        arrays["cloud"] = runs.members.cloud.rows
    for name in (
        "times",
        "numbers",
        "number_errors",
        "rows",
        "outcomes",
        "reasons",
        "ends",
        "errors",
        "steps",
    ):
        arrays[name] = getattr(runs, name)
    return {**arrays, REPORT: np.array(json.dumps(report))}


def read_ensemble(path: str | Path) -> Ensemble:
    """Read what ``save`` wrote as .npz. Raises ResultsFileError and OSError."""
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        report = json.loads(str(arrays.pop(REPORT)))
        axes = [Axis(n, u, arrays.pop(f"axis_{k}")) for k, (n, u) in enumerate(report["axes"])]
        cloud = None
        if report["cloud"] is not None:
            names, units = report["cloud"]
            cloud = Listed(tuple(names), tuple(units), arrays.pop("cloud"))
        columns: dict[str, Any] = {
            name: tuple(Column(*pair) for pair in report[name]) for name in ("scalars", "series")
        }
        words: dict[str, Any] = {
            n: report[n]
            for n in ("model", "experiment", "method", "tolerance", "seconds", "threads", "build")
        }
        return Ensemble(
            members=Members(tuple(axes), cloud),
            time=Column(*report["time"]),
            texts=tuple(report["texts"]),
            remarks=tuple(report["remarks"]),
            **words,
            **columns,
            **arrays,
        )
    except (ValueError, KeyError, TypeError) as error:
        raise ResultsFileError(f"{path} holds no ensemble: {error}") from error


Described = dict[str, tuple[Any, Any, dict[str, Any]]]
"""Variables by name: their dimensions, values and attributes."""


def dataset(runs: Ensemble) -> xarray.Dataset:
    """Give an xarray.Dataset. Raises ImportError where xarray is not installed."""
    try:
        import xarray
    except ImportError:
        raise ImportError("xarray is not installed: pip install 'mechc[data]' brings it") from None
    return xarray.Dataset(*_described(runs))


def _named_for_files(runs: Ensemble) -> dict[str, str]:
    """Give other names to what files cannot name: a slash parts folders there. The attribute ``long_name`` keeps it."""
    return {name: name.replace("/", " per ") for name in _described(runs)[0] if "/" in name}


def _write_netcdf(runs: Ensemble, path: Path) -> None:
    """Write what xarray reads as that dataset, in the conventions that it writes itself; xarray takes a second to import."""
    try:
        import netCDF4
    except ImportError:
        raise ImportError("netCDF4 is not installed: pip install 'mechc[data]' brings it") from None
    data, coords, facts = _described(runs)
    named = _named_for_files(runs)
    lengths = dict(zip(runs.dimensions, runs.shape, strict=True)) | {"time": runs.times.size}
    beside = [name for name, (dims, _, _) in coords.items() if dims != name]
    with netCDF4.Dataset(path, "w", format="NETCDF4") as file:
        file.setncatts(facts)
        for name, (dims, values, about) in {**coords, **data}.items():
            dims = (dims,) if isinstance(dims, str) else dims
            for one in dims:
                if one not in file.dimensions:
                    file.createDimension(one, lengths[one])
            empty = np.nan if values.dtype.kind == "f" and name not in runs.dimensions else None
            variable = file.createVariable(named.get(name, name), values.dtype, dims, fill_value=empty)
            variable.set_auto_maskandscale(False)
            variable.setncatts({n: np.array(v) if isinstance(v, list) else v for n, v in about.items()})
            if here := [one for one in beside if name not in coords and coords[one][0] in dims]:
                variable.setncattr("coordinates", " ".join(here))
            variable[...] = values


def _described(runs: Ensemble) -> tuple[Described, Described, dict[str, Any]]:
    """Give the variables of an ensemble, its coordinates, and what is told of the whole."""
    dims = runs.dimensions
    coords: Described = {
        a.name: (a.name, a.values, {"units": a.unit, "long_name": a.name}) for a in runs.members.axes
    }
    data: Described = {}
    cloud = runs.members.cloud
    for k, (name, unit) in enumerate(zip(cloud.names, cloud.units, strict=True) if cloud else ()):
        assert cloud is not None
        coords[name] = (dims[-1], cloud.rows[:, k], {"units": unit, "long_name": name})
    if runs.series:
        coords["time"] = ("time", runs.times, {"units": runs.time.unit, "long_name": "time"})
    for column in runs.scalars:
        about = {"units": column.unit, "long_name": column.name}
        data[column.name] = (dims, runs[column.name], about)
        data[f"error of {column.name}"] = (dims, runs.error(column.name), about)
    for column in runs.series:
        data[column.name] = (
            (*dims, "time"),
            runs[column.name],
            {"units": column.unit, "long_name": column.name},
        )
    data["error of states"] = (dims, runs.errors.reshape(runs.shape), {"units": "1"})
    words = {
        "flag_values": list(range(len(ENDINGS))),
        "flag_meanings": " ".join(e.replace(" ", "_") for e in ENDINGS),
    }
    data["outcome"] = (dims, runs.outcomes.reshape(runs.shape), words)
    texts = {f"reason_{k}": text for k, text in enumerate(runs.texts)}
    data["reason"] = (
        dims,
        runs.reasons.reshape(runs.shape),
        {"long_name": "number of a reason, -1: none", **texts},
    )
    facts = {"model": runs.model, "method": runs.method, "tolerance": runs.tolerance, "build": runs.build}
    return data, coords, facts


class PiecesFolder:
    """Finished batches in a folder beside the result, so that an ensemble that was interrupted goes on."""

    def __init__(self, result: Path, question: str, *, resume: bool) -> None:
        self.folder = result.with_name(f"{result.name}.parts")
        said = self.folder / QUESTION
        if self.folder.exists() and resume and said.read_text(encoding="utf-8") != question:
            raise ResultsFileError(
                f"{self.folder} holds pieces of another ensemble: ask the same question, or leave --resume out"
            )
        if self.folder.exists() and not resume:
            shutil.rmtree(self.folder)
        self.folder.mkdir(parents=True, exist_ok=True)
        said.write_text(question, encoding="utf-8")

    def kept(self) -> Iterator[tuple[int, int, Piece]]:
        """Give the pieces that are there, with their first member and the one after their last."""
        for path in sorted(self.folder.glob("*.npz")):
            if (name := PIECE.fullmatch(path.name)) is not None:
                with np.load(path, allow_pickle=False) as file:
                    yield int(name[1]), int(name[2]), {n: file[n] for n in file.files}

    def save(self, first: int, last: int, piece: Piece) -> None:
        partial = self.folder / f".{first}-{last}.npz"
        np.savez(partial, allow_pickle=False, **piece)
        os.replace(partial, self.folder / f"{first}-{last}.npz")

    def remove(self) -> None:
        shutil.rmtree(self.folder)

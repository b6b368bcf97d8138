"""What an ensemble gives: arrays with named dimensions and units, and how each member ended."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from ..outcome import Outcome, Told
from ..problem import Array
from ..results.files import json_number
from ..results.solution import Solution
from .members import Members

if TYPE_CHECKING:
    import pandas
    import xarray


ENDINGS = ("not made", "completed", "terminated", "doubtful", "failed")
"""How a member ended: what ``outcomes`` numbers."""
MADE = 1
QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)


class Column(Struct, frozen=True):
    """A kept number or series: its name, and its SI unit."""

    name: str
    unit: str


class Ensemble(Struct, Told, frozen=True, eq=False):
    """The members in the order of the product, the last dimension fastest; n of them.

    ``numbers`` [n, scalars] are what was kept, ``number_errors`` the estimated errors of these; ``rows`` [n, series, times]
    what was kept over time. ``outcomes`` [n] numbers ``ENDINGS``, ``reasons`` [n] the ``texts`` (-1: none), ``ends`` [n]
    are the times at the end, ``errors`` [n] the largest relative errors of the states; errors are not-a-number where no
    companion ran, numbers where a member did not reach its end.
    """

    model: str
    experiment: str
    members: Members
    time: Column
    scalars: tuple[Column, ...]
    series: tuple[Column, ...]
    times: Array
    numbers: Array
    number_errors: Array
    rows: Array
    outcomes: NDArray[np.int8]
    reasons: NDArray[np.int32]
    texts: tuple[str, ...]
    ends: Array
    errors: Array
    steps: NDArray[np.int64]
    method: str
    tolerance: float
    seconds: float
    threads: int
    build: str = ""
    remarks: tuple[str, ...] = ()

    def __repr__(self) -> str:
        counts = ", ".join(f"{n} {word}" for word, n in self.counts().items())
        return f"<mechc ensemble of {self.model}: {counts}; {', '.join(self.names)}>"

    def __len__(self) -> int:
        return self.members.count

    def __iter__(self) -> Iterator[str]:
        """Go through the names of what was kept and of what was varied."""
        return iter((*self.names, *self.members.names))

    @property
    def runs(self) -> tuple[Solution, ...]:
        """No single motion is kept."""
        return ()

    @property
    def complete(self) -> bool:
        return bool((self.outcomes >= MADE).all())

    @property
    def outcome(self) -> Outcome:
        """That of the whole: a member that fails is a row, not the end."""
        return Outcome.COMPLETED if self.complete else Outcome.INTERRUPTED

    @property
    def shape(self) -> tuple[int, ...]:
        return self.members.shape

    @property
    def dimensions(self) -> tuple[str, ...]:
        return self.members.dimensions

    @property
    def names(self) -> tuple[str, ...]:
        """What was kept."""
        return tuple(column.name for column in (*self.scalars, *self.series))

    def __getitem__(self, name: str) -> Array:
        """Give what was kept, or the varied values, by name: an array with the dimensions of the ensemble, then of time."""
        for k, column in enumerate(self.scalars):
            if column.name == name:
                return self.numbers[:, k].reshape(self.shape)
        for k, column in enumerate(self.series):
            if column.name == name:
                return self.rows[:, k].reshape(*self.shape, self.times.size)
        if name in self.members.names:
            return self.members.values(0, len(self))[:, self.members.names.index(name)].reshape(self.shape)
        raise KeyError(f"'{name}' was not kept: there are {', '.join((*self.names, *self.members.names))}")

    def error(self, name: str) -> Array:
        """Give the estimated errors of a kept number, not-a-number where no companion ran."""
        names = [column.name for column in self.scalars]
        if name not in names:
            raise KeyError(f"'{name}' is not a number that was kept: there are {', '.join(names)}")
        return self.number_errors[:, names.index(name)].reshape(self.shape)

    def unit(self, name: str) -> str:
        units = {column.name: column.unit for column in (*self.scalars, *self.series)}
        return {**dict(zip(self.members.names, self.members.units, strict=True)), **units}[name]

    @property
    def outcome_words(self) -> NDArray[np.str_]:
        return np.array(ENDINGS)[self.outcomes].reshape(self.shape)

    def reason(self, *place: int) -> str:
        """Say why a member failed or is doubtful, by its place in the dimensions; empty where it did neither."""
        k = int(np.ravel_multi_index(place, self.shape)) if len(place) > 1 else place[0]
        return self.texts[self.reasons[k]] if self.reasons[k] >= 0 else ""

    def counts(self) -> dict[str, int]:
        """Count the members by how they ended."""
        found = np.bincount(self.outcomes, minlength=len(ENDINGS))
        return {word: int(n) for word, n in zip(ENDINGS, found, strict=True) if n}

    def why(self) -> dict[str, int]:
        """Count the reasons of those that failed or are doubtful."""
        found = np.bincount(self.reasons[self.reasons >= 0], minlength=len(self.texts))
        return dict(zip(self.texts, found.tolist(), strict=True))

    @property
    def arrays(self) -> dict[str, Any]:
        """Everything as plain arrays of n rows, by names with units."""
        from .files import columns_of

        return columns_of(self)

    def save(self, path: str | Path) -> None:
        """Write everything as .npz, .csv, .nc, .zarr or .parquet. Raises ResultsFileError for another ending."""
        from .files import write

        write(self, Path(path))

    def to_xarray(self) -> xarray.Dataset:
        """Give an xarray.Dataset: dimensions are the varied quantities, then time; units are attributes (extra ``data``)."""
        from .files import dataset

        return dataset(self)

    def to_dataframe(self) -> pandas.DataFrame:
        """Give a pandas.DataFrame of a row for each member, without series over time (extra ``data``)."""
        import pandas

        from .files import columns_of

        # the times of series are none of members
        columns = {n: a for n, a in columns_of(self).items() if a.ndim == 1 and a is not self.times}
        return pandas.DataFrame(columns)

    def quantiles(self, name: str, levels: tuple[float, ...] = QUANTILES) -> Array:
        """Give quantiles [levels] of a kept number, or [levels, times] of a series, over the members that have one."""
        values = self[name].reshape(len(self), -1)
        with np.errstate(all="ignore"):
            found: Array = np.nanquantile(values, levels, axis=0)
        return found[:, 0] if values.shape[1] == 1 else found

    def sobol(self, name: str) -> dict[str, float]:
        """Give the first-order Sobol' index of each varied quantity: its share of the variance of a kept number."""
        return first_order(
            self[name].reshape(len(self)), self.members.values(0, len(self)), self.members.names
        )

    def summary(self) -> Mapping[str, Any]:
        """Give an ensemble as JSON knows it, in SI."""
        errors = self.errors[np.isfinite(self.errors)]
        kept = []
        for column in self.scalars:
            values = self[column.name]
            finite = values[np.isfinite(values)]
            row: dict[str, Any] = {"name": column.name, "unit": column.unit, "members": int(finite.size)}
            if finite.size:
                row |= {
                    "mean": float(finite.mean()),
                    "deviation": float(finite.std(ddof=1)) if finite.size > 1 else None,
                }
                row["quantiles"] = {
                    f"{q:g}": float(v) for q, v in zip(QUANTILES, np.quantile(finite, QUANTILES), strict=True)
                }
            kept.append(row)
        return {
            "study": "ensemble",
            "model": self.model,
            "experiment": self.experiment,
            "outcome": self.outcome.value,
            "dimensions": dict(zip(self.dimensions, self.shape, strict=True)),
            "varied": dict(zip(self.members.names, self.members.units, strict=True)),
            "members": self.counts(),
            "reasons": self.why(),
            "kept": kept,
            "series": [column.name for column in self.series],
            "method": self.method,
            "tolerance": self.tolerance,
            "accuracy": {
                "estimated": int(errors.size),
                "median": json_number(float(np.median(errors))) if errors.size else None,
                "largest": json_number(float(errors.max())) if errors.size else None,
            },
            "seconds": self.seconds,
            "threads": self.threads,
            "remarks": list(self.remarks),
        }


FEWEST = 30
"""Members from which indices are estimated."""


def first_order(values: Array, where: Array, names: Sequence[str]) -> dict[str, float]:
    """Give, for each varied quantity, the share of the variance of ``values`` [n] that it explains; ``where`` [n, names].

    On a product it is the variance of the means over its values. On a cloud of independent values it is estimated from the
    same members: means over bins of equal counts, with the variance that the means of n / bins members have by chance
    taken off. Raises ValueError where fewer than ``FEWEST`` members have the number.
    """
    good = np.isfinite(values)
    if good.sum() < FEWEST:
        raise ValueError(f"{good.sum()} members have the number: for its Sobol' indices {FEWEST} are needed")
    variance = float(values[good].var())
    return {
        one: _explained(where[good, k], values[good]) / variance if variance > 0 else float("nan")
        for k, one in enumerate(names)
    }


def _explained(x: Array, values: Array) -> float:
    """Give the variance of the conditional means of ``values`` over x, one for each value of x or for each bin."""
    group: NDArray[np.intp]
    levels, group = np.unique(x, return_inverse=True)
    if levels.size > values.size ** (1 / 2):
        bins = max(2, round(values.size ** (1 / 3)))
        group = np.empty(values.size, dtype=np.intp)
        group[np.argsort(x, kind="stable")] = np.arange(values.size) * bins // values.size
    counts = np.bincount(group)
    means = np.bincount(group, values) / counts
    within = np.bincount(group, values**2) / counts - means**2
    shares = counts / values.size
    chance = float((shares * within / np.maximum(counts - 1, 1)).sum())
    return max(0.0, float((shares * (means - values.mean()) ** 2).sum()) - chance)

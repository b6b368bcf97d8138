"""What the columns of a run reach."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from msgspec import Struct

from ..problem import Array
from ..rows import AT_ONCE
from .evaluate import Table


class Extent(Struct, frozen=True):
    """The ``first`` and ``last`` value of a column, its ``lowest`` and ``highest``; not-a-number where one of its values is none."""

    first: float
    last: float
    lowest: float
    highest: float

    @property
    def largest(self) -> float:
        return max(abs(self.lowest), abs(self.highest))

    @property
    def constant(self) -> bool:
        return self.first == self.lowest == self.highest


def extents(table: Table, columns: Mapping[str, int]) -> Mapping[str, Extent]:
    """Give the extents of states and outputs by name: of many rows all in one pass, else each when somebody asks for it."""
    width = table.y.shape[1] + table.outputs_at(slice(0, 0)).shape[1]
    own = {name: index for name, index in columns.items() if index < width}
    return _Each(table, own) if len(table) <= AT_ONCE else _all(table, own)


class _Each(Mapping[str, Extent]):
    def __init__(self, table: Table, columns: Mapping[str, int]) -> None:
        self._table, self._columns = table, columns

    def __getitem__(self, name: str) -> Extent:
        column = self._table.column(self._columns[name])
        return Extent(*map(float, (column[0], column[-1], column.min(), column.max())))

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        return len(self._columns)


def _all(table: Table, columns: Mapping[str, int]) -> dict[str, Extent]:
    first = last = lowest = highest = np.empty(0)
    for rows, outputs in table.parts():
        low, high = (np.hstack([f(table.y[rows], axis=0), f(outputs, axis=0)]) for f in (np.min, np.max))
        lowest, highest = (
            (low, high) if not rows.start else (np.minimum(lowest, low), np.maximum(highest, high))
        )
        last = _row(table.y[rows], outputs, -1)
        first = first if rows.start else _row(table.y[rows], outputs, 0)
    rows_of = np.array([first, last, lowest, highest])
    return {name: Extent(*rows_of[:, index].tolist()) for name, index in columns.items()}


def _row(y: Array, outputs: Array, which: int) -> Array:
    return np.hstack([y[which], outputs[which]])

"""Measured motions: columns over time, of which some may be missing in some rows, and inputs that were measured with them."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from msgspec import Struct, field
from msgspec.structs import replace
from numpy.typing import NDArray

from ..inputs import Table
from ..outcome import SimulationError
from ..problem import Array

MOST_TWICE = 0.25
"""Share of rows that may repeat the time before them with other values of all columns: more are not events, but a clock with too few
digits."""

SAME = 1e-9
"""What differs by less, in the largest value of its column, does not jump."""


class Measured(Struct, frozen=True, eq=False):
    """One measured motion in SI. ``times`` [n] rise; ``columns`` [n] each, not-a-number where nothing was measured;
    ``inputs`` drive the motion that is compared with it. ``units``: as they were written, by column; ``remarks`` on how it was read.
    """

    source: str
    times: Array
    columns: Mapping[str, Array]
    inputs: Mapping[str, Table] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()

    def since(self, begin: float) -> Measured:
        """Return what was measured from ``begin`` on; inputs keep all their rows."""
        there = self.times >= begin
        if not there.any():
            raise SimulationError(
                f"{self.source} ends at {self.times[-1]:g}, before the motion begins at {begin:g}"
            )
        columns = {name: values[there] for name, values in self.columns.items()}
        return replace(self, times=self.times[there], columns=columns)

    def count(self, names: tuple[str, ...]) -> int:
        """Count the numbers that were measured of some quantities."""
        return sum(int(np.isfinite(self.columns[name]).sum()) for name in names if name in self.columns)


def measured(
    source: str,
    times: Array,
    columns: Mapping[str, Array],
    inputs: Mapping[str, Table] | None = None,
    *,
    place: Callable[[int], str] = lambda row: f"row {row + 1} of the data",
    units: Mapping[str, str] | None = None,
    remarks: tuple[str, ...] = (),
) -> Measured:
    """Check one measured motion; ``place`` says where a row stands, by its index. Rows at one time are the sides of an event, of
    which ``_one_side`` makes one. Raises SimulationError for times that do not rise, for columns of other lengths and for values that
    are infinite."""
    times = np.asarray(times, dtype=np.float64)
    arrays = {name: np.asarray(values, dtype=np.float64) for name, values in columns.items()}
    if times.ndim != 1 or not times.size:
        raise SimulationError(f"{source} has no rows")
    if not np.isfinite(times).all():
        raise SimulationError(f"{place(int(np.argmin(np.isfinite(times))))} has no time")
    steps = np.diff(times)
    if (falls := steps < 0).any():
        raise SimulationError(_not_rising(times, int(np.argmax(falls)) + 1, place))
    for name, values in arrays.items():
        if values.shape != times.shape:
            raise SimulationError(f"'{name}' of {source} has {values.size} values at {times.size} times")
        if (endless := np.isinf(values)).any():
            raise SimulationError(f"{place(int(np.argmax(endless)))} has an infinite value of '{name}'")
    if (again := steps == 0).any():
        moved = again & _all_jump(arrays)
        if moved.sum() > MOST_TWICE * times.size:
            raise SimulationError(
                f"{_not_rising(times, int(np.argmax(moved)) + 1, place)}; with other values in {int(moved.sum())} of"
                f" {times.size} rows these are not events, but a clock with too few digits"
            )
        times, arrays, told = _one_side(source, times, arrays)
        remarks = (*remarks, told)
    return Measured(source, times, arrays, inputs or {}, units or {}, remarks)


def _not_rising(times: Array, row: int, place: Callable[[int], str]) -> str:
    return f"measured times must rise, but in {place(row)} the time {times[row]:g} follows {times[row - 1]:g}"


def _all_jump(columns: Mapping[str, Array]) -> NDArray[np.bool_]:
    """Tell of each row but the first whether no value is that of the row before: at an event something does not jump."""
    same = [np.abs(np.diff(v)) <= SAME * np.nanmax(np.abs(v), initial=0.0) for v in columns.values()]
    jumping: NDArray[np.bool_] = ~np.any(same, axis=0)
    return jumping


def _one_side(source: str, times: Array, columns: Mapping[str, Array]) -> tuple[Array, dict[str, Array], str]:
    """Return one row for each time, and what to tell of it. What is the same on both sides of an event counts once; what jumps there
    is left out: in a motion whose event is a little earlier or later, that time is on one side."""
    first = np.flatnonzero(np.diff(times, prepend=-np.inf) > 0)
    kept: dict[str, Array] = {}
    jumps = []
    for name, values in columns.items():
        low, high = np.fmin.reduceat(values, first), np.fmax.reduceat(values, first)
        size = np.nanmax(np.abs(values), initial=0.0)
        jumping = high - low > SAME * size
        kept[name] = np.where(jumping, np.nan, (low + high) / 2)
        if jumping.any():
            jumps.append(name)
    told = f"{source} has {times.size - first.size} times with two rows, the sides of an event"
    left = f": {', '.join(jumps)} jump there and are not compared at these times" if jumps else ""
    return times[first], kept, told + left

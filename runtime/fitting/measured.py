"""Measured motions: columns over time, of which some may be missing in some rows, and inputs that were measured with them."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from msgspec import Struct, field
from msgspec.structs import replace

from ..inputs import Table
from ..outcome import SimulationError
from ..problem import Array


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
    """Check one measured motion; ``place`` says where a row stands, by its index. Raises SimulationError for times that do not
    rise, for columns of other lengths and for values that are infinite."""
    times = np.asarray(times, dtype=np.float64)
    arrays = {name: np.asarray(values, dtype=np.float64) for name, values in columns.items()}
    if times.ndim != 1 or not times.size:
        raise SimulationError(f"{source} has no rows")
    if not np.isfinite(times).all():
        raise SimulationError(f"{place(int(np.argmin(np.isfinite(times))))} has no time")
    if (falls := np.diff(times) <= 0).any():
        row = int(np.argmax(falls)) + 1
        raise SimulationError(
            f"measured times must rise, but in {place(row)} the time {times[row]:g} follows {times[row - 1]:g}"
        )
    for name, values in arrays.items():
        if values.shape != times.shape:
            raise SimulationError(f"'{name}' of {source} has {values.size} values at {times.size} times")
        if (endless := np.isinf(values)).any():
            raise SimulationError(f"{place(int(np.argmax(endless)))} has an infinite value of '{name}'")
    return Measured(source, times, arrays, inputs or {}, units or {}, remarks)

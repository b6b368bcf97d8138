"""Measured motions: columns over time, of which some may be missing in some rows, and inputs that were measured with them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from msgspec import Struct, field

from ..inputs import Table
from ..outcome import SimulationError
from ..problem import Array


class Measured(Struct, frozen=True, eq=False):
    """One measured motion in SI. ``times`` [n] rise; ``columns`` [n] each, not-a-number where nothing was measured;
    ``inputs`` drive the motion that is compared with it."""

    source: str
    times: Array
    columns: Mapping[str, Array]
    inputs: Mapping[str, Table] = field(default_factory=dict)

    def count(self, names: tuple[str, ...]) -> int:
        """Count the numbers that were measured of some quantities."""
        return sum(int(np.isfinite(self.columns[name]).sum()) for name in names if name in self.columns)


def measured(
    source: str, times: Array, columns: Mapping[str, Array], inputs: Mapping[str, Table] | None = None
) -> Measured:
    """Check one measured motion. Raises SimulationError for times that do not rise and for columns of other lengths."""
    times = np.asarray(times, dtype=np.float64)
    arrays = {name: np.asarray(values, dtype=np.float64) for name, values in columns.items()}
    if times.ndim != 1 or not times.size:
        raise SimulationError(f"{source} has no rows")
    if not np.isfinite(times).all():
        raise SimulationError(f"row {int(np.argmin(np.isfinite(times))) + 2} of {source} has no time")
    if (falls := np.diff(times) <= 0).any():
        row = int(np.argmax(falls)) + 1
        raise SimulationError(
            f"times of {source} must rise, but row {row + 2} ({times[row]:g}) follows {times[row - 1]:g}"
        )
    for name, values in arrays.items():
        if values.shape != times.shape:
            raise SimulationError(f"'{name}' of {source} has {values.size} values at {times.size} times")
    return Measured(source, times, arrays, inputs or {})

"""The times at which a run gives its results."""

from __future__ import annotations

import math

import numpy as np

from .outcome import SimulationError
from .problem import Array
from .rows import IN_MEMORY, Storage, slices


def output_times(
    start: float, stop: float, every: float | None, points: int, storage: Storage = IN_MEMORY
) -> Array:
    """Times from ``start`` to ``stop``: multiples of ``every`` and the stop, or ``points`` evenly spread."""
    if not (math.isfinite(start) and math.isfinite(stop)):
        raise SimulationError("start and stop are finite times")
    if stop < start:
        raise SimulationError(f"the stop time {stop:g} lies before the start {start:g}")
    if stop == start:
        return np.array([stop], dtype=np.float64)
    if every is None:
        if points < 2:
            raise SimulationError(f"at least 2 output points are needed, not {points}")
        return _evenly(start, (stop - start) / (points - 1), points, stop, storage)
    if not every > 0:
        raise SimulationError(f"the output spacing is positive, it is {every:g}")
    count = (stop - start) / every
    number = math.floor(count * (1 + 1e-12)) + 1
    last = start + every * (number - 1)
    further = not (last > stop or stop - last < 1e-9 * every)
    return _evenly(start, every, number + further, stop, storage)


def _evenly(start: float, every: float, number: int, stop: float, storage: Storage) -> Array:
    """Give ``number`` times, of which the last one is the stop."""
    times = storage.empty(number)
    for rows in slices(number, times):
        times[rows] = start + every * np.arange(rows.start, rows.stop)
    times[-1] = stop
    return times

"""Rows of runs of any length: where they lie, and a slice of them at a time, so that what is computed of many on the way needs no
memory of their number."""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from .outcome import SimulationError
from .problem import Array

AT_ONCE = 65_536
"""Rows that are looked at together."""
FEW_NUMBERS = 65_536
"""Numbers in the rows of runs that are judged when somebody asks."""
FEW = 8
"""Rows that are taken from anywhere before what lies around them leaves the memory."""
NO_RESERVE = 0x4000 if sys.platform.startswith("linux") else 0
"""Of mmap: memory that is never there as a whole."""


class Storage(Protocol):
    """Where the arrays of a run are made."""

    def empty(self, *shape: int) -> Array: ...


class Follower(Protocol):
    """Whoever writes the results of a run down while it goes on, and says where its rows lie."""

    @property
    def storage(self) -> Storage: ...

    def begin(self, case: Any, y: Array) -> None:
        """Be told that a run begins, of which the states will be ``y``; the one before is forgotten."""

    def follow(self, t: Array, y: Array, z: Array | None) -> None:
        """Take further rows of the results."""

    def finish(self, table: Any, y: Array) -> None:
        """Take all rows of the run that counts."""


class Memory:
    """Arrays in memory."""

    def empty(self, *shape: int) -> Array:
        return np.empty(shape)


IN_MEMORY = Memory()


class Passing:
    """Arrays whose rows are forgotten once they were looked at (``passed``), where the system can do that."""

    def empty(self, *shape: int) -> Array:
        if shape[0] <= AT_ONCE:
            return np.empty(shape)
        import mmap

        size = 8 * math.prod(shape)
        if size == 0 or not hasattr(mmap, "MAP_PRIVATE"):
            return np.empty(shape)
        flags = mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS | NO_RESERVE
        return np.frombuffer(mmap.mmap(-1, size, flags=flags), dtype=float).reshape(shape)


class Scratch:
    """Arrays in files without a name, in a folder that has room for them; they go with the arrays."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def empty(self, *shape: int) -> Array:
        """Raises OSError where the disk has no room: before anything is written."""
        size = 8 * math.prod(shape)
        if size == 0:
            return np.empty(shape)
        import mmap
        import tempfile

        try:
            with tempfile.TemporaryFile(dir=self._folder) as file:
                _reserve(file, size)
                mapped = mmap.mmap(file.fileno(), size)
        except OSError as error:
            error.filename = f"{self._folder} (room for {size / 1e9:.3g} GB of states)"
            raise
        return np.frombuffer(mapped, dtype=float).reshape(shape)


def _reserve(file: Any, size: int) -> None:
    """Take room for a file, so that no write to it fails later."""
    if hasattr(os, "posix_fallocate"):
        os.posix_fallocate(file.fileno(), 0, size)
        return
    block = bytes(1 << 20)
    for begin in range(0, size, len(block)):
        file.write(block[: size - begin])
    file.flush()


def slices(count: int, *arrays: Array | None) -> Iterator[slice]:
    """Take rows apart. Those of ``arrays`` that lie in files leave the memory after each slice."""
    for begin in range(0, count, AT_ONCE):
        yield slice(begin, min(begin + AT_ONCE, count))
        if begin:
            passed(*arrays)


def taken(which: NDArray[np.intp], *arrays: Array | None) -> tuple[Array | None, ...]:
    """Take a few rows by their numbers, none of ``Passing``. One in a file brings up to megabytes around it along, which leave the memory
    on the way."""
    if not any(map(_mapped, arrays)):
        return tuple(None if array is None else array[which] for array in arrays)
    found = []
    for array in arrays:
        parts = []
        for begin in range(0, 0 if array is None else len(which), FEW):
            assert array is not None
            parts.append(array[which[begin : begin + FEW]])
            passed(array)
        found.append(None if array is None else np.concatenate([array[:0], *parts]))
    return tuple(found)


def passed(*arrays: Array | None) -> None:
    """Let rows leave the memory: those in files are read again when somebody asks for them, those of ``Passing`` are gone."""
    for array in arrays:
        mapped = _mapped(array)
        if mapped is not None and hasattr(mapped, "madvise"):
            import mmap

            mapped.madvise(mmap.MADV_DONTNEED)


def _mapped(array: Array | None) -> Any:
    """Return the file that an array lies in, or the memory of ``Passing``; None for others."""
    base: Any = array
    while type(base).__module__ == "numpy":
        base = base.base
    if isinstance(base, memoryview):
        base = base.obj
    return base if type(base).__module__ == "mmap" else None


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

"""A companion run read beside the rows of the main run, while it is made."""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np

from ..case import Case
from ..integrate.trajectory import Statistics, Trajectory
from ..problem import Array
from ..rows import FEW_NUMBERS, Storage, passed
from .accuracy import EPSILON
from .consistency import Check, Pair, values_of

Rows = tuple[Array, Array, "Array | None"]


class Comparison:
    """Reads a companion: how far its states are from those of the main run at the times that both have, and what the
    ``listed`` checks are in it. A model may end one run just before an output time and the other just after it: their last
    rows belong together.

    ``factor``: from a difference to an error, which is never below the growth of rounding errors. Rows of a short run are kept
    as they come, and looked at when somebody asks for the ``pair``.
    """

    def __init__(
        self,
        case: Case,
        main: Trajectory,
        nominal: Array,
        factor: float,
        listed: tuple[Check, ...],
        storage: Storage,
    ) -> None:
        self._case, self._main, self._nominal, self._factor, self._listed = (
            case,
            main,
            nominal,
            factor,
            listed,
        )
        self._storage = storage
        self._kept: list[tuple[int, Array, Array, Array | None]] = []
        self._keeps = main.y.size <= FEW_NUMBERS
        self._count = 0
        self._held: Rows | None = None

    def read(self, first: int, t: Array, y: Array, z: Array | None) -> None:
        """Take further rows of the companion, of which the first has the number ``first``."""
        if not t.size:
            return
        if self._keeps:
            self._kept.append((first, t.copy(), y.copy(), None if z is None else z.copy()))
        else:
            self._read(first, t, y, z)

    @cached_property
    def _theirs(self) -> Array:
        return self._storage.empty(self._main.t.size, len(self._listed))

    @cached_property
    def _floor(self) -> float:
        return EPSILON * math.sqrt(max(self._main.statistics.steps, 1))

    def _read(self, first: int, t: Array, y: Array, z: Array | None) -> None:
        """Compare all rows but the last one, which may be the last of all."""
        if self._held is None:
            self.largest = np.full(self._case.problem.ny, -np.inf)
        if self._held is not None:
            self._compare(first - 1, *self._held)
        self._compare(first, t[:-1], y[:-1], None if z is None else z[:-1])
        self._held = t[-1:].copy(), y[-1:].copy(), None if z is None else z[-1:].copy()
        self._count = first + t.size

    def pair(self, companion: Statistics, tolerance: float) -> Pair:
        """Compare the ends of both runs; give what the checks are looked at by."""
        for rows in self._kept:
            self._read(*rows)
        self._kept.clear()
        assert self._held is not None
        main, count = self._main, min(self._count, self._main.t.size)
        self.last = self._errors(main.y[-1:], self._held[1])[0]
        self.largest = np.maximum(self.largest, self.last)
        self._theirs[count - 1 : count] = values_of(self._case, self._listed, *self._held)
        steps = max(main.statistics.steps, companion.steps)
        z = None if main.happened is None else main.happened.grid_z
        return Pair(main.t, main.y, z, count, self._theirs[:count], steps, self._factor, tolerance)

    def _compare(self, first: int, t: Array, y: Array, z: Array | None) -> None:
        count = min(t.size, self._main.t.size - 1 - first)
        if count <= 0:
            return
        rows = slice(first, first + count)
        t, y, z = t[:count], y[:count], None if z is None else z[:count]
        self.largest = np.maximum(self.largest, self._errors(self._main.y[rows], y).max(axis=0))
        if self._listed:
            self._theirs[rows] = values_of(self._case, self._listed, t, y, z)
        passed(self._main.t, self._main.y, self._theirs)

    def _errors(self, ours: Array, theirs: Array) -> Array:
        size = self._nominal + np.abs(theirs)
        return np.asarray(np.maximum(self._factor * np.abs(ours - theirs) / size, self._floor))

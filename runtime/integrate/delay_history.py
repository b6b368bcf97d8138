"""What delays look back at, from the results of a run: as the kernel does while it runs (``kernel/events/history.h``)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..case import Case, inputs_at
from ..delays import DelayTable, U, Y, Z
from ..problem import Array


class DelayHistory:
    """The history of one run, by its polynomials ``y`` of the states (None: straight lines between the rows ``t`` [n] with
    ``z`` [n, nz]) and what else changes, ``modes``."""

    def __init__(
        self,
        case: Case,
        delays: DelayTable,
        y: Callable[[Array], Array] | None,
        modes: Callable[[Array], Array],
        rows: tuple[Array, Array],
    ) -> None:
        self._case, self._delays, self._y, self._modes, self._rows = case, delays, y, modes, rows

    def fill(self, t: Array, z: Array) -> None:
        """Write what was into z [n, nz] at the times t [n]."""
        for k, delay in enumerate(self._delays.times):
            of = self._delays.delayed[self._delays.delayed[:, 2] == k]
            if self._y is None:
                times, known = self._rows
                for place in of[:, 0]:
                    z[:, place] = np.interp(t, times, known[:, place])
                continue
            then = np.maximum(t - delay, self._case.begin)
            y, modes, u = self._y(then), self._modes(then), None
            for place, source, _ in of:
                array, index = self._delays.sources[source]
                if array == U and u is None:
                    u = np.array([inputs_at(self._case, float(at)) for at in then])
                columns = {Y: y, U: u, Z: modes}.get(int(array))
                z[:, place] = then if columns is None else columns[:, index]

"""What the kernel notes of events during a run, in buffers that grow where they are."""

from __future__ import annotations

import numpy as np

from ..problem import Array, Problem
from .events import EventRecord
from .solver import Solver

MOST_AT_ONCE = 16_384
"""Instants by which the kernel's buffers grow at most."""


class EventLog:
    """The events and instants of a run: the kernel gets more room whenever it has used what it has."""

    def __init__(self, solver: Solver, problem: Problem) -> None:
        self._solver = solver
        self._problem = problem

    def renew(self) -> None:
        self._solver.grow_events(MOST_AT_ONCE)

    def finish(self, begin: float, t: Array, grid_z: Array) -> EventRecord:
        """Give what happened since ``begin``, with the discrete variables ``grid_z`` [n, nz] at the times ``t`` [n].

        At the start they are as before the first later instant: the first of these times may be after that.
        """
        noted, instants = self._solver.happened()
        ny, size = self._solver.ny, self._solver.ny + self._solver.nz
        start_z = grid_z[0] if t.size else self._solver.discretes()
        later = np.flatnonzero(instants[:, 0] > begin)
        if later.size and not (t.size and t[0] < instants[later[0], 0]):
            start_z = instants[later[0], 1 + ny : 1 + size]
        return EventRecord(self._problem, noted, instants, start_z, grid_z)

"""What the kernel notes of events during a run, taken out of its buffers whenever they are full."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..problem import Array, Problem
from .events import EventRecord, Events
from .solver import FIRST_EVENTS, Solver

MOST_AT_ONCE = 16_384
"""Instants that the kernel's buffers have room for at most."""


class EventLog:
    """The events and instants of a run, taken out of the kernel whenever its buffers are full."""

    def __init__(self, solver: Solver, problem: Problem) -> None:
        self._solver = solver
        self._problem = problem
        self._events: list[NDArray[np.void]] = []
        self._instants: list[Array] = []
        self._count = 0
        self._capacity = FIRST_EVENTS

    def renew(self) -> None:
        self._take()
        self._capacity = min(2 * self._capacity, MOST_AT_ONCE)
        self._solver.start_events(self._capacity)

    def _take(self) -> None:
        events, instants = self._solver.happened()
        events["instant"] += self._count
        self._events.append(events)
        self._instants.append(instants)
        self._count += len(instants)

    def finish(self, start_z: Array, grid_z: Array) -> EventRecord:
        self._take()
        size = self._solver.ny + self._solver.nz
        rows = np.vstack(self._instants)
        before, after = rows[:, 1 : 1 + size], rows[:, 1 + size :]
        events = Events(self._problem, np.concatenate(self._events), before, after)
        return EventRecord(events, rows[:, 0].copy(), before, after, start_z, grid_z)

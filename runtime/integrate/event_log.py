"""What the kernel notes of events during a run, in buffers that grow where they are."""

from __future__ import annotations

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

    def finish(self, start_z: Array, grid_z: Array) -> EventRecord:
        noted, instants = self._solver.happened()
        return EventRecord(self._problem, noted, instants, start_z, grid_z)

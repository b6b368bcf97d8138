"""What the kernel notes of events during a run, taken out of its buffers whenever they are full."""

from __future__ import annotations

import numpy as np

from ..native import kernel as native
from ..problem import Array, Problem
from .events import Event, EventRecord, Note
from .solver import FIRST_EVENTS, Solver


class EventLog:
    """The events and instants of a run, taken out of the kernel whenever its buffers are full."""

    def __init__(self, solver: Solver, problem: Problem) -> None:
        self._solver = solver
        self._problem = problem
        self._events: list[tuple[float, str, str, float, int]] = []
        self._instants: list[Array] = []
        self._notes: list[Note] = []
        self._count = 0
        self._capacity = FIRST_EVENTS

    def renew(self) -> None:
        self._take()
        self._capacity *= 2
        self._solver.start_events(self._capacity)

    def _take(self) -> None:
        events, instants = self._solver.happened()
        for e in events:
            kind = native.EVENT_KINDS[e.kind]
            name = self._name(kind, e.index)
            self._notes.append(Note(self._count + e.instant, kind, e.index, e.value))
            self._events.append((e.t, name, kind, e.value, self._count + e.instant))
        self._instants.append(instants)
        self._count += len(instants)

    def _name(self, kind: str, index: int) -> str:
        hybrid = self._problem.hybrid
        assert hybrid is not None
        return hybrid.branches[index].text if kind == "when" else hybrid.rows[index].name

    def finish(self, start_z: Array, grid_z: Array) -> EventRecord:
        self._take()
        ny, nz = self._solver.ny, self._solver.nz
        rows = np.vstack(self._instants)
        before, after = rows[:, 1 : 1 + ny + nz], rows[:, 1 + ny + nz :]
        names = [q.name for q in (*self._problem.states, *self._problem.discretes)]
        shown = [q.kind != "mode" for q in (*self._problem.states, *self._problem.discretes)]
        events = []
        for t, name, kind, value, instant in self._events:
            changed: tuple[dict[str, float], dict[str, float]] = ({}, {})
            if instant < len(rows):
                for i in np.flatnonzero((before[instant] != after[instant]) & shown):
                    changed[0][names[i]] = float(before[instant, i])
                    changed[1][names[i]] = float(after[instant, i])
            events.append(Event(t, name, kind, value, *changed))
        return EventRecord(
            tuple(events), rows[:, 0].copy(), before, after, start_z, grid_z, tuple(self._notes)
        )

"""What happened during a run: events with their names, and both sides of each instant."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from msgspec import Struct, field

from . import native
from .problem import Array, Problem
from .solver import FIRST_EVENTS, Solver


class Event(Struct, frozen=True):
    """``kind``: when, impact, rest, lift-off, slip, stick, crossing, reflection, release, engage.

    ``before`` and ``after``: coordinates, rates, states and discrete variables at both sides of the instant, where
    they differ. ``value``: of an impact the approach speed, else 0.
    """

    time: float
    name: str
    kind: str
    value: float = 0.0
    before: Mapping[str, float] = field(default_factory=dict)
    after: Mapping[str, float] = field(default_factory=dict)


class Happenings(Struct, frozen=True, eq=False):
    """``times`` [m]; ``before`` and ``after`` [m, ny + nz]; ``grid_z`` [n, nz] belongs to the rows of the grid."""

    events: tuple[Event, ...]
    times: Array
    before: Array
    after: Array
    start_z: Array
    grid_z: Array

    def discretes(self, t: Array, ny: int) -> Array:
        """Give z [n, nz] at the times t [n], continuous from the right."""
        rows = np.vstack([self.start_z, self.after[:, ny:]])
        found: Array = rows[np.searchsorted(self.times, t, side="right")]
        return found

    def merged(self, t: Array, y: Array, ny: int) -> tuple[Array, Array, Array]:
        """Give times, states and discrete variables of the grid with both sides of each instant."""
        kept = ~np.isin(t, self.times)
        times = np.concatenate([t[kept], self.times, self.times])
        side = np.concatenate([np.zeros(kept.sum()), np.zeros(self.times.size), np.ones(self.times.size)])
        number = np.concatenate(
            [np.zeros(kept.sum()), np.arange(self.times.size), np.arange(self.times.size)]
        )
        states = np.vstack([np.hstack([y[kept], self.grid_z[kept]]), self.before, self.after])
        order = np.lexsort((side, number, times))
        return times[order], states[order, :ny], states[order, ny:]


class Log:
    """The events and instants of a run, taken out of the kernel whenever its buffers are full."""

    def __init__(self, solver: Solver, problem: Problem) -> None:
        self._solver = solver
        self._problem = problem
        self._events: list[tuple[float, str, str, float, int]] = []
        self._instants: list[Array] = []
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
            self._events.append((e.t, name, kind, e.value, self._count + e.instant))
        self._instants.append(instants)
        self._count += len(instants)

    def _name(self, kind: str, index: int) -> str:
        hybrid = self._problem.hybrid
        assert hybrid is not None
        return hybrid.branches[index].text if kind == "when" else hybrid.rows[index].name

    def finish(self, start_z: Array, grid_z: Array) -> Happenings:
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
        return Happenings(tuple(events), rows[:, 0].copy(), before, after, start_z, grid_z)

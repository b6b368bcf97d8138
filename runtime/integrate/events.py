"""What happened during a run: events with their names, and both sides of each instant."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from msgspec import Struct, field

from ..problem import Array


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


class Note(Struct, frozen=True):
    """What the kernel noted at an ``instant``, in the order in which it happened: ``index`` of a branch or a row."""

    instant: int
    kind: str
    index: int
    value: float


class EventRecord(Struct, frozen=True, eq=False):
    """``times`` [m]; ``before`` and ``after`` [m, ny + nz]; ``grid_z`` [n, nz] belongs to the rows of the grid."""

    events: tuple[Event, ...]
    times: Array
    before: Array
    after: Array
    start_z: Array
    grid_z: Array
    notes: tuple[Note, ...] = ()

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

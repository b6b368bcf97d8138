"""What happened during a run: events with their names, and both sides of each instant."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, overload

import numpy as np
from msgspec import Struct, field
from numpy.typing import NDArray

from ..native import kernel as native
from ..problem import Array, Problem

NOTED = np.dtype(native.EventStruct)
"""One event as the kernel notes it."""


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


class Events(Sequence[Event]):
    """The events of a run in their order, each made when it is asked for: what the kernel noted stays as it is.

    ``noted`` [k] of ``NOTED``; ``before`` and ``after`` [m, ny + nz] by instant.
    """

    def __init__(self, problem: Problem, noted: NDArray[np.void], before: Array, after: Array) -> None:
        self.noted = noted
        self._before, self._after = before, after
        self._hybrid = problem.hybrid
        quantities = (*problem.states, *problem.discretes)
        self._names = [q.name for q in quantities]
        self._shown = np.array([q.kind != "mode" for q in quantities])

    def __len__(self) -> int:
        return len(self.noted)

    @overload
    def __getitem__(self, index: int) -> Event: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[Event, ...]: ...
    def __getitem__(self, index: int | slice) -> Event | tuple[Event, ...]:
        if isinstance(index, slice):
            return tuple(self[i] for i in range(*index.indices(len(self))))
        one = self.noted[index]
        kind, instant = native.EVENT_KINDS[one["kind"]], int(one["instant"])
        changed: tuple[dict[str, float], dict[str, float]] = ({}, {})
        if instant < len(self._before):
            sides = self._before[instant], self._after[instant]
            for i in np.flatnonzero((sides[0] != sides[1]) & self._shown):
                for values, side in zip(changed, sides, strict=True):
                    values[self._names[i]] = float(side[i])
        return Event(
            float(one["t"]), self._name(kind, int(one["index"])), kind, float(one["value"]), *changed
        )

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Sequence) and tuple(self) == tuple(other)

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return repr(tuple(self))

    def notes(self, instant: int) -> list[Note]:
        """Give what was noted at an instant, in the order in which it happened."""
        return [_note(one) for one in self.noted[self.noted["instant"] == instant]]

    def _name(self, kind: str, index: int) -> str:
        assert self._hybrid is not None
        return self._hybrid.branches[index].text if kind == "when" else self._hybrid.rows[index].name


def _note(one: Any) -> Note:
    kind = native.EVENT_KINDS[one["kind"]]
    return Note(int(one["instant"]), kind, int(one["index"]), float(one["value"]))


class EventRecord(Struct, frozen=True, eq=False):
    """``times`` [m]; ``before`` and ``after`` [m, ny + nz]; ``grid_z`` [n, nz] belongs to the rows of the grid."""

    events: Events
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

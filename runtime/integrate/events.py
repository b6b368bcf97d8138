"""What happened during a run: events with their names, and both sides of each instant."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol, overload

import numpy as np
from msgspec import Struct, field
from numpy.typing import NDArray

from ..case import Case, inputs_at
from ..delays import DelayTable, U, Y, Z
from ..native import kernel as native
from ..problem import Array, Problem
from ..rows import IN_MEMORY, Storage, slices

NOTED: np.dtype[np.void] = np.dtype(native.EventStruct)  # type: ignore[assignment]
"""One event as the kernel notes it."""


class Event(Struct, frozen=True):
    """``kind``: when, impact, rest, lift-off, slip, stick, crossing, reflection, release, engage.

    ``before`` and ``after``: coordinates, rates, states and discrete variables at both sides of the instant, where
    they differ; of a rest both are the state at rest. ``value``: of an impact the approach speed, else 0.
    """

    time: float
    name: str
    kind: str
    value: float = 0.0
    before: Mapping[str, float] = field(default_factory=dict)
    after: Mapping[str, float] = field(default_factory=dict)


class Ticks(Struct, frozen=True):
    """How often a branch acted that only clocks fulfil, and when for the first and the last time."""

    name: str
    count: int
    first: float
    last: float


class Note(Struct, frozen=True):
    """What the kernel noted at an ``instant``, in the order in which it happened: ``index`` of a branch or a row."""

    instant: int
    kind: str
    index: int
    value: float


class Sides(Protocol):
    """States and discrete variables [ny + nz] before and after each instant."""

    def __len__(self) -> int: ...
    def at(self, instant: int) -> tuple[Array, Array]: ...


_OF_FREEWHEELS = {"rest": "stick", "lift-off": "slip"}


class Events(Sequence[Event]):
    """The events of a run in their order, each made when it is asked for: what the kernel noted stays as it is.

    ``noted`` [k] of ``NOTED``; ``sides`` of the instants.
    """

    def __init__(self, problem: Problem, noted: NDArray[np.void], sides: Sides) -> None:
        self.noted = noted
        self._sides = sides
        self._problem = problem
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
        kind, instant = self._kind(native.EVENT_KINDS[one["kind"]], int(one["index"])), int(one["instant"])
        changed: tuple[dict[str, float], dict[str, float]] = ({}, {})
        if instant < len(self._sides):
            sides = self._sides.at(instant)
            for i in np.flatnonzero((sides[0] != sides[1]) & self._shown):
                for values, side in zip(changed, sides, strict=True):
                    # what an impact takes at this instant is told of that: what rests is at rest
                    values[self._names[i]] = float(sides[1][i] if kind == "rest" else side[i])
        name = self._name(kind, int(one["index"]))
        return Event(float(one["t"]), name, kind, float(one["value"]), *changed)

    @property
    def times(self) -> Array:
        """When each happened, in their order."""
        found: Array = self.noted["t"]
        return found

    def condensed(self) -> tuple[tuple[Ticks, ...], Events]:
        """Give one entry for each branch that only clocks fulfil and that acted more than once, and all other events."""
        if self._hybrid is None:
            return (), self
        found: list[Ticks] = []
        others = np.ones(len(self.noted), dtype=bool)
        whens = self.noted["kind"] == native.EVENT_KINDS.index("when")
        for k, branch in enumerate(self._hybrid.branches):
            mine = whens & (self.noted["index"] == k)
            times = self.times[mine]
            if branch.sampled and times.size > 1:
                found.append(Ticks(branch.text, times.size, float(times[0]), float(times[-1])))
                others &= ~mine
        return tuple(found), Events(self._problem, self.noted[others], self._sides)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Sequence) and tuple(self) == tuple(other)

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return repr(tuple(self))

    def notes(self, instant: int) -> list[Note]:
        """Give what was noted at an instant, in the order in which it happened."""
        return [_note(one) for one in self.noted[self.noted["instant"] == instant]]

    def _kind(self, kind: str, index: int) -> str:
        """Give the word for what happened: a friction that is a contact to the kernel sticks and slips."""
        if kind not in _OF_FREEWHEELS or self._hybrid is None or self._hybrid.row(index).kind != "freewheel":
            return kind
        return _OF_FREEWHEELS[kind]

    def _name(self, kind: str, index: int) -> str:
        assert self._hybrid is not None
        return self._hybrid.branches[index].text if kind == "when" else self._hybrid.row(index).name


def _note(one: Any) -> Note:
    kind = native.EVENT_KINDS[one["kind"]]
    return Note(int(one["instant"]), kind, int(one["index"]), float(one["value"]))


class EventRecord:
    """``times`` [m]; ``before`` and ``after`` [m, ny + nz]; ``grid_z`` [n, nz] belongs to the rows of the grid.

    ``instants`` [m, 1 + 2(ny + nz)] are kept until they are ``merged`` with the rows of the grid, and found there from
    then on: the numbers of many events are there once.
    """

    def __init__(
        self, problem: Problem, noted: NDArray[np.void], instants: Array, start_z: Array, grid_z: Array
    ) -> None:
        self.times = instants[:, 0].copy()
        self.start_z, self.grid_z = start_z, grid_z
        self.events = Events(problem, noted, self)
        self._sides: Array | _Merged = instants[:, 1:]
        self.past: DelayHistory | None = None
        """Of a model with delays: what changes in z between events."""

    def __len__(self) -> int:
        return len(self.times)

    def at(self, instant: int) -> tuple[Array, Array]:
        """Give both sides [ny + nz] of an instant."""
        before, after = (self._side(k, np.array([instant])) for k in range(2))
        return before[0], after[0]

    @property
    def before(self) -> Array:
        return self._side(0)

    @property
    def after(self) -> Array:
        return self._side(1)

    def _side(self, which: int, of: NDArray[np.intp] | slice = slice(None)) -> Array:
        if isinstance(self._sides, _Merged):
            places = self._sides.places[of] + which
            return np.hstack([self._sides.y[places], self._sides.z[places]])
        size = self._sides.shape[1] // 2
        found: Array = self._sides[of, which * size : (which + 1) * size]
        return found

    def discretes(self, t: Array, ny: int) -> Array:
        """Give z [n, nz] at the times t [n], continuous from the right."""
        found = self.held(t, ny)
        if self.past is not None:
            self.past.fill(t, found)
        return found

    def held(self, t: Array, ny: int) -> Array:
        """Give z [n, nz] as events have left it."""
        last = np.searchsorted(self.times, t, side="right") - 1
        found = np.tile(self.start_z, (len(t), 1))
        later = last >= 0
        found[later] = self._side(1, last[later])[:, ny:]
        return found

    def merged(self, t: Array, y: Array, storage: Storage = IN_MEMORY) -> tuple[Array, Array, Array]:
        """Give times, states and discrete variables of the grid with both sides of each instant."""
        assert not isinstance(self._sides, _Merged)
        times, states, modes, places = merged(t, y, self.grid_z, self.times, self._sides, storage)
        self._sides = _Merged(states, modes, places)
        return times, states, modes


def merged(
    t: Array, y: Array, z: Array, instants: Array, sides: Array, storage: Storage = IN_MEMORY
) -> tuple[Array, Array, Array, NDArray[np.intp]]:
    """Give times, states and discrete variables of rows of the grid with both ``sides`` [m, 2(ny + nz)] of each of the
    ``instants`` [m], and the row before each of these."""
    ny, nz, m = y.shape[1], z.shape[1], len(instants)
    places = np.searchsorted(t, instants)
    met = places[places < len(t)]
    met = met[t[met] == instants[: len(met)]]
    met = met[np.diff(np.append(met, len(t))) > 0]  # rows of the grid that are instants, each once
    count = len(t) - len(met) + 2 * m
    times, states, modes = storage.empty(count), storage.empty(count, ny), storage.empty(count, nz)
    done = 0
    for rows in slices(len(t), t, y, z, times, states, modes):
        kept = rows.start + np.flatnonzero(~np.isin(t[rows], t[met]))
        to = done + np.arange(len(kept)) + 2 * np.searchsorted(instants, t[kept])
        times[to], states[to], modes[to] = t[kept], y[kept], z[kept]
        done += len(kept)
    places = 2 * np.arange(m) + places - np.searchsorted(met, places)
    for k in range(2):
        side = sides[:, k * (ny + nz) : (k + 1) * (ny + nz)]
        times[places + k], states[places + k], modes[places + k] = instants, side[:, :ny], side[:, ny:]
    return times, states, modes, places


class _Merged(Struct, frozen=True, eq=False):
    """States and discrete variables of a run, and the rows [m] before its instants: those after these are the other sides."""

    y: Array
    z: Array
    places: NDArray[np.intp]


MOST_AT_ONCE = 16_384
"""Instants by which the kernel's buffers grow at most."""


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

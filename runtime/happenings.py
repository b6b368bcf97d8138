"""What happened during a run: events with their names, both sides of each instant, and how events end a run."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from msgspec import Struct, field

from . import native
from .outcome import Failure, state_at, time_text
from .problem import Array, Problem
from .solver import Solver

MOST_ROWS = 64
"""That may be chosen among at an instant: the room that the kernel has for them (modes.c)."""


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
        self._capacity = 256

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


def event_failure(problem: Problem, status: int, report: native.ReportStruct, y: Array) -> Failure | None:
    """Give the failure that ends a run at an event, or None if the status is another one."""
    hybrid = problem.hybrid
    if hybrid is None or status > native.EVENT_LOOP:
        return None
    k, at = report.failed_index, time_text(problem, report.t)
    branch = hybrid.branches[k] if k < len(hybrid.branches) else None
    row = hybrid.rows[k] if k < len(hybrid.rows) else None
    name, origin = "", None
    match status:
        case native.EVENT_LOOP if branch is not None:
            kind, origin = "event loop", branch.origin
            conditions = ", ".join(f"'{b.text}'" for b in hybrid.branches)
            message = f"the events at {at} do not come to rest: 'when {branch.text}' fires again and again (of {conditions})"
        case native.EVENT_LOOP:
            kind, message = "event loop", f"the events at {at} do not come to rest"
        case native.ZENO:
            assert branch is not None
            kind, origin = "zeno", branch.origin
            message = (
                f"'when {branch.text}' fires in ever shorter intervals, until {at}: "
                "for something that bounces or rests, write a 'contact', which comes to rest"
            )
        case native.PENETRATION:
            assert row is not None
            kind, name, origin = "penetration", row.name, row.origin
            message = f"contact '{row.name}' is penetrated at {at}: its gap is {report.failed_value:.6g} (SI)"
        case native.ENERGY_RAISED:
            assert row is not None
            kind, name, origin = "impact", row.name, row.origin
            message = (
                f"the impact of '{row.name}' at {at} would raise the energy: Newton's restitution and Coulomb's "
                "friction do not fit together here; use a smaller restitution or no friction"
            )
        case native.CHATTER:
            kind = "chattering"
            message = (
                f"a condition in the equations of motion goes to and fro at {at}: the motion slides along it; "
                "write it as 'friction' or 'contact'"
            )
        case native.BRANCH_ASSERTION:
            assert branch is not None
            check = branch.checks[report.failed_part]
            kind, origin = "assertion", check.origin
            message = f"assertion failed at {at}: {check.message}"
        case native.APART:
            assert row is not None
            kind, name, origin = "engage", row.name, row.origin
            apart = f"its sides are {abs(report.failed_value):.6g} (SI) apart"
            message = f"'{row.name}' is engaged at {at}, but does not hold there: {apart}"
        case native.OUT_OF_RANGE:
            assert row is not None
            kind, name, origin = "coefficient", row.name, row.origin
            value = f"{report.failed_value:.6g}"
            if row.kind == "contact":
                message = f"the restitution of '{row.name}' is {value} at {at}; it lies between 0 and 1"
            else:
                message = (
                    f"the friction of '{row.name}' has a negative coefficient or limit at {at}, {value} (SI): "
                    "it is a size; where the normal force can change its sign, write a 'contact' with friction"
                )
        case native.NO_MODE if len(hybrid.rows) > MOST_ROWS:
            kind, name, origin = "modes", "", None
            message = (
                f"the model has {len(hybrid.rows)} rows of contacts, friction and constraints that switch; "
                f"a run decides over {MOST_ROWS} at once: replace some by potentials, or by friction "
                'with law = "regularized"'
            )
        case native.NO_MODE:
            kind = "modes"
            title = f"'{row.name}'" if row is not None else "the contacts"
            name, origin = (row.name, row.origin) if row is not None else ("", None)
            message = (
                f"no combination of touching, sticking and sliding fits for {title} at {at}: "
                "Coulomb's law has no solution, or more than one"
            )
        case _:
            kind = "impact"
            name, origin = (row.name, row.origin) if row is not None else ("", None)
            message = f"the impacts at {at} have no solution"
    return Failure(kind, report.t, name, message, origin, state_at(problem, y))

"""Where outputs that equations determine leave the solution that they have followed.

Values at neighbouring times belong to one solution where Newton's method goes from an extrapolation of the earlier ones to
the later one without detours. Where it does not, the time between is halved, until it does (a fast change), or
until nothing is between: there the solution ended, or another one was taken.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from msgspec import Struct

from ..problem import Array
from .systems import RunSystem, StatesAt, SystemPlace

ONE = 1e-6
"""Solutions that differ by less, as a share of the unknowns, are one, or have just met."""
REACHED = 1e-9
"""How near, as a share of the unknowns, Newton's method comes to the solution that it goes to."""
BESIDE = 0.1
"""How far, as a share of their sizes, unknowns may lie from what is extrapolated for them."""
ROUNDING = 1e-14
"""Errors of residuals, as a share of their terms."""
NEAR = 1e-3
"""Solutions that differ by less at times that cannot be told apart are neighbours."""
SAME_INSTANT = 1e-13
"""Times that differ by less, as a share of the run, are not told apart."""
FLAT = 1e6
"""Flatness of equations from which on two solutions are said to meet."""
FLAT_END = 1e4
"""Flatness from which on a run that failed may have done so in a fold: steps end at the root of what is left before it."""
BEYOND = 1e-6
"""How far behind the end of a run the solution is looked for, as a share of its time."""
OWN_JUMP = 1e-6
"""Residual, as a share of its terms, that shows that the equations themselves have jumped."""
MOST_JUMPS = 20
"""So many are looked for."""
MOST_LOOKS = 40_000
"""Intervals that are looked at, at most."""


class JumpKind(StrEnum):
    """What happened to the solution that was followed."""

    JUMP = "jump"
    """It goes on, and the guess leads to another one."""
    FOLD = "fold"
    """It ends."""
    MEETING = "meeting"
    """It meets another one, and both go on."""
    LOST = "lost"
    """It goes on, and nothing is found from the guess."""


class Jump(Struct, frozen=True):
    """Names of the outputs of one system, the time, and their values in SI before and after (not-a-number: none)."""

    kind: JumpKind
    names: tuple[str, ...]
    time: float
    before: tuple[float, ...]
    after: tuple[float, ...]


class JumpPoint(NamedTuple):
    """What is reported at a place."""

    at: SystemPlace
    values: Array


class Followed(NamedTuple):
    """Jumps in the order of their times; ``until``: where it was given up, None where all was looked at."""

    jumps: tuple[Jump, ...]
    until: float | None = None


class _Follower:
    def __init__(self, system: RunSystem, states_at: StatesAt, span: float) -> None:
        self.system, self.states_at, self.span = system, states_at, span
        self.jumps: list[Jump] = []
        self.looks = 0
        self.before: JumpPoint | None = None

    def between(self, a: JumpPoint, b: JumpPoint) -> bool:
        """Follow the solution from one point to another; tell whether there was enough time for it."""
        pending = [(a, b)]
        while pending:
            a, b = pending.pop()
            if not np.isfinite(a.values).all() or self._goes_on(a, b):
                self.before = a
                continue
            self.looks += 1
            if self.looks > MOST_LOOKS or len(self.jumps) >= MOST_JUMPS:
                return False
            middle = None if self._at_an_instant(a, b) else self._middle(a, b)
            if middle is not None:
                pending += [(middle, b), (a, middle)]
                continue
            self._note(a, b)
            self.before = None
        return True

    def _goes_on(self, a: JumpPoint, b: JumpPoint) -> bool:
        if not np.isfinite(b.values).all():
            return False
        system = self.system
        start = self._extrapolated(a, b)
        found = system.nearest(b.at, start)
        if found is None:
            return False
        sizes = np.maximum(system.largest, np.abs(b.values))
        if np.any(np.abs(found - start) > BESIDE * sizes):
            return False
        apart = np.abs(found - b.values)
        if np.all(apart <= REACHED * system.sizes(b.values)):
            return True
        blurred = ROUNDING * system.flatness(system.look(b.at, b.values), b.values)
        return bool(np.all(apart <= min(blurred, ONE) * system.largest))

    def _extrapolated(self, a: JumpPoint, b: JumpPoint) -> Array:
        before = self.before
        if before is None or not before.at.t < a.at.t or not np.isfinite(before.values).all():
            return a.values
        share = (b.at.t - a.at.t) / (a.at.t - before.at.t)
        return a.values + share * (a.values - before.values)

    def _at_an_instant(self, a: JumpPoint, b: JumpPoint) -> bool:
        if b.at.t - a.at.t <= SAME_INSTANT * self.span:
            return True
        return bool(np.isfinite(b.values).all()) and all(
            self.system.flatness(self.system.look(p.at, p.values), p.values) >= FLAT for p in (a, b)
        )

    def _middle(self, a: JumpPoint, b: JumpPoint) -> JumpPoint | None:
        t = 0.5 * (a.at.t + b.at.t)
        if not a.at.t < t < b.at.t:
            return None
        y, z = self.states_at(np.array([t]))
        at = self.system.place(t, y[0], a.at.z if z is None else z[0])
        return JumpPoint(at, self.system.reported(at))

    def _note(self, a: JumpPoint, b: JumpPoint) -> None:
        kind = self._kind(a, b)
        if kind is None or (kind is JumpKind.MEETING and self._noted_already(b.at.t)):
            return
        names = tuple(q.name for q in self.system.quantities)
        self.jumps.append(
            Jump(
                kind, names, 0.5 * (a.at.t + b.at.t), tuple(map(float, a.values)), tuple(map(float, b.values))
            )
        )

    def _noted_already(self, t: float) -> bool:
        return bool(self.jumps) and t - self.jumps[-1].time <= ONE * self.span

    def _kind(self, a: JumpPoint, b: JumpPoint) -> JumpKind | None:
        system = self.system
        if self._equations_jump(a, b):
            return None
        further = self._extrapolated(a, b)
        beside = [system.nearest(b.at, start) for start in (a.values, further)]
        goes_on = any(x is not None and system.alike(x, a.values, NEAR) for x in beside)
        if not np.isfinite(b.values).all():
            return JumpKind.LOST if goes_on else JumpKind.FOLD
        if not system.alike(a.values, b.values, NEAR):
            return JumpKind.JUMP if goes_on else JumpKind.FOLD
        other = any(
            x is not None and system.alike(x, a.values, NEAR) and not self._one(x, b.values, a.values)
            for x in (*beside, system.nearest(b.at, 2 * a.values - b.values))
        )
        return JumpKind.MEETING if other else None

    def _equations_jump(self, a: JumpPoint, b: JumpPoint) -> bool:
        """Tell whether the equations are others at once, or have no values there."""
        look = self.system.look(b.at, a.values)
        near = self.system.alike(a.values, a.values + self.system.step(look), NEAR)  # where all terms vanish
        return not (near or np.all(np.abs(look.rows) <= OWN_JUMP))

    def _one(self, x: Array, y: Array, beside: Array) -> bool:
        """Tell whether solutions that are all close together are the same: by their distance to each other."""
        apart = float(np.max(np.abs(x - y) / self.system.largest))
        return apart <= NEAR * max(float(np.max(np.abs(v - w) / self.system.largest)) for v, w in ((x, beside), (y, beside)))  # fmt: skip


def end_of(system: RunSystem, points: Sequence[JumpPoint]) -> Jump | None:
    """Find whether a run that failed did so where the solution ends: there it is flat, and none is near in the direction of the motion."""
    last = points[-1]
    earlier = last.at.t - BEYOND * (last.at.t - points[0].at.t)
    before = next((p for p in reversed(points) if p.at.t < earlier), None)
    if (
        before is None
        or not np.isfinite(last.values).all()
        or system.flatness(system.look(last.at, last.values), last.values) < FLAT_END
    ):
        return None
    follower = _Follower(system, lambda t: (np.empty((0, 0)), None), 1.0)
    share = (last.at.t - earlier) / (last.at.t - before.at.t)
    t = last.at.t + share * (last.at.t - before.at.t)
    at = system.place(t, last.at.y + share * (last.at.y - before.at.y), last.at.z)
    beyond = JumpPoint(at, system.reported(at))
    if np.isfinite(beyond.values).all() or follower._kind(last, beyond) is not JumpKind.FOLD:
        return None
    names = tuple(q.name for q in system.quantities)
    nowhere = (float("nan"),) * len(names)
    return Jump(JumpKind.FOLD, names, last.at.t, tuple(map(float, last.values)), nowhere)


def follow(system: RunSystem, points: Sequence[JumpPoint], states_at: StatesAt) -> Followed:
    """Find where the outputs of a system leave the solution that they follow. Points at one time are sides of an event."""
    if len(points) < 2:
        return Followed(())
    span = max(points[-1].at.t - points[0].at.t, 1e-300)
    follower = _Follower(system, states_at, span)
    for a, b in pairwise(points):
        if not a.at.t < b.at.t:
            follower.before = None
            continue
        if not follower.between(a, b):
            last = follower.jumps[-1].time if follower.jumps else a.at.t
            return Followed(tuple(follower.jumps), max(a.at.t, last))
    return Followed(tuple(follower.jumps))

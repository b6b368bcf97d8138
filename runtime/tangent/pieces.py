"""A motion with events, differentiated piece by piece: between its instants nothing switches, at them derivatives jump."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from msgspec import Struct
from msgspec.structs import replace
from numpy.typing import NDArray

from ..case import Case
from ..integrate.choose_method import Method
from ..integrate.events import EventRecord
from ..integrate.kernel_run import run_kernel
from ..integrate.solver import SolverOptions
from ..integrate.trajectory import Trajectory
from ..native import contract
from ..outcome import Failure, SimulationError, time_text
from ..problem import Array
from .augmented import Augmented
from .instant import Instant
from .saltation import SAME_TIME, TangentSizes, check_start, crossed

SHORT = 0.1
"""Roots of the tolerance: the last part of a piece, where errors of the motion turn the direction of a slip that vanishes. A
straight line there is off by the square of it."""

APART = 1e5
"""Tolerances by which a piece that is integrated with its derivatives may end beside the run, and of a fixed step: ..."""
APART_FIXED = 1e-2

TICK = 8 * float(np.finfo(float).eps)
"""Relative difference of times that are the same, as in the kernel (``events/schedule.c``)."""

SOON = 1e-6
"""Of the duration: instants closer than that are told, as their order may be about to change."""


class Rows(Struct, frozen=True, eq=False):
    """Both sides of each instant among the times ``t`` [n]: states, derivatives [n, ny, k], discrete variables and theirs."""

    t: Array
    y: Array
    w: Array
    z: Array
    dz: Array
    run: Trajectory
    failure: Failure | None = None
    remarks: tuple[str, ...] = ()

    def at(self, times: Array) -> Rows:
        """Give the rows at some of its times, after what happens there, and where it ended before the last."""
        last = self.t[-1]
        chosen = np.searchsorted(self.t, times[times <= last], side="right") - 1
        if times[-1] > last and (not chosen.size or chosen[-1] < self.t.size - 1):
            chosen = np.append(chosen, self.t.size - 1)
        return self._chosen(chosen)

    def before_ticks(self, case: Case, end: float) -> Rows:
        """Leave out what clocks and known times do at ``end``, within rounding: whoever goes on from there does it."""
        address = case.functions.struct.hybrid
        assert address
        hybrid = contract.HybridStruct.from_address(address)
        known = [hybrid.times[2 * k] for k in range(hybrid.n_times)]
        known += [hybrid.clocks[2 * k + 1] for k in range(hybrid.n_clocks)]
        near = int(np.searchsorted(self.t, end - TICK * abs(end)))
        changed = (self.z[near:-1, known] != self.z[near + 1 :, known]).any(axis=1)
        count = near + int(np.argmax(changed)) + 1 if changed.any() else self.t.size
        return self._chosen(slice(count))

    def _chosen(self, chosen: slice | NDArray[np.intp]) -> Rows:
        parts = {name: getattr(self, name)[chosen] for name in ("t", "y", "w", "z", "dz")}
        return replace(self, **parts)


class Pieces:
    """What is needed to follow derivatives through the pieces of a motion. ``probe``: a free direction of the state."""

    def __init__(
        self,
        augmented: Augmented,
        method: Method,
        recording: Method,
        tolerance: float,
        nominal: Array,
        probe: int,
        max_steps: int | None = None,
    ) -> None:
        self.augmented, self.method, self.recording = augmented, method, recording
        self.tolerance, self.nominal, self.probe = tolerance, nominal, probe
        self.reals = len(augmented.reals)
        self.max_steps = max_steps

    def follow(
        self,
        begin: float,
        y: Array,
        w: Array,
        sizes: Array,
        times: Array,
        z: Array | None = None,
        dz: Array | None = None,
    ) -> Rows:
        """Give everything at ``times`` [n] and at both sides of each instant; W [ny, k] belongs to y at ``begin``.

        ``z`` [nz] and ``dz`` [real ones, k]: discrete variables there and their derivatives, those of the start without them.
        """
        ny = self.augmented.case.problem.ny
        run = self._recorded(begin, y, times, z)
        record = run.happened
        assert record is not None
        dz = self._started(begin, y) if dz is None else dz
        z = record.start_z
        at_begin = record.times.size and record.times[0] == begin
        z_first = record.before[0, ny:] if at_begin else z
        here = Instant(self.augmented, begin, y, w, z_first, dz, np.zeros(w.shape[1]))
        check_start(Instant(self.augmented, begin, y, w, z, dz, np.zeros(w.shape[1])), self.nominal)
        state, z = y, here.z
        rows: list[tuple[float, Array, Array, Array, Array]] = []
        remarks: list[str] = []
        dt = np.zeros(w.shape[1])
        t, kept = begin, times[~np.isin(times, record.times)]
        end = float(run.t[-1])
        for number in range(record.times.size + 1):
            last = number == record.times.size
            until = end if last else float(record.times[number])
            inside = kept[(kept >= t if not rows and t == begin else kept > t) & (kept <= until)]
            if last and until > t and (not inside.size or inside[-1] < until):
                inside = np.append(inside, until)  # where a run stopped early
            to_rest = not last and self._comes_to_rest(record, number)
            found, w, failure = self._piece(t, state, w, z, dz, sizes, inside, until, to_rest)
            rows += [(s, a, b, z, dz) for s, a, b in found]
            if failure is not None:
                return self._rows(rows, run, failure, remarks)
            if last:
                break
            before, after = record.before[number], record.after[number]
            self._meets(t, until, found, before[:ny])
            if until > begin or (begin in times):
                rows.append((until, before[:ny], w, before[ny:], dz))
            jump = crossed(
                self.augmented, TangentSizes(self.nominal, sizes), record, number, w, dz, self.probe
            )
            crowd = self._crowded(record, number, dt, jump.dt) if number else ""
            remarks += [said for said in (jump.remark, crowd) if said]
            dt = jump.dt
            t, state, z, w, dz = until, after[:ny], after[ny:], jump.w, jump.dz
            rows.append((until, state, w, z, dz))
        if not rows:  # it fails where it begins
            rows.append((t, state, w, z, dz))
        return self._rows(rows, run, None, remarks)

    def _recorded(self, begin: float, y: Array, times: Array, z: Array | None) -> Trajectory:
        """Follow the motion alone, with all that happens."""
        case = replace(
            self.augmented.case,
            begin=begin,
            y0=y,
            wanted=y,
            z=self.augmented.case.z if z is None else z,
            assembled=None,
            grid=times,
            stop=float(times[-1]),
        )
        step = case.step if self.recording.fixed_step else None
        options = SolverOptions(
            self.recording.name, self.tolerance, self.nominal, step, max_steps=self.max_steps
        )
        run = run_kernel(case, options)
        if run.interrupted:
            raise KeyboardInterrupt
        return run

    def _started(self, begin: float, y: Array) -> Array:
        """Give the derivatives of the real discrete variables at the start, [real ones, k]."""
        augmented = self.augmented
        assert augmented.functions.discretes is not None
        unknown = np.full(augmented.problem.ny, np.nan)
        z = augmented.functions.discretes(
            begin,
            unknown,
            augmented.inputs(begin),
            np.full(len(augmented.problem.discretes), np.nan),
            augmented.p,
        )
        first = len(augmented.case.problem.discretes)
        return z[first : first + self.reals * augmented.count].reshape(augmented.count, self.reals).T

    def _piece(
        self,
        t: float,
        y: Array,
        w: Array,
        z: Array,
        dz: Array,
        sizes: Array,
        inside: Array,
        until: float,
        to_rest: bool,
    ) -> tuple[list[tuple[float, Array, Array]], Array, Failure | None]:
        """Give rows at the times ``inside``, and W at the end; without events. ``to_rest``: it ends where slip in two
        directions vanishes, and with it the direction of friction: its last part is a straight line."""
        if not until > t:
            return [(float(s), y, w) for s in inside], w, None
        augmented = self.augmented
        last = until
        until = max(until - SHORT * self.tolerance**0.5 * (until - t), t) if to_rest else until
        behind = inside[inside > until]
        grid = inside[inside <= until]
        grid = grid if grid.size and grid[-1] == until else np.append(grid, until)
        nominal = augmented.joined(self.nominal, np.maximum(sizes, spread(w, self.nominal)))
        more = augmented.discretes(z, dz)
        joined = augmented.joined(y, w)
        run = augmented.run(self.method, self.tolerance, nominal, t, joined, more, grid, self.max_steps)
        if run.interrupted:
            raise KeyboardInterrupt
        states, tangents = augmented.split(run.y, y.size)
        rows = list(zip(run.t.tolist(), states, tangents, strict=True))
        rows = rows[: inside.size - behind.size]
        if not to_rest or run.failure is not None:
            self._last = states[-1]
            return rows, tangents[-1], run.failure
        rates = augmented.functions.rhs(until, run.y[-1], augmented.inputs(until), more, augmented.p)
        for s in (*behind, last):
            self._last, w = (
                a[0] for a in augmented.split((run.y[-1] + (s - until) * rates)[None, :], y.size)
            )
            if s in behind:
                rows.append((float(s), self._last, w))
        return rows, w, None

    def _comes_to_rest(self, record: EventRecord, number: int) -> bool:
        """Whether friction in two directions begins to stick at an instant."""
        hybrid = self.augmented.case.problem.hybrid
        assert hybrid is not None
        names = [row.name for row in hybrid.rows if row.kind == "friction"]
        return any(
            note.kind == "stick" and names.count(hybrid.rows[note.index].name) > 1
            for note in record.events.notes(number)
        )

    def _meets(self, t: float, until: float, found: Sequence[object], y: Array) -> None:
        """Refuse a piece that does not end where the run did: something was not understood."""
        if not until > t:
            return
        off = float((np.abs(self._last - y) / (self.nominal + np.abs(y))).max(initial=0.0))
        if not off <= (APART_FIXED if self.recording.fixed_step else max(APART * self.tolerance, 1e-9)):
            problem = self.augmented.case.problem
            raise SimulationError(
                f"between {time_text(problem, t)} and {until:g} the motion with its derivatives ends {off:.1g} beside the run: "
                "what holds there changes without an event, so it is not differentiated"
            )

    def _crowded(self, record: EventRecord, number: int, before: Array, dt: Array) -> str:
        """Tell two instants that almost coincide, and that go apart: their order is about to change."""
        case = self.augmented.case
        gap = float(record.times[number] - record.times[number - 1])
        if gap >= SOON * (case.stop - case.begin):
            return ""
        if np.abs(dt - before).max(initial=0.0) <= SAME_TIME * max(np.abs(dt).max(), np.abs(before).max()):
            return ""
        at = time_text(case.problem, float(record.times[number]))
        return f"two events at {at} are only {gap:.1g} apart: the derivatives hold as long as their order stays as it is"

    def _rows(
        self,
        rows: Sequence[tuple[float, Array, Array, Array, Array]],
        run: Trajectory,
        failure: Failure | None,
        remarks: Sequence[str],
    ) -> Rows:
        t, y, w, z, dz = zip(*rows, strict=True)
        return Rows(
            np.array(t),
            np.array(y),
            np.array(w),
            np.array(z),
            np.array(dz),
            run,
            failure or run.failure,
            tuple(remarks),
        )


def spread(w: Array, nominal: Array) -> Array:
    """Give sizes [ny, k] by how far the directions reach now: they may have been scaled since the start."""
    far: Array = np.abs(w / nominal[:, None]).max(axis=0)
    return nominal[:, None] * far

"""Members that follow each other, made by calls into C, and given to other builds of the model that follow them better."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace
from numpy.typing import NDArray

from ..case import SimulationOptions, prepare
from ..functions import load_functions
from ..integrate.kernel_failure import kernel_failure
from ..native import kernel as native
from ..native.status import Status
from ..outcome import SimulationError, time_text, too_many_steps
from ..problem import Array, Problem
from .kernel_arguments import Batch, Posed
from .native import Stage
from .result import ENDINGS
from .result_buffer import Piece
from .watch import Watch

COMPLETED, TERMINATED, DOUBTFUL, FAILED = (ENDINGS.index(w) for w in ENDINGS[1:])
SINGULAR = (Status.STEP_TOO_SMALL, Status.NOT_CONVERGED, Status.OFF_CONSTRAINTS, Status.NOT_FINITE)
FEW = 64
"""Members among which one that takes too long is looked for, before each is given a call of its own."""


class Other(Struct, frozen=True, eq=False):
    """The model built otherwise, for members that the first build cannot follow: the stiff ones, or those that meet a singular
    position. ``make`` gives None where there is no such build."""

    stiff: bool
    make: Callable[[], Problem | None]


class Batches:
    """Makes batches of the members of one question. ``share``: of the members that get a companion run."""

    def __init__(
        self,
        first: Posed,
        options: SimulationOptions,
        others: tuple[Other, ...],
        few_steps: int | None,
        threads: int,
        share: float,
    ) -> None:
        self._first, self._options, self._others = first, options, others
        self._few_steps, self._threads, self._share = few_steps, threads, share
        self._posed: dict[int, Posed | None] = {}

    def make(self, first: int, values: Array, watch: Watch) -> Piece:
        """Make the members from the number ``first`` on; those that the watch has ended wait."""
        flags = estimated(first, first + len(values), self._share)
        batch = self._first.empty(len(values))
        late = self._call(self._first, values, flags, batch, watch)
        if self._few_steps is not None or self._others:
            self._again(values, flags, batch, watch, late)
        return self._piece(values, batch, late, watch.limit)

    def _call(
        self, posed: Posed, values: Array, flags: NDArray[np.uint8], batch: Batch, watch: Watch
    ) -> NDArray[np.bool_]:
        """Make those members of a batch that wait; tell which of them take longer than the limit."""
        late = np.zeros(len(values), dtype=bool)

        def run(chosen: slice) -> bool:
            part = Batch(*(getattr(batch, name)[chosen] for name in Batch.__struct_fields__))
            watch.begin()
            posed.run(values[chosen], flags[chosen], part, self._threads, watch.done, watch.stopped)
            return watch.late and not watch.ended

        if not run(slice(None)):
            return late
        for few in range(0, len(values), FEW):
            if not run(slice(few, few + FEW)):
                continue
            for k in np.flatnonzero(batch.members["stage"][few : few + FEW] == Stage.WAITS) + few:
                late[k] = run(slice(k, k + 1))
        return late

    def _again(
        self,
        values: Array,
        flags: NDArray[np.uint8],
        batch: Batch,
        watch: Watch,
        late: NDArray[np.bool_],
    ) -> None:
        """Give members to other builds that can follow them; those that took many steps and are not stiff go on here."""
        it = batch.members
        ran = it["stage"] == Stage.RAN
        many = ran & (it["status"] == Status.RUNNING)
        for k, other in enumerate(self._others):
            chosen = many & (it["stiff"] == 1) if other.stiff else ran & np.isin(it["status"], SINGULAR)
            if chosen.any() and (posed := self._other(k)) is not None:
                self._replace(posed, chosen, values, flags, batch, watch, late, better=not other.stiff)
        left = (it["stage"] == Stage.RAN) & (it["status"] == Status.RUNNING)
        if left.any() and self._few_steps is not None:
            self._replace(self._other(-1), left, values, flags, batch, watch, late, better=False)

    def _other(self, k: int) -> Posed | None:
        if k not in self._posed:
            problem = self._first.problem if k < 0 else self._others[k].make()
            kept = (*self._first.scalars, *self._first.series)
            self._posed[k] = (
                None if problem is None else Posed(problem, self._options, self._first.members, kept)
            )
        return self._posed[k]

    def _replace(
        self,
        posed: Posed | None,
        chosen: NDArray[np.bool_],
        values: Array,
        flags: NDArray[np.uint8],
        batch: Batch,
        watch: Watch,
        late: NDArray[np.bool_],
        *,
        better: bool,
    ) -> None:
        assert posed is not None
        places = np.flatnonzero(chosen)
        again = posed.empty(places.size)
        slow = self._call(posed, values[places], flags[places], again, watch)
        if again.ends.shape[1] != batch.ends.shape[1]:
            again = replace(again, ends=np.full((places.size, batch.ends.shape[1]), np.nan))
        taken = np.ones(places.size, dtype=bool)
        if better:
            taken = (again.members["stage"] == Stage.RAN) & (again.members["status"] >= 0)
        else:
            late[places] = slow
        for name in Batch.__struct_fields__:
            getattr(batch, name)[places[taken]] = getattr(again, name)[taken]

    # ---- results

    def _piece(self, values: Array, batch: Batch, late: NDArray[np.bool_], limit: float | None) -> Piece:
        batch = self._first.finished(batch)
        it = batch.members
        ran = it["stage"] == Stage.RAN
        outcomes = np.where(it["stage"] == Stage.WAITS, 0, FAILED).astype(np.int8)
        outcomes[ran & (it["status"] == Status.REACHED)] = COMPLETED
        outcomes[ran & (it["status"] == Status.TERMINATED)] = TERMINATED
        outcomes[it["companion"] < 0] = DOUBTFUL
        outcomes[late] = FAILED
        reasons, texts = np.full(len(values), -1, dtype=np.int32), list[str]()
        groups: dict[tuple[int, ...], int] = {}
        for k in np.flatnonzero((outcomes == FAILED) | (outcomes == DOUBTFUL)):
            key: tuple[int, ...] = tuple(int(it[name][k]) for name in ("stage", "status", "index", "part"))
            key = (-1,) if outcomes[k] == DOUBTFUL else key
            if key not in groups:
                doubtful = outcomes[k] == DOUBTFUL
                text = self._text(values[k], it[k], batch.ends[k], doubtful=doubtful, limit=limit)
                if text not in texts:
                    texts.append(text)
                groups[key] = texts.index(text)
            reasons[k] = groups[key]
        waits = it["stage"] == Stage.WAITS  # what one that was stopped has given so far is of no meaning
        for numbers in (batch.kept, batch.errors, batch.series):
            numbers[waits] = np.nan
        return {
            "numbers": batch.kept,
            "number_errors": batch.errors,
            "rows": batch.series,
            "outcomes": outcomes,
            "reasons": reasons,
            "ends": np.where(waits, np.nan, it["t"]),
            "errors": np.where(waits, np.nan, it["error"]),
            "steps": np.where(waits, 0, it["steps"]),
            "texts": np.array(texts, dtype=np.str_),
        }

    def _text(self, values: Array, member: Any, end: Array, *, doubtful: bool, limit: float | None) -> str:
        """Say why a member has no result, without its time: others of the same kind share the text."""
        problem = self._first.problem
        if doubtful:
            return "the companion run for the error estimate ended otherwise than the run"
        stage, status = Stage(int(member["stage"])), int(member["status"])
        if stage == Stage.WAITS:
            return f"it took longer than the time limit of a member, {limit:g} s"
        if stage == Stage.TIMES:
            raise SimulationError(
                "the times or the tolerance of the experiment differ from member to member",
                help="give them for all: stop, every, tolerance",
            )
        if stage == Stage.RAN and status == Status.RUNNING:
            return too_many_steps(problem, int(member["steps"]), float(member["t"]), end).message
        if stage == Stage.RAN:
            report = native.ReportStruct(
                t=float(member["t"]),
                failed_value=float(member["failed_value"]),
                failed_index=int(member["index"]),
                failed_part=int(member["part"]),
            )
            failure = kernel_failure(problem, Status(status), report, end)
            assert failure is not None
            return failure.message.replace(f" at {time_text(problem, report.t)}", "").split(", with ")[0]
        if stage == Stage.MEMORY:
            return "no memory"
        return self._no_start(values) or f"no start was found ({stage.name.lower()})"

    def _no_start(self, values: Array) -> str:
        names = self._first.members.names
        given = {**self._options.values, **dict(zip(names, values.tolist(), strict=True))}
        try:
            prepare(
                self._first.problem, load_functions(self._first.problem), replace(self._options, values=given)
            )
        except SimulationError as error:
            return error.message
        return ""


def estimated(first: int, last: int, share: float) -> NDArray[np.uint8]:
    """Tell which members get a companion run: a share of them, chosen by their number alone (splitmix64)."""
    x = (np.arange(first, last, dtype=np.uint64) + np.uint64(1)) * np.uint64(0x9E3779B97F4A7C15)
    x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    x ^= x >> np.uint64(31)
    return ((x >> np.uint64(11)).astype(np.float64) * 2.0**-53 < share).astype(np.uint8)


def given_up(posed: Posed, losses: int) -> Piece:
    """Give what a member is told to be that took every worker with it."""
    empty = posed.finished(posed.empty(1))
    return {
        "numbers": empty.kept,
        "number_errors": empty.errors,
        "rows": empty.series,
        "outcomes": np.array([FAILED], dtype=np.int8),
        "reasons": np.zeros(1, dtype=np.int32),
        "ends": np.full(1, np.nan),
        "errors": np.full(1, np.nan),
        "steps": np.zeros(1, dtype=np.int64),
        "texts": np.array([f"{losses} workers went away while they made it"], dtype=np.str_),
    }

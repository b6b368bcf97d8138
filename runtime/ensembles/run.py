"""All members of an ensemble, batch by batch: one call into C each, while progress is told and Ctrl-C is heard."""

from __future__ import annotations

import ctypes
import os
import threading
import time
from collections.abc import Callable, Mapping
from typing import Any, Protocol

import numpy as np
from msgspec import Struct
from msgspec.structs import replace
from numpy.typing import NDArray

from ..case import Progress, SimulationOptions, prepare
from ..functions import load_functions
from ..integrate.interruption import noted_interruptions
from ..integrate.kernel_failure import kernel_failure
from ..native import kernel as native
from ..native.kernel import Status
from ..outcome import SimulationError, time_text, too_many_steps
from ..problem import Array, Problem
from .kept import Kept
from .lanes import Maker
from .members import Members
from .native import Stage
from .posed import Batch, Posed
from .result import ENDINGS, Column, Ensemble

LARGEST, SMALLEST, PIECES = 65_536, 64, 200
"""Members of a batch, and how many batches there are where results are written in pieces."""
MOST_BYTES = 4e9
"""Of a result in memory."""
INTERVAL = 0.05
COMPLETED, TERMINATED, DOUBTFUL, FAILED = (ENDINGS.index(w) for w in ENDINGS[1:])
SINGULAR = (Status.STEP_TOO_SMALL, Status.NOT_CONVERGED, Status.OFF_CONSTRAINTS)


class Pieces(Protocol):
    """Where finished batches are put, and found when an ensemble goes on."""

    def load(self, first: int) -> Mapping[str, Any] | None: ...
    def save(self, first: int, arrays: Mapping[str, Any]) -> None: ...


class Other(Struct, frozen=True, eq=False):
    """The model built otherwise, for members that the first build cannot follow: the stiff ones, or those that meet a singular
    position. ``make`` gives None where there is no such build."""

    stiff: bool
    make: Callable[[], Problem | None]


class Found(Struct, eq=False):
    """The results so far, a row for each member."""

    numbers: Array
    number_errors: Array
    rows: Array
    outcomes: NDArray[np.int8]
    reasons: NDArray[np.int32]
    ends: Array
    errors: Array
    steps: NDArray[np.int64]
    texts: list[str]


def run_ensemble(
    problem: Problem,
    options: SimulationOptions,
    members: Members,
    kept: tuple[Kept, ...],
    *,
    share: float,
    threads: int | None = None,
    others: tuple[Other, ...] = (),
    few_steps: int | None = None,
    pieces: Pieces | None = None,
    maker: Maker | None = None,
) -> Ensemble:
    """Run all members; Ctrl-C keeps those that are done. ``share``: of the members that get a companion run.

    ``few_steps``: after so many a member that ``others`` may follow better is given to them, before it goes on without
    a bound. ``maker``: of the lanes in which members run side by side. Raises SimulationError where no member can begin, or the result would fill the memory.
    """
    begun = time.perf_counter()
    crew = (
        threads or len(os.sched_getaffinity(0))
        if hasattr(os, "sched_getaffinity")
        else threads or os.cpu_count() or 1
    )
    # whether a member gets another try does not depend on the other members
    first = Posed(problem, replace(options, max_steps=few_steps or options.max_steps), members, kept, maker)
    _check_size(first, members.count)
    run = _Run(first, options, others, few_steps, crew, share)
    found = run.all(pieces, options.progress)
    case = first.case
    return Ensemble(
        model=problem.name,
        experiment=case.experiment,
        members=members,
        time=Column("time", problem.time.unit),
        scalars=tuple(Column(one.label, one.unit(problem)) for one in first.scalars),
        series=tuple(Column(one.label, one.unit(problem)) for one in first.series),
        times=first.grid if first.series else np.empty(0),
        numbers=found.numbers,
        number_errors=found.number_errors,
        rows=found.rows,
        outcomes=found.outcomes,
        reasons=found.reasons,
        texts=tuple(found.texts),
        ends=found.ends,
        errors=found.errors,
        steps=found.steps,
        method=first.method.name,
        tolerance=case.tolerance,
        seconds=time.perf_counter() - begun,
        threads=crew,
        build=first.build,
        remarks=members.remarks + _remarks(first),
    )


def _remarks(posed: Posed) -> tuple[str, ...]:
    return (
        (f"members ran one by one, not side by side: {posed.without_lanes}",) if posed.without_lanes else ()
    )


def _check_size(posed: Posed, n: int) -> None:
    """Refuse results that fill the memory before anything runs, and say what would fit."""
    each = (
        16 * len(posed.scalars) + 8 * len(posed.series) * posed.grid.size + 40 + 8 * len(posed.members.names)
    )
    if n * each <= MOST_BYTES:
        return
    what = f"{n:.3g} members of {each} bytes each are {n * each / 1e9:.3g} GB"
    if posed.series:
        series = ", ".join(f"'{one.label}'" for one in posed.series)
        raise SimulationError(
            f"{what}: {series} {'is' if len(posed.series) == 1 else 'are'} kept at {posed.grid.size} times",
            help=f"keep numbers instead, as final({posed.series[0].quantity}), or fewer times ('every'); "
            f"at most {MOST_BYTES / 1e9:g} GB are kept",
        )
    raise SimulationError(what, help=f"at most {MOST_BYTES / 1e9:g} GB are kept: ask for fewer members")


def estimated(first: int, last: int, share: float) -> NDArray[np.uint8]:
    """Tell which members get a companion run: a share of them, chosen by their number alone (splitmix64)."""
    x = (np.arange(first, last, dtype=np.uint64) + np.uint64(1)) * np.uint64(0x9E3779B97F4A7C15)
    x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    x ^= x >> np.uint64(31)
    return ((x >> np.uint64(11)).astype(np.float64) * 2.0**-53 < share).astype(np.uint8)


class _Run:
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
        self._groups: dict[tuple[int, ...], int] = {}
        n = first.members.count
        times = first.grid.size if first.series else 0
        self._found = Found(
            np.full((n, len(first.scalars)), np.nan),
            np.full((n, len(first.scalars)), np.nan),
            np.full((n, len(first.series), times), np.nan),
            np.zeros(n, dtype=np.int8),
            np.full(n, -1, dtype=np.int32),
            np.full(n, np.nan),
            np.full(n, np.nan),
            np.zeros(n, dtype=np.int64),
            [],
        )
        self._done, self._stopped = ctypes.c_long(0), ctypes.c_int(0)

    def all(self, pieces: Pieces | None, progress: Progress | None) -> Found:
        n = self._first.members.count
        size = LARGEST if pieces is None else max(SMALLEST, min(LARGEST, -(-n // PIECES)))
        with noted_interruptions() as interrupted:
            for first in range(0, n, size):
                last = min(first + size, n)
                kept = pieces.load(first) if pieces is not None else None
                if kept is not None:
                    self._take(first, last, kept)
                    continue
                self._watched(first, last, progress, interrupted)
                if self._stopped.value:
                    break
                if pieces is not None:
                    pieces.save(first, self._piece(first, last))
        return self._found

    def _watched(
        self,
        first: int,
        last: int,
        progress: Progress | None,
        interrupted: Callable[[], bool],
    ) -> None:
        """Run a batch in a thread, so that this one hears Ctrl-C and tells progress."""
        trouble: list[BaseException] = []

        def guarded() -> None:
            try:
                self._batch(first, last)
            except BaseException as error:  # raised again below, in the thread that waits
                trouble.append(error)

        self._done.value = 0
        n = self._first.members.count
        worker = threading.Thread(target=guarded)
        worker.start()
        try:
            while worker.is_alive():
                worker.join(INTERVAL)
                if interrupted():
                    self._stopped.value = 1
                if progress is not None:
                    progress(min(1.0, (first + self._done.value) / n))
        finally:
            if worker.is_alive():  # Ctrl-C was pressed again
                self._stopped.value = 1
                worker.join()
        if trouble:
            raise trouble[0]

    def _batch(self, first: int, last: int) -> None:
        values = self._first.members.values(first, last)
        flags = estimated(first, last, self._share)
        batch = self._first.empty(last - first)
        self._call(self._first, values, flags, batch)
        if self._few_steps is not None or self._others:
            self._again(values, flags, batch)
        self._put(first, values, batch)

    def _call(self, posed: Posed, values: Array, flags: NDArray[np.uint8], batch: Batch) -> None:
        posed.run(values, flags, batch, self._threads, self._done, self._stopped)

    def _again(self, values: Array, flags: NDArray[np.uint8], batch: Batch) -> None:
        """Give members to other builds that can follow them; those that took many steps and are not stiff go on here."""
        it = batch.members
        ran = it["stage"] == Stage.RAN
        many = ran & (it["status"] == Status.RUNNING)
        for k, other in enumerate(self._others):
            chosen = many & (it["stiff"] == 1) if other.stiff else ran & np.isin(it["status"], SINGULAR)
            if chosen.any() and (posed := self._other(k)) is not None:
                self._replace(posed, chosen, values, flags, batch, better=not other.stiff)
        left = (it["stage"] == Stage.RAN) & (it["status"] == Status.RUNNING)
        if left.any() and self._few_steps is not None:
            self._replace(self._other(-1), left, values, flags, batch, better=False)

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
        *,
        better: bool,
    ) -> None:
        assert posed is not None
        places = np.flatnonzero(chosen)
        again = posed.empty(places.size)
        self._call(posed, values[places], flags[places], again)
        if again.ends.shape[1] != batch.ends.shape[1]:
            again = replace(again, ends=np.full((places.size, batch.ends.shape[1]), np.nan))
        taken = np.ones(places.size, dtype=bool)
        if better:
            taken = (again.members["stage"] == Stage.RAN) & (again.members["status"] >= 0)
        for name in ("members", "kept", "errors", "series", "ends"):
            getattr(batch, name)[places[taken]] = getattr(again, name)[taken]

    # ---- results

    def _put(self, first: int, values: Array, batch: Batch) -> None:
        it, found = batch.members, self._found
        rows = slice(first, first + len(values))
        ran = it["stage"] == Stage.RAN
        outcomes = np.where(it["stage"] == Stage.WAITS, 0, FAILED).astype(np.int8)
        outcomes[ran & (it["status"] == Status.REACHED)] = COMPLETED
        outcomes[ran & (it["status"] == Status.TERMINATED)] = TERMINATED
        outcomes[it["companion"] < 0] = DOUBTFUL
        found.numbers[rows], found.number_errors[rows], found.rows[rows] = (
            batch.kept,
            batch.errors,
            batch.series,
        )
        found.outcomes[rows], found.ends[rows] = outcomes, it["t"]
        found.errors[rows], found.steps[rows] = it["error"], it["steps"]
        for k in np.flatnonzero((outcomes == FAILED) | (outcomes == DOUBTFUL)):
            key: tuple[int, ...] = tuple(int(it[name][k]) for name in ("stage", "status", "index", "part"))
            key = (-1,) if outcomes[k] == DOUBTFUL else key
            if key not in self._groups:
                text = self._text(values[k], it[k], batch.ends[k], doubtful=outcomes[k] == DOUBTFUL)
                if text not in found.texts:
                    found.texts.append(text)
                self._groups[key] = found.texts.index(text)
            found.reasons[first + k] = self._groups[key]

    def _text(self, values: Array, member: Any, end: Array, *, doubtful: bool) -> str:
        """Say why a member has no result, without its time: others of the same kind share the text."""
        problem = self._first.problem
        if doubtful:
            return "the companion run for the error estimate ended otherwise than the run"
        stage, status = Stage(int(member["stage"])), int(member["status"])
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

    def _piece(self, first: int, last: int) -> dict[str, Any]:
        found, rows = self._found, slice(first, last)
        names = ("numbers", "number_errors", "rows", "outcomes", "reasons", "ends", "errors", "steps")
        return {
            **{name: getattr(found, name)[rows] for name in names},
            "texts": np.array(found.texts, dtype=np.str_),
        }

    def _take(self, first: int, last: int, kept: Mapping[str, Any]) -> None:
        found, rows = self._found, slice(first, last)
        for name in ("numbers", "number_errors", "rows", "outcomes", "ends", "errors", "steps"):
            getattr(found, name)[rows] = kept[name]
        texts = [str(text) for text in kept["texts"]]
        found.texts += [text for text in texts if text not in found.texts]
        own = np.array([found.texts.index(text) for text in texts] or [0], dtype=np.int32)
        found.reasons[rows] = np.where(kept["reasons"] >= 0, own[kept["reasons"]], -1)

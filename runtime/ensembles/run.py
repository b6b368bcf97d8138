"""All members of an ensemble, batch by batch: here, by calls into C while Ctrl-C is heard, or on a cluster."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterable, Iterator
from typing import Protocol

import numpy as np

from ..integrate.interruption import NotedInterruptions
from ..numerics.growth_rates import parted
from ..outcome import SimulationError
from .batches import Batches
from .kept import FACTOR
from .kernel_arguments import Posed
from .members import Members
from .recipe import Recipe
from .result import Column, Ensemble
from .result_buffer import Piece, ResultBuffer
from .watch import Watch

LARGEST, SMALLEST, PIECES = 65_536, 64, 200
"""Members of a batch, and how many batches there are where results are written in pieces."""
MOST_BYTES = 4e9
"""Of a result in memory."""

Gaps = Iterable[tuple[int, int]]
Made = tuple[int, int, Piece]
"""The first member, the one after the last, and what they gave."""


class RunPieces(Protocol):
    """Where finished batches are put, and found when an ensemble goes on."""

    def kept(self) -> Iterator[Made]: ...
    def save(self, first: int, last: int, piece: Piece) -> None: ...


class Elsewhere(Protocol):
    """What makes members outside of this process. ``about`` and ``threads`` say in the end who made them."""

    def made(
        self, posed: Posed, gaps: Gaps, interrupted: Callable[[], bool], progress: Callable[[int], None]
    ) -> Iterator[Made]: ...
    @property
    def about(self) -> tuple[str, ...]: ...
    @property
    def threads(self) -> int: ...


def run_ensemble(
    recipe: Recipe,
    members: Members,
    *,
    threads: int | None = None,
    pieces: RunPieces | None = None,
    elsewhere: Elsewhere | None = None,
) -> Ensemble:
    """Run all members; Ctrl-C keeps those that are done. ``elsewhere``: who makes the members, if not this process.

    Raises SimulationError where no member can begin, or the result would fill the memory.
    """
    begun = time.perf_counter()
    crew = threads or processors()
    problem, first = recipe.problem, recipe.posed(members)
    n = members.count
    _check_size(first, n)
    found = ResultBuffer.empty(
        n, len(first.scalars), len(first.series), first.grid.size if first.series else 0
    )
    for one in pieces.kept() if pieces is not None else ():
        found.take(*one)
    told = recipe.options.progress or _nobody
    done = int((found.outcomes > 0).sum())
    with NotedInterruptions() as interrupted:
        if done:
            told(done / n)

        def progress(more: int) -> None:
            told(min(1.0, (done + more) / n))

        if elsewhere is not None:
            source = elsewhere.made(first, found.gaps(), interrupted, progress)
        else:
            size = LARGEST if pieces is None else max(SMALLEST, min(LARGEST, -(-n // PIECES)))
            batches = recipe.batches(first, crew)
            source = _made_here(batches, members, found.gaps(), size, recipe.limit, interrupted, progress)
        for start, end, piece in source:
            found.take(start, end, piece)
            if pieces is not None and (piece["outcomes"] > 0).all():
                pieces.save(start, end, piece)
    found.number_reasons()
    case = first.case
    factors = next((k for k, one in enumerate(first.scalars) if one.kind == FACTOR), None)
    chaos = () if factors is None else parted(found.numbers[:, factors])
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
        threads=crew if elsewhere is None else elsewhere.threads,
        build=first.build,
        remarks=members.remarks
        + chaos
        + _remarks(first)
        + (elsewhere.about if elsewhere is not None else ()),
    )


def processors() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _made_here(
    batches: Batches,
    members: Members,
    gaps: Gaps,
    size: int,
    limit: float | None,
    interrupted: Callable[[], bool],
    progress: Callable[[int], None],
) -> Iterator[Made]:
    """Make batches in a thread, so that this one hears Ctrl-C and tells progress."""
    before = 0
    for begin, end in gaps:
        for first in range(begin, end, size):
            last = min(first + size, end)
            watch = Watch(limit)

            def now_and_then(watch: Watch = watch, before: int = before, most: int = last - first) -> None:
                if interrupted():
                    watch.end()
                progress(before + min(watch.done.value, most))  # those that are made again count twice

            def work(first: int = first, last: int = last, watch: Watch = watch) -> Piece:
                return batches.make(first, members.values(first, last), watch)

            yield first, last, watch.over(work, now_and_then)
            if watch.ended:
                return
            before += last - first


def _nobody(fraction: float) -> None:
    """Tell progress to nobody."""


def _remarks(posed: Posed) -> tuple[str, ...]:
    told = []
    if posed.without_lanes:
        told.append(f"members ran one by one, not side by side: {posed.without_lanes}")
    unit = f" {posed.problem.time.unit}" if posed.problem.time.unit else ""
    if posed.bound is not None:
        told.append(
            f"members took steps of at most {posed.bound:.2g}{unit} for what is narrow in time: what is met for less may be missed"
        )
    return tuple(told)


def _check_size(posed: Posed, n: int) -> None:
    """Refuse results that fill the memory before anything runs, and say what would fit."""
    each = bytes_of_a_member(posed)
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


def bytes_of_a_member(posed: Posed) -> int:
    """Give the size of the results and values of one member."""
    numbers = 16 * len(posed.scalars) + 8 * len(posed.rows) * posed.grid.size
    return numbers + 40 + 8 * len(posed.members.names)

"""Ensembles on a Dask cluster: what a batch costs beside its members, and how much of many workers is used.

To see how many workers are kept busy where there are fewer processors than workers, these are threads of one process, and members
sleep instead of being computed; all else is as in a real run: batches, what is sent, what comes back. What a batch
costs is measured on a worker that is a process of its own.
"""

from __future__ import annotations

import logging
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import distributed
import numpy as np
from msgspec import Struct
from msgspec.structs import asdict

import mechc
from mechc.requests.question import study
from mechc.runtime.ensembles import cluster as dask_side
from mechc.runtime.ensembles.batches import COMPLETED, Batches
from mechc.runtime.ensembles.kernel_arguments import Posed
from mechc.runtime.ensembles.recipe import Make, Recipe
from mechc.runtime.ensembles.result_buffer import Piece
from mechc.runtime.ensembles.run import bytes_of_a_member, run_ensemble
from mechc.runtime.ensembles.watch import Watch
from mechc.runtime.studies.kinds.ensemble import EnsembleOf
from mechc.session import problem_of, with_others

from .ensembles import PENDULUM
from .machine import table, write

WORKERS = (1, 2, 4, 8, 16)
EACH = 2e-3
"""Seconds that a member sleeps."""
SECONDS = 20.0
"""Of sleep for each worker."""
LIGHT, BATCHES = 20, 400
"""Members of a batch that takes next to no time, and how many of these there are."""


class Sleeper:
    """Makes members by sleeping."""

    def __init__(self, posed: Posed, each: float) -> None:
        self._posed, self._each = posed, each

    def make(self, first: int, values: Any, watch: Watch) -> Piece:
        time.sleep(self._each * len(values))
        n = len(values)
        empty = self._posed.empty(n)
        return {
            "numbers": empty.kept,
            "number_errors": empty.errors,
            "rows": empty.series,
            "outcomes": np.full(n, COMPLETED, dtype=np.int8),
            "reasons": np.full(n, -1, dtype=np.int32),
            "ends": np.zeros(n),
            "errors": np.zeros(n),
            "steps": np.zeros(n, dtype=np.int64),
            "texts": np.array([], dtype=np.str_),
        }


class Sleeping(Recipe, frozen=True, eq=False, kw_only=True):
    """A recipe whose members sleep."""

    each: float

    def batches(self, first: Posed, threads: int) -> Batches:
        sleeper: Any = Sleeper(first, self.each)
        return sleeper


class Asleep(Struct, frozen=True):
    """What is sent of it."""

    make: Make
    each: float

    def __call__(self) -> Recipe:
        return Sleeping(**asdict(self.make()), each=self.each)


def question(n: int) -> tuple[Any, Recipe, Make]:
    """Return n members, how they are made, and what is sent of that."""
    model = mechc.loads(PENDULUM)
    given = {"vary": "a ~ uniform(-1, 1 rad), b ~ uniform(-1, 1 rad)", "samples": n, "lanes": "off"}
    given |= {"keep": "final(a), final(b), max(a)"}
    changed, asked = model._asked("ensemble", None, given)
    problem = problem_of(changed, asked)
    whole: Any = with_others(changed, asked, problem, study(asked, problem))
    assert isinstance(whole, EnsembleOf) and whole.send is not None
    return whole.members(problem), whole.recipe(problem), whole.send(whole)


@contextmanager
def machines(workers: int, processes: bool) -> Iterator[Any]:
    """Begin a cluster; its scheduler is in this process, and its workers, if they are not processes of their own."""
    with (
        distributed.LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            processes=processes,
            dashboard_address=":0",
            silence_logs=logging.CRITICAL,
        ) as local,
        distributed.Client(local, set_as_default=False) as client,
    ):
        yield client


def overhead(batches: int) -> list[str]:
    """Measure processor times for each batch of members that sleep for no time."""
    members, recipe, make = question(LIGHT * batches)
    kept = dask_side.FIRST, dask_side.LARGEST
    dask_side.FIRST = dask_side.LARGEST = LIGHT
    try:
        with machines(1, processes=True) as client:
            here, there = time.process_time(), sum(client.run(time.process_time).values())
            begun = time.perf_counter()
            crew = dask_side.Cluster(client, Asleep(make, 0.0), members, False, 1)
            assert run_ensemble(recipe, members, elsewhere=crew).complete
            clock = time.perf_counter() - begun
            here, there = time.process_time() - here, sum(client.run(time.process_time).values()) - there
    finally:
        dask_side.FIRST, dask_side.LARGEST = kept
    made = crew.batches
    rows = [
        ["sender and scheduler", f"{here / made * 1e3:.2f}"],
        ["worker", f"{there / made * 1e3:.2f}"],
        ["clock", f"{clock / made * 1e3:.2f}"],
    ]
    each = bytes_of_a_member(recipe.posed(members))
    return [
        table(
            [
                "ms for each batch",
                "one worker, two batches at a time, compiling and sending the model included",
            ],
            rows,
        ),
        f"A member of three numbers takes {each} bytes in the result. With batches of {dask_side.TARGET:g} s the sender and the "
        f"scheduler, where they share a processor, keep some {dask_side.TARGET / (here / made):.0f} workers busy.",
    ]


def efficiency(seconds: float) -> list[str]:
    """Measure how much of their time sleeping workers sleep."""
    rows = []
    for workers in WORKERS:
        members, recipe, make = question(int(workers * seconds / EACH))
        with machines(workers, processes=False) as client:
            crew = dask_side.Cluster(client, Asleep(make, EACH), members, False, 1)
            runs = run_ensemble(recipe, members, elsewhere=crew)
            assert runs.complete, runs.remarks
        slept = len(runs) * EACH
        rows.append(
            [
                str(workers),
                str(len(runs)),
                str(crew.batches),
                f"{runs.seconds:.1f}",
                f"{slept / workers / runs.seconds:.3f}",
            ]
        )
    return [table(["workers", "members", "batches", "time on the clock [s]", "efficiency"], rows)]


def main(quick: bool = False) -> None:
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else 0.0
    write(
        "cluster",
        "Ensembles on a cluster",
        [
            f"Workers are threads of one process, on {os.cpu_count()} processors; members sleep for {EACH * 1e3:g} ms each, so that more "
            "workers than processors can be told apart. Efficiency: the time that all members sleep, over that of all workers "
            "from the question to the answer, with telling them the question, compiling the model, sending and gathering. "
            f"Load of the machine when it began: {load:.1f}.",
            *efficiency(3.0 if quick else SECONDS),
            *overhead(100 if quick else BATCHES),
        ],
    )

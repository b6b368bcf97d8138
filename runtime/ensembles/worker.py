"""What runs on the workers of a cluster: they are told once how members are made, and then make batches of them."""

from __future__ import annotations

import pickle
import threading
import time
from collections.abc import Mapping
from typing import Any

from msgspec import Struct
from msgspec.structs import replace

from ..native import build
from ..native.cache import ENTRY
from ..native.kept_files import build_folder, find_entry, keep_entry
from ..outcome import SimulationError
from ..problem import Array
from .batches import Batches
from .compatibility import Facts, own_facts
from .members import Listed, Members
from .recipe import Recipe
from .result_buffer import Piece
from .watch import Watch

MOST = 4
"""Questions that a worker remembers, the last ones."""


class Sent(Struct, frozen=True):
    """A question as it is sent. ``recipe``: pickled, gives a ``Recipe`` when it is called; ``rows`` [n, names] of a few
    members, of which one can begin; ``libraries``: compiled code by its name in the cache, for machines like the sender's."""

    job: str
    sender: Facts
    recipe: bytes
    names: tuple[str, ...]
    units: tuple[str, ...]
    rows: Array
    in_lanes: bool
    libraries: Mapping[str, bytes]
    threads: int | None = None


class Refused(Struct, frozen=True):
    """A worker that cannot make members, and why."""

    why: str


class Job(Struct, eq=False):
    """A question that this worker knows."""

    batches: Batches
    limit: float | None
    watches: list[Watch]
    stopped: bool = False


_jobs: dict[str, Job] = {}
_settling = threading.Lock()
_busy: dict[str, threading.Lock] = {}
"""By the address of a worker, of which a process may hold several: one batch at a time has its processors."""


def settle(sent: Sent) -> Facts | Refused:
    """Make a question ready on this worker; give what it is."""
    own = own_facts()
    if why := own.refused_by(sent.sender):
        return Refused(why)
    with _settling:
        if sent.job not in _jobs:
            if own.runs_code_of(sent.sender):
                _take_libraries(sent.libraries)
                if own.lacks_compiler:
                    build.assume_compiler(sent.sender.compiler)
            try:
                recipe = pickle.loads(sent.recipe)()
                _remember(sent, recipe)
            except (SimulationError, build.BuildError, build.CompilerMissing, OSError) as trouble:
                return Refused(f"the model could not be compiled there: {str(trouble).splitlines()[0]}")
    return own


def _take_libraries(libraries: Mapping[str, bytes]) -> None:
    """Put compiled code where a build would have put it. What is damaged on its way is never found there."""
    for name, content in libraries.items():
        if not ENTRY.fullmatch(name):
            raise ValueError(f"'{name}' is not a name of compiled code")
        stem, _, last = name.rpartition("-")
        suffix = last[last.index(".") :]
        if find_entry(stem, suffix) is None:
            with build_folder() as folder:
                (folder / f"sent{suffix}").write_bytes(content)
                keep_entry(folder / f"sent{suffix}", stem, suffix)


def _remember(sent: Sent, recipe: Recipe) -> None:
    members = Members((), Listed(sent.names, sent.units, sent.rows))
    # what the sender has decided for all members holds for the few that it has sent
    posed = replace(recipe, lanes="on" if sent.in_lanes else "off").posed(members)
    _jobs[sent.job] = Job(recipe.batches(posed, sent.threads or _threads()), recipe.limit, [])
    while len(_jobs) > MOST:
        del _jobs[next(iter(_jobs))]


def _threads() -> int:
    """Give the threads that the cluster lets this worker have."""
    return int(_worker().state.nthreads)


def _worker() -> Any:
    from distributed import get_worker

    return get_worker()


def make_batch(job: str, first: int, values: Array) -> tuple[float, Piece] | None:
    """Make the members from the number ``first`` on; give the seconds it took, and the results. None: the job is not known."""
    known = _jobs.get(job)
    if known is None:
        return None
    with _busy.setdefault(_worker().address, threading.Lock()):
        watch = Watch(known.limit)
        known.watches.append(watch)
        if known.stopped:
            watch.end()
        begun = time.perf_counter()
        try:
            piece = watch.over(lambda: known.batches.make(first, values, watch), _nothing)
        finally:
            known.watches.remove(watch)
        return time.perf_counter() - begun, piece


async def stop(job: str) -> None:
    """End what this worker does for a question, and forget it: begun at once, whatever the worker is at."""
    known = _jobs.pop(job, None)
    if known is not None:
        known.stopped = True
        for watch in list(known.watches):
            watch.end()


def _nothing() -> None:
    """Look at nothing else."""

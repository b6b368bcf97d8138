"""Members made by the workers of a Dask cluster: batches sized by measured time, and nothing lost with a worker.

Each batch is given to one worker, which has one more waiting. A worker that goes away gives back what it had; a result is
taken once, from the worker that has the batch. So it does not matter what becomes of workers, and the bits are those of a run
in one process, as they depend on the values of a member alone.

The client is the caller's own, that of an address, or of processes on this machine.
"""

from __future__ import annotations

import contextlib
import logging
import pickle
import time
import uuid
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from msgspec import Struct

from ..native import kernel as native
from ..outcome import SimulationError
from .batches import given_up
from .compatibility import Facts, own_facts
from .kernel_arguments import TRIED, Posed
from .members import Members
from .native import load_ensemble
from .recipe import Make
from .result_buffer import Piece
from .run import LARGEST, Gaps, Made, bytes_of_a_member, processors
from .worker import Refused, Sent, make_batch, settle, stop

TARGET, LEAST, FIRST, GROWTH = 1.0, 0.1, 16, 4
"""Seconds of a batch and of the smallest ones, near the end; members of a worker's first batch; how much larger the next one may be."""
AHEAD = 2
"""Batches that a worker has, one of them waiting."""
MOST_BYTES = 2e7
"""Of the results of a batch."""
INTERVAL, LOOK = 0.01, 0.5
"""Seconds between two looks at batches, and at the list of workers."""
PATIENCE, SILENT, NO_WORKERS = 20.0, 120.0, 60.0
"""Seconds without a scheduler, with one that does not answer, and without a worker, after which nothing is hoped for."""
LOSSES = 3
"""Workers that may go away under a batch before it is halved, and under a single member before that is given up."""


class MemberBatch(Struct, eq=False):
    """Members to be made. ``losses``: workers that went away with it."""

    first: int
    last: int
    losses: int = 0


class Flight(Struct, eq=False):
    """A batch that a worker has."""

    batch: MemberBatch
    future: Any


class Hand(Struct, eq=False):
    """A worker. ``settling`` is there until it knows the question; ``each``: seconds that a member takes there."""

    address: str
    threads: int
    settling: Any
    ready: bool = False
    same_bits: bool = True
    each: float = 0.0
    size: int = 0
    flying: list[Flight] = []


class Cluster:
    """The workers of a scheduler, which make the members of one question."""

    def __init__(
        self, client: Any, make: Make, members: Members, reproducible: bool, threads: int | None
    ) -> None:
        self._client, self._make, self._members = client, make, members
        self._reproducible, self._asked_threads = reproducible, threads
        self._hands: dict[str, Hand] = {}
        self._refused: dict[str, str] = {}
        self._again: deque[MemberBatch] = deque()
        self._gaps: deque[tuple[int, int]] = deque()
        self._given_up: list[MemberBatch] = []
        self.batches = self._lost = self._most_threads = 0
        self._helped: set[str] = set()
        self._other_bits: set[str] = set()
        self._ended_by = ""

    @property
    def threads(self) -> int:
        return self._most_threads

    @property
    def about(self) -> tuple[str, ...]:
        """Who made the members, and what went wrong with whom."""
        n = len(self._helped)
        found = [f"made by {n} worker{'s' * (n != 1)} of a Dask cluster, in {self.batches} batches"]
        if self._lost:
            found.append(
                f"{self._lost} worker{'s' * (self._lost != 1)} went away meanwhile; what they had was made by others"
            )
        found += [f"the worker {who} was left out: {why}" for who, why in self._refused.items()]
        if self._other_bits and not self._reproducible:
            found.append(
                f"{len(self._other_bits)} of the workers have another processor or compiler than this machine: their members "
                "agree with its own within the tolerance, not to the last bit ('reproducible' makes them equal)"
            )
        return (*found, self._ended_by) if self._ended_by else tuple(found)

    def made(
        self, posed: Posed, gaps: Gaps, interrupted: Callable[[], bool], progress: Callable[[int], None]
    ) -> Iterator[Made]:
        """Let all members be made. Raises SimulationError where no worker can."""
        self._gaps.extend(gaps)
        self._largest = max(1, min(LARGEST, int(MOST_BYTES / bytes_of_a_member(posed))))
        sent = self._sent(posed)
        done, look, seen, workers_seen = 0, 0.0, time.monotonic(), time.monotonic()
        finished = False
        try:
            while self._left():
                now = time.monotonic()
                if interrupted():
                    return
                if now >= look:
                    there = self._there()
                    if there is not None:
                        seen = now
                        self._meet(there, sent)
                        if self._hands:
                            workers_seen = now
                    look = time.monotonic() + LOOK
                self._settle(sent.sender)
                if self._hopeless(now - seen, now - workers_seen):
                    return
                for batch, piece in self._arrived(posed):
                    done, seen = done + batch.last - batch.first, time.monotonic()
                    progress(done)
                    yield batch.first, batch.last, piece
                self._hand_out(sent.job)
                time.sleep(INTERVAL)
            finished = True
        finally:
            self._call_off(sent.job, stopping=not finished)

    def _left(self) -> bool:
        return bool(
            self._gaps or self._again or self._given_up or any(hand.flying for hand in self._hands.values())
        )

    # ---- what is sent

    def _sent(self, posed: Posed) -> Sent:
        members = self._members
        libraries = [Path(str(posed.problem.library)), *_loaded(self._reproducible)]
        if posed.lanes is not None:
            libraries.append(Path(posed.lanes.library._name))
        return Sent(
            uuid.uuid4().hex,
            own_facts(),
            pickle.dumps(self._make),
            members.names,
            members.units,
            members.values(0, min(TRIED, members.count)),
            posed.lanes is not None,
            {path.name: path.read_bytes() for path in libraries},
            self._asked_threads,
        )

    # ---- workers

    def _there(self) -> dict[str, int] | None:
        """Give the threads of the workers by their addresses; None where the scheduler does not answer."""
        client = self._client
        if client.status != RUNNING:
            return None
        try:
            found: dict[str, int] = client.sync(client.scheduler.ncores, callback_timeout=ANSWER)
        except (OSError, TimeoutError, RuntimeError, AttributeError):
            return None
        return found

    def _meet(self, there: dict[str, int], sent: Sent) -> None:
        """Tell new workers what it is about, and take back what those had that are gone."""
        for address in [one for one in self._hands if one not in there]:
            self._take_back(address, gone=True)
        for address, threads in there.items():
            if address not in self._hands and address not in self._refused:
                self._hands[address] = Hand(address, threads, self._submit(address, settle, sent))

    def _settle(self, own: Facts) -> None:
        """Let workers begin that know the question."""
        for hand in list(self._hands.values()):
            if hand.settling is not None and hand.settling.done():
                self._settled(hand, own)
        self._most_threads = max(self._most_threads, sum(h.threads for h in self._hands.values() if h.ready))

    def _settled(self, hand: Hand, own: Facts) -> None:
        future, hand.settling = hand.settling, None
        answer: Any = None
        if future.status == "finished":
            with contextlib.suppress(Exception):
                answer = future.result(timeout=ANSWER)
        elif future.status == "error":
            trouble = future.exception(timeout=ANSWER)
            answer = Refused(f"{type(trouble).__name__}: {trouble}".splitlines()[0])
        if isinstance(answer, Refused):
            self._refused[hand.address] = answer.why
        if not isinstance(answer, Facts):  # gone meanwhile, or refused
            del self._hands[hand.address]
            return
        hand.ready, hand.same_bits = True, answer.same_bits_as(own)

    def _take_back(self, address: str, *, gone: bool) -> None:
        """Forget a worker. The batch that it was at may have been its end."""
        hand = self._hands.pop(address, None)
        if hand is None:
            return
        self._lost += hand.ready
        for k, flight in enumerate(hand.flying):
            self._release(flight.future)
            self._put_back(flight.batch, lost=gone and k == 0)
        hand.flying.clear()
        if hand.settling is not None:
            self._release(hand.settling)

    def _put_back(self, batch: MemberBatch, *, lost: bool) -> None:
        batch.losses += lost
        n = batch.last - batch.first
        if batch.losses < LOSSES:
            self._again.appendleft(batch)
            return
        if n == 1:
            self._given_up.append(batch)
            return
        middle = batch.first + n // 2
        for first, last in ((batch.first, middle), (middle, batch.last)):
            self._again.appendleft(MemberBatch(first, last, LOSSES - 1))

    def _hopeless(self, without_scheduler: float, without_workers: float) -> bool:
        """Tell that nothing more is to be hoped for. Raises SimulationError where nothing was made."""
        where = getattr(self._client.scheduler, "address", "") or "of the cluster"
        status = self._client.status
        if without_scheduler > (SILENT if status == RUNNING else PATIENCE) or status == "closed":
            self._ended_by = f"the scheduler {where} went away: what was made is kept"
            return True
        all_refused = bool(self._refused) and not self._hands
        patience = NO_WORKERS * (5 if self._helped else 1)  # those that went away may come back
        if without_workers <= (PATIENCE / 4 if all_refused else patience):
            return False
        why = "; ".join(f"{who} was left out: {why}" for who, why in self._refused.items())
        if self._helped:
            self._ended_by = f"no worker is left: what was made is kept{'; ' * bool(why)}{why}"
            return True
        raise SimulationError(
            f"no worker of the scheduler {where} can make members" + (f": {why}" if why else ""),
            help="workers need the same versions of Python and mechc as the sender"
            if why
            else "it has none: start some, as with 'dask worker ADDRESS'",
        )

    # ---- batches

    def _hand_out(self, job: str) -> None:
        if self._client.status != RUNNING:
            return
        for _ in range(AHEAD):  # everybody has one before anybody has two
            for hand in self._hands.values():
                if not hand.ready or len(hand.flying) >= AHEAD or (batch := self._next(hand)) is None:
                    continue
                values = self._members.values(batch.first, batch.last)
                future = self._submit(hand.address, make_batch, job, batch.first, values)
                hand.flying.append(Flight(batch, future))

    def _next(self, hand: Hand) -> MemberBatch | None:
        if self._again:
            return self._again.popleft()
        if not self._gaps:
            return None
        first, last = self._gaps[0]
        size = self._size(hand)
        if first + size >= last:
            self._gaps.popleft()
        else:
            self._gaps[0] = (first + size, last)
        return MemberBatch(first, min(first + size, last))

    def _size(self, hand: Hand) -> int:
        """Choose how many members a worker gets: by time, and fewer near the end, so that all end at about the same time."""
        each = hand.each
        if not each:
            return min(FIRST, self._largest)
        ready = sum(one.ready for one in self._hands.values())
        left = sum(last - first for first, last in self._gaps)
        wanted = min(TARGET / each, max(left / (AHEAD * ready), LEAST / each), GROWTH * hand.size)
        return max(1, min(int(wanted), self._largest))

    def _arrived(self, posed: Posed) -> Iterator[tuple[MemberBatch, Piece]]:
        """Give what was made since, each batch once."""
        for hand in list(self._hands.values()):
            for flight in [one for one in hand.flying if one.future.done()]:
                if flight not in hand.flying:  # the worker was forgotten meanwhile
                    continue
                hand.flying.remove(flight)
                try:
                    piece = self._answer(hand, flight)
                finally:
                    self._release(flight.future)
                if piece is not None:
                    yield flight.batch, piece
        while self._given_up:
            batch = self._given_up.pop()
            yield batch, given_up(posed, batch.losses)

    def _answer(self, hand: Hand, flight: Flight) -> Piece | None:
        """Give the results of a batch, or put it back. Raises what stands against it on every worker."""
        future, batch = flight.future, flight.batch
        if future.status == "error":
            trouble = future.exception(timeout=ANSWER)
            if isinstance(trouble, SimulationError) or batch.losses + 1 >= LOSSES:
                raise trouble
            self._put_back(batch, lost=True)
            return None
        answer: tuple[float, Piece] | None = None
        if future.status == "finished":
            with contextlib.suppress(Exception):  # the worker went away with it
                answer = future.result(timeout=ANSWER)
        if answer is None:  # cancelled with its scheduler, gone, or the question is not known there any more
            self._put_back(batch, lost=False)
            self._take_back(hand.address, gone=False)
            return None
        seconds, piece = answer
        n = batch.last - batch.first
        hand.each, hand.size = max(seconds, 1e-9) / n, n
        self.batches += 1
        self._helped.add(hand.address)
        if not hand.same_bits:
            self._other_bits.add(hand.address)
        return piece

    def _submit(self, address: str, function: Callable[..., Any], *given: Any) -> Any:
        return self._client.submit(
            function, *given, workers=[address], allow_other_workers=False, pure=False, retries=0
        )

    def _release(self, future: Any) -> None:
        with contextlib.suppress(Exception):
            if future.done() or self._client.status != RUNNING:
                future.release()
            else:
                future.cancel()

    def _call_off(self, job: str, *, stopping: bool) -> None:
        """Leave nothing after on the cluster."""
        for hand in self._hands.values():
            for one in (*(flight.future for flight in hand.flying), hand.settling):
                if one is not None:
                    self._release(one)
        if self._client.status == RUNNING and self._hands:
            with contextlib.suppress(Exception):
                self._client.run(stop, job, workers=list(self._hands), wait=False, on_error="ignore")


def _loaded(reproducible: bool) -> list[Path]:
    return [Path(load(reproducible)._name) for load in (load_ensemble, native.load_kernel)]


RUNNING = "running"
"""What Dask calls a client that a scheduler answers."""
DEAF = "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN)"
"""Ctrl-C in a terminal reaches all processes; it is this one that ends the others."""
ANSWER = 5.0
"""Seconds in which a scheduler answers."""


@contextmanager
def connected(cluster: Any, workers: int | None, threads: int | None) -> Iterator[Any]:
    """Give the client of a cluster: one that the caller has, that of an address, or of ``workers`` processes begun here.

    Raises SimulationError.
    """
    try:
        import distributed
    except ImportError:
        raise SimulationError(
            "dask.distributed is not installed, which runs clusters",
            help="pip install 'mechc[cluster]' brings it",
        ) from None
    if cluster is not None and workers is not None:
        raise SimulationError(
            "'workers' begins processes on this machine, and 'cluster' names others: take one of them"
        )
    if isinstance(cluster, distributed.Client):
        if cluster.asynchronous or cluster.status != RUNNING:
            what = "asynchronous" if cluster.asynchronous else cluster.status
            raise SimulationError(
                f"the client of the cluster is {what}: an ensemble takes one that waits for answers"
            )
        yield cluster
    elif isinstance(cluster, str):
        try:
            client = distributed.Client(cluster, timeout=ANSWER, set_as_default=False)
        except (OSError, ValueError, TimeoutError) as trouble:
            raise SimulationError(
                f"no scheduler answers at '{cluster}': {str(trouble).splitlines()[0]}",
                help="'dask scheduler' begins one and prints its address, as tcp://10.0.0.1:8786",
            ) from None
        with client:
            yield client
    elif cluster is not None:
        if not hasattr(cluster, "scheduler_address"):
            raise SimulationError(
                f"'cluster' is an address, a dask.distributed.Client or a cluster of it, not {cluster!r}"
            )
        with distributed.Client(cluster, set_as_default=False) as client:
            yield client
    else:
        assert workers is not None
        each = threads or max(1, processors() // workers)
        with (
            distributed.LocalCluster(
                n_workers=workers,
                threads_per_worker=each,
                dashboard_address=":0",
                silence_logs=logging.CRITICAL,
                preload=[DEAF],
            ) as local,
            distributed.Client(local, set_as_default=False) as client,
        ):
            yield client

"""The client of a Dask cluster: the caller's own, that of an address, or of processes on this machine."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from ..outcome import SimulationError
from .run import processors

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

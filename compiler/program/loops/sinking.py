"""Iterations of loops that carry nothing moved to just before what reads them first, so that loops meet and join."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..model import Store
from .nest import Nest, Nests, StatementSite
from .stream import Numbers, Stream


def sunk(nests: Nests) -> Stream:
    """Return the stream with each such iteration, as a whole, before its first reader; the order of the rest stays."""
    made = nests.stream
    n = len(made.done)
    unit = np.full(n, -1, np.int64)
    units = 0
    for nest in nests.top:
        if type(nest) is Nest and nest.independent and not _fixed(nests, nest):
            for site in nest.children:
                assert type(site) is StatementSite
                unit[site.statements] = units + np.arange(len(site.statements))
            units += nest.total
    first = [n] * units
    # readers come later: the key of a unit is known when its statements are met
    for i, own, read in _readers(made, unit):
        key = first[own] if own >= 0 and first[own] < n else i
        if key < first[read]:
            first[read] = key
    keys = np.arange(n)
    keys_of_units = np.array([*first, n])[unit]
    keys = np.where(keys_of_units < n, keys_of_units, keys)
    return made.ordered(np.argsort(keys, kind="stable"))


def _readers(made: Stream, unit: Numbers) -> Iterator[tuple[int, int, int]]:
    """Yield, from the last one on, each statement that reads another unit: it, its own unit or -1, and that one."""
    operands = made.operands[::-1]
    read = np.where(operands >= 0, unit[np.maximum(operands, 0)], -1)
    own = np.broadcast_to(unit[::-1, None], read.shape)
    rows, columns = np.nonzero((read >= 0) & (read != own))
    yield from zip(
        (len(unit) - 1 - rows).tolist(),
        own[rows, columns].tolist(),
        read[rows, columns].tolist(),
        strict=True,
    )


def _fixed(nests: Nests, nest: Nest) -> bool:
    """Whether a loop writes what is read by its name: parameters."""
    first = [nests.stream.statement(s.statements[0]) for s in nests.sites_in([nest])]
    return any(type(s) is Store and s.array == "p" for s in first)

"""Iterations of loops that carry nothing moved to just before what reads them first, so that loops meet and join."""

from __future__ import annotations

from ..model import Store
from .nest import Nest, Nests, Site
from .stream import Stream


def sunk(nests: Nests) -> Stream:
    """Return the stream with each such iteration, as a whole, before its first reader; the order of the rest stays."""
    made = nests.stream
    n = len(made.done)
    unit = [-1] * n
    units = 0
    for nest in nests.top:
        if type(nest) is Nest and nest.independent and not _fixed(nests, nest):
            for site in nest.children:
                assert type(site) is Site
                for k, i in enumerate(site.statements.tolist()):
                    unit[i] = units + k
            units += nest.total
    first = [n] * units
    for i in range(
        n - 1, -1, -1
    ):  # readers come later: the key of a unit is known when its statements are met
        own = unit[i]
        key = first[own] if own >= 0 and first[own] < n else i
        for a in made.operands[i]:
            if a >= 0 and unit[a] >= 0 and unit[a] != own and key < first[unit[a]]:
                first[unit[a]] = key
    keys = [first[u] if u >= 0 and first[u] < n else i for i, u in enumerate(unit)]
    return made.ordered(sorted(range(n), key=lambda i: (keys[i], i)))


def _fixed(nests: Nests, nest: Nest) -> bool:
    """Whether a loop writes what is read by its name: parameters."""
    first = [nests.stream.done[s.statements[0]] for s in nests.sites_in([nest])]
    return any(type(s) is Store and s.array == "p" for s in first)

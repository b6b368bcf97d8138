"""What iterations read of the one before them: it stays in registers, on which processors do not wait as they do on memory."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...graph.operations import ADD, SUB
from ..model import Operate
from .stream import Numbers

if TYPE_CHECKING:
    from .nest import Nests, StatementSite


class CarriedValue:
    """The value of ``source`` in the iteration before; in the first one of each instance what was made as ``first``."""

    __slots__ = ("first", "number", "source")

    def __init__(self, number: int, source: StatementSite, first: Numbers) -> None:
        self.number = number
        self.source = source
        self.first = first


def carry(nests: Nests) -> None:
    """Replace operands by what is carried. Sums that nothing else reads are left: they have one place from end to end."""
    found: dict[int, list[tuple[StatementSite, int]]] = {}
    for site in nests.sites:
        for k, column in enumerate(site.operands):
            if isinstance(column, np.ndarray) and column[0] >= 0:
                source = _source(nests, site, column)
                if source is not None:
                    found.setdefault(source.number, []).append((site, k))
    if not found:
        return
    taken = {(site.number, k) for readers in found.values() for site, k in readers}
    elsewhere = np.zeros(len(nests.stream.done), bool)
    for site in nests.sites:
        for k, column in enumerate(site.operands):
            if isinstance(column, np.ndarray) and column[0] >= 0 and (site.number, k) not in taken:
                elsewhere[column] = True
    number = 0
    for source_number, readers in found.items():
        source = nests.sites[source_number]
        nest = source.chain[-1]
        before_last = np.delete(source.statements, nest.ends)
        if _is_sum(nests, source, readers) and not elsewhere[before_last].any():
            continue
        known: dict[bytes, CarriedValue] = {}
        for site, k in readers:
            column = site.operands[k]
            assert isinstance(column, np.ndarray)
            first = column[nest.starts]
            key = first.tobytes()
            if key not in known:
                known[key] = CarriedValue(number, source, first)
                nest.carried.append(known[key])
                number += 1
            site.operands[k] = known[key]


def _source(nests: Nests, site: StatementSite, column: Numbers) -> StatementSite | None:
    """Return whose value an operand is, where each iteration reads that of the one before it."""
    if not (site.chain and site.chain[-1].innermost):
        return None
    nest = site.chain[-1]
    inside = np.ones(nest.total, bool)
    inside[nest.starts] = False
    iterations = np.flatnonzero(inside)
    if not iterations.size:
        return None
    read = column[iterations]
    source = nests.sites[nests.site_of[read[0]]]
    if source.chain != site.chain or not (nests.site_of[read] == source.number).all():
        return None
    if not (nests.iteration_of[read] == iterations - 1).all():
        return None
    begins = next(nests.sites_in(nest.children)).statements[nest.starts]
    return source if (column[nest.starts] < begins).all() else None


def _is_sum(nests: Nests, source: StatementSite, readers: list[tuple[StatementSite, int]]) -> bool:
    """Whether a value is read by what it is added to, and by nothing else."""
    statement = nests.stream.statement(source.statements[0])
    return (
        all(site is source for site, _ in readers)
        and type(statement) is Operate
        and statement.code in (ADD, SUB)
    )

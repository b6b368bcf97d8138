"""Numbers over all iterations of nested loops as affine functions of the counters, or as tables."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .nest import Nest
from .rolled import Index
from .stream import Numbers


class Indices:
    """Makes indices; ``tables`` collects what is not affine, ``numbered`` the loops whose iterations those count."""

    def __init__(self) -> None:
        self.tables: list[tuple[int, ...]] = []
        self.numbered: set[int] = set()
        self._known: dict[bytes, int] = {}

    def index(self, numbers: Numbers, chain: Sequence[Nest]) -> Index:
        """Return the index whose values are these, one for each iteration of the last loop of the chain."""
        if not chain:
            return Index(int(numbers[0]))
        nest = chain[-1]
        inside = np.ones(len(numbers), bool)
        inside[nest.starts] = False
        steps = np.diff(numbers)[inside[1:]]
        if not steps.size or (steps == steps[0]).all():
            outer = self.index(numbers[nest.starts], chain[:-1])
            if not steps.size or steps[0] == 0:
                return outer
            return Index(
                outer.base, (*outer.strides, (nest.number, int(steps[0]))), outer.table, outer.numbered
            )
        self.numbered.add(nest.number)
        return Index(table=self._table(numbers), numbered=nest.number)

    def _table(self, numbers: Numbers) -> int:
        key = numbers.tobytes()
        if key not in self._known:
            self._known[key] = len(self.tables)
            self.tables.append(tuple(numbers.tolist()))
        return self._known[key]


def is_affine(index: Index) -> bool:
    return index.table < 0

"""A long function to loops."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction

import numpy as np

from ..model import Literal, Load, Lookup, Operate, ProgramFunction, Store
from . import rolled
from .indices import Indices, is_affine
from .loop_carried import CarriedValue
from .nest import Nest, Nests, StatementSite
from .places import PAD, Places
from .rolled import (
    NUMBERS,
    Carry,
    Compute,
    Index,
    Item,
    Local,
    Loop,
    LoopNumber,
    LoopRegister,
    Operand,
    Put,
    Read,
    Rolled,
)
from .runs import count_of_sites, runs
from .sinking import sunk
from .stream import Numbers, stream, tokens

WORTH = 4
"""A function becomes loops where these have at most this part of its statements."""


MANY = 16
"""Iterations of a loop, on average, that are worth being done side by side."""


def roll(function: ProgramFunction) -> Rolled | None:
    """Return a function as loops; None where it is short, or holds too little that repeats itself."""
    if not function.made:
        return None
    straight = stream(function)
    for by_number in (True, False):  # constants may differ where nothing repeats itself with them
        entries = runs(tokens(straight, by_number), straight.operands)
        if WORTH * count_of_sites(entries) <= len(straight.done):
            break
    else:
        return None
    first = Nests(straight, entries)
    Places(first)
    moved = sunk(first)
    first.let_go()
    nests = Nests(moved, runs(tokens(moved, by_number), moved.operands))
    rolled = _Writer(nests).rolled()
    nests.let_go()
    return rolled


class _Writer:
    def __init__(self, nests: Nests) -> None:
        self.nests = nests
        self.places = Places(nests)
        self.indices = Indices()
        self.taken = set(self.places.at[self.places.at >= 0].tolist())
        self.numbers: list[Fraction] = []
        self.known: dict[tuple[Fraction, ...], int] = {}
        self.padded: dict[int, int] = {}
        """Free places that hold a copy, and whose value it is."""

    def rolled(self) -> Rolled:
        items = self._items(self.nests.top)
        return Rolled(tuple(items), tuple(self.indices.tables), self.places.count, tuple(self.numbers))

    def _items(self, children: Sequence[StatementSite | Nest]) -> list[Item]:
        found: list[Item] = []
        for child in children:
            if type(child) is Nest:
                found += self._loop(child)
            else:
                assert type(child) is StatementSite
                found.append(self._statement(child, None, found))
        return found

    def _loop(self, nest: Nest) -> list[Item]:
        """Return a loop, and before it the copies that it needs."""
        chain = self.nests.chain_of(nest)
        before: list[Item] = []
        body: list[Item] = []
        for child in nest.children:
            if type(child) is Nest:
                body += self._loop(child)
            else:
                assert type(child) is StatementSite
                body.append(self._statement(child, nest, before))
        trips = self.indices.index(nest.trips, chain[:-1])
        kept = tuple((n, self.indices.index(places, chain[:-1])) for n, places in nest.kept.items())
        numbered = nest.number in self.indices.numbered
        apart = nest.apart and nest.total >= MANY * len(nest.trips) and not _writes_parameters(body)
        carried = tuple(self._carries(nest, chain[:-1]))
        return [*before, Loop(nest.number, trips, tuple(body), kept, numbered, apart, carried)]

    def _carries(self, nest: Nest, around: Sequence[Nest]) -> Iterator[Carry]:
        written: set[int] = set()
        for carried in nest.carried:
            source = carried.source
            last = None
            if source.last_in_memory and source.number not in written:
                written.add(source.number)
                last = self.indices.index(self.places.at[source.statements[nest.ends]], around)
            first = self.indices.index(self.places.at[carried.first], around)
            yield Carry(carried.number, source.number, first, last)

    def _statement(self, site: StatementSite, nest: Nest | None, before: list[Item]) -> Item:
        statement = self.nests.stream.statement(site.statements[0])
        operands = tuple(self._operand(site, k, nest, before) for k in range(len(site.operands)))
        if type(statement) is Store:
            index = self.indices.index(self.nests.stream.targets_of(site.statements), site.chain)
            return Put(statement.array, index, operands[0], statement.guarded)
        assert type(statement) is Operate or type(statement) is Lookup
        if nest is not None and site.number in nest.kept:
            return Compute(site.number, statement, operands, kept=True)
        place = None
        if site.in_memory:
            place = self.indices.index(self.places.at[site.statements], site.chain)
        return Compute(site.number, statement, operands, place)

    def _operand(self, site: StatementSite, k: int, nest: Nest | None, before: list[Item]) -> Operand:
        column = site.operands[k]
        if isinstance(column, StatementSite):
            return Local(column.number)
        if isinstance(column, CarriedValue):
            return rolled.Carried(column.number)
        if column[0] < 0:
            return self._leaf(column, site)
        places = self.places.at[column]
        if nest is not None and site.number in nest.kept and k == site.updates:
            return LoopRegister(site.number)
        index = None
        if len(site.chain) == 1 and nest is not None:
            index = self._padded(column, places, nest, before)
        return Read("w", index or self.indices.index(places, site.chain))

    def _leaf(self, column: Numbers, site: StatementSite) -> Operand:
        first = self.nests.stream.leaf(column[0])
        if type(first) is Literal:
            numbers = tuple(self.nests.stream.numbers_of(column))
            if all(number == first.number for number in numbers):
                return LoopNumber(first.number)
            if numbers not in self.known:
                self.known[numbers] = len(self.numbers)
                self.numbers += numbers
            places = self.known[numbers] + np.arange(len(numbers))
            return Read(NUMBERS, self.indices.index(places, site.chain))
        assert type(first) is Load
        return Read(first.array, self.indices.index(self.nests.stream.indices_of(column), site.chain))

    def _padded(self, column: Numbers, places: Numbers, nest: Nest, before: list[Item]) -> Index | None:
        """Return an affine index where the first one or two iterations read what was made before the loop: it is copied
        to the free places before the block that the others read."""
        for peeled in range(1, PAD + 1):
            if len(places) < peeled + 3 or (column[:peeled] >= self._begin(nest)).any():
                return None
            step = places[peeled + 1] - places[peeled]
            wanted = places[peeled] - step * np.arange(peeled, 0, -1)
            all_places = np.concatenate([wanted, places[peeled:]])
            if step == 0 or (np.diff(all_places) != step).any() or (wanted == places[:peeled]).all():
                continue
            if not all(self._is_free(int(at), int(of)) for at, of in zip(wanted, column, strict=False)):
                continue
            for at, of, source in zip(wanted.tolist(), column.tolist(), places.tolist(), strict=False):
                self.padded[at] = of
                before.append(Put("w", Index(at), Read("w", Index(source))))
            index = self.indices.index(all_places, (nest,))
            return index if is_affine(index) else None
        return None

    def _is_free(self, place: int, value: int) -> bool:
        return 0 <= place < self.places.count and (
            self.padded.get(place, value) == value and place not in self.taken
        )

    def _begin(self, nest: Nest) -> int:
        return min(int(site.statements[0]) for site in self.nests.sites_in([nest]))


def _writes_parameters(body: Sequence[Item]) -> bool:
    return any(isinstance(item, Put) and item.array == "p" for item in body)

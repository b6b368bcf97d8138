"""A long function to loops."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction

import numpy as np

from ..model import Literal, Load, Lookup, Operate, ProgramFunction, Store
from . import rolled
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
from .stream import Numbers, Stream, stream, tokens

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

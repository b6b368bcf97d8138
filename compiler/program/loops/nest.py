"""Nests of loops over the statements of a stream: which statement is which iteration of which site."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from .loop_carried import CarriedValue, carry
from .runs import Entry, IterationRun
from .stream import NONE, Numbers, Stream


class StatementSite:
    """One statement of the text: ``statements`` of the stream, one for each iteration of the loops around it (``chain``,
    outermost first). ``operands``: by position, a leaf, a value of the same iteration (``StatementSite``) or of the one before
    (``CarriedValue``), or what lies in w."""

    __slots__ = ("chain", "in_memory", "last_in_memory", "number", "operands", "statements", "updates")

    def __init__(self, number: int, chain: tuple[Nest, ...], statements: Numbers) -> None:
        self.number = number
        self.chain = chain
        self.statements = statements
        self.operands: list[Numbers | StatementSite | CarriedValue] = []
        """Positions in the stream (negative: leaves) over all iterations, or the site that each iteration reads."""
        self.in_memory = False
        self.last_in_memory = False
        """Whether only what the last iteration of each instance makes must lie in memory. It is carried as well."""
        self.updates: int | None = None
        """The operand whose place the result takes: it is read for the last time here."""


class Nest:
    """One loop of the text. Instance k of it, of those around it, has ``trips[k]`` iterations, which are numbered
    through all instances from ``starts[k]`` on."""

    __slots__ = ("apart", "carried", "children", "depth", "kept", "number", "starts", "total", "trips")

    def __init__(self, number: int, depth: int, trips: Numbers) -> None:
        self.number = number
        self.depth = depth
        self.trips = trips
        self.starts = np.cumsum(trips) - trips
        self.total = int(trips.sum())
        self.children: list[StatementSite | Nest] = []
        self.apart = False
        """Whether no iteration reads or writes what another one writes, but for what is kept."""
        self.kept: dict[int, Numbers] = {}
        """Sites whose place is the same through each instance, and that place by instance."""
        self.carried: list[CarriedValue] = []

    @property
    def independent(self) -> bool:
        return self.apart and not self.kept

    @property
    def innermost(self) -> bool:
        return all(type(child) is StatementSite for child in self.children)

    @property
    def ends(self) -> Numbers:
        """Return the last iteration of each instance."""
        return self.starts + self.trips - 1

    def instances(self) -> Numbers:
        """Return the instance of each iteration."""
        return np.repeat(np.arange(len(self.trips)), self.trips)


class Nests:
    """All of a function: ``top`` in order, and its sites and loops by number."""

    def __init__(self, stream: Stream, entries: Sequence[Entry]) -> None:
        self.stream = stream
        self.sites: list[StatementSite] = []
        self.loops: list[Nest] = []
        n = len(stream.done)
        self.site_of = np.zeros(n, np.int64)
        self.iteration_of = np.zeros(n, np.int64)
        self.top = self._build([entries], ())
        self.last_reader = self._last_readers()
        self._resolve()

    def _build(
        self, bodies: Sequence[Sequence[Entry]], chain: tuple[Nest, ...]
    ) -> list[StatementSite | Nest]:
        found: list[StatementSite | Nest] = []
        plain = not any(type(entry) is IterationRun for entry in bodies[0])  # statements one after the other
        begins = np.array([body[0] for body in bodies]) if plain else None
        for q, first in enumerate(bodies[0]):
            if type(first) is IterationRun:
                runs = [body[q] for body in bodies]
                iterations = [run.iterations for run in runs if type(run) is IterationRun]
                nest = Nest(len(self.loops), len(chain) + 1, np.array([len(i) for i in iterations]))
                self.loops.append(nest)
                nest.children = self._build([i for each in iterations for i in each], (*chain, nest))
                found.append(nest)
            else:
                statements = np.array([body[q] for body in bodies]) if begins is None else begins + q
                site = StatementSite(len(self.sites), chain, statements)
                self.sites.append(site)
                self.site_of[statements] = site.number
                self.iteration_of[statements] = np.arange(len(bodies))
                found.append(site)
        return found

    def _last_readers(self) -> Numbers:
        last = np.full(len(self.stream.done), -1, np.int64)
        for column in self.stream.operands.T:
            reading = np.flatnonzero(column >= 0)
            np.maximum.at(last, column[reading], reading)
        return last

    def _outer(self, chain: tuple[Nest, ...], depth: int) -> Numbers:
        """Return for each iteration of the innermost loop the one of the loop at ``depth`` that it is part of."""
        found = np.arange(chain[-1].total) if chain else np.zeros(1, np.int64)
        for nest in reversed(chain[depth:]):
            found = nest.instances()[found]
        return found

    def _resolve(self) -> None:
        """Find out which operands are values of the same iteration, and what must lie in memory."""
        operands = [np.ascontiguousarray(column) for column in self.stream.operands.T]
        outer: dict[tuple[int, int], Numbers] = {}
        for site in self.sites:
            for operand in operands:
                column = operand[site.statements]
                if column[0] == NONE:
                    break
                if column[0] < 0:
                    site.operands.append(column)
                    continue
                source = self.sites[self.site_of[column[0]]]
                depth = len(source.chain)
                local = source.chain == site.chain[:depth] and bool(
                    (self.site_of[column] == source.number).all()
                )
                if local:
                    key = (site.chain[-1].number if site.chain else -1, depth)
                    if key not in outer:
                        outer[key] = self._outer(site.chain, depth)
                    local = bool((self.iteration_of[column] == outer[key]).all())
                if local:
                    site.operands.append(source)
                else:
                    site.operands.append(column)
        carry(self)
        needed = np.zeros(len(self.stream.done), bool)
        for site in self.sites:
            for read in site.operands:
                if isinstance(read, CarriedValue):
                    needed[read.first] = True
                elif not isinstance(read, StatementSite) and read[0] >= 0:
                    needed[read] = True
        for site in self.sites:
            site.in_memory = bool(needed[site.statements].any())
        for source in {c.source for nest in self.loops for c in nest.carried}:
            before_last = np.delete(source.statements, source.chain[-1].ends)
            if source.in_memory and not needed[before_last].any():
                source.in_memory, source.last_in_memory = False, True

    def let_go(self) -> None:
        """Forget what lies in loops, which know each other in circles that nothing collects while a model is compiled."""
        for nest in self.loops:
            nest.children = []

    def chain_of(self, nest: Nest) -> tuple[Nest, ...]:
        """Return a loop with those around it, outermost first."""
        child: StatementSite | Nest = nest
        while type(child) is Nest:
            child = child.children[0]
        assert type(child) is StatementSite
        return child.chain[: nest.depth]

    def sites_in(self, children: Sequence[StatementSite | Nest]) -> Iterator[StatementSite]:
        for child in children:
            if type(child) is Nest:
                yield from self.sites_in(child.children)
            else:
                assert type(child) is StatementSite
                yield child

"""Places in the workspace for what lives longer than an iteration.

What is updated in place (a sum and what is added to it) shares one place. The places of an update stand in the order of its
largest loop, so that indices are affine; what is left over is in the order of making.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...graph.operations import ADD, SUB
from ..model import Operate
from .loop_carried import CarriedValue
from .nest import Nest, Nests, StatementSite
from .stream import Numbers

PAD = 2
"""Free places before and after each block, for what loops read from before their beginning."""


class Places:
    """``at``: the place of each statement of the stream, -1 without one; ``count`` places."""

    def __init__(self, nests: Nests) -> None:
        self.nests = nests
        self.count = 0
        self._find_updates()
        self.at = self._allocate()
        for nest in nests.loops:
            self._analyse(nest)

    def _find_updates(self) -> None:
        """A sum whose first or second operand is read for the last time there, every time, takes its place."""
        last = self.nests.last_reader
        for site in self.nests.sites:
            statement = self.nests.stream.statement(site.statements[0])
            if not (
                site.in_memory and site.chain and type(statement) is Operate and statement.code in (ADD, SUB)
            ):
                continue
            for k, column in enumerate(site.operands):
                if isinstance(column, StatementSite | CarriedValue) or column[0] < 0:
                    continue
                if not (last[column] == site.statements).all():
                    continue
                others = [o for j, o in enumerate(site.operands) if j != k]
                if all(isinstance(o, StatementSite | CarriedValue) or (o != column).all() for o in others):
                    site.updates = k
                    break

    def _allocate(self) -> Numbers:
        sites = self.nests.sites
        n = len(self.nests.stream.done)
        shared = np.full(n, -1, np.int64)
        """The first statement of those that share a place."""
        pairs: list[tuple[int, int]] = []
        for site in sites:
            if site.updates is not None:
                column = site.operands[site.updates]
                assert not isinstance(column, StatementSite | CarriedValue)
                pairs += zip(site.statements.tolist(), column.tolist(), strict=True)
            elif site.in_memory or site.last_in_memory:
                shared[_in_memory(site)] = _in_memory(site)
        for statement, value in sorted(pairs):
            shared[statement] = shared[value]
        at = np.full(n, -1, np.int64)

        def give(owners: Numbers) -> None:
            at[owners] = self.count + PAD + np.arange(len(owners))
            self.count += len(owners) + 2 * PAD

        updating = sorted(
            (s for s in sites if s.updates is not None), key=lambda s: (-len(s.statements), s.number)
        )
        for way in range(3):
            for site in updating:
                nest = site.chain[-1]
                k = int(np.argmax(nest.trips))
                longest = slice(nest.starts[k], nest.starts[k] + nest.trips[k])
                owners = shared[
                    (site.statements[longest], site.statements[nest.starts], site.statements)[way]
                ]
                if len(owners) > 1 and (at[owners] < 0).all() and len(np.unique(owners)) == len(owners):
                    give(owners)
        for site in sites:
            if (site.in_memory and site.updates is None) or site.last_in_memory:
                owners = _in_memory(site)
                owners = owners[at[owners] < 0]
                if len(owners) and site.chain and site.in_memory:
                    give(owners)
                elif len(owners):
                    at[owners] = self.count + np.arange(len(owners))
                    self.count += len(owners)
        return np.where(shared >= 0, at[np.maximum(shared, 0)], -1)

    def _analyse(self, nest: Nest) -> None:
        """Find what an innermost loop may keep in a register, and whether its iterations are apart."""
        children = nest.children
        sites = [child for child in children if type(child) is StatementSite]
        if len(sites) < len(children):
            return
        instance, first = nest.instances(), np.repeat(nest.starts, nest.trips)
        written = {s.number: self.at[s.statements] for s in sites if s.in_memory}
        read = {
            (s.number, k): self.at[o]
            for s in sites
            for k, o in enumerate(s.operands)
            if not isinstance(o, StatementSite | CarriedValue) and o[0] >= 0
        }
        for site in sites:
            if site.updates is None or not (written[site.number] == written[site.number][first]).all():
                continue
            own = instance[nest.starts] * self.count + written[site.number][nest.starts]
            others = [w for number, w in written.items() if number != site.number]
            others += [r for key, r in read.items() if key != (site.number, site.updates)]
            if not any(np.isin(instance * self.count + places, own).any() for places in others):
                nest.kept[site.number] = written[site.number][nest.starts]
        updated = {(s.number, s.updates) for s in sites if s.number in nest.kept}
        nest.apart = not nest.carried and self._is_independent(
            nest,
            instance,
            [places for number, places in written.items() if number not in nest.kept],
            [places for key, places in read.items() if key not in updated],
        )

    def _is_independent(
        self, nest: Nest, instance: Numbers, written: Sequence[Numbers], read: Sequence[Numbers]
    ) -> bool:
        if not written:
            return True
        iteration = np.arange(nest.total)
        keys = np.concatenate([instance * self.count + places for places in written])
        by = np.tile(iteration, len(written))
        order = np.lexsort((by, keys))
        keys, by = keys[order], by[order]
        if ((keys[1:] == keys[:-1]) & (by[1:] != by[:-1])).any():
            return False
        for places in read:
            wanted = instance * self.count + places
            found = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
            if ((keys[found] == wanted) & (by[found] != iteration)).any():
                return False
        return True


def _in_memory(site: StatementSite) -> Numbers:
    """Return the statements of a site whose values lie in memory."""
    return site.statements[site.chain[-1].ends] if site.last_in_memory else site.statements

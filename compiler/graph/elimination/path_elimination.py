"""Path elimination: solve affine residuals by straight-line code that keeps the sharing of the graph.

The system has the residual rows and, for every shared linear node, a definition with unit pivot (linear.py).
For one unknown after the other, leaves of the tree first: eliminate the definitions on its paths to its
residual, then pivot on (residual, unknown). The pivot is the Schur complement of the mass matrix, positive
for any order if the matrix is; what is left is evaluated forward. On a tree of bodies this finds the
articulated-body recursion.

Two frontier sweeps bound the fill-in at hubs and in loops. Where the row of the pivot has more than a few
variables (six for a tree of bodies in space, five for loops in the plane), definitions in it are replaced by
their variables, and likewise definitions that use the unknown by their users, down to the smallest frontier
met: a greedy vertex cut, with a budget of 4 times the frontier plus 16 steps. Multipliers are unknowns like
others, placed right after the last unknown on which their constraint depends.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from enum import Enum
from functools import partial
from heapq import heapify, heappop, heappush
from typing import Final

from msgspec import Struct

from ..node import Graph, Node
from .linear import Coefficients, LinearRows


class ZeroPivot(ZeroDivisionError):
    """The matrix is singular at every state: no equation left holds any of the ``remaining`` unknowns.

    ``unknown`` is the first of them. They are as many as the matrix lacks rank.
    """

    def __init__(self, unknown: int, remaining: tuple[int, ...]) -> None:
        super().__init__(f"the pivot of unknown {unknown} is identically zero")
        self.unknown = unknown
        self.remaining = remaining


class TooMuchWork(Exception):
    """The elimination exceeded its limit."""


class NextDefinition(Enum):
    """Which definition on the paths of an unknown to eliminate next; any choice is safe."""

    OLDEST = "oldest definition first"
    LEAST_FILL = "least fill first"
    FEWEST_USERS = "fewest users first"


NARROW: Final = 5
"""Entries of rows and columns that no usual variant sweeps."""


class Variant(Struct, frozen=True):
    """``frontier``: rows and columns of a pivot with more entries than this are swept."""

    choice: NextDefinition
    frontier: int

    @property
    def name(self) -> str:
        return f"path elimination, {self.choice.value}, frontier {self.frontier}"


class PathElimination(Struct, frozen=True):
    """``unknowns`` in the order given; ``pivots[k]`` is that of unknown ``order[k]`` in residual ``rows[k]``.

    ``work`` counts products.
    """

    unknowns: tuple[Node, ...]
    pivots: tuple[Node, ...]
    order: tuple[int, ...]
    rows: tuple[int, ...]
    work: int


class Attempt:
    """One elimination under way: ``advance`` as far as wanted, then ``solution``.

    Unknowns go in the given order and each with its row of ``rows`` where that is possible. An unknown whose
    pivot is zero waits until others are gone; where all that are left have zero pivots, two of them exchange
    their rows. Raises ZeroPivot, and TooMuchWork where more than ``limit`` products would be formed.
    """

    def __init__(
        self,
        graph: Graph,
        system: LinearRows,
        rows: Sequence[int],
        order: Sequence[int],
        variant: Variant,
    ) -> None:
        self.variant = variant
        self._state = _State(graph, system)
        self._row_of = list(rows)
        self._pending = list(order)
        self._pivots: list[Node] = []
        self._done: list[int] = []
        self._widths: set[int] = set()

    @property
    def work(self) -> int:
        """The number of products so far."""
        return self._state.work

    @property
    def widths(self) -> frozenset[int]:
        """The numbers of entries of those rows and columns of pivots that a sweep changes."""
        return frozenset(self._widths)

    def advance(self, count: int | None = None, *, limit: float = float("inf")) -> None:
        """Eliminate so many unknowns, or all that are left."""
        self._state.limit = limit
        state, row_of, pending, variant = self._state, self._row_of, self._pending, self.variant
        unknowns = state.unknowns
        left = 0 if count is None else max(0, len(pending) - count)
        while len(pending) > left:
            for i in pending:
                unknown, row = unknowns[i], ~row_of[i]
                state.remove_paths(unknown, row, variant.choice)
                if unknown in state.rows[row]:
                    break
            else:
                i = _exchange(state, row_of, pending, variant.choice)
                unknown, row = unknowns[i], ~row_of[i]
            self._sweep(state.rows[row], partial(state.row_sweep, unknown, row))
            self._sweep(state.users[unknown], partial(state.column_sweep, unknown, row))
            self._pivots.append(state.pivot(unknown, row))
            pending.remove(i)
            self._done.append(i)

    def _sweep(self, entries: Collection[Node], sweep: Callable[[], list[Node]]) -> None:
        """Sweep a row or a column if it is wide; note whether that changes it, also where only others would do it."""
        width = len(entries)
        if width > min(self.variant.frontier, NARROW):
            changed = sweep()
            if changed:
                self._widths.add(width)
            if width > self.variant.frontier:
                for v in changed:
                    self._state.remove(v)

    def formulas(self) -> list[Node]:
        """Return those of the unknowns that are gone, in terms of what is left, and of the rows that are left."""
        state = self._state
        gone = state.back_substitute([state.unknowns[i] for i in self._done])
        left = [c for k, row in state.rows.items() for c in (*row.values(), state.offsets[k])]
        return [*gone, *left]

    def solution(self, *, limit: float = float("inf")) -> PathElimination:
        """Eliminate what is left, and evaluate the unknowns."""
        self.advance(limit=limit)
        state = self._state
        for k, row in state.rows.items():
            state.solved[Node(k)] = (row, state.offsets[k])
        return PathElimination(
            state.back_substitute(state.unknowns),
            tuple(self._pivots),
            tuple(self._done),
            tuple(self._row_of[i] for i in self._done),
            self.work,
        )


def _exchange(state: _State, row_of: list[int], pending: list[int], choice: NextDefinition) -> int:
    """Give some unknown a row in which it has a pivot, and return it. Raises ZeroPivot if there is none."""
    for i in pending:
        for j in pending:
            row = ~row_of[j]
            state.remove_paths(state.unknowns[i], row, choice)
            if state.unknowns[i] in state.rows[row]:
                row_of[i], row_of[j] = row_of[j], row_of[i]
                return i
    raise ZeroPivot(pending[0], tuple(pending))


class _State:
    """The rows while they are eliminated. ``users`` inverts ``rows``; its values are ordered sets."""

    __slots__ = ("graph", "limit", "offsets", "ordered", "rows", "solved", "unknowns", "users", "work")

    def __init__(self, graph: Graph, system: LinearRows) -> None:
        self.graph = graph
        self.unknowns = system.unknowns
        self.rows = {k: dict(c) for k, c in system.rows.items()}
        self.offsets = dict(system.offsets)
        self.users: dict[Node, dict[Node, None]] = {v: {} for v in system.unknowns}
        for k in self.rows:
            if k >= 0:
                self.users[Node(k)] = {}
        for k, row in self.rows.items():
            for v in row:
                self.users[v][Node(k)] = None
        self.solved: dict[Node, tuple[Coefficients, Node]] = {}
        self.ordered = True
        """No definition depends on a younger one; an unknown that was solved for may bring that about."""
        self.work = 0
        self.limit = float("inf")

    def remove_paths(self, unknown: Node, row: int, choice: NextDefinition) -> None:
        """Eliminate every definition on a path from the unknown to its row."""
        users, rows = self.users, self.rows
        # no path goes beyond the largest one in the row, while definitions depend on smaller numbers only
        largest = max(rows[row], default=-1) if self.ordered else len(self.graph)
        above: set[Node] = set()
        stack = [unknown]
        while stack:
            for k in users[stack.pop()]:
                if 0 <= k <= largest and k not in above:
                    above.add(k)
                    stack.append(k)
        path: set[Node] = set()
        frontier = [v for v in rows[row] if v in above]
        while frontier:
            v = frontier.pop()
            if v not in path:
                path.add(v)
                frontier += [w for w in rows[v] if w in above]
        if choice is NextDefinition.OLDEST or len(path) <= 1:
            for v in sorted(path):
                self.remove(v)
        else:
            self._remove_cheapest_first(
                path, self._fill if choice is NextDefinition.LEAST_FILL else self._use
            )

    def _remove_cheapest_first(self, path: set[Node], cost: Callable[[Node], tuple[int, int]]) -> None:
        costs = {v: cost(v) for v in path}
        heap = [(c, v) for v, c in costs.items()]
        heapify(heap)
        while costs:
            c, v = heappop(heap)
            if costs.get(v) != c:
                continue  # removed, or its cost has changed since
            del costs[v]
            near = set(self.users[v])
            self.remove(v)
            near.update(*[self.rows[k] for k in near])
            for w in costs.keys() & near:
                costs[w] = c = cost(w)
                heappush(heap, (c, w))

    def _fill(self, v: Node) -> tuple[int, int]:
        """Return how many entries the rows of the users would gain; the older of two goes first."""
        variables, rows = self.rows[v], self.rows
        fill = 0
        for k in self.users[v]:
            row = rows[k]
            # not a difference of sets: that would walk through the row, which may be long
            fill += sum([w not in row for w in variables])
        return fill, v

    def _use(self, v: Node) -> tuple[int, int]:
        """Return the number of users; the younger of two goes first."""
        return len(self.users[v]), -v

    def row_sweep(self, unknown: Node, row: int) -> list[Node]:
        """Return definitions in the row, and in those, that have fewer variables than it; the one to go first stands first."""
        frontier = set(self.rows[row])
        frontier.discard(unknown)
        heap = [-v for v in frontier if v in self.rows]
        heapify(heap)
        best, taken = len(frontier), 0
        passed: dict[Node, None] = {}  # met again only where definitions depend on younger ones
        for _ in range(4 * len(frontier) + 16):
            if not heap:
                break
            v = Node(-heappop(heap))
            frontier.discard(v)
            passed[v] = None
            for w in self.rows[v]:
                if w not in frontier and w not in passed:
                    frontier.add(w)
                    if w in self.rows:
                        heappush(heap, -w)
            if len(frontier) < best:
                best, taken = len(frontier), len(passed)
        return list(reversed(list(passed)[:taken]))

    def column_sweep(self, unknown: Node, row: int) -> list[Node]:
        """Return definitions that use the unknown, and those that use them, that have fewer users than it."""
        frontier = set(self.users[unknown])
        frontier.discard(row)
        heap = [k for k in frontier if k >= 0]
        heapify(heap)
        best, taken = len(frontier), 0
        passed: dict[Node, None] = {}
        for _ in range(4 * len(frontier) + 16):
            if not heap:
                break
            v = Node(heappop(heap))
            frontier.discard(v)
            passed[v] = None
            for k in self.users[v]:
                if k not in frontier and k not in passed:
                    frontier.add(k)
                    if k >= 0:
                        heappush(heap, k)
            if len(frontier) < best:
                best, taken = len(frontier), len(passed)
        return list(passed)[:taken]

    def remove(self, v: Node) -> None:
        """Put a definition into all its users."""
        coefficients = self.rows.pop(v)
        offset = self.offsets.pop(v)
        for w in coefficients:
            del self.users[w][v]
        self._insert(v, coefficients, offset)

    def pivot(self, unknown: Node, row: int) -> Node:
        """Solve a row for an unknown that it contains, and put the result into all its users."""
        graph = self.graph
        coefficients = self.rows.pop(row)
        offset = self.offsets.pop(row)
        for w in coefficients:
            del self.users[w][Node(row)]
        pivot = coefficients.pop(unknown)
        factor = graph.div(graph.minus_one, pivot)
        solved = {w: graph.mul(c, factor) for w, c in coefficients.items()}
        self._insert(unknown, solved, graph.mul(offset, factor))
        return pivot

    def _insert(self, v: Node, coefficients: Coefficients, offset: Node) -> None:
        graph, rows, users = self.graph, self.rows, self.users
        add, mul, zero = graph.add, graph.mul, graph.zero
        self.work += len(coefficients) * len(users[v])
        if self.work > self.limit:
            raise TooMuchWork
        youngest = max(coefficients, default=-1)
        for k in users[v]:
            row = rows[k]
            factor = row.pop(v)
            self.ordered = self.ordered and not 0 <= k < youngest
            for w, c in coefficients.items():
                product = mul(factor, c)
                held = row.get(w)
                if held is None:
                    row[w] = product
                    users[w][k] = None
                else:
                    total = add(held, product)
                    if total == zero:
                        del row[w]
                        del users[w][k]
                    else:
                        row[w] = total
            if offset != zero:
                self.offsets[k] = add(self.offsets[k], mul(factor, offset))
        users[v] = {}
        self.solved[v] = (coefficients, offset)

    def back_substitute(self, unknowns: Sequence[Node]) -> tuple[Node, ...]:
        """Evaluate what the unknowns need, each once; what is not solved for stands for itself."""
        graph, solved = self.graph, self.solved
        values: dict[Node, Node] = {}
        for unknown in unknowns:
            stack = [unknown]
            while stack:
                v = stack[-1]
                if v in values:
                    stack.pop()
                    continue
                if v not in solved:
                    values[v] = v
                    continue
                coefficients, total = solved[v]
                missing = [w for w in coefficients if w not in values]
                if missing:
                    stack += missing
                    continue
                for w, c in coefficients.items():
                    total = graph.add(total, graph.mul(c, values[w]))
                values[v] = total
        return tuple(values[v] for v in unknowns)

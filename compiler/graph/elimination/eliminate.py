"""Solve affine residuals for their unknowns: try the variants, keep the one with the fewest operations.

The order in which unknowns are eliminated is found before anything is computed.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from functools import cached_property

from msgspec import Struct

from ..node import Graph, Node
from .dense import eliminate_dense
from .linear import Coefficients, LinearRows, linear_system
from .path_elimination import (
    NARROW,
    Attempt,
    NextDefinition,
    PathElimination,
    TooMuchWork,
    Variant,
    ZeroPivot,
)

__all__ = ["VARIANTS", "NextDefinition", "Elimination", "Variant", "ZeroPivot", "solve", "solve_dense"]

VARIANTS = (
    Variant(NextDefinition.LEAST_FILL, 6),
    Variant(NextDefinition.OLDEST, NARROW),
    Variant(NextDefinition.FEWEST_USERS, 6),
    Variant(NextDefinition.LEAST_FILL, NARROW),
    Variant(NextDefinition.OLDEST, 6),
    Variant(NextDefinition.FEWEST_USERS, NARROW),
)
"""No variant is best everywhere; each of them has linear cost for every tree tried."""

ALWAYS_TRIED = 3
"""Variants that are tried whatever they cost."""

TRIAL_NODES = 40_000
"""Nodes made by all variants together, after which no others are tried."""

COMPARED_HALF_WAY, COMPARED_AFTER = 80, 100
"""From so many unknowns on variants are compared where half of the unknowns are gone, or so many, and one goes on."""

DENSE = "dense elimination"
DENSE_LIMIT = 16
"""Above this many unknowns the dense elimination never was the cheaper one."""


class Elimination(Struct, frozen=True):
    """``solutions`` in the order of the unknowns; ``pivots[k]`` is that of unknown ``order[k]``, in ``rows[k]``.

    The solution holds wherever no pivot vanishes. Pivots of coordinates are positive, those of multipliers
    negative, as long as the mass matrix is positive definite and the constraints are independent; where a row
    is not the unknown's own, its matrix is indefinite or singular, and the pivot may vanish at some states.
    ``variant`` says in words what was chosen; ``operations`` counts those of the solutions with all they
    depend on.
    """

    solutions: tuple[Node, ...]
    pivots: tuple[Node, ...]
    order: tuple[int, ...]
    rows: tuple[int, ...]
    variant: str
    operations: int


def solve(
    graph: Graph,
    residuals: Sequence[Node],
    unknowns: Sequence[Node],
    *,
    rows: Sequence[int] | None = None,
    after: Mapping[int, Collection[int]] | None = None,
    variants: Sequence[Variant] = VARIANTS,
    dense: bool = True,
) -> Elimination:
    """Return the unknowns (symbols) that make all residuals zero.

    ``rows[i]`` is the residual to pivot on for unknown i (default: i); where its pivot is zero another one is
    taken. ``after[k]`` are the unknowns to eliminate before k; by default an unknown that does not occur in its own
    row, such as a multiplier, follows all unknowns of that row. ``dense`` adds Gaussian elimination to the
    ``variants`` for small systems; it is all that is tried where there are no variants.
    Raises ZeroPivot, NotAffine (linear.py), and ValueError where sizes or ``after`` make no sense.
    """
    rows = _check(residuals, unknowns, rows)
    system = linear_system(graph, residuals, unknowns)
    order = elimination_order(system, rows, after)
    half = min(len(unknowns) // 2, COMPARED_AFTER)
    count = len(unknowns) if len(unknowns) < COMPARED_HALF_WAY else half
    best: _Candidate | None = None
    made = tried = 0
    done: list[tuple[Variant, frozenset[int]]] = []
    considered = _variants(system, variants, dense)
    alone = len(considered) == 1
    for variant in considered:
        if tried >= ALWAYS_TRIED and made > TRIAL_NODES:
            break
        if variant and any(_same(variant, other, widths) for other, widths in done):
            continue
        tried += 1
        # what is much worse than the best one is not carried to its end
        limit = float("inf") if best is None else 3.0 * best.work + 1000.0
        fork = graph if alone else graph.fork()
        try:
            candidate = _try(fork, system, rows, order, variant, count, limit)
        except TooMuchWork:
            continue
        finally:
            made += len(fork) - len(graph)
        if isinstance(candidate.found, Attempt):
            done.append((candidate.found.variant, candidate.found.widths))
        if best is None or candidate.operations < best.operations:
            best = candidate
        del fork, candidate  # before another one is made
    if best is None:
        raise ValueError("no variant to try")
    if best.graph is not graph:
        graph.adopt(best.graph)
    if isinstance(best.found, PathElimination):
        return _elimination(best.found, DENSE, best.operations)
    found = best.found.solution()
    return _elimination(found, best.found.variant.name, graph.count_operations(found.unknowns))


class _Candidate(Struct, frozen=True, dict=True):
    """What one variant came to in ``graph``, with the formulas and the products that it made so far."""

    graph: Graph
    found: Attempt | PathElimination
    formulas: Sequence[Node]
    work: int

    @cached_property
    def operations(self) -> int:
        return self.graph.count_operations(self.formulas)


def _try(
    fork: Graph,
    system: LinearRows,
    rows: Sequence[int],
    order: Sequence[int],
    variant: Variant | None,
    count: int,
    limit: float,
) -> _Candidate:
    """Eliminate ``count`` unknowns in a fork; dense elimination goes to its end. Raises TooMuchWork."""
    if variant is None:
        found = eliminate_dense(fork, system, rows, order, limit)
        return _Candidate(fork, found, found.unknowns, found.work)
    attempt = Attempt(fork, system, rows, order, variant)
    attempt.advance(count, limit=limit)
    return _Candidate(fork, attempt, attempt.formulas(), attempt.work)


def solve_dense(
    graph: Graph, residuals: Sequence[Node], unknowns: Sequence[Node], *, rows: Sequence[int] | None = None
) -> Elimination:
    """Solve by Gaussian elimination on the matrix. Raises ZeroPivot, NotAffine and ValueError like ``solve``."""
    rows = _check(residuals, unknowns, rows)
    system = linear_system(graph, residuals, unknowns)
    order = elimination_order(system, rows, None)
    found = eliminate_dense(graph, system, rows, order)
    operations = graph.count_operations(found.unknowns)
    return _elimination(found, DENSE, operations)


def _same(variant: Variant, done: Variant, widths: frozenset[int]) -> bool:
    """Tell whether a variant repeats one in which sweeps would have changed rows and columns of these widths."""
    low, high = sorted((variant.frontier, done.frontier))
    return variant.choice is done.choice and not any(low < width <= high for width in widths)


def _elimination(found: PathElimination, variant: str, operations: int) -> Elimination:
    return Elimination(found.unknowns, found.pivots, found.order, found.rows, variant, operations)


def _variants(system: LinearRows, variants: Sequence[Variant], dense: bool) -> list[Variant | None]:
    """Return what to try; None stands for dense elimination."""
    found: list[Variant | None] = list(variants)
    if len(system.unknowns) > DENSE_LIMIT and all(len(row) <= 1 for row in system.rows.values()):
        return found[:1] or [None]  # no unknown feels another: there is nothing to choose
    if dense and (len(system.unknowns) <= DENSE_LIMIT or not found):
        found.insert(1, None)
    return found


def _check(residuals: Sequence[Node], unknowns: Sequence[Node], rows: Sequence[int] | None) -> list[int]:
    count = len(unknowns)
    if len(residuals) != count:
        raise ValueError(f"{len(residuals)} equations for {count} unknowns")
    if rows is None:
        return list(range(count))
    if sorted(rows) != list(range(count)):
        raise ValueError("every unknown needs a row of its own")
    return list(rows)


def elimination_order(
    system: LinearRows, rows: Sequence[int], after: Mapping[int, Collection[int]] | None
) -> list[int]:
    """Return the unknowns by height, the longest path from their row; multipliers after their coordinates.

    Of unknowns of equal height the one that is in fewer rows comes first: the outer one of a tree.
    ``rows[i]`` is the residual for unknown i. ``after[k]`` are the unknowns that must precede k; where it
    says nothing, an unknown that its own row does not contain comes after all unknowns in that row.
    Raises ValueError if ``after`` is cyclic.
    """
    count = len(system.unknowns)
    heights, reached = _heights(system)
    waiting = dict(after) if after is not None else {}
    for k, found in _absent(system, rows).items():
        # what waits for k comes after it
        waiting.setdefault(k, {i for i in found if k not in waiting.get(i, ())})
    keys = [(heights.get(v, 0), reached.get(v, 0).bit_count(), -i) for i, v in enumerate(system.unknowns)]
    ranked = sorted(range(count), key=keys.__getitem__)
    blocked = {k: set(s) for k, s in waiting.items() if s}
    order: list[int] = []
    ready = [i for i in ranked if i not in blocked]
    ready.reverse()
    followers: dict[int, list[int]] = {}
    for k in sorted(blocked):
        for i in blocked[k]:
            followers.setdefault(i, []).append(k)
    while ready:
        i = ready.pop()
        order.append(i)
        for k in reversed(followers.get(i, ())):
            blocked[k].discard(i)
            if not blocked[k]:
                ready.append(k)
    if len(order) < count:
        raise ValueError("unknowns wait for each other")
    return order


def _heights(system: LinearRows) -> tuple[dict[Node, int], dict[Node, int]]:
    """Return the longest path from each variable to a residual, and the residuals that each unknown reaches, as bits."""
    heights: dict[Node, int] = {}
    reached: dict[Node, int] = {}
    keys = sorted(system.rows, reverse=True)
    definitions = [k for k in keys if k >= 0]
    for k in (*(k for k in keys if k < 0), *definitions):
        above = heights.get(Node(k), 1) if k >= 0 else 0
        residuals = reached.pop(Node(k), 0) if k >= 0 else 1 << ~k
        for v in system.rows[k]:
            reached[v] = reached.get(v, 0) | residuals
            if heights.get(v, 0) <= above:
                heights[v] = above + 1
    return heights, reached


def _absent(system: LinearRows, rows: Sequence[int]) -> dict[int, set[int]]:
    """Return {k: unknowns in the row of k} for every unknown k that its own row does not reach."""
    bits = {v: 1 << i for i, v in enumerate(system.unknowns)}
    definitions = sorted(k for k in system.rows if k >= 0)
    last = {v: k for k in (*definitions, *(~row for row in rows)) for v in system.rows[k] if v in system.rows}
    found: dict[int, set[int]] = {}

    def union(k: int) -> int:
        """Return what a row reaches, and forget what it is the last one to read."""
        mask = _union(bits, system.rows[k])
        for v in system.rows[k]:
            if last.get(v) == k:
                del bits[v]
        return mask

    for k in definitions:
        bits[Node(k)] = union(k)
    for k, row in enumerate(rows):
        mask = union(~row)
        if not mask >> k & 1:
            found[k] = {i for i in range(len(rows)) if mask >> i & 1}
    return {k: {i for i in s if i not in found} for k, s in found.items()}


def _union(bits: Mapping[Node, int], row: Coefficients) -> int:
    mask = 0
    for v in row:
        mask |= bits[v]
    return mask

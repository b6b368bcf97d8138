"""The order in which unknowns are eliminated, found before anything is computed."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from ..node import Node
from .linear import Coefficients, LinearRows


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

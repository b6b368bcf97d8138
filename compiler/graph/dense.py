"""Gaussian elimination on the matrix itself, as straight-line code: cheaper than paths for small systems.

Entries that are zero are skipped, and a symmetric matrix costs what LDL^T costs: the upper and lower
triangle have equal values, so interning by value makes them the same nodes.
"""

from __future__ import annotations

from collections.abc import Sequence

from .linear import LinearSystem
from .node import Graph, Node
from .path import Solution, TooMuchWork, ZeroPivot


def eliminate_dense(
    graph: Graph, system: LinearSystem, rows: Sequence[int], order: Sequence[int], limit: float = float("inf")
) -> Solution:
    """Solve the system in the given order without pivoting; ``rows[i]`` is the residual for unknown i.

    Raises ZeroPivot, and TooMuchWork beyond ``limit`` products.
    """
    sub, mul, zero = graph.sub, graph.mul, graph.zero
    matrix, right = _expand(graph, system, limit)
    matrix = [matrix[row] for row in rows]
    right = [right[row] for row in rows]
    pivots: list[Node] = []
    work = 0
    for done, k in enumerate(order):
        pivot = matrix[k].get(k)
        if pivot is None:
            raise ZeroPivot(k, tuple(order[done:]))
        pivots.append(pivot)
        inverse = graph.div(graph.one, pivot)
        later = order[done + 1 :]
        pivot_row = [(j, c) for j in later if (c := matrix[k].get(j)) is not None]
        for i in later:
            entry = matrix[i].pop(k, None)
            if entry is None:
                continue
            factor = mul(entry, inverse)
            work += len(pivot_row) + 1
            if work > limit:
                raise TooMuchWork
            for j, c in pivot_row:
                reduced = sub(matrix[i].get(j, zero), mul(factor, c))
                if reduced == zero:
                    matrix[i].pop(j, None)
                else:
                    matrix[i][j] = reduced
            right[i] = sub(right[i], mul(factor, right[k]))
    values: dict[int, Node] = {}
    for k in reversed(order):
        total = right[k]
        for j, c in matrix[k].items():
            if j in values:
                total = sub(total, mul(c, values[j]))
        values[k] = mul(total, graph.div(graph.one, matrix[k][k]))
    return Solution(tuple(values[i] for i in range(len(order))), tuple(pivots), work, len(order))


def _expand(graph: Graph, system: LinearSystem, limit: float) -> tuple[list[dict[int, Node]], list[Node]]:
    """Return the matrix A (rows as {column: entry}) and b of A x = b, with all definitions put in."""
    add, mul, zero = graph.add, graph.mul, graph.zero
    expanded: dict[Node, tuple[dict[int, Node], Node]] = {
        v: ({i: graph.one}, zero) for i, v in enumerate(system.unknowns)
    }
    work = 0

    def expand(k: int) -> tuple[dict[int, Node], Node]:
        nonlocal work
        total: dict[int, Node] = {}
        offset = system.offsets[k]
        for v, c in system.rows[k].items():
            inner, inner_offset = expanded[v]
            work += len(inner)
            for j, d in inner.items():
                total[j] = add(total.get(j, zero), mul(c, d))
            offset = add(offset, mul(c, inner_offset))
        if work > limit:
            raise TooMuchWork
        return {j: c for j, c in total.items() if c != zero}, offset

    for k in sorted(k for k in system.rows if k >= 0):
        expanded[Node(k)] = expand(k)
    matrix: list[dict[int, Node]] = []
    right: list[Node] = []
    for i in range(len(system.unknowns)):
        row, offset = expand(~i)
        matrix.append(row)
        right.append(graph.neg(offset))
    return matrix, right

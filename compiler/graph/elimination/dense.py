"""Gaussian elimination on the matrix itself, as straight-line code: cheaper than paths for small systems.

Entries that are zero are skipped, and a symmetric matrix costs what LDL^T costs: the upper and lower
triangle have equal values, so interning by value makes them the same nodes.
"""

from __future__ import annotations

from collections.abc import Sequence

from ..node import Graph, Node
from .linear import LinearRows
from .path_elimination import PathElimination, TooMuchWork, ZeroPivot


def eliminate_dense(
    graph: Graph, system: LinearRows, rows: Sequence[int], order: Sequence[int], limit: float = float("inf")
) -> PathElimination:
    """Solve the system; order, rows and what happens at zero pivots as for ``path.eliminate``.

    Raises ZeroPivot, and TooMuchWork beyond ``limit`` products.
    """
    sub, mul, zero = graph.sub, graph.mul, graph.zero
    matrix, right = _expand(graph, system, limit)
    matrix = [matrix[row] for row in rows]
    right = [right[row] for row in rows]
    row_of = {i: i for i in order}
    pending = list(order)
    done: list[int] = []
    pivots: list[Node] = []
    work = 0
    while pending:
        k = _next_pivot(matrix, row_of, pending)
        pending.remove(k)
        done.append(k)
        pivot_row = matrix[row_of[k]]
        pivots.append(pivot_row[k])
        inverse = graph.div(graph.one, pivot_row[k])
        entries = [(j, c) for j in pending if (c := pivot_row.get(j)) is not None]
        for i in pending:
            row = matrix[row_of[i]]
            entry = row.pop(k, None)
            if entry is None:
                continue
            factor = mul(entry, inverse)
            work += len(entries) + 1
            if work > limit:
                raise TooMuchWork
            for j, c in entries:
                reduced = sub(row.get(j, zero), mul(factor, c))
                if reduced == zero:
                    row.pop(j, None)
                else:
                    row[j] = reduced
            right[row_of[i]] = sub(right[row_of[i]], mul(factor, right[row_of[k]]))
    values: dict[int, Node] = {}
    for k in reversed(done):
        total = right[row_of[k]]
        for j, c in matrix[row_of[k]].items():
            if j in values:
                total = sub(total, mul(c, values[j]))
        values[k] = mul(total, graph.div(graph.one, matrix[row_of[k]][k]))
    unknowns = tuple(values[i] for i in range(len(order)))
    paired = tuple(rows[row_of[i]] for i in done)
    return PathElimination(unknowns, tuple(pivots), tuple(done), paired, work)


def _next_pivot(matrix: list[dict[int, Node]], row_of: dict[int, int], pending: list[int]) -> int:
    """Return the next unknown with a pivot in its row, after an exchange of rows if there is no other way."""
    for k in pending:
        if k in matrix[row_of[k]]:
            return k
    for k in pending:
        for j in pending:
            if k in matrix[row_of[j]]:
                row_of[k], row_of[j] = row_of[j], row_of[k]
                return k
    raise ZeroPivot(pending[0], tuple(pending))


def _expand(graph: Graph, system: LinearRows, limit: float) -> tuple[list[dict[int, Node]], list[Node]]:
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

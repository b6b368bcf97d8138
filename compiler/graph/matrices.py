"""Determinants, inverses, systems of equations and eigenvalues of matrices of nodes, as formulas.

Columns are made orthogonal one by one, the right sides with them (modified Gram-Schmidt, without square roots). That is
stable in the sense of backward errors (A. Bjorck 1967; N. Higham, Accuracy and Stability of Numerical Algorithms, 2nd
ed., section 20.3), which cofactors are not: of 3 rows with the condition 1e6 they leave a residual of 1e-9. And it needs no
exchange of rows, whose comparisons would be surfaces where runs stop. It divides only by what is zero where the
matrix is singular. Zeros that are known vanish on the way.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from itertools import combinations

from .node import Graph, Node
from .vector import Matrix, Vector, identity, transpose


def determinant(graph: Graph, a: Matrix) -> Node:
    """Return the determinant by rows, a minor for each set of columns: n 2^(n-1) products, and no division."""

    @cache
    def minor(row: int, columns: tuple[int, ...]) -> Node:
        if not columns:
            return graph.one
        total = graph.zero
        for k, column in enumerate(columns):
            entry = a[row][column]
            if entry == graph.zero:
                continue
            term = graph.mul(entry, minor(row + 1, columns[:k] + columns[k + 1 :]))
            total = graph.sub(total, term) if k % 2 else graph.add(total, term)
        return total

    return minor(0, tuple(range(len(a))))


def inverse(graph: Graph, a: Matrix) -> Matrix:
    """Return the inverse. Raises DivisionByZero where the matrix is singular whatever the values."""
    return transpose(tuple(solve(graph, a, identity(graph, len(a)))))


def solve(graph: Graph, a: Matrix, right: Sequence[Vector]) -> list[Vector]:
    """Return x with a x = b for each b of ``right``. Raises DivisionByZero as ``inverse`` does."""
    columns, sides = list(transpose(a)), list(right)
    upper: list[list[Node]] = []
    found: list[list[Node]] = [[] for _ in sides]
    for k, column in enumerate(columns):
        length = graph.div(graph.one, graph.dot(column, column))
        shares = [_removed(graph, column, length, columns, j) for j in range(k + 1, len(a))]
        upper.append(shares)
        for j in range(len(sides)):
            found[j].append(_removed(graph, column, length, sides, j))
    for values in found:
        for k in reversed(range(len(a))):
            for j, share in enumerate(upper[k], k + 1):
                values[k] = graph.sub(values[k], graph.mul(share, values[j]))
    return [tuple(values) for values in found]


def _removed(graph: Graph, column: Vector, length: Node, others: list[Vector], j: int) -> Node:
    """Take its part along a column from another one, and return how much of it that was."""
    share = graph.mul(graph.dot(column, others[j]), length)
    if share != graph.zero:
        others[j] = tuple(graph.sub(x, graph.mul(share, y)) for x, y in zip(others[j], column, strict=True))
    return share


SWEEPS = 8
"""Of rotations through all elements beside the diagonal: from then on those of 8 rows are rounding errors."""


def eigenvalues(graph: Graph, a: Matrix) -> Vector:
    """Return the eigenvalues of a symmetric matrix, the smallest first: by Jacobi's rotations, each of which makes an
    element vanish."""
    n, zero = len(a), graph.zero
    rows = [list(row) for row in a]
    for p, q in [pair for _ in range(SWEEPS) for pair in combinations(range(n), 2)]:
        beside = rows[p][q]
        if beside == zero:
            continue
        twice = graph.mul(graph.two, beside)
        angle = graph.mul(graph.half, graph.atan2(twice, graph.sub(rows[p][p], rows[q][q])))
        c, s = graph.cos(angle), graph.sin(angle)
        cc, ss, both = graph.mul(c, c), graph.mul(s, s), graph.mul(graph.mul(c, s), twice)
        first, last = rows[p][p], rows[q][q]
        rows[p][p] = graph.sum((graph.mul(cc, first), both, graph.mul(ss, last)))
        rows[q][q] = graph.sum((graph.mul(ss, first), graph.neg(both), graph.mul(cc, last)))
        rows[p][q] = rows[q][p] = zero
        for k in range(n):
            if k not in (p, q):
                x, y = rows[k][p], rows[k][q]
                rows[k][p] = rows[p][k] = graph.add(graph.mul(c, x), graph.mul(s, y))
                rows[k][q] = rows[q][k] = graph.sub(graph.mul(c, y), graph.mul(s, x))
    found = [rows[k][k] for k in range(n)]
    for end in range(n - 1, 0, -1):
        for k in range(end):
            found[k], found[k + 1] = (
                graph.minimum(found[k], found[k + 1]),
                graph.maximum(found[k], found[k + 1]),
            )
    return tuple(found)

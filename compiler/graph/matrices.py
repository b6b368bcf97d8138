"""Determinants, inverses and systems of equations of matrices of nodes, as formulas without choices.

Columns are made orthogonal one by one, the right sides with them (modified Gram-Schmidt, without square roots). That is
stable in the sense of backward errors (A. Bjorck 1967; N. Higham, Accuracy and Stability of Numerical Algorithms, 2nd
ed., section 20.3), which cofactors are not: of 3 rows with the condition 1e6 they leave a residual of 1e-9. And it needs no
exchange of rows, whose comparisons would be surfaces where runs stop. It divides only by what is zero where the
matrix is singular. Zeros that are known vanish on the way.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

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

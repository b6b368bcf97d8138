"""Vectors and 3x3 matrices of nodes. Structural zeros vanish in the constructors of the graph."""

from __future__ import annotations

from collections.abc import Sequence

from .node import Graph, Node

Vector = tuple[Node, ...]
"""Two or three components."""
Matrix = tuple[Vector, ...]
"""Three rows of three."""


def unit_vector(graph: Graph, axis: int, size: int = 3) -> Vector:
    return tuple(graph.one if i == axis else graph.zero for i in range(size))


def add(graph: Graph, a: Sequence[Node], b: Sequence[Node]) -> Vector:
    return tuple(graph.add(x, y) for x, y in zip(a, b, strict=True))


def subtract(graph: Graph, a: Sequence[Node], b: Sequence[Node]) -> Vector:
    return tuple(graph.sub(x, y) for x, y in zip(a, b, strict=True))


def negate(graph: Graph, a: Sequence[Node]) -> Vector:
    return tuple(graph.neg(x) for x in a)


def scale(graph: Graph, factor: Node, a: Sequence[Node]) -> Vector:
    return tuple(graph.mul(factor, x) for x in a)


def dot(graph: Graph, a: Sequence[Node], b: Sequence[Node]) -> Node:
    return graph.dot(a, b)


def norm(graph: Graph, a: Sequence[Node]) -> Node:
    return graph.sqrt(graph.dot(a, a))


def cross(graph: Graph, a: Sequence[Node], b: Sequence[Node]) -> Vector:
    """Return the vector product in space."""
    (ax, ay, az), (bx, by, bz) = a, b
    mul, sub = graph.mul, graph.sub
    return (
        sub(mul(ay, bz), mul(az, by)),
        sub(mul(az, bx), mul(ax, bz)),
        sub(mul(ax, by), mul(ay, bx)),
    )


def cross_planar(graph: Graph, a: Sequence[Node], b: Sequence[Node]) -> Node:
    """Return the vector product in the plane, a number."""
    return graph.sub(graph.mul(a[0], b[1]), graph.mul(a[1], b[0]))


def matvec(graph: Graph, m: Matrix, v: Sequence[Node]) -> Vector:
    return tuple(graph.dot(row, v) for row in m)


def transpose_matvec(graph: Graph, m: Matrix, v: Sequence[Node]) -> Vector:
    return tuple(graph.dot(column, v) for column in transpose(m))


def matmul(graph: Graph, a: Matrix, b: Matrix) -> Matrix:
    columns = transpose(b)
    return tuple(tuple(graph.dot(row, column) for column in columns) for row in a)


def transpose(m: Matrix) -> Matrix:
    return tuple(zip(*m, strict=True))


def identity(graph: Graph, size: int = 3) -> Matrix:
    return tuple(unit_vector(graph, i, size) for i in range(size))


def skew(graph: Graph, a: Sequence[Node]) -> Matrix:
    """Return the matrix of the vector product with ``a`` on the left."""
    x, y, z = a
    zero, neg = graph.zero, graph.neg
    return ((zero, neg(z), y), (z, zero, neg(x)), (neg(y), x, zero))


def axis_rotation(graph: Graph, axis: int, angle: Node) -> Matrix:
    """Return the rotation about coordinate axis 0, 1 or 2: components in the turned axes to those in the old ones."""
    c, s = graph.cos(angle), graph.sin(angle)
    n, one, zero = graph.neg(s), graph.one, graph.zero
    match axis:
        case 0:
            return ((one, zero, zero), (zero, c, n), (zero, s, c))
        case 1:
            return ((c, zero, s), (zero, one, zero), (n, zero, c))
        case 2:
            return ((c, n, zero), (s, c, zero), (zero, zero, one))
        case _:
            raise ValueError(f"axis {axis}")


def rotation_about(graph: Graph, axis: Sequence[Node], angle: Node) -> Matrix:
    """Return the rotation about a unit vector (Rodrigues): c I + s [n] + (1 - c) n n^T."""
    c, s = graph.cos(angle), graph.sin(angle)
    rest = graph.sub(graph.one, c)
    turned = skew(graph, axis)
    return tuple(
        tuple(
            graph.sum(
                (
                    c if i == j else graph.zero,
                    graph.mul(s, turned[i][j]),
                    graph.mul(rest, graph.mul(axis[i], axis[j])),
                )
            )
            for j in range(3)
        )
        for i in range(3)
    )


def quaternion_rotation(graph: Graph, q: Sequence[Node]) -> Matrix:
    """Return the rotation of a unit quaternion, scalar part first."""
    w, x, y, z = q
    add, sub, mul, two = graph.add, graph.sub, graph.mul, graph.two

    def diagonal(a: Node, b: Node) -> Node:
        return sub(graph.one, mul(two, add(mul(a, a), mul(b, b))))

    def plus(a: Node, b: Node, c: Node) -> Node:
        return mul(two, add(mul(a, b), mul(w, c)))

    def minus(a: Node, b: Node, c: Node) -> Node:
        return mul(two, sub(mul(a, b), mul(w, c)))

    return (
        (diagonal(y, z), minus(x, y, z), plus(x, z, y)),
        (plus(x, y, z), diagonal(x, z), minus(y, z, x)),
        (minus(x, z, y), plus(y, z, x), diagonal(x, y)),
    )


def quaternion_rate(graph: Graph, q: Sequence[Node], spin: Sequence[Node]) -> Vector:
    """Return dq/dt = 1/2 q (0, spin) of a quaternion, ``spin`` in the axes of the body."""
    w, x, y, z = q
    a, b, c = spin
    neg, half = graph.neg, graph.half
    rates = (
        neg(graph.dot((x, y, z), spin)),
        graph.dot((w, y, neg(z)), (a, c, b)),
        graph.dot((w, z, neg(x)), (b, a, c)),
        graph.dot((w, x, neg(y)), (c, b, a)),
    )
    return scale(graph, half, rates)

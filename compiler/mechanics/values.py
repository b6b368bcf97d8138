"""What an expression lowers to: nodes, nested tuples of nodes, poses, frames, points; and arithmetic on them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import cast

from ..graph import Graph, Node
from .frames import Frame, Kinematics, Point, displaced
from .pose import Pose, Rotate, Translate, Turn, join

Value = object
"""Node (an int), tuple of values, ``Oriented`` pose, ``Frame``, ``Point`` or str."""


class Placement(tuple[object, ...]):
    """A pose as a value: a tuple of steps, told apart from a tuple of nodes by its class."""

    __slots__ = ()

    @property
    def pose(self) -> Pose:
        return cast(Pose, tuple(self))


def node(value: Value) -> Node:
    """Return a scalar value as a node."""
    assert isinstance(value, int), value
    return cast(Node, value)


def elements(value: Value) -> Iterator[Node]:
    """Yield the numbers of a value in row-major order."""
    if isinstance(value, int):
        yield cast(Node, value)
        return
    assert isinstance(value, tuple) and not isinstance(value, Placement), value
    for item in value:
        yield from elements(item)


def vector(value: Value) -> tuple[Node, ...]:
    """Return a one-dimensional value as a tuple of nodes."""
    assert isinstance(value, tuple) and not isinstance(value, Placement), value
    return tuple(node(x) for x in value)


def filled(shape: tuple[int, ...], item: Callable[[tuple[int, ...]], Node]) -> Value:
    """Return a value of ``shape`` whose entries are ``item(indices)``."""

    def part(prefix: tuple[int, ...]) -> Value:
        if len(prefix) == len(shape):
            return item(prefix)
        return tuple(part((*prefix, i)) for i in range(shape[len(prefix)]))

    return part(())


def broadcast(value: Value, shape: tuple[int, ...]) -> Value:
    """Return ``value`` in ``shape``; a scalar fills it."""
    if shape and isinstance(value, int):
        return filled(shape, lambda _: cast(Node, value))
    return value


def each(function: Callable[..., Node], *values: Value) -> Value:
    """Apply a scalar function entry by entry; scalars stand for all entries."""
    tuples = [v for v in values if isinstance(v, tuple)]
    if not tuples:
        return function(*values)
    count = len(tuples[0])
    return tuple(each(function, *(v[i] if isinstance(v, tuple) else v for v in values)) for i in range(count))


def multiply(kinematics: Kinematics, a: Value, b: Value) -> Value:
    """Return the product in the sense of the language: numbers, arrays, matrices, poses, frames, points."""
    graph = kinematics.graph
    match a, b:
        case Frame(), Placement():
            return displaced(graph, a, b.pose)
        case Placement(), Placement():
            return Placement(join(graph, a.pose, b.pose))
        case Frame(), tuple():
            return Point(a, vector(b))
        case Placement(), tuple():
            return _displaced_vector(kinematics, a.pose, vector(b))
        case int(), _:
            return each(graph.mul, a, b)
        case _, int():
            return each(graph.mul, a, b)
        case tuple(), tuple():
            return _matrix_product(graph, a, b)
    raise AssertionError((a, b))


def _displaced_vector(kinematics: Kinematics, pose: Pose, offset: tuple[Node, ...]) -> Value:
    root = kinematics.world
    return kinematics.position(Point(displaced(kinematics.graph, root, pose), offset))


def _matrix_product(graph: Graph, a: tuple[Value, ...], b: tuple[Value, ...]) -> Value:
    if isinstance(b[0], int):
        return tuple(graph.dot(vector(row), vector(b)) for row in a)
    columns = tuple(zip(*(vector(row) for row in b), strict=True))
    return tuple(tuple(graph.dot(vector(row), column) for column in columns) for row in a)


def quaternion_of(graph: Graph, pose: Pose) -> tuple[Node, ...]:
    """Return the unit quaternion (scalar first) of a pose made of rotations."""
    result: tuple[Node, ...] = tuple(graph.constant(x) for x in (1, 0, 0, 0))
    for step in pose:
        match step:
            case Rotate(axis, angle):
                half = graph.mul(graph.half, angle)
                s, zero = graph.sin(half), graph.constant(0)
                factor = (graph.cos(half), *(s if k == axis else zero for k in range(3)))
            case Turn(matrix, _):
                factor = _matrix_quaternion(graph, matrix)
            case Translate():
                raise AssertionError("a translation in a rotation")
        result = quaternion_product(graph, result, factor)
    return result


def quaternion_product(graph: Graph, p: tuple[Node, ...], q: tuple[Node, ...]) -> tuple[Node, ...]:
    """Return the Hamilton product of two quaternions, scalar first."""
    table = (
        ((1, 0, 0), (-1, 1, 1), (-1, 2, 2), (-1, 3, 3)),
        ((1, 0, 1), (1, 1, 0), (1, 2, 3), (-1, 3, 2)),
        ((1, 0, 2), (1, 2, 0), (1, 3, 1), (-1, 1, 3)),
        ((1, 0, 3), (1, 3, 0), (1, 1, 2), (-1, 2, 1)),
    )
    return tuple(
        graph.sum(
            graph.mul(p[i], q[j]) if sign > 0 else graph.neg(graph.mul(p[i], q[j])) for sign, i, j in row
        )
        for row in table
    )


def _matrix_quaternion(graph: Graph, matrix: tuple[tuple[Node, ...], ...]) -> tuple[Node, ...]:
    """Return the quaternion of a matrix by its largest component (Shepperd 1978), scalar first."""
    mul, add, sub = graph.mul, graph.add, graph.sub
    m = matrix
    one, half = graph.constant(1), graph.half
    trace = graph.sum((m[0][0], m[1][1], m[2][2]))

    def case(k: int) -> tuple[Node, ...]:
        if k == 0:
            size = graph.sqrt(add(one, trace))
            f = graph.div(half, size)
            return (
                mul(half, size),
                mul(f, sub(m[2][1], m[1][2])),
                mul(f, sub(m[0][2], m[2][0])),
                mul(f, sub(m[1][0], m[0][1])),
            )
        i, j, l = k - 1, k % 3, (k + 1) % 3
        size = graph.sqrt(add(one, sub(sub(m[i][i], m[j][j]), m[l][l])))
        f = graph.div(half, size)
        parts = {
            0: mul(f, sub(m[l][j], m[j][l])),
            i + 1: mul(half, size),
            j + 1: mul(f, add(m[i][j], m[j][i])),
            l + 1: mul(f, add(m[i][l], m[l][i])),
        }
        return tuple(parts[n] for n in range(4))

    largest = [trace, m[0][0], m[1][1], m[2][2]]
    result = case(3)
    for k in (2, 1, 0):
        best = one
        for other in range(4):
            if other != k:
                best = graph.logical_and(best, graph.less_equal(largest[other], largest[k]))
        result = tuple(graph.select(best, a, b) for a, b in zip(case(k), result, strict=True))
    return result

"""What an expression lowers to: nodes, nested tuples of nodes, poses, frames, points; and arithmetic on them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import repeat

from msgspec import Struct

from ...graph import Graph, Node
from ..kinematics.frames import Frame, FrameKinematics, Point, displaced
from ..kinematics.pose import Pose, join


class Placement(Struct, frozen=True):
    """A pose as a value, told apart from a tuple of values by its class."""

    pose: Pose


Value = Node | tuple["Value", ...] | Placement | Frame | Point | str
"""What an expression is worth; an array is a tuple of its elements along the first dimension."""


def node(value: Value) -> Node:
    """Return a scalar value as a node."""
    assert isinstance(value, int), value
    return value


def elements(value: Value) -> Iterator[Node]:
    """Yield the numbers of a value in row-major order."""
    if isinstance(value, int):
        yield value
        return
    assert isinstance(value, tuple), value
    for item in value:
        yield from elements(item)


def vector(value: Value) -> tuple[Node, ...]:
    """Return a one-dimensional value as a tuple of nodes."""
    assert isinstance(value, tuple), value
    return tuple(node(x) for x in value)


def filled(shape: tuple[int, ...], item: Callable[[tuple[int, ...]], Node]) -> Value:
    """Return a value of ``shape`` whose entries are ``item(indices)``."""
    return _filled(shape, item, ())


def _filled(
    shape: tuple[int, ...], item: Callable[[tuple[int, ...]], Node], prefix: tuple[int, ...]
) -> Value:
    if len(prefix) == len(shape):
        return item(prefix)
    return tuple([_filled(shape, item, (*prefix, i)) for i in range(shape[len(prefix)])])


def each(function: Callable[..., Node], *values: Value) -> Value:
    """Apply a scalar function entry by entry; scalars stand for all entries."""
    if True not in [isinstance(v, tuple) for v in values]:
        return function(*values)
    columns = [v if isinstance(v, tuple) else repeat(v) for v in values]
    return tuple([each(function, *entries) for entries in zip(*columns, strict=False)])


def multiply(kinematics: FrameKinematics, a: Value, b: Value) -> Value:
    """Return the product in the sense of the language: numbers, arrays, matrices, poses, frames, points."""
    graph = kinematics.graph
    if isinstance(a, int) and isinstance(b, int):
        return graph.mul(a, b)
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


def _displaced_vector(kinematics: FrameKinematics, pose: Pose, offset: tuple[Node, ...]) -> Value:
    root = kinematics.world
    return kinematics.position(Point(displaced(kinematics.graph, root, pose), offset))


def _matrix_product(graph: Graph, a: tuple[Value, ...], b: tuple[Value, ...]) -> Value:
    if isinstance(b[0], int):
        return tuple(graph.dot(vector(row), vector(b)) for row in a)
    columns = tuple(zip(*(vector(row) for row in b), strict=True))
    return tuple(tuple(graph.dot(vector(row), column) for column in columns) for row in a)

"""Unit quaternions of rotations, scalar part first."""

from __future__ import annotations

from ...flat.model import StartValue
from ...graph import Graph, Node
from ..kinematics.pose import Pose, Rotate, Translate, Turn
from .lower import Lowering
from .values import Placement, elements


def rotation_quaternion(graph: Graph, lowering: Lowering, start: StartValue) -> tuple[Node, ...]:
    """Return the unit quaternion of a rotation given as a pose, or as four numbers (normalised)."""
    value = lowering.value(start.value)
    if isinstance(value, Placement):
        return quaternion_of(graph, value.pose)
    q = tuple(elements(value))
    square = graph.constant(0)
    for x in q:
        square = graph.add(square, graph.mul(x, x))
    size = graph.sqrt(square)
    return tuple(graph.div(x, size) for x in q)


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
                factor = _of_matrix(graph, matrix)
            case Translate():
                raise AssertionError("a translation in a rotation")
        result = _product(graph, result, factor)
    return result


def _product(graph: Graph, p: tuple[Node, ...], q: tuple[Node, ...]) -> tuple[Node, ...]:
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


def _of_matrix(graph: Graph, matrix: tuple[tuple[Node, ...], ...]) -> tuple[Node, ...]:
    """Return the quaternion of a matrix by its largest component (Shepperd 1978), scalar first; one that is always zero is
    never the largest."""
    mul, add, sub = graph.mul, graph.add, graph.sub
    m = matrix
    one, half = graph.constant(1), graph.half
    trace = graph.sum((m[0][0], m[1][1], m[2][2]))

    def case(k: int) -> tuple[Node, ...] | None:
        if k == 0:
            size = graph.sqrt(add(one, trace))
            if graph.is_zero(size):
                return None
            f = graph.div(half, size)
            return (
                mul(half, size),
                mul(f, sub(m[2][1], m[1][2])),
                mul(f, sub(m[0][2], m[2][0])),
                mul(f, sub(m[1][0], m[0][1])),
            )
        i, j, l = k - 1, k % 3, (k + 1) % 3
        size = graph.sqrt(add(one, sub(sub(m[i][i], m[j][j]), m[l][l])))
        if graph.is_zero(size):
            return None
        f = graph.div(half, size)
        parts = {
            0: mul(f, sub(m[l][j], m[j][l])),
            i + 1: mul(half, size),
            j + 1: mul(f, add(m[i][j], m[j][i])),
            l + 1: mul(f, add(m[i][l], m[l][i])),
        }
        return tuple(parts[n] for n in range(4))

    largest = [trace, m[0][0], m[1][1], m[2][2]]
    cases = {k: found for k in (3, 2, 1, 0) if (found := case(k)) is not None}
    first, result = next(iter(cases.items()))
    for k in [k for k in cases if k != first]:
        best = one
        for other in range(4):
            if other != k:
                best = graph.logical_and(best, graph.less_equal(largest[other], largest[k]))
        result = tuple(graph.select(best, a, b) for a, b in zip(cases[k], result, strict=True))
    return result

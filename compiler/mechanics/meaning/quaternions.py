"""Unit quaternions of rotations, scalar part first."""

from __future__ import annotations

from ...flat.model import Expression
from ...graph import Graph, Node
from ..kinematics.pose import Pose, Rotate, Translate, Turn
from .lower import Lowering
from .values import Placement, elements


def rotation_quaternion(graph: Graph, lowering: Lowering, given: Expression) -> tuple[Node, ...]:
    """Return the unit quaternion of a rotation given as a pose, or as four numbers (normalised)."""
    value = lowering.value(given)
    if isinstance(value, Placement):
        if any(isinstance(step, Translate) for step in value.pose):
            raise lowering.reporter.fail(
                "E0303",
                "a rotation displaces nothing",
                given.span,
                caption="this pose contains a 'trans'",
                help="a joint such as 'Free' has a position beside its orientation",
            )
        return _quaternion_of(graph, value.pose)
    q = tuple(elements(value))
    square = graph.constant(0)
    for x in q:
        square = graph.add(square, graph.mul(x, x))
    size = graph.sqrt(square)
    return tuple(graph.div(x, size) for x in q)


def _quaternion_of(graph: Graph, pose: Pose) -> tuple[Node, ...]:
    """Return the unit quaternion (scalar first) of a pose made of rotations."""
    result: tuple[Node, ...] = tuple(graph.constant(x) for x in (1, 0, 0, 0))
    for step in pose:
        match step:
            case Rotate(axis, angle):
                half = graph.mul(graph.half, angle)
                s, zero = graph.sin(half), graph.constant(0)
                factor = (graph.cos(half), *(s if k == axis else zero for k in range(3)))
            case Turn(quaternion=q):
                assert q is not None, "a rotation of which only the matrix is known"
                factor = q
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

"""Rigid displacements as sequences of elementary steps, in the plane and in space.

A pose is kept as steps, not as a matrix: consecutive rotations about one axis add their angles before sine and
cosine are taken, translations add, and velocities follow step by step in the moving axes.
"""

from __future__ import annotations

from msgspec import Struct

from ...graph import Graph, Node
from ...graph.vector import Matrix, Vector, add, axis_rotation, matvec, negate, transpose


class Translate(Struct, frozen=True):
    """Move the origin by ``offset`` (components in the axes reached so far)."""

    offset: Vector


class Rotate(Struct, frozen=True):
    """Turn about coordinate axis 0, 1 or 2 (in the plane: 2) by ``angle``."""

    axis: int
    angle: Node


class Turn(Struct, frozen=True):
    """A general rotation: ``matrix`` maps new components to old ones, ``rate`` is the angular velocity of the
    new axes relative to the old ones, in new components; None for a constant rotation. ``quaternion``: the unit quaternion of the
    matrix, scalar part first, where it is known."""

    matrix: Matrix
    rate: Vector | None
    quaternion: Vector | None = None


Step = Translate | Rotate | Turn
Pose = tuple[Step, ...]


def numbers_of(step: Step) -> list[Node]:
    """Return the numbers of a step."""
    match step:
        case Translate(offset):
            return list(offset)
        case Rotate(_, angle):
            return [angle]
        case Turn(matrix, rate):
            return [*(x for row in matrix for x in row), *(rate or ())]


def join(graph: Graph, first: Pose, second: Pose) -> Pose:
    """Return the product of two poses, merging steps of the same kind where they meet."""
    steps = list(first)
    for step in second:
        last = steps[-1] if steps else None
        if isinstance(step, Translate) and isinstance(last, Translate):
            steps[-1] = Translate(add(graph, last.offset, step.offset))
        elif isinstance(step, Rotate) and isinstance(last, Rotate) and step.axis == last.axis:
            steps[-1] = Rotate(step.axis, graph.add(last.angle, step.angle))
        else:
            steps.append(step)
    return tuple(steps)


def inverse(graph: Graph, pose: Pose) -> Pose:
    """Return the displacement that undoes ``pose``."""
    steps: list[Step] = []
    for step in reversed(pose):
        match step:
            case Translate(offset):
                steps.append(Translate(negate(graph, offset)))
            case Rotate(axis, angle):
                steps.append(Rotate(axis, graph.neg(angle)))
            case Turn(matrix, rate):
                back = None if rate is None else negate(graph, matvec(graph, matrix, rate))
                steps.append(Turn(transpose(matrix), back))
    return tuple(steps)


def rotation_of(graph: Graph, step: Rotate | Turn) -> Matrix:
    """Return the 3x3 matrix that maps components in the new axes to the old ones."""
    match step:
        case Rotate(axis, angle):
            return axis_rotation(graph, axis, angle)
        case Turn(matrix, _):
            return matrix

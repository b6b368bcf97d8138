"""Rigid bodies: which masses and inertias move as one, their mass centre and inertia tensor."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

from ..graph import Graph, Node
from ..graph.vector import Matrix, Vector, add, scale, subtract
from .kinematics.frames import Frame, FrameKinematics
from .kinematics.pose import Rotate, Step, Translate
from .kinematics.reactions import only_virtual
from .system import PointMass, RotaryInertia


class Massive(Protocol):
    """What has mass in a system; ``rate`` is the total time derivative."""

    @property
    def graph(self) -> Graph: ...
    @property
    def rate(self) -> Callable[[Node], Node]: ...
    @property
    def kinematics(self) -> FrameKinematics: ...
    @property
    def masses(self) -> tuple[PointMass, ...]: ...
    @property
    def inertias(self) -> tuple[RotaryInertia, ...]: ...


def carrier(system: Massive, frame: Frame) -> Frame:
    """Return the frame nearest to the root to which ``frame`` is rigidly attached."""
    at = frame
    while at.step is not None and at.parent is not None and _rigid(system, at.step):
        at = at.parent
    return at


def _rigid(system: Massive, step: Step) -> bool:
    match step:
        case Translate(offset):
            parts: Sequence[Node] = offset
        case Rotate(_, angle):
            parts = (angle,)
        case _:
            parts = step.rate or ()
            return all(only_virtual(system.graph, x) for x in parts)
    return all(only_virtual(system.graph, system.rate(x)) for x in parts)


def masses_of(system: Massive, frame: Frame | None) -> list[PointMass]:
    """Return the masses of the rigid body of a frame, or all masses."""
    if frame is None:
        return list(system.masses)
    body = carrier(system, frame)
    return [m for m in system.masses if carrier(system, m.point.frame) is body]


def mass_centre(system: Massive, frame: Frame | None) -> Vector | None:
    """Return the mass centre in world components; None where there is no mass."""
    graph, kinematics = system.graph, system.kinematics
    masses = masses_of(system, frame)
    if not masses:
        return None
    total = graph.sum(m.mass for m in masses)
    moment: Vector = (graph.zero,) * kinematics.size
    for m in masses:
        moment = add(graph, moment, scale(graph, m.mass, kinematics.position(m.point)))
    return tuple(graph.div(x, total) for x in moment)


def inertia_tensor(system: Massive, frame: Frame) -> Matrix | None:
    """Return the inertia of the rigid body of a frame about its mass centre, in the axes of the frame.

    1x1 in the plane; parallel axes by Steiner: J + sum m (r.r 1 - r r^T).
    """
    graph, kinematics = system.graph, system.kinematics
    centre = mass_centre(system, frame)
    if centre is None:
        return None
    body, size = carrier(system, frame), kinematics.size
    count = 1 if size == 2 else 3
    total = [[graph.zero] * count for _ in range(count)]
    for part in system.inertias:
        if carrier(system, part.frame) is not body:
            continue
        turned = part.inertia if size == 2 else _turned(system, part.frame, frame, part.inertia)
        total = [
            [graph.add(a, b) for a, b in zip(r, s, strict=True)] for r, s in zip(total, turned, strict=True)
        ]
    for m in masses_of(system, frame):
        arm = kinematics.to_frame(frame, subtract(graph, kinematics.position(m.point), centre))
        square = graph.dot(arm, arm)
        for i in range(count):
            for j in range(count):
                outer = graph.zero if count == 1 else graph.mul(arm[i], arm[j])
                term = graph.sub(square if i == j else graph.zero, outer)
                total[i][j] = graph.add(total[i][j], graph.mul(m.mass, term))
    return tuple(tuple(row) for row in total)


def _turned(system: Massive, source: Frame, target: Frame, inertia: Matrix) -> Matrix:
    """Return R J R^T with R from the axes of ``source`` to those of ``target``."""
    kinematics = system.kinematics

    def move(vector: Vector) -> Vector:
        return kinematics.to_frame(target, kinematics.to_world(source, vector))

    half = [move(tuple(row[j] for row in inertia)) for j in range(3)]
    rows = [tuple(half[j][i] for j in range(3)) for i in range(3)]
    return tuple(move(row) for row in rows)

"""Kinematics in the plane: total angles, world components, velocities by differentiation of positions.

Natural axes are the world's: measured over chains, world and body axes cost the same in the plane.
"""

from __future__ import annotations

from collections.abc import Callable

from ...graph import Graph, Node
from ...graph.vector import Vector, add, dot, subtract
from .frames import Frame, Point, along
from .pose import Rotate, Translate


class Planar:
    """``rate`` is the total time derivative of a node."""

    size = 2

    def __init__(self, graph: Graph, rate: Callable[[Node], Node]) -> None:
        self.graph = graph
        self.world = Frame(None, None, 0)
        self._rate = rate
        self._zero = graph.constant(0)

    def angle(self, frame: Frame) -> Node:
        """Return the total angle of the frame to the world [rad]."""

        def advance(child: Frame, value: Node) -> Node:
            return self.graph.add(value, child.step.angle) if isinstance(child.step, Rotate) else value

        return along(frame, "angle", self._zero, advance)

    def to_world(self, frame: Frame, vector: Vector) -> Vector:
        graph, (x, y) = self.graph, vector
        angle = self.angle(frame)
        c, s = graph.cos(angle), graph.sin(angle)
        return (
            graph.sub(graph.mul(c, x), graph.mul(s, y)),
            graph.add(graph.mul(s, x), graph.mul(c, y)),
        )

    def _origin(self, frame: Frame) -> Vector:
        def advance(child: Frame, value: Vector) -> Vector:
            if not isinstance(child.step, Translate):
                return value
            assert child.parent is not None
            return add(self.graph, value, self.to_world(child.parent, child.step.offset))

        return along(frame, "origin", (self._zero, self._zero), advance)

    def position(self, point: Point) -> Vector:
        return add(self.graph, self._origin(point.frame), self.to_world(point.frame, point.offset))

    def velocity(self, point: Point) -> Vector:
        return tuple(self._rate(x) for x in self.position(point))

    def velocity_at(self, frame: Frame, point: Point) -> Vector:
        origin = Point(frame, (self._zero, self._zero))
        (spin,) = self.angular_velocity(frame)
        dx, dy = subtract(self.graph, self.position(point), self.position(origin))
        return add(
            self.graph,
            self.velocity(origin),
            (self.graph.neg(self.graph.mul(spin, dy)), self.graph.mul(spin, dx)),
        )

    def acceleration(self, point: Point, field: Vector | None) -> Vector:
        acceleration = tuple(self._rate(v) for v in self.velocity(point))
        return acceleration if field is None else subtract(self.graph, acceleration, field)

    def angular_velocity(self, frame: Frame) -> Vector:
        return (self._rate(self.angle(frame)),)

    def angular_acceleration(self, frame: Frame) -> Vector:
        return (self._rate(self._rate(self.angle(frame))),)

    def potential(self, point: Point, field: Vector) -> Node:
        return dot(self.graph, field, self.position(point))

    def to_frame(self, frame: Frame, vector: Vector) -> Vector:
        graph, (x, y) = self.graph, vector
        angle = self.angle(frame)
        c, s = graph.cos(angle), graph.sin(angle)
        return (
            graph.add(graph.mul(c, x), graph.mul(s, y)),
            graph.sub(graph.mul(c, y), graph.mul(s, x)),
        )

    def to_natural(self, frame: Frame, vector: Vector) -> Vector:
        return vector

    def from_natural(self, frame: Frame, vector: Vector) -> Vector:
        return vector

    def spin_from_natural(self, frame: Frame, vector: Vector) -> Vector:
        return vector

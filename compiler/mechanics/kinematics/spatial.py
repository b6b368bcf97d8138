"""Kinematics in space: recursions in body axes from parent to child.

With w the angular velocity, v the velocity of the origin, both in body axes, and a step from A to B:

    translation by d:   v_B = v_A + w x d + d',   a_B = a_A + w' x d + w x (w x d) + 2 w x d' + d''
    rotation R (B to A), relative rate s in B:   w_B = R^T w_A + s,   w'_B = R^T w'_A + (R^T w_A) x s + s'

(Featherstone 2008, ch. 3, with classical instead of spatial accelerations.) A uniform field is carried as an
acceleration -g of the root, so gravity costs nothing extra. World components are formed only where they are requested.

The total derivative uses these rates: R (w x .) for a rotation R, R v_B and R a_B for positions that rotations connect to
the world. Differentiated term by term, n links would cost n^2.
"""

from __future__ import annotations

from ...graph import Graph, Node
from ...graph.vector import (
    Matrix,
    Vector,
    add,
    cross,
    dot,
    identity,
    matmul,
    matvec,
    scale,
    subtract,
    transpose_matvec,
)
from .frames import Frame, Point, along
from .pose import Rotate, Step, Translate, Turn, rotation_of
from .rates import TotalDerivative


class Spatial:
    """``rate`` is the total time derivative of a node; ``field`` the one that accelerations most often carry."""

    size = 3

    def __init__(self, graph: Graph, rate: TotalDerivative) -> None:
        self.graph = graph
        self.world = Frame(None, None, 0)
        self.field: Vector | None = None
        self._rate = rate
        zero = graph.constant(0)
        self._none: Vector = (zero, zero, zero)

    def _rates(self, vector: Vector) -> Vector:
        return tuple(self._rate(x) for x in vector)

    def _relative_rate(self, step: Step) -> Vector | None:
        match step:
            case Rotate(axis, angle):
                spin = self._rate(angle)
                zero = self._none[0]
                return tuple(spin if k == axis else zero for k in range(3))
            case Turn(_, rate):
                return rate
            case Translate():
                return None

    def _back(self, step: Step, vector: Vector) -> Vector:
        """Turn components before the step into components after it."""
        if isinstance(step, Translate):
            return vector
        return transpose_matvec(self.graph, rotation_of(self.graph, step), vector)

    # ------------------------------------------------------------ carried from parent to child

    def angular_velocity(self, frame: Frame) -> Vector:
        def advance(child: Frame, parent: Vector) -> Vector:
            assert child.step is not None
            relative = self._relative_rate(child.step)
            turned = self._back(child.step, parent)
            return turned if relative is None else add(self.graph, turned, relative)

        return along(frame, "spin", self._none, advance)

    def angular_acceleration(self, frame: Frame) -> Vector:
        def advance(child: Frame, parent: Vector) -> Vector:
            assert child.step is not None and child.parent is not None
            turned = self._back(child.step, parent)
            relative = self._relative_rate(child.step)
            if relative is None:
                return turned
            carried = self._back(child.step, self.angular_velocity(child.parent))
            gyroscopic = cross(self.graph, carried, relative)
            return add(self.graph, add(self.graph, turned, gyroscopic), self._rates(relative))

        return along(frame, "spin rate", self._none, advance)

    def _origin_velocity(self, frame: Frame) -> Vector:
        def advance(child: Frame, parent: Vector) -> Vector:
            assert child.step is not None and child.parent is not None
            if isinstance(child.step, Translate):
                return self._moved(child.parent, parent, child.step.offset)
            return self._back(child.step, parent)

        return along(frame, "velocity", self._none, advance)

    def _moved(self, frame: Frame, velocity: Vector, offset: Vector) -> Vector:
        spin = self.angular_velocity(frame)
        carried = add(self.graph, velocity, cross(self.graph, spin, offset))
        return add(self.graph, carried, self._rates(offset))

    def _origin_acceleration(self, frame: Frame, field: Vector | None) -> Vector:
        root = self._none if field is None else scale(self.graph, self.graph.constant(-1), field)

        def advance(child: Frame, parent: Vector) -> Vector:
            assert child.step is not None and child.parent is not None
            if isinstance(child.step, Translate):
                return self._accelerated(child.parent, parent, child.step.offset)
            return self._back(child.step, parent)

        return along(frame, ("acceleration", field), root, advance)

    def _accelerated(self, frame: Frame, acceleration: Vector, offset: Vector) -> Vector:
        graph = self.graph
        spin = self.angular_velocity(frame)
        velocity = self._rates(offset)
        moved = cross(graph, spin, offset)
        # w x (w x d) + 2 w x d' = w x (w x d + 2 d')
        inner = add(graph, moved, scale(graph, graph.constant(2), velocity))
        total = add(graph, acceleration, cross(graph, self.angular_acceleration(frame), offset))
        total = add(graph, total, cross(graph, spin, inner))
        return add(graph, total, self._rates(velocity))

    # ------------------------------------------------------------ points

    def velocity(self, point: Point) -> Vector:
        return self._moved(point.frame, self._origin_velocity(point.frame), point.offset)

    def velocity_at(self, frame: Frame, point: Point) -> Vector:
        graph = self.graph
        origin = Point(frame, self._none)
        arm = self.to_frame(frame, subtract(graph, self.position(point), self.position(origin)))
        velocity = add(graph, self._origin_velocity(frame), cross(graph, self.angular_velocity(frame), arm))
        return self.to_world(frame, velocity)

    def acceleration(self, point: Point, field: Vector | None) -> Vector:
        return self._accelerated(point.frame, self._origin_acceleration(point.frame, field), point.offset)

    def potential(self, point: Point, field: Vector) -> Node:
        def advance(child: Frame, parent: Node) -> Node:
            if not isinstance(child.step, Translate):
                return parent
            assert child.parent is not None
            return self.graph.add(parent, dot(self.graph, self._seen(child.parent, field), child.step.offset))

        height = along(point.frame, ("height", field), self._none[0], advance)
        return self.graph.add(height, dot(self.graph, self._seen(point.frame, field), point.offset))

    def _seen(self, frame: Frame, vector: Vector) -> Vector:
        """Return a constant world vector in the axes of a frame, carried from parent to child."""

        def advance(child: Frame, parent: Vector) -> Vector:
            assert child.step is not None
            return self._back(child.step, parent)

        return along(frame, ("seen", vector), vector, advance)

    # ------------------------------------------------------------ world components

    def rotation(self, frame: Frame) -> Matrix:
        """Return the 3x3 matrix from frame to world components."""

        def advance(child: Frame, parent: Matrix) -> Matrix:
            assert child.step is not None
            if isinstance(child.step, Translate):
                return parent
            return self._turned(child, matmul(self.graph, parent, rotation_of(self.graph, child.step)))

        return along(frame, "rotation", identity(self.graph), advance)

    def _turned(self, frame: Frame, matrix: Matrix) -> Matrix:
        """Offer the rates of a rotation matrix."""
        graph = self.graph
        for row in matrix:
            for k in range(3):
                i, j = (k + 1) % 3, (k + 2) % 3

                def rate(x: Node = row[i], y: Node = row[j], i: int = i, j: int = j) -> Node:
                    spin = self.angular_velocity(frame)
                    return graph.sub(graph.mul(x, spin[j]), graph.mul(y, spin[i]))

                self._rate.offer(row[k], rate)
        return matrix

    def position(self, point: Point) -> Vector:
        def advance(child: Frame, parent: Vector) -> Vector:
            if not isinstance(child.step, Translate):
                return parent
            assert child.parent is not None
            return add(self.graph, parent, self.to_world(child.parent, child.step.offset))

        origin = along(point.frame, "origin", self._none, advance)
        position = add(self.graph, origin, self.to_world(point.frame, point.offset))
        if self._hangs_by_rotations(point.frame):
            for k, node in enumerate(position):
                self._rate.offer(node, lambda k=k: self._world_velocity(point)[k])  # type: ignore[misc]
        return position

    def _hangs_by_rotations(self, frame: Frame) -> bool:
        """Whether nothing on the way from the world moves before it can turn.

        Velocities of what does are known in world axes; turned to and fro they would be less simple.
        """

        def advance(child: Frame, parent: bool | None) -> bool | None:
            if parent is not None:
                return parent
            if isinstance(child.step, Translate):
                moves = any(not self.graph.is_zero(x) for x in self._rates(child.step.offset))
                return False if moves else None
            return True

        return along(frame, "hangs", None, advance) is True

    def _world_velocity(self, point: Point) -> Vector:
        velocity = self.to_world(point.frame, self.velocity(point))
        for k, node in enumerate(velocity):
            self._rate.offer(node, lambda k=k: self._world_acceleration(point)[k])  # type: ignore[misc]
        return velocity

    def _world_acceleration(self, point: Point) -> Vector:
        acceleration = self.to_world(point.frame, self.acceleration(point, self.field))
        return acceleration if self.field is None else add(self.graph, acceleration, self.field)

    def to_world(self, frame: Frame, vector: Vector) -> Vector:
        return matvec(self.graph, self.rotation(frame), vector)

    def to_frame(self, frame: Frame, vector: Vector) -> Vector:
        return transpose_matvec(self.graph, self.rotation(frame), vector)

    def to_natural(self, frame: Frame, vector: Vector) -> Vector:
        return self.to_frame(frame, vector)

    def from_natural(self, frame: Frame, vector: Vector) -> Vector:
        return self.to_world(frame, vector)

    def spin_from_natural(self, frame: Frame, vector: Vector) -> Vector:
        return self.to_world(frame, vector)

"""Frames as a tree of poses, and what both the plane and space offer on them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, TypeVar

from msgspec import Struct, field

from ...graph import Graph, Node
from ...graph.vector import Vector
from .pose import Pose, Rotate, Step, Translate

Value = TypeVar("Value")


class Frame(Struct, eq=False):
    """One node of the frame tree: ``parent`` displaced by ``step``. ``known`` holds what was computed on it."""

    parent: Frame | None
    step: Step | None
    depth: int
    known: dict[object, object] = field(default_factory=dict)
    children: dict[Step, Frame] = field(default_factory=dict)


class Point(Struct, frozen=True):
    """A point at ``offset`` (components in the axes of ``frame``)."""

    frame: Frame
    offset: Vector


def along(frame: Frame, key: object, root: Value, advance: Callable[[Frame, Value], Value]) -> Value:
    """Return the value of ``key`` on a frame, carried from the root by ``advance(child, value of parent)``.

    Values are kept on the frames, so a tree costs one visit for each frame; no recursion, whatever its depth.
    """
    pending: list[Frame] = []
    at: Frame | None = frame
    while at is not None and key not in at.known:
        pending.append(at)
        at = at.parent
    value: Value = root if at is None else at.known[key]  # type: ignore[assignment]
    for child in reversed(pending):
        if child.parent is not None:
            value = advance(child, value)
        child.known[key] = value
    return value


class FrameKinematics(Protocol):
    """Positions, velocities and accelerations of frames and points.

    Velocities and accelerations have components in *natural* axes: those of the world in the plane, those of
    the frame itself in space, where that costs a third of the operations.
    """

    graph: Graph
    size: int
    world: Frame

    def position(self, point: Point) -> Vector:
        """World components of the position [m]."""

    def velocity(self, point: Point) -> Vector:
        """Velocity of a point in natural axes [m/s], including that of its offset."""

    def velocity_at(self, frame: Frame, point: Point) -> Vector:
        """World components of the velocity of the material point of ``frame`` that is now at ``point``."""

    def acceleration(self, point: Point, field: Vector | None) -> Vector:
        """Acceleration minus ``field`` (world components; None for no field) in natural axes [m/s^2]."""

    def angular_velocity(self, frame: Frame) -> Vector:
        """Natural components, one in the plane, three in space [rad/s]."""

    def angular_acceleration(self, frame: Frame) -> Vector:
        """Natural components [rad/s^2]."""

    def potential(self, point: Point, field: Vector) -> Node:
        """Scalar product of the position with a uniform field, up to a constant: [m] times its unit."""

    def to_world(self, frame: Frame, vector: Vector) -> Vector:
        """Turn frame components into world components."""

    def to_frame(self, frame: Frame, vector: Vector) -> Vector:
        """Turn world components into frame components."""

    def to_natural(self, frame: Frame, vector: Vector) -> Vector:
        """Turn world components into natural components at ``frame``."""

    def from_natural(self, frame: Frame, vector: Vector) -> Vector:
        """Turn natural components at ``frame`` into world components."""

    def spin_from_natural(self, frame: Frame, vector: Vector) -> Vector:
        """As ``from_natural`` for angular quantities (a scalar in the plane)."""


def displaced(graph: Graph, frame: Frame, pose: Pose) -> Frame:
    """Return ``frame`` displaced by ``pose``; equal displacements give the same frame."""
    for step in pose:
        if isinstance(step, Rotate) and isinstance(frame.step, Rotate) and frame.step.axis == step.axis:
            assert frame.parent is not None
            angle = graph.add(frame.step.angle, step.angle)
            frame, step = frame.parent, Rotate(step.axis, angle)
        if isinstance(step, Translate) and all(graph.is_zero(d) for d in step.offset):
            continue
        if isinstance(step, Rotate) and graph.is_zero(step.angle):
            continue
        child = frame.children.get(step)
        if child is None:
            child = frame.children[step] = Frame(frame, step, frame.depth + 1)
        frame = child
    return frame


def pose_between(frame: Frame, ancestor: Frame) -> Pose | None:
    """Return the steps that lead from ``ancestor`` to ``frame``, or None if it is not an ancestor."""
    steps: list[Step] = []
    at: Frame | None = frame
    while at is not None and at is not ancestor:
        if at.step is not None:
            steps.append(at.step)
        at = at.parent
    return None if at is None else tuple(reversed(steps))

"""Rotations and poses (language, sections 6 and 7): matrices of numbers or of series."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np

from oracle.series import Series, apply, real
from oracle.values import NotCovered

Vector = Any


@dataclass(frozen=True)
class Pose:
    """``x -> R x + p``. In the plane ``angle`` counts whole turns, in space it is None."""

    R: Vector
    p: Vector
    angle: Any = None

    def __matmul__(self, other: Pose) -> Pose:
        angle = None if self.angle is None else self.angle + other.angle
        return Pose(self.R @ other.R, self.R @ other.p + self.p, angle)

    def inverse(self) -> Pose:
        return Pose(self.R.T, -(self.R.T @ self.p), None if self.angle is None else -self.angle)

    def own_spin(self) -> Vector:
        """The angular velocity in the axes of the pose itself."""
        rate = [[x.der() if isinstance(x, Series) else 0.0 for x in row] for row in self.R]
        return self.R.T @ spin(self.R, matrix(rate))

    def way_to(self, other: Pose) -> Vector:
        """The small turn from here to another rotation, in the axes of both, which are alike to its third power."""
        R = self.R.T @ other.R
        return vector(*((R[i, j] - R[j, i]) * 0.5 for i, j in ((2, 1), (0, 2), (1, 0))))


def vector(*items: Any) -> Vector:
    out = np.empty(len(items), object)
    for i, item in enumerate(items):
        out[i] = item
    return out


def matrix(rows: Any) -> Vector:
    out = np.empty((len(rows), len(rows[0])), object)
    for i, row in enumerate(rows):
        for j, item in enumerate(row):
            out[i, j] = item
    return out


def identity(space: int) -> Pose:
    return Pose(np.eye(space).astype(object), vector(*[0.0] * space), 0.0 if space == 2 else None)


def displacement(d: Vector) -> Pose:
    return Pose(np.eye(len(d)).astype(object), vector(*d), 0.0 if len(d) == 2 else None)


def cross(a: Vector, b: Vector) -> Any:
    """In the plane, a number (section 6)."""
    if len(a) == 2:
        return a[0] * b[1] - a[1] * b[0]
    return vector(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def planar(angle: Any) -> Pose:
    s, c = apply("sin", angle), apply("cos", angle)
    return Pose(matrix([[c, -s], [s, c]]), vector(0.0, 0.0), angle)


def about(axis: Vector, angle: Any) -> Pose:
    """Rotation about an axis of any length, by the formula of Rodrigues."""
    x, y, z = np.asarray(axis, object) / norm(axis)
    s, c = apply("sin", angle), apply("cos", angle)
    K = matrix([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return Pose(np.eye(3).astype(object) + K * s + (K @ K) * (1 - c), vector(0.0, 0.0, 0.0))


def norm(v: Vector) -> Any:
    return apply("sqrt", sum(x * x for x in np.ravel(v)))


def quaternion(q: Vector) -> Pose:
    """The rotation of a quaternion of any length, scalar part first."""
    w, x, y, z = q
    n = w * w + x * x + y * y + z * z
    s = 2.0 / n
    xx, yy, zz = x * x * s, y * y * s, z * z * s
    xy, xz, yz = x * y * s, x * z * s, y * z * s
    wx, wy, wz = w * x * s, w * y * s, w * z * s
    R = matrix(
        [
            [1.0 - (yy + zz), xy - wz, xz + wy],
            [xy + wz, 1.0 - (xx + zz), yz - wx],
            [xz - wy, yz + wx, 1.0 - (xx + yy)],
        ]
    )
    return Pose(R, vector(0.0, 0.0, 0.0))


def quaternion_of(pose: Pose) -> Vector:
    """The unit quaternion of a rotation of numbers, scalar part not negative."""
    R = np.array([[real(x) for x in row] for row in pose.R])
    four = np.array(
        [
            1 + R[0, 0] + R[1, 1] + R[2, 2],
            1 + R[0, 0] - R[1, 1] - R[2, 2],
            1 - R[0, 0] + R[1, 1] - R[2, 2],
            1 - R[0, 0] - R[1, 1] + R[2, 2],
        ]
    )
    products = {
        0: (R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]),
        1: (R[2, 1] - R[1, 2], R[1, 0] + R[0, 1], R[0, 2] + R[2, 0]),
        2: (R[0, 2] - R[2, 0], R[1, 0] + R[0, 1], R[2, 1] + R[1, 2]),
        3: (R[1, 0] - R[0, 1], R[0, 2] + R[2, 0], R[2, 1] + R[1, 2]),
    }
    k = int(np.argmax(four))
    q = np.insert(np.array(products[k]), k, four[k])
    q = q / np.linalg.norm(q)
    return q if q[0] >= 0 else -q


def times(p: Vector, q: Vector) -> Vector:
    """The product of two quaternions."""
    (a, b, c, d), (w, x, y, z) = p, q
    return vector(
        a * w - b * x - c * y - d * z,
        a * x + b * w + c * z - d * y,
        a * y - b * z + c * w + d * x,
        a * z + b * y - c * x + d * w,
    )


def spin(R: Vector, rate: Vector) -> Vector:
    """The angular velocity in world components: the axial vector of R' R^T."""
    W = {(i, j): sum(rate[i] * R[j]) for i, j in itertools.permutations(range(3), 2)}
    return vector(*((W[i, j] - W[j, i]) * 0.5 for i, j in ((2, 1), (0, 2), (1, 0))))


def heading(pose: Pose) -> Any:
    if pose.angle is None:
        raise NotCovered("the heading of a frame in space")
    return pose.angle

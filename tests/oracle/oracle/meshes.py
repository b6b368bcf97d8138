"""Volume, centre and inertia of unit density inside triangles: sums of tetrahedra about a point inside."""

from __future__ import annotations

from typing import Any

import numpy as np

from oracle import poses
from oracle.series import real

Value = Any


def solid(asked: str, corners: Value, faces: Value) -> Value:
    """Each tetrahedron has the moments of its mid points: of degree two, exact (A. H. Stroud 1971)."""
    middle = sum(corners[1:], corners[0]) / len(corners)
    volume: Value = 0.0
    first: Value = 0.0 * middle
    second: Value = 0.0 * poses.matrix([[x * y for x in middle] for y in middle])
    a, b = (5 - 5**0.5) / 20, (5 + 3 * 5**0.5) / 20
    for face in faces:
        p, q, r = (corners[int(real(k)) - 1] - middle for k in face)
        part = sum(x * y for x, y in zip(p, poses.cross(q, r), strict=True)) / 6
        volume = volume + part
        for weights in ((a, a, a), (b, a, a), (a, b, a), (a, a, b)):
            x = weights[0] * p + weights[1] * q + weights[2] * r
            first = first + part / 4 * x
            second = second + poses.matrix([[part / 4 * s * t for s in x] for t in x])
    if asked == "mesh_volume":
        return volume
    centre = first / volume
    if asked == "mesh_centre":
        return middle + centre
    about = second - poses.matrix([[volume * s * t for s in centre] for t in centre])
    trace = about[0, 0] + about[1, 1] + about[2, 2]
    return trace * np.eye(3).astype(object) - about

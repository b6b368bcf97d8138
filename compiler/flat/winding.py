"""How often triangles enclose a place: once inside and never outside of a solid.

The solid angles of all triangles, seen from a place, add up to 4 pi times this number, the winding number
(A. van Oosterom, J. Strackee, IEEE Trans. Biomed. Eng. 30, 1983).
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

NEAR = 1e-5
"""Distance from a triangle of the places beside it, of the radius of its inner circle: more than the rounding of files that hold
24 bits, less than the thickness of sheets."""

CLEAR = 0.1
"""A winding number farther from a whole number is of a place too near to another triangle: it says nothing."""


def misplaced(
    corners: Sequence[Sequence[Fraction]], faces: Sequence[Sequence[int]]
) -> tuple[int, int] | None:
    """Return a triangle, by its number, and how often a place beside it is enclosed, if that is neither once nor not at all.

    Looks at both sides of the largest triangle of each piece. Below zero a piece faces inwards and lies in no other one.
    """
    triangles = np.array([[float(x) for x in corner] for corner in corners])[np.array(faces)]
    sides = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    areas = np.linalg.norm(sides, axis=1)
    around = np.linalg.norm(triangles - np.roll(triangles, 1, axis=1), axis=2).sum(axis=1)
    pieces = _pieces(faces)
    boxes = [(triangles[piece].min(axis=(0, 1)), triangles[piece].max(axis=(0, 1))) for piece in pieces]
    for piece in pieces:
        largest = int(piece[np.argmax(areas[piece])])
        if not areas[largest]:
            continue
        step = NEAR * sides[largest] / around[largest]  # twice the area over the perimeter is the radius
        centre = triangles[largest].mean(axis=0)
        for place in (centre - step, centre + step):
            near = [
                p
                for p, (low, high) in zip(pieces, boxes, strict=True)
                if ((low <= place) & (place <= high)).all()
            ]
            count = sum(_winding(triangles[p], place) for p in near)
            if abs(count - round(count)) < CLEAR and round(count) not in (0, 1):
                return largest, round(count)
    return None


def _winding(triangles: Array, place: Array) -> float:
    arms = triangles - place
    a, b, c = arms[:, 0], arms[:, 1], arms[:, 2]
    la, lb, lc = np.linalg.norm(arms, axis=2).T
    volume = np.einsum("ij,ij->i", a, np.cross(b, c))
    cosines = [np.einsum("ij,ij->i", x, y) for x, y in ((a, b), (b, c), (c, a))]
    below = la * lb * lc + cosines[0] * lc + cosines[1] * la + cosines[2] * lb
    return float(np.arctan2(volume, below).sum() / (2 * np.pi))


def _pieces(faces: Sequence[Sequence[int]]) -> list[NDArray[np.intp]]:
    """Return the triangles that hang together by their corners."""
    head: dict[int, int] = {}

    def first(k: int) -> int:
        while (up := head.setdefault(k, k)) != k:
            head[k] = head.setdefault(up, up)
            k = up
        return k

    for a, b, c in faces:
        head[first(b)] = first(a)
        head[first(c)] = first(a)
    found: dict[int, list[int]] = {}
    for k, face in enumerate(faces):
        found.setdefault(first(face[0]), []).append(k)
    return [np.array(piece) for piece in found.values()]

"""Volume, centre and moments of a solid inside triangles, exactly, and what keeps triangles from enclosing one.

Each triangle makes a tetrahedron with the origin, whose volume counts with its sign (divergence theorem).
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Hashable, Iterable, Sequence
from fractions import Fraction

from msgspec import Struct


class Moments(Struct, frozen=True):
    """``tensor``: of unit density, about the centre, in the axes of the corners."""

    volume: Fraction
    centre: tuple[Fraction, ...]
    tensor: tuple[tuple[Fraction, ...], ...]


def moments(corners: Sequence[Sequence[Fraction]], faces: Iterable[Sequence[int]]) -> Moments | None:
    """Return the moments of a closed surface, by whole numbers; None where it encloses nothing."""
    unit = math.lcm(*(x.denominator for corner in corners for x in corner))
    points = [tuple(int(x * unit) for x in corner) for corner in corners]
    volume, first = 0, [0, 0, 0]
    second = [[0] * 3 for _ in range(3)]
    for i, j, k in faces:
        a, b, c = points[i], points[j], points[k]
        d = (
            a[0] * (b[1] * c[2] - b[2] * c[1])
            + a[1] * (b[2] * c[0] - b[0] * c[2])
            + a[2] * (b[0] * c[1] - b[1] * c[0])
        )
        s = [x + y + z for x, y, z in zip(a, b, c, strict=True)]
        volume += d
        for m in range(3):
            first[m] += d * s[m]
            for n in range(m, 3):
                second[m][n] += d * (s[m] * s[n] + a[m] * a[n] + b[m] * b[n] + c[m] * c[n])
    if volume == 0:
        return None
    centre = [Fraction(f, 4 * volume) for f in first]
    about = [
        [
            Fraction(second[min(m, n)][max(m, n)], 120) - Fraction(volume, 6) * centre[m] * centre[n]
            for n in range(3)
        ]
        for m in range(3)
    ]
    trace = about[0][0] + about[1][1] + about[2][2]
    return Moments(
        Fraction(volume, 6 * unit**3),
        tuple(x / unit for x in centre),
        tuple(tuple((trace * (m == n) - about[m][n]) / unit**5 for n in range(3)) for m in range(3)),
    )


def repeated(faces: Iterable[Sequence[int]]) -> tuple[tuple[int, ...], int] | None:
    """Return a triangle that stands more than once with the same side outwards, and how many do; None if none does."""
    counts = Counter(_oriented(face) for face in faces if len(set(face)) == 3)
    twice = [face for face, count in counts.items() if count > 1]
    return (twice[0], len(twice)) if twice else None


def two_sided(faces: Iterable[Sequence[int]]) -> bool:
    """Tell whether each triangle stands beside one that faces the other way."""
    found = {_oriented(face) for face in faces}
    return found == {_oriented(face[::-1]) for face in found}


def _oriented(face: Sequence[int]) -> tuple[int, ...]:
    """Return the corners of a triangle in their order, from the lowest one."""
    k = min(range(3), key=face.__getitem__)
    return (*face[k:], *face[:k])


def flaw(faces: Iterable[Sequence[Hashable]]) -> tuple[bool, Hashable, Hashable] | None:
    """Return an edge at which triangles do not close, or meet with opposite sides (first entry true); None if all do."""
    edges: Counter[tuple[Hashable, Hashable]] = Counter()
    for a, b, c in faces:
        edges.update(((a, b), (b, c), (c, a)))
    turned = None
    for (p, q), count in edges.items():
        back = edges.get((q, p), 0)
        if p == q or count == back:
            continue
        if (count + back) % 2:
            return False, p, q
        turned = turned or (True, p, q)
    return turned

"""Which coordinate belongs to each velocity."""

from __future__ import annotations

from collections.abc import Sequence


def partners(names: Sequence[str], nq: int, nv: int, rotations: Sequence[int]) -> tuple[int, ...]:
    """Return the index in y of the coordinate of each velocity; the three of a rotation belong to its first entry.

    ``names`` [ny] of the states tell, as a coordinate whose rate is prescribed has no velocity; else their order.
    """
    places = {name: i for i, name in enumerate(names[:nq])}
    found: list[int] = []
    for name in names[nq : nq + nv]:
        base, _, _ = name.removeprefix("der(").rpartition(")")
        place = places.get(base, places.get(f"{base}[1]"))
        if place is None:
            return _in_order(nq, nv, rotations)
        found.append(place)
    return tuple(found)


def _in_order(nq: int, nv: int, rotations: Sequence[int]) -> tuple[int, ...]:
    partner, coordinate = list[int](), 0
    while coordinate < nq and len(partner) < nv:
        partner += [coordinate] * (3 if coordinate in rotations else 1)
        coordinate += 4 if coordinate in rotations else 1
    return tuple(partner)

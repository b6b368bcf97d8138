"""How large a value is likely to be that is zero: as large as others of its unit, or as its dimension makes it of them."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping

from msgspec import Struct

from mechc.lang.units import BASE, parse_unit

PLACE = re.compile(r"\[[^\]]*\]$")

LEAST = 1e-9
"""Pivots below are zero: exponents of units are small fractions."""


class UsualSizes(Struct, frozen=True):
    """Sizes by unit: of each part of the model, by its name, of the whole model, and of the motion."""

    parts: Mapping[str, Mapping[str, float]]
    model: Mapping[str, float]
    motion: Mapping[str, float]

    def of(self, name: str, unit: str) -> float | None:
        """Return the size of a value: of its own part before the model, of the same unit before what others make of it."""
        if not unit:
            return None
        part = self.parts.get(part_of(name), {})
        for known in (part, self.model, self.motion):
            if unit in known:
                return known[unit]
            if known is part and (size := of_dimension(unit, part)):
                return size
        return of_dimension(unit, self.model) or of_dimension(unit, {**self.motion, **self.model})


def sizes_of(values: Iterable[tuple[str, str, float]], motion: Mapping[str, float]) -> UsualSizes:
    """Return the sizes of settings (name, unit, value), medians of those of one unit; ``motion``: the largest values by unit."""
    parts: dict[str, dict[str, list[float]]] = {}
    model: dict[str, list[float]] = {}
    for name, unit, value in values:
        if unit and value != 0 and math.isfinite(value):
            for of in (parts.setdefault(part_of(name), {}), model):
                of.setdefault(unit, []).append(abs(value))
    return UsualSizes(
        {part: _medians(of) for part, of in parts.items()},
        _medians(model),
        {unit: size for unit, size in motion.items() if unit and size > 0},
    )


def part_of(name: str) -> str:
    """Return the part of the model that has this name: ``bus`` of ``bus.com[1]``."""
    return PLACE.sub("", name).rpartition(".")[0]


def _medians(found: Mapping[str, list[float]]) -> dict[str, float]:
    return {unit: sorted(of)[len(of) // 2] for unit, of in found.items()}


def of_dimension(unit: str, known: Mapping[str, float]) -> float | None:
    """Return the product of powers of known sizes that has a unit, to two digits: of a stiffness and a mass it makes a damping.

    Of several products it is the one of the scales of mass, length and time that fit all sizes best. None where there is none.
    """
    wanted = _exponents(unit)
    rows = [(_exponents(other), math.log(size)) for other, size in known.items()]
    if not any(wanted):
        return None
    n = len(BASE)
    # normal equations, for wanted = sum of rows
    square = [[*(sum(row[i] * row[k] for row, _ in rows) for k in range(n)), wanted[i]] for i in range(n)]
    free = list(range(n))
    for k in range(n):
        pivot = max(free, key=lambda i: abs(square[i][k]), default=None)
        if pivot is None or abs(square[pivot][k]) < LEAST:
            continue
        free.remove(pivot)
        for i in range(n):
            if i != pivot:
                share = square[i][k] / square[pivot][k]
                square[i] = [a - share * b for a, b in zip(square[i], square[pivot], strict=True)]
    if any(abs(square[i][n]) > LEAST for i in free):
        return None
    weights = [0.0] * n
    for i in set(range(n)) - set(free):
        k = next(k for k in range(n) if abs(square[i][k]) >= LEAST)
        weights[k] = square[i][n] / square[i][k]
    power = sum(size * sum(w * e for w, e in zip(weights, row, strict=True)) for row, size in rows)
    return float(f"{math.exp(power):.2g}") if abs(power) < 300 else None


def _exponents(unit: str) -> list[float]:
    return [float(e) for e in parse_unit(unit or "1").dimension.exponents]

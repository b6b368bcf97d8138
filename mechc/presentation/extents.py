"""Which quantities of a motion change by more than errors of the computation, told from their lowest and highest values."""

from __future__ import annotations

import math
from collections.abc import Mapping

from msgspec import Struct, field

NOISE = 1e-9
"""Share of the largest value of its unit below which a change does not count."""
ERRORS, LARGEST = 10, 1e-6
"""So many estimated errors do not count as a change either, up to a share."""
STEADY = 1e-4


class Errors(Struct, frozen=True):
    """Estimated errors of a motion: ``by_state`` over the nominal and the largest value of each, and the largest of them."""

    by_state: Mapping[str, float]
    nominal: Mapping[str, float]
    largest: float


class Extents(Struct, frozen=True):
    """``ends`` are the lowest and the highest finite value of each quantity, which are not finite where it has none; ``errors``:
    None where nobody has estimated them."""

    units: Mapping[str, str]
    ends: Mapping[str, tuple[float, float]]
    errors: Errors | None = None
    sizes: dict[str, float] = field(default_factory=dict)
    """The largest value of each unit."""

    def __post_init__(self) -> None:
        for name, unit in self.units.items():
            self.sizes[unit] = max(self.sizes.get(unit, 0.0), self.largest(name))

    def largest(self, name: str) -> float:
        """Return the size of the largest value of a quantity."""
        low, high = self.ends[name]
        return max(abs(low), abs(high)) if math.isfinite(low) else 0.0

    def constant(self, name: str) -> bool:
        low, high = self.ends[name]
        return math.isfinite(low) and high - low <= self.noise(name, self.largest(name))

    def noise(self, name: str, size: float) -> float:
        """Return the change that errors make of a quantity of this size."""
        least = NOISE * self.sizes[self.units[name]]
        if self.errors is None:
            return least
        share, of = self.errors.largest, size
        if name in self.errors.by_state:
            share, of = self.errors.by_state[name], self.errors.nominal[name] + size
        return max(least, min(ERRORS * share, LARGEST) * of)

    def steady(self, rate: str) -> bool:
        """Tell whether a rate changes so little that its phase portrait is a straight line."""
        low, high = self.ends[rate]
        return not math.isfinite(low) or high - low <= STEADY * self.largest(rate)

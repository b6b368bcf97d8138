"""The result of a run with the units that it is shown in: what reports and pictures are made of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from types import MappingProxyType
from typing import TYPE_CHECKING, Self

import numpy as np

from .display import Display, choose, shown_unit
from .runtime.results.quantities import Display as Unit
from .runtime.results.solution import Motion
from .runtime.results.solution import Solution as Run

if TYPE_CHECKING:
    from .runtime.interface import Scene
    from .runtime.problem import Array
    from .runtime.results.solution import Columns


class ShownSolution(Run):
    """A mapping from names to arrays over ``time``; see ``mechc.runtime.results.solution`` for what it holds.

    ``display`` are the units that it is shown in, ``angles`` the unit in which pictures show angles; ``swept`` the values that this run of a sweep has, in SI: they are
    written into files as columns.
    """

    def __init__(
        self,
        motion: Motion,
        display: Display = Display(),  # noqa: B008, a frozen value
        swept: Mapping[str, float | bool | str] = MappingProxyType({}),
    ) -> None:
        super().__init__(motion)
        self.display = display
        self.angles = ""
        self.swept = swept

    def in_picture(self) -> Self:
        """Return the same run in the units of pictures: with angles as the text of the model writes them."""
        if self.display.chosen or not self.angles:
            return self
        other = copy(self)
        other.display = choose(self.angles)
        return other

    def staged(self) -> tuple[Scene, Columns] | None:
        """Return what is drawn and the function that gives its numbers, or None where the run was made without."""
        scene, pictured = self.problem.scene, self.motion.pictured
        return None if scene is None or pictured is None else (scene, pictured)

    def columns(
        self, names: Sequence[str] | None = None, display: Unit | None = None
    ) -> dict[str, tuple[str, Array]]:
        """Give unit and values by name, time first, swept parameters last."""
        columns = super().columns(names, display)
        units = {quantity.name: quantity.unit for quantity in self.problem.parameters}
        for name, value in self.swept.items():
            if name not in self and isinstance(value, float | int):
                unit, factor = (
                    display(name, units[name]) if display and name in units else (units.get(name, ""), 1.0)
                )
                columns[name] = (unit, np.full_like(self.time, value * factor))
        return columns

    def shown_unit(self, name: str, si: str | None = None) -> tuple[str, float]:
        """Return the unit that a quantity is shown in, and the factor from SI to it (``display.py``)."""
        return shown_unit(self.display, self.quantities, name, self.unit(name) if si is None else si)

    def shown(self, name: str) -> Array:
        """Return the values of a quantity in the unit that it is shown in."""
        return self[name] * self.shown_unit(name)[1]

"""What of a motion stays constant or is there twice, which a picture says in a line and not with curves."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from .extents import Errors, Extents
from .letters import letters, unit_text

if TYPE_CHECKING:
    from ..runtime.problem import Array
    from ..solution import Solution

SAME = 1e-12
CURVES = ("coordinate", "state", "output")
"""Kinds of quantities that have curves of their own."""
MOST = 8
"""Constants that the line names."""


class Stillness:
    """Tells for the quantities of a solution whether they change by more than errors of the computation."""

    def __init__(self, solution: Solution) -> None:
        self.solution = solution
        self.extents = extents_of(solution)

    def constant(self, name: str) -> bool:
        return self.extents.constant(name)

    def steady(self, rate: str) -> bool:
        """Tell whether a rate changes so little that its phase portrait is a straight line."""
        return self.extents.steady(rate)

    def among(self, name: str, columns: Sequence[Array]) -> bool:
        """Tell whether the values of a quantity are one of these columns."""
        values = self.solution[name]
        return any(_same(values, column) for column in columns)

    def twin(self, output: str) -> str | None:
        """Return the state, or the output before this one, that has the same values."""
        unit = self.solution.quantities[output].unit
        for name, quantity in self.solution.quantities.items():
            if name == output and quantity.kind == "output":
                return None
            if (
                quantity.kind in CURVES
                and quantity.unit == unit
                and _same(self.solution[output], self.solution[name])
            ):
                return name
        return None

    def line(self) -> str:
        """Return what is constant with its value, what is another quantity, and how well energies balance."""
        shown = ("coordinate", "state", "output", "input", "discrete")
        constant: dict[tuple[str, str], list[str]] = {}
        twins: list[str] = []
        for name, quantity in self.solution.quantities.items():
            if quantity.kind not in shown:
                continue
            if self.constant(name):
                value, unit = self._value(name)
                constant.setdefault((value, unit), []).append(letters(name))
            elif quantity.kind == "output" and (twin := self.twin(name)):
                twins.append(f"{letters(name)} is {letters(twin)}")
        named = [
            f"{_listed(names)} = {value}{' ' * bool(unit)}{unit}" for (value, unit), names in constant.items()
        ]
        if len(named) > MOST:
            named = [*named[:MOST], f"{len(named) - MOST} others"]
        parts = [f"constant: {', '.join(named)}"] if named else []
        parts += [", ".join(twins[:MOST])] if twins else []
        drift = self.solution.accuracy.energy
        if drift is not None and drift.relative is not None:
            parts.append(f"energies balance within {drift.relative:.1g} of the largest")
        return "; ".join(parts)

    def _value(self, name: str) -> tuple[str, str]:
        """Return the value of what is constant, in the unit that it is shown in."""
        unit, factor = self.solution.shown_unit(name)
        values = self.solution[name]
        first = float(values[np.isfinite(values)][0])
        zero = abs(first) <= self.extents.noise(name, abs(first))
        return "0" if zero else f"{first * factor:.4g}", "" if unit == "1" else unit_text(unit)


def _listed(names: Sequence[str]) -> str:
    """Join names with equal signs; of many, the first and the last."""
    return " = ".join(names) if len(names) <= 4 else f"{names[0]} = … = {names[-1]}"


def _same(a: Array, b: Array) -> bool:
    size = max(_largest(a), _largest(b))
    return bool(np.array_equal(np.isfinite(a), np.isfinite(b))) and _largest(a - b) <= SAME * size


def extents_of(solution: Solution) -> Extents:
    """Return the extents of the quantities of a run."""
    error = solution.accuracy.error
    return Extents(
        {name: quantity.unit for name, quantity in solution.quantities.items()},
        {name: _ends(solution[name]) for name in solution.quantities},
        None if error is None else Errors(error.by_state, error.nominal, error.largest),
    )


def _ends(values: Array) -> tuple[float, float]:
    finite = values[np.isfinite(values)]
    return (float(finite.min()), float(finite.max())) if finite.size else (np.nan, np.nan)


def _largest(values: Array) -> float:
    finite = values[np.isfinite(values)]
    return float(np.abs(finite).max()) if finite.size else 0.0

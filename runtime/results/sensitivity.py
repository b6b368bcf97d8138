"""How a motion changes with parameters, initial values and inputs: derivatives over time, with estimated errors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from msgspec import Struct

from mechc.suggest import suggest

from ..outcome import SimulationError
from ..problem import Array
from .files import json_number
from .quantities import elements


class Sensitivity(Struct, frozen=True, eq=False):
    """d(``of``)/d(``to``) over time: ``values`` [n] in SI, or [n, m] of a vector; ``errors`` like them are estimated,
    None where no second run was made. ``numpy.asarray`` gives the values."""

    of: str
    to: str
    unit: str
    values: Array
    errors: Array | None = None

    @property
    def name(self) -> str:
        return f"d({self.of})/d({self.to})"

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Array:
        return np.array(self.values, dtype=dtype)

    def __len__(self) -> int:
        return len(self.values)


class Sensitivities(Struct, frozen=True, eq=False):
    """``columns``: for each state and output its derivatives [n, k] in the directions ``to`` [k]; ``errors`` like them;
    ``units`` by quantity and direction. ``remark``: why there are no errors, or fewer rows than the motion has."""

    to: tuple[str, ...]
    columns: Mapping[str, Array]
    units: Mapping[str, tuple[str, ...]]
    errors: Mapping[str, Array] | None = None
    remark: str = ""

    def of(self, quantity: str, to: str) -> Sensitivity:
        """Give one derivative; that of a vector has a column for each element. Raises KeyError."""
        if to not in self.to:
            asked = ", ".join(self.to)
            raise KeyError(f"the run was not differentiated in '{to}', only in {asked}{suggest(to, self.to)}")
        k = self.to.index(to)
        if quantity in self.columns:
            errors = None if self.errors is None else self.errors[quantity][:, k]
            return Sensitivity(quantity, to, self.units[quantity][k], self.columns[quantity][:, k], errors)
        names = elements(self.columns, quantity)
        if not names:
            raise KeyError(f"'{quantity}' is neither a state nor an output{suggest(quantity, self.columns)}")
        errors = None if self.errors is None else np.column_stack([self.errors[n][:, k] for n in names])
        values = np.column_stack([self.columns[n][:, k] for n in names])
        return Sensitivity(quantity, to, self.units[names[0]][k], values, errors)

    def listed(self, names: Sequence[str] | None = None) -> list[Sensitivity]:
        """Give all derivatives, or those of some quantities."""
        wanted = [n for n in self.columns if names is None or n in names]
        return [self.of(name, to) for name in wanted for to in self.to]

    def at_end(self) -> dict[str, dict[str, float | None]]:
        """Give the last values by quantity and direction, as JSON knows them."""
        return {name: dict(zip(self.to, _numbers(v[-1]), strict=True)) for name, v in self.columns.items()}

    def errors_at_end(self) -> dict[str, dict[str, float | None]] | None:
        if self.errors is None:
            return None
        return {name: dict(zip(self.to, _numbers(v[-1]), strict=True)) for name, v in self.errors.items()}


def none_asked() -> SimulationError:
    return SimulationError(
        "the run was not differentiated",
        help='ask for it: --sensitivity l,theta to the command, or sensitivity=["l", "theta"] in Python',
    )


def _numbers(row: Array) -> list[float | None]:
    return [json_number(float(value)) for value in row]

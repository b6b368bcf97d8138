"""What most studies find: values with their errors, remarks, and curves for a picture; data and no more."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from msgspec import Struct, field
from numpy.typing import NDArray

from ..outcome import Outcome, Told
from ..problem import Array
from ..results.files import json_number
from ..results.solution import Solution

MOST_SHOWN = 4
"""Values in the short form of an answer."""
MOST_DIGITS = 12
"""Of a number in a sentence."""


class Value(Struct, frozen=True):
    """One value in SI. ``error``: how far it may be off, in the same unit; None where that cannot be told."""

    name: str
    unit: str
    value: float
    error: float | None = None


def known_digits(value: float, error: float, unit: str) -> str:
    """Return a number with the digits that its error leaves, twelve at most and two at least, and its unit."""
    digits = MOST_DIGITS
    if value and error > 0 and math.isfinite(value) and math.isfinite(error):
        digits = math.floor(math.log10(abs(value))) + 1 - math.ceil(math.log10(error))
    return f"{value:.{min(max(digits, 2), MOST_DIGITS)}g} {unit}".rstrip()


class Curve(Struct, frozen=True, eq=False):
    """``x`` [n] and ``y`` [n], in SI. ``style``: line, dashed, dotted, points, spots (smaller), dots (of many), or cells (of a grid of places);
    curves of one ``colour`` number look alike. A line is broken where there is no number."""

    name: str
    x: Array
    y: Array
    style: str = "line"
    colour: int | None = None


class Landscape(Struct, frozen=True, eq=False):
    """``values`` [len(y), len(x)] over a grid, not-a-number where there are none: drawn as lines of equal value; what is at
    most ``level`` is filled, and its border is thick."""

    x: Array
    y: Array
    values: Array
    level: float
    others: tuple[float, ...]
    unit: str


class Panel(Struct, frozen=True, eq=False):
    """One diagram: labels and units of its axes, curves, whether both scales are equal, and which are logarithmic
    (``"x"``, ``"y"``, ``"xy"``)."""

    title: str
    x_label: str
    x_unit: str
    y_label: str
    y_unit: str
    curves: tuple[Curve, ...]
    equal: bool = False
    logarithmic: str = ""
    tall: bool = False
    """A picture of its own rather than a strip beside others."""
    x_names: tuple[str, ...] = ()
    """What stands at 1, 2, ... of x, which counts."""
    landscape: Landscape | None = None


Cell = str | float | complex | None


class Table(Struct, frozen=True):
    """Rows of cells below a head of names with their units; numbers are in SI, None cannot be told."""

    title: str
    head: tuple[tuple[str, str], ...]
    rows: tuple[tuple[Cell, ...], ...]


class Findings(Struct, Told, frozen=True, eq=False, kw_only=True):
    """The answer to a study that is made of values, tables and curves.

    ``details``: what else its JSON object holds, by name, as plain data; ``arrays``: what files of arrays hold (.npz,
    .mat).
    """

    study: str
    model: str
    outcome: Outcome
    message: str
    values: tuple[Value, ...] = ()
    errors_from: str
    remarks: tuple[str, ...] = ()
    tables: tuple[Table, ...] = ()
    panels: tuple[Panel, ...] = ()
    details: Mapping[str, Any] = field(default_factory=dict)
    arrays: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    runs: tuple[Solution, ...] = ()

    def __repr__(self) -> str:
        found = ", ".join(f"{value.name} {value.value:.6g}" for value in self.values[:MOST_SHOWN])
        return f"<mechc {self.study} of {self.model}: {self.message}{'; ' * bool(found)}{found}>"

    def __getitem__(self, name: str) -> float:
        """Return a value by its name."""
        for value in self.values:
            if value.name == name:
                return value.value
        raise KeyError(f"there is no '{name}'; there are {', '.join(value.name for value in self.values)}")

    def summary(self) -> dict[str, Any]:
        """Give the answer as JSON knows it, in SI; not-a-number and infinity are null."""
        return {
            "study": self.study,
            "model": self.model,
            "outcome": self.outcome.value,
            "message": self.message,
            "values": {value.name: json_number(value.value) for value in self.values},
            "accuracy": {
                "errors": {
                    value.name: None if value.error is None else json_number(value.error)
                    for value in self.values
                },
                "errors_from": self.errors_from,
            },
            "remarks": list(self.remarks),
            **self.details,
        }

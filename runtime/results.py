"""Quantities over time: a mapping from names to arrays, with units, interpolation, data frames and files."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .problem import Array
from .suggest import suggest

if TYPE_CHECKING:
    import pandas

Display = Callable[[str, str], tuple[str, float]]
"""(name, SI unit) -> (unit to show, factor from SI)"""


class Results(Mapping[str, Array]):
    """``results["theta"]`` is an array along ``results.time``; SI throughout.

    ``units`` has an entry for each name, and for "time". ``report`` is what the run said of itself
    (``Solution.summary``), where it is known.
    """

    def __init__(
        self,
        time: Array,
        values: Mapping[str, Array],
        units: Mapping[str, str],
        report: Mapping[str, Any] | None = None,
    ) -> None:
        self.time = time
        self.report = report
        self._values = dict(values)
        self._units = dict(units)

    def __getitem__(self, name: str) -> Array:
        if name == "time":
            return self.time
        try:
            return self._values[name]
        except KeyError:
            raise KeyError(f"there is no '{name}'{suggest(name, self._values)}") from None

    def __contains__(self, name: object) -> bool:
        return name == "time" or name in self._values

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def unit(self, name: str) -> str:
        """Give the SI unit of a quantity, "" for a pure number."""
        return self._units[name]

    def __call__(self, time: float | Sequence[float] | Array) -> dict[str, Array]:
        """Interpolate everything at ``time`` (a number or an array) by cubic splines through the points.

        Raises ``ValueError`` outside the range of time.
        """
        at = self._inside(time)
        if self.time.size < 4:
            return {name: np.interp(at, self.time, values) for name, values in self._values.items()}
        from scipy.interpolate import CubicSpline

        return {name: CubicSpline(self.time, values)(at) for name, values in self._values.items()}

    def _inside(self, time: float | Sequence[float] | Array) -> Array:
        at = np.asarray(time, dtype=np.float64)
        if at.size and not (at.min() >= self.time[0] and at.max() <= self.time[-1]):
            raise ValueError(f"results reach from time {self.time[0]:g} to {self.time[-1]:g}")
        return at

    def columns(
        self, names: Sequence[str] | None = None, display: Display | None = None
    ) -> dict[str, tuple[str, Array]]:
        """Give unit and values by name, time first, in the units that ``display`` wants."""
        chosen = {"time": self.time} | {name: self[name] for name in (self if names is None else names)}
        columns: dict[str, tuple[str, Array]] = {}
        for name, values in chosen.items():
            unit, factor = display(name, self.unit(name)) if display else (self.unit(name), 1.0)
            columns[name] = (unit, values if factor == 1.0 else values * factor)
        return columns

    def to_dataframe(
        self, names: Sequence[str] | None = None, display: Display | None = None
    ) -> pandas.DataFrame:
        """Give a pandas data frame with units in the headers and the time as index."""
        import pandas

        columns = {
            header(name, unit): values for name, (unit, values) in self.columns(names, display).items()
        }
        index = next(iter(columns))
        return pandas.DataFrame(columns).set_index(index)

    def save(
        self, path: Path | str, names: Sequence[str] | None = None, display: Display | None = None
    ) -> None:
        """Write a CSV, NPZ or JSON file, by the end of its name."""
        from .files import write_results

        write_results(Path(path), self.columns(names, display), self.report)


def header(name: str, unit: str) -> str:
    return f"{name} [{unit}]" if unit else name

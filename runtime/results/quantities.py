"""Quantities over time: a mapping from names to arrays, with units, interpolation, data frames and files."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mechc.suggest import suggest

from ..problem import Array

if TYPE_CHECKING:
    import pandas

Display = Callable[[str, str], tuple[str, float]]
"""(name, SI unit) -> (unit to show, factor from SI)"""


_INDEX = re.compile(r"\[(\d+(?:, ?\d+)*)\]")
_PART = re.compile(r"(?P<part>[A-Za-z_]\w*+(?!\()|\))(?P<index>\[[^\]]*\])?|.")
_ANY = r"(?:\[(\d+(?:, ?\d+)*)\])?"


class Values(dict[str, Array]):
    """Arrays by the names of scalars; the name of a vector or matrix gives its elements along further axes."""

    def __missing__(self, name: str) -> Array:
        return _whole(self, name)


class LazyValues(Mapping[str, Array]):
    """The same, of arrays that are made when somebody asks for them."""

    def __init__(self, names: Iterable[str], make: Callable[[str], Array]) -> None:
        self._names = dict.fromkeys(names)
        self._make = make

    def __getitem__(self, name: str) -> Array:
        return self._make(name) if name in self._names else _whole(self, name)

    def __contains__(self, name: object) -> bool:
        return name in self._names

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)


def _whole(known: Mapping[str, Array], name: str) -> Array:
    """Put a vector or matrix together. Raises KeyError where a name is none of these."""
    pattern = _elements_of(name)
    found = {one: match for one in known if one != name and (match := pattern.fullmatch(one))}
    names = [*found]
    places = [tuple(int(i) for part in m.groups() if part for i in part.split(",")) for m in found.values()]
    if not names:
        raise KeyError(f"there is no '{name}'{suggest(name, names_of(known))}")
    shape = tuple(max(axis) for axis in zip(*places, strict=False))
    if places != [tuple(i + 1 for i in place) for place in np.ndindex(shape)]:
        raise KeyError(f"'{name}' is not a whole array, its elements are {', '.join(names)}")
    first = np.asarray(known[names[0]])
    return np.stack([known[one] for one in names], axis=-1).reshape(*first.shape, *shape)


def names_of(known: Iterable[str]) -> list[str]:
    """Give all names that can be asked for: those of scalars, then of the vectors and matrices that they make up."""
    scalars = list(known)
    return list(dict.fromkeys((*scalars, *(_INDEX.sub("", name) for name in scalars))))


def elements(known: Iterable[str], name: str) -> list[str]:
    """Give the elements of a vector in their order: ``joint.angle`` has ``joint[1].angle``, ``joint[2].angle``, and
    ``joint[1].position`` has ``joint[1].position[1]``."""
    pattern = _elements_of(name)
    return [one for one in known if one != name and pattern.fullmatch(one)]


def _elements_of(name: str) -> re.Pattern[str]:
    """Return what the names of elements look like: with any index after each part that has none."""
    return re.compile(
        _PART.sub(lambda m: re.escape(m[0]) + (_ANY if m["part"] and not m["index"] else ""), name)
    )


class Results(Mapping[str, Array]):
    """``results["theta"]`` is an array along ``results.time``; SI throughout.

    ``results["x"]`` of a vector with the elements ``x[1]``, ``x[2]`` has them as columns; iteration gives the elements.
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
        self._report = report
        self._values = Values(values)
        self._units = dict(units)

    @property
    def report(self) -> Mapping[str, Any] | None:
        """What the run said of itself."""
        return self._report

    def __repr__(self) -> str:
        return f"<results of mechc: {len(self.time)} times, {len(self)} quantities>"

    def __getitem__(self, name: str) -> Array:
        if name == "time":
            return self.time
        return self._values[name]

    def __contains__(self, name: object) -> bool:
        return name == "time" or name in self._values

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def unit(self, name: str) -> str:
        """Give the SI unit of a quantity, "" for a pure number. Raises KeyError where elements have several."""
        units = {part: self._units[part] for part in self.named([name])}
        if len(set(units.values())) > 1:
            each = ", ".join(f"{part} in {unit or '1'}" for part, unit in units.items())
            raise KeyError(f"'{name}' has no single unit: {each}")
        return next(iter(units.values()))

    def named(self, names: Iterable[str]) -> list[str]:
        """Put the elements instead of each vector. Raises KeyError for a name that there is not."""
        found: list[str] = []
        for name in names:
            parts = [name] if name in self else elements(self._values, name)
            if not parts:
                raise KeyError(f"there is no '{name}'{suggest(name, names_of(self._values))}")
            found += parts
        return found

    def __call__(self, time: float | Sequence[float] | Array) -> dict[str, Array]:
        """Interpolate everything at ``time`` (a number or an array) by cubic splines through the points, one between two
        events: there a time stands twice, with both sides, of which the later one is taken.

        Raises ``ValueError`` outside the range of time.
        """
        at = self._inside(time)
        piece = np.r_[0, np.cumsum(np.diff(self.time) == 0)]
        wanted = piece[np.searchsorted(self.time, at, side="right") - 1]
        found = {name: np.empty(at.shape) for name in self._values}
        for k in np.unique(wanted):
            rows, places = piece == k, wanted == k
            for name, values in self._values.items():
                found[name][places] = _interpolated(self.time[rows], values[rows], at[places])
        return Values(found)

    def _inside(self, time: float | Sequence[float] | Array) -> Array:
        at = np.asarray(time, dtype=np.float64)
        if at.size and not (at.min() >= self.time[0] and at.max() <= self.time[-1]):
            raise ValueError(f"results reach from time {self.time[0]:g} to {self.time[-1]:g}")
        return at

    def columns(
        self, names: Sequence[str] | None = None, display: Display | None = None
    ) -> dict[str, tuple[str, Array]]:
        """Give unit and values by name, time first, in the units that ``display`` wants."""
        wanted = self if names is None else self.named(names)
        chosen = {"time": self.time} | {name: self[name] for name in wanted}
        columns: dict[str, tuple[str, Array]] = {}
        for name, values in chosen.items():
            unit, factor = display(name, self.unit(name)) if display else (self.unit(name), 1.0)
            columns[name] = (unit, values if factor == 1.0 else values * factor)
        return columns

    def to_dataframe(
        self, names: Sequence[str] | None = None, display: Display | None = None
    ) -> pandas.DataFrame:
        """Give a pandas data frame with units in the headers and the time as index. Raises ImportError without pandas."""
        try:
            import pandas
        except ImportError:
            raise ImportError("a data frame needs pandas: pip install pandas", name="pandas") from None

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

        write_results(Path(path), self.columns(names), self.report, display)


def _interpolated(t: Array, values: Array, at: Array) -> Array:
    """Interpolate by a cubic spline through the points, by straight lines where they are fewer than four."""
    if t.size < 4:
        return np.interp(at, t, values)
    from scipy.interpolate import CubicSpline

    found: Array = CubicSpline(t, values)(at)
    return found


def header(name: str, unit: str) -> str:
    return f"{name} [{unit}]" if unit else name

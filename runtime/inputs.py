"""Inputs given over time, as tables or functions: their values, their kinks, and how tables are read from a sheet."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path

import numpy as np
from msgspec import Struct

from .outcome import SimulationError
from .problem import Array
from .sheets import Sheet, is_time

ConvertUnit = Callable[[str, str], float]
"""(input name or "time", unit as written) -> factor to SI; raises ``SimulationError`` for a wrong unit."""


class Table(Struct, frozen=True, eq=False):
    """Values of one input over time in SI; the first and the last value hold beyond the ends.

    A time that stands twice is a jump, from the first of its values to the second.
    ``interpolation``: linear, step (holds the value of the row before) or spline (natural cubic). ``remarks``: what
    readers of results should know of how it was read. ``ends``: where steps end, None at its rows or, of a spline, its ends.
    """

    times: Array
    values: Array
    slopes: Array
    interpolation: str
    remarks: tuple[str, ...] = ()
    ends: Array | None = None

    def __call__(self, t: Array) -> Array:
        """Evaluate at ``t``, continuous from the right."""
        x, v = self.times, self.values
        t = np.clip(np.asarray(t, dtype=np.float64), x[0], x[-1])
        i = np.clip(np.searchsorted(x, t, side="right") - 1, 0, max(x.size - 2, 0))
        if x.size == 1:
            return np.full(t.shape, v[0])
        i = np.where(t < x[-1], i, x.size - 1)
        if self.interpolation == "step":
            return v[i]
        following = np.minimum(i + 1, x.size - 1)
        h, d = x[following] - x[i], v[following] - v[i]
        s = (t - x[i]) / np.where(h > 0, h, 1.0)
        if self.interpolation == "linear":
            return v[i] + s * d
        r = 1 - s
        return v[i] + s * (d + r * (r * (h * self.slopes[i] - d) - s * (h * self.slopes[following] - d)))

    def rate(self, t: float) -> float:
        """Give its derivative at ``t``, where it jumps that of what follows."""
        x, v = self.times, self.values
        if self.interpolation == "step" or not x[0] <= t < x[-1]:
            return 0.0
        i = int(np.searchsorted(x, t, side="right")) - 1
        h = x[i + 1] - x[i]
        mean = (v[i + 1] - v[i]) / h
        if self.interpolation == "linear":
            return float(mean)
        s, first, last = (t - x[i]) / h, self.slopes[i], self.slopes[i + 1]
        return float((1 - s) * first + s * last + 3 * s * (1 - s) * (2 * mean - first - last))

    def kinks(self) -> Array:
        """Times at which the value or its slope jumps: each must be the end of a step."""
        if self.ends is not None:
            return self.ends
        if self.times.size == 1:
            return self.times[:0]
        return self.times[[0, -1]] if self.interpolation == "spline" else self.times


def _row(index: int) -> str:
    return f"row {index + 1}"


def make_table(
    times: Sequence[float] | Array,
    values: Sequence[float] | Array,
    interpolation: str = "linear",
    place: Callable[[int], str] = _row,
) -> Table:
    """Check and prepare a table. ``place`` says where a row stands, by its index. Raises ``SimulationError``."""
    x, v = np.array(times, dtype=np.float64), np.array(values, dtype=np.float64)
    if interpolation not in ("linear", "step", "spline"):
        raise SimulationError(f"interpolation is linear, step or spline, not '{interpolation}'")
    if x.ndim != 1 or x.shape != v.shape or x.size == 0:
        raise SimulationError("a table needs as many values as times, and at least one")
    if not (np.isfinite(x).all() and np.isfinite(v).all()):
        raise SimulationError("a table holds finite numbers only")
    _check_order(x, v, interpolation, place)
    slopes = _spline_slopes(x, v) if interpolation == "spline" else np.zeros_like(x)
    return Table(x, v, slopes, interpolation)


def _check_order(times: Array, values: Array, interpolation: str, place: Callable[[int], str]) -> None:
    """Refuse times that fall, three equal ones, and jumps of a smooth curve."""
    steps = np.diff(times)
    falls, jumps = steps < 0, steps == 0
    if falls.any():
        row = int(np.argmax(falls)) + 1
        raise SimulationError(
            f"times of a table must not fall, but in {place(row)} the time {times[row]:g} follows {times[row - 1]:g}"
        )
    if jumps.any() and interpolation == "spline":
        row = int(np.argmax(jumps)) + 1
        raise SimulationError(
            f"a spline has no jumps, but the time {times[row]:g} stands twice, with {values[row - 1]:g} and with {values[row]:g} (in SI) in {place(row)}",
            help="leave one of the two out",
        )
    if (twice := jumps[1:] & jumps[:-1]).any():
        row = int(np.argmax(twice)) + 2
        raise SimulationError(
            f"the time {times[row]:g} stands more than twice, the third time in {place(row)}: a jump has two values"
        )


def derivatives(table: Table) -> tuple[Table, Table]:
    """Return the first and the second derivative of a natural cubic spline, exactly; of a constant they are zero."""
    x, m = table.times, table.slopes
    if x.size == 1:
        return constant(0.0), constant(0.0)
    h, d = np.diff(x), np.diff(table.values) / np.diff(x)
    second = np.append(2 * (3 * d - 2 * m[:-1] - m[1:]) / h, 0.0)
    second[-1] = 2 * (m[-2] + 2 * m[-1] - 3 * d[-1]) / h[-1]
    return Table(x, m, second, "spline"), Table(x, second, np.zeros_like(x), "linear")


def constant(value: float) -> Table:
    return make_table([0.0], [value], "step")


def _spline_slopes(x: Array, v: Array) -> Array:
    """Slopes of the natural cubic spline, by the tridiagonal system for its first derivatives."""
    n = x.size
    if n == 1:
        return np.zeros(1)
    h, d = np.diff(x), np.diff(v) / np.diff(x)
    lower, diagonal, upper, right = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)
    diagonal[0], upper[0], right[0] = 2.0, 1.0, 3 * d[0]
    diagonal[-1], lower[-1], right[-1] = 2.0, 1.0, 3 * d[-1]
    lower[1:-1], upper[1:-1] = h[1:], h[:-1]
    diagonal[1:-1] = 2 * (h[1:] + h[:-1])
    right[1:-1] = 3 * (h[1:] * d[:-1] + h[:-1] * d[1:])
    for i in range(1, n):
        factor = lower[i] / diagonal[i - 1]
        diagonal[i] -= factor * upper[i - 1]
        right[i] -= factor * right[i - 1]
    slopes = np.zeros(n)
    slopes[-1] = right[-1] / diagonal[-1]
    for i in range(n - 2, -1, -1):
        slopes[i] = (right[i] - upper[i] * slopes[i + 1]) / diagonal[i]
    return slopes


def read_tables(
    sheet: Sheet, interpolations: Mapping[str, str], convert: ConvertUnit, column: str | None = None
) -> dict[str, Table]:
    """Make a table of each column of a sheet that is headed ``time [s],torque [N.m],...``.

    ``interpolations`` gives, for each input that exists, how its table is interpolated. With ``column`` the
    table is that of this input only: the column that has its name, or the only one beside the time whatever its header says.
    Raises ``SimulationError`` with file and line.
    """
    path, names = sheet.path, [name for name, _ in sheet.heads]
    clock = time_column(sheet, names, interpolations)
    if column is None:
        chosen = {k: name for k, name in enumerate(names) if k != clock}
    else:
        chosen = {_column_of(path, names, clock, column): column}
    times = np.array(sheet.complete(clock, "time")) * _factor(path, convert, "time", sheet.heads[clock][1])
    tables: dict[str, Table] = {}
    for index, name in chosen.items():
        if name not in interpolations:
            known = ", ".join(sorted(interpolations)) or "none"
            raise SimulationError(f"{path} has a column '{name}', which is not an input (inputs: {known})")
        if name in tables:
            raise SimulationError(f"{path} has two columns '{name}'")
        values = np.array(sheet.complete(index, name)) * _factor(path, convert, name, sheet.heads[index][1])
        tables[name] = make_table(times, values, interpolations[name], sheet.place)
    return tables


def time_column(sheet: Sheet, names: Sequence[str], others: Collection[str]) -> int:
    """Find the column of the time: the one called so, else one with a name for it that is none of ``others``. Raises
    SimulationError."""
    found = [k for k, name in enumerate(names) if name == "time"]
    found = found or [k for k, name in enumerate(names) if is_time(name) and name not in others]
    if len(found) == 1:
        return found[0]
    if found:
        raise SimulationError(
            f"{sheet.path} has {'two' if len(found) == 2 else len(found)} columns '{names[found[0]]}'"
            if len({names[k] for k in found}) == 1
            else f"{sheet.path} has several columns for the time: {', '.join(repr(names[k]) for k in found)}",
            help=f'say which: --columns "{names[found[0]]} = time"',
        )
    there = ", ".join(f"'{name}'" for name in names)
    raise SimulationError(
        f"{sheet.path} has no column 'time'; it has {there}",
        help=f"its head is 'time [s],...', or say which it is: --columns \"{names[0]} = time\""
        if sheet.from_file
        else "call the column of the time 'time [s]'",
    )


def _factor(path: Path, convert: ConvertUnit, name: str, unit: str) -> float:
    try:
        return convert(name, unit)
    except SimulationError as error:
        raise SimulationError(f"{path}: {error.message}", help=error.help) from error


def _column_of(path: Path, names: Sequence[str], clock: int, wanted: str) -> int:
    """Find the column of an input: the only one beside the time, or the one that has its name."""
    if len(names) == 2:
        return 1 - clock
    if names.count(wanted) != 1:
        found = ", ".join(f"'{name}'" for k, name in enumerate(names) if k != clock) or "none"
        raise SimulationError(
            f"{path} needs one column beside the time, or one headed '{wanted}'; it has {found}"
        )
    return names.index(wanted)


class Signal(Struct, frozen=True, eq=False):
    """An input as a function of the time, both in SI."""

    function: Callable[[float], float]

    def table(self, name: str, begin: float, stop: float, tolerance: float) -> Table:
        """Follow the function by cubics, one after the other, as closely as ``tolerance`` of its largest value.

        Where it jumps, and where its slope does, steps of a run end (``Table.ends``). Raises SimulationError.
        """
        edges = np.linspace(begin, stop, FIRST_PIECES + 1)
        pieces, jumps, found = np.column_stack([edges[:-1], edges[1:]]), np.empty(0), []
        largest = 0.0
        while pieces.size:
            a, b = pieces.T
            h = b - a
            v = self._values(name, np.column_stack([a, a + h / 3, a + 2 * h / 3, b]))
            checks = self._values(name, a[:, None] + h[:, None] * _BETWEEN)
            largest = max(largest, float(np.abs(v).max()), float(np.abs(checks).max()))
            first, last = _SLOPES @ v.T
            off = np.abs(np.column_stack([v[:, 0], first, v[:, 3], last]) @ _AT_CHECKS.T - checks).max(axis=1)
            followed, small = off <= tolerance * largest, h <= SMALLEST_PIECE * (stop - begin)
            found.append(np.column_stack([a, v[:, 0], first / h, b, v[:, 3], last / h])[followed])
            jumps = np.append(jumps, b[small & ~followed])
            a, b = pieces[~(followed | small)].T
            pieces = np.concatenate([np.column_stack([a, (a + b) / 2]), np.column_stack([(a + b) / 2, b])])
            if jumps.size > MOST_JUMPS or pieces.size > MOST_PIECES:
                raise SimulationError(
                    f"the function of '{name}' changes too often to be followed over the run, as noise does",
                    help=f"give a table of '{name}'",
                )
        rows = np.concatenate(found)
        t, value, slope = rows[np.argsort(rows[:, 0])].reshape(-1, 3).T.copy()
        bends = np.abs(slope[2::2] - slope[1:-1:2]) > 1e-3 * np.abs(slope).max()
        ends = np.concatenate([[begin, stop], jumps, t[2::2][bends]])
        return Table(t, value, slope, "spline", ends=np.unique(ends))

    def _values(self, name: str, times: Array) -> Array:
        """Call the function at ``times`` [n, m]. Raises SimulationError for what is not a finite number."""
        values = np.array([self._value(name, t) for t in times.ravel().tolist()]).reshape(times.shape)
        if not np.isfinite(values).all():
            k = int(np.argmin(np.isfinite(values)))
            raise SimulationError(f"the function of '{name}' gives {values.flat[k]} at {times.flat[k]:g}")
        return values

    def _value(self, name: str, t: float) -> float:
        found = self.function(t)
        try:
            return float(found)
        except (TypeError, ValueError):
            raise SimulationError(
                f"the function of '{name}' gives {found!r} at {t:g}, and an input is one number"
            ) from None


FIRST_PIECES, MOST_PIECES, MOST_JUMPS = 64, 1_000_000, 10_000
SMALLEST_PIECE = 1e-13
"""Of a run: within it a function jumps."""
_SLOPES = np.array([[-11.0, 18.0, -9.0, 2.0], [-2.0, 9.0, -18.0, 11.0]]) / 2
"""Derivatives at both ends of the cubic through values at 0, 1/3, 2/3 and 1."""
_BETWEEN = np.array([1 / 6, 1 / 2, 5 / 6])
_AT_CHECKS = np.array(
    [[(1 + 2 * s) * (1 - s) ** 2, s * (1 - s) ** 2, s * s * (3 - 2 * s), s * s * (s - 1)] for s in _BETWEEN]
)
"""Hermite's cubic by value and slope at both ends."""

"""Values of tables of one and of two variables: their points and values are numbers that nothing can change.

A short smooth table of one variable is one look-up. All others are formulas of *samples*: an argument lies in a cell, whose index
reads the coefficients of its polynomial or, of two variables, the numbers at its corners. Where a table bends or jumps the index is a whole part, so that events locate the points.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from itertools import chain, pairwise
from typing import TYPE_CHECKING

from msgspec import Struct

from mechc.lang.diagnostics import Reporter
from mechc.lang.source import Span

from ...flat.model import Expression, Literal, Origin, TableData
from ...flat.values.evaluate import Value, constant
from ...graph import Graph, Node, Samples, Table
from ...graph.table import monotone_slopes

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Grid = NDArray[np.float64]

SHORT = 64
"""Points of a smooth table up to which it is looked up by halves, with slopes beside its values."""

SMOOTH = ("smooth", "spline")
Numbers = tuple[float, ...]


class TurningTable(Struct, frozen=True):
    """A table of the graph that is searched for the argument ``x``, with its ``points``. ``bends``: how much it bends at each, by
    ``_bends``."""

    table: int
    x: Node
    points: Numbers
    bends: Numbers
    periodic: bool


class Tables:
    """Tables of one model. ``numbers`` gives the entries of an expression in row-major order; ``data`` what files hold;
    ``located`` takes comparisons and whole parts at which a run stops."""

    def __init__(
        self,
        graph: Graph,
        numbers: Callable[[Expression], Sequence[Node]],
        data: Mapping[str, TableData],
        located: Callable[[Node], None],
        reporter: Reporter,
    ) -> None:
        self._graph = graph
        self._numbers = numbers
        self._data = data
        self._located = located
        self._reporter = reporter
        self.points: dict[Node, None] = {}
        """Whole parts that tell between which points of a table an argument lies."""
        self.bends: dict[Node, None] = {}
        """Those of the located ones across which tables are continuous."""
        self.turning: list[TurningTable] = []
        """Smooth tables, whose second derivative jumps at the points."""
        self.conditions: dict[Node, tuple[Node, str, Origin]] = {}
        """What must hold where tables do not go on beyond their ends, with what to say where it does not."""

    def value(self, *arguments: Expression) -> Node:
        """Return the value of ``table``: x, points, values; then kind and what is outside. Of two variables: x, y, their points,
        values, kind, what is outside."""
        if len(arguments) == 7:
            x, y, *grid = arguments[:5]
            return self._surface((x, y), grid, *map(_word, arguments[5:]))
        x, places, heights = arguments[:3]
        kind, outside = map(_word, arguments[3:]) if len(arguments) > 3 else ("smooth", "extend")
        if isinstance(places, Literal) and isinstance(places.value, str):
            data = self._data[places.value]
            points, values = data.points, data.values
        else:
            points, values = self._constants(places), self._constants(heights)
            if len(points) != len(values):
                raise self._short(points, values, places.span)
            self._check_points(points, values, places)
        (at,) = self._numbers(x)
        return self._curve(at, points, values, kind, outside, x)

    # ------------------------------------------------------------ one variable

    def _curve(
        self, x: Node, points: Numbers, values: Numbers, kind: str, outside: str, x_of: Expression
    ) -> Node:
        graph = self._graph
        x = self._inside(x, points, outside, x_of)
        if kind in SMOOTH:
            slopes = _slopes(points, values, kind, outside)
            if len(points) <= SHORT:
                at = self._wrapped(x, points) if outside == "periodic" else x
                table = graph.add_table(Table(points, values, slopes))
                self._note(table, x, points, _bends(points, values, slopes), kind, outside)
                return graph.lookup(table, at)
            places, coefficients = _cubics(points, values, slopes, straight=outside == "extend")
            table = graph.add_table(Samples(places))
            self._note(table, x, points, _bends(points, values, slopes), kind, outside)
            at = self._wrapped(x, points) if outside == "periodic" else x
            return self._polynomial(graph.cell(table, at), at, places, coefficients)
        jumps = kind == "step" or (outside == "periodic" and values[0] != values[-1])
        place = self._place(x, points, outside, steps=kind == "step", jumps=jumps)
        if kind == "step":
            return self._samples(values)(place.index)
        slopes = tuple(
            (g - f) / (b - a) for (a, b), (f, g) in zip(pairwise(points), pairwise(values), strict=True)
        )
        return self._polynomial(place.index, place.x, points, (values, slopes))

    def _polynomial(self, index: Node, x: Node, points: Numbers, coefficients: Sequence[Numbers]) -> Node:
        """Return the polynomial of a cell in the distance from its point."""
        graph, found = self._graph, self._graph.zero
        s = graph.sub(x, self._samples(points)(index))
        for c in reversed(coefficients):
            found = graph.add(self._samples(c)(index), graph.mul(s, found))
        return found

    def _inside(self, x: Node, points: Numbers, outside: str, x_of: Expression) -> Node:
        """Return an argument as it is held at the ends; where a table is to end there, state that it does not pass them."""
        graph = self._graph
        first, last = (graph.constant(p) for p in (points[0], points[-1]))
        if outside == "hold":
            below, above = graph.less(x, first), graph.less(last, x)
            for one in (below, above):
                self._located(one)
                self.bends[one] = None
            return graph.select(below, first, graph.select(above, last, x))
        if outside == "error":
            holds = graph.logical_and(graph.less_equal(first, x), graph.less_equal(x, last))
            message = f"the argument of a table is between {points[0]:.6g} and {points[-1]:.6g}"
            unit = str(x_of.type.dimension)
            self.conditions[holds] = (holds, f"{message} {unit}".strip(), Origin(x_of.span))
        return x

    def _wrapped(self, x: Node, points: Numbers) -> Node:
        """Return a place in the first period of a table that goes on periodically."""
        graph, first = self._graph, self._graph.constant(points[0])
        period = graph.constant(points[-1] - points[0])
        return graph.add(first, graph.modulo(graph.sub(x, first), period))

    def _note(self, table: int, x: Node, points: Numbers, bends: Numbers, kind: str, outside: str) -> None:
        if kind == "smooth":
            self.turning.append(TurningTable(table, x, points, bends, outside == "periodic"))

    def _cell(self, x: Node, points: Numbers, bends: Numbers, kind: str, outside: str) -> _Cell:
        """Return the cell around a place of what is smooth across cells."""
        graph = self._graph
        table = graph.add_table(Samples(points))
        self._note(table, x, points, bends, kind, outside)
        if outside == "periodic":
            x = self._wrapped(x, points)
        index = graph.cell(table, x)
        low, high = graph.element(table, index), graph.element(table, graph.add(index, graph.one))
        width = graph.sub(high, low)
        return _Cell(index, graph.div(graph.sub(x, low), width), width, outside == "extend")

    def _place(self, x: Node, points: Numbers, outside: str, *, steps: bool, jumps: bool) -> _Place:
        """Return the piece around a place of what bends or jumps between pieces: events locate their ends.

        The index is the whole part of a formula that grows by one from each point to the next. Beyond the ends it stays half a
        unit away from the next whole number.
        """
        graph = self._graph
        periodic = outside == "periodic"
        pieces = len(points) if steps and not periodic else len(points) - 1
        table = graph.add_table(Samples(points))
        last = graph.constant(len(points) - 1)
        period = graph.constant(points[-1] - points[0])
        turns = graph.zero
        if periodic:
            turns = graph.floor(graph.div(graph.sub(x, graph.constant(points[0])), period))
        inner = graph.sub(x, graph.mul(period, turns))
        cell = graph.cell(table, inner)
        inverses = self._samples(tuple(1 / (b - a) for a, b in pairwise(points)))
        along = graph.add(cell, graph.mul(graph.sub(inner, graph.element(table, cell)), inverses(cell)))
        if periodic:
            whole = graph.floor(graph.add(graph.mul(last, turns), along))
            turns = graph.floor(graph.div(whole, last))
            index = graph.sub(whole, graph.mul(last, turns))
            inner = graph.sub(x, graph.mul(period, turns))
        elif pieces == 1:
            whole = index = graph.zero
        else:
            end = graph.sub(graph.constant(pieces), graph.half)
            whole = index = graph.floor(graph.minimum(graph.maximum(along, graph.half), end))
        if not graph.is_constant(whole):
            self._located(whole)
            self.points[whole] = None
            if not jumps:
                self.bends[whole] = None
        low, high = graph.element(table, index), graph.element(table, graph.add(index, graph.one))
        return _Place(index, inner, graph.div(graph.sub(inner, low), graph.sub(high, low)))

    def _samples(self, values: Numbers) -> Callable[[Node], Node]:
        table = self._graph.add_table(Samples(values))
        return lambda index: self._graph.element(table, index)

    # ------------------------------------------------------------ two variables

    def _surface(
        self, arguments: Sequence[Expression], grid: Sequence[Expression], kind: str, outside: str
    ) -> Node:
        graph = self._graph
        *axes, values = (self._constants(e) for e in grid)
        for points, expression in zip(axes, grid, strict=False):
            self._check_points(points, values[: len(points)], expression)
        places = [
            self._inside(self._numbers(e)[0], points, outside, e)
            for e, points in zip(arguments, axes, strict=True)
        ]
        rows = graph.constant(len(axes[1]))
        if kind not in SMOOTH:
            row, column = (
                self._place(
                    x, points, outside, steps=kind == "step", jumps=kind == "step" or outside == "periodic"
                )
                for x, points in zip(places, axes, strict=True)
            )
            corner = graph.add(graph.mul(rows, row.index), column.index)
            read = self._samples(values)
            if kind == "step":
                return read(corner)
            sides = [
                _line(graph, column.share, read(at), read(graph.add(at, graph.one)))
                for at in (corner, graph.add(corner, rows))
            ]
            return _line(graph, row.share, *sides)
        first, second = (
            self._cell(x, points, (math.inf,) * len(points), kind, outside)
            for x, points in zip(places, axes, strict=True)
        )
        corner = graph.add(graph.mul(rows, first.index), second.index)
        f, by_x, by_y, by_both = map(self._samples, _grid_slopes(axes, values, kind, outside))
        ends = [
            [
                second.between(
                    graph, *(n(at) for n in (value, slope) for at in (start, graph.add(start, graph.one)))
                )
                for start in (corner, graph.add(corner, rows))
            ]
            for value, slope in ((f, by_y), (by_x, by_both))
        ]
        return first.between(graph, *ends[0], *ends[1])

    # ------------------------------------------------------------ what is given

    def _check_points(self, points: Numbers, values: Numbers, places: Expression) -> None:
        if len(points) < 2:
            raise self._short(points, values, places.span)
        if any(b <= a for a, b in pairwise(points)):
            raise self._reporter.fail(
                "E0311", "the points of a table must increase", places.span, caption="these do not"
            )

    def _short(self, points: Numbers, values: Numbers, span: Span) -> Exception:
        return self._reporter.fail(
            "E0310",
            f"a table needs as many values as points, at least two: {len(points)} and {len(values)}",
            span,
        )

    def _constants(self, expression: Expression) -> Numbers:
        if math.prod(expression.type.shape) > SHORT and (known := _leaves(constant(expression))) is not None:
            return known  # without a node for each
        result = []
        for item in self._numbers(expression):
            if not self._graph.is_constant(item):
                raise self._reporter.fail(
                    "E0312",
                    "the numbers of a table must be constants",
                    expression.span,
                    caption="this depends on something that can change",
                    help="numbers, or a 'structural parameter'",
                )
            result.append(float(self._graph.value(item)))
        return tuple(result)


class _Cell(Struct, frozen=True):
    """A cell of what is smooth across cells: its index, the ``share`` of it below the place, its ``width``. ``beyond``: the place
    may lie beyond the last cells, where the table goes on as a straight line."""

    index: Node
    share: Node
    width: Node
    beyond: bool

    def between(self, graph: Graph, low: Node, high: Node, slope: Node, end_slope: Node) -> Node:
        """Return the cubic through two values with two slopes."""
        one, s, before, behind = graph.one, self.share, graph.zero, graph.zero
        if self.beyond:  # where two of these meet, derivatives are those on the right
            before = graph.minimum(self.share, graph.zero)
            along = graph.sub(self.share, before)
            s = graph.minimum(along, one)
            behind = graph.sub(along, s)
        square, rest = graph.mul(s, s), graph.sub(one, s)
        rise = graph.mul(square, graph.sub(graph.constant(3), graph.mul(graph.two, s)))
        first = graph.add(graph.mul(s, graph.mul(rest, rest)), before)
        second = graph.sub(behind, graph.mul(square, rest))
        bent = graph.add(graph.mul(first, slope), graph.mul(second, end_slope))
        return graph.add(_line(graph, rise, low, high), graph.mul(self.width, bent))


class _Place(Struct, frozen=True):
    """A piece of what bends or jumps between pieces: its index, the place ``x`` within one period, and the ``share`` of the piece below
    it."""

    index: Node
    x: Node
    share: Node


def _line(graph: Graph, share: Node, low: Node, high: Node) -> Node:
    return graph.add(low, graph.mul(share, graph.sub(high, low)))


def _leaves(value: Value | None) -> Numbers | None:
    """Return the numbers of an array in row-major order."""
    if not isinstance(value, tuple):
        return None
    rows = [
        _leaves(row) if isinstance(row, tuple) else (float(row),) for row in value if not isinstance(row, str)
    ]
    return tuple(chain.from_iterable(row for row in rows if row is not None))


def _word(expression: Expression) -> str:
    assert isinstance(expression, Literal) and isinstance(expression.value, str)
    return expression.value


# ---------------------------------------------------------------- slopes


def _slopes(points: Numbers, values: Numbers, kind: str, outside: str) -> Numbers:
    """Return the slopes at the points."""
    if kind == "spline":
        return tuple(_spline_slopes(points, values, outside, 0).tolist())
    if outside != "periodic":
        return monotone_slopes(points, values)
    # two points more on either side, which the slopes at the ends see
    period, n = points[-1] - points[0], len(points) - 1
    around = [divmod(k, n) for k in range(-2, n + 3)]
    wider = monotone_slopes(
        tuple(points[i] + period * turn for turn, i in around), tuple(values[i] for _, i in around)
    )
    return wider[2:-2]


def _cubics(
    points: Numbers, values: Numbers, slopes: Numbers, *, straight: bool
) -> tuple[Numbers, tuple[Numbers, ...]]:
    """Return points and, of the cell behind each, the coefficients of its polynomial in the distance from it. ``straight``: with a cell
    before the first point and one behind the last, in which the table goes on as a line."""
    ends = zip(pairwise(points), pairwise(values), pairwise(slopes), strict=True)
    found = []
    for (a, b), (f, g), (d, e) in ends:
        h, secant = b - a, (g - f) / (b - a)
        found.append((a, f, d, (3 * secant - 2 * d - e) / h, (d + e - 2 * secant) / (h * h)))
    if straight:
        far = (points[-1] - points[0]) / (len(points) - 1)
        before = (points[0] - far, values[0] - far * slopes[0], slopes[0], 0.0, 0.0)
        found = [before, *found, (points[-1], values[-1], slopes[-1], 0.0, 0.0)]
    places, *coefficients = zip(*found, strict=True)
    return (*places, points[-1] + far if straight else points[-1]), tuple(coefficients)


def _bends(points: Numbers, values: Numbers, slopes: Numbers) -> Numbers:
    """Return how far each cell of a table of cubics leaves the parabola that goes on there, as a share of the range of the values: the
    jump of the second derivative over a cell. At the ends, where something else goes on, it is infinite."""
    _, (*_, c, e) = _cubics(points, values, slopes, straight=False)
    curvatures = [(2 * c[k], 2 * c[k] + 6 * e[k] * (points[k + 1] - points[k])) for k in range(len(c))]
    reach = max(values) - min(values)
    inner = (
        abs(b[0] - a[1]) / 2 * min(points[k + 1] - points[k], points[k] - points[k - 1]) ** 2
        for k, (a, b) in enumerate(pairwise(curvatures), 1)
    )
    return (math.inf, *(bend / reach if reach > 0 else 0.0 for bend in inner), math.inf)


def _spline_slopes(points: Numbers, values: Numbers | Grid, outside: str, axis: int) -> Grid:
    from scipy.interpolate import CubicSpline

    ends = "periodic" if outside == "periodic" else "not-a-knot"
    slopes: Grid = CubicSpline(points, values, axis, ends)(points, 1)
    return slopes


def _grid_slopes(axes: Sequence[Numbers], values: Numbers, kind: str, outside: str) -> tuple[Numbers, ...]:
    """Return values and slopes by x, by y and by both. Of smooth tables the last one is the mean of both orders."""
    import numpy as np

    def along(axis: int, given: Grid) -> Grid:
        if kind == "spline":
            return _spline_slopes(axes[axis], given, outside, axis)
        lines = np.moveaxis(given, axis, 1)
        found = [_slopes(axes[axis], tuple(line.tolist()), kind, outside) for line in lines]
        return np.moveaxis(np.array(found), 1, axis)

    f = np.reshape(values, [len(points) for points in axes])
    by_x, by_y = along(0, f), along(1, f)
    by_both = (along(1, by_x) + along(0, by_y)) / 2
    return tuple(tuple(grid.ravel().tolist()) for grid in (f, by_x, by_y, by_both))

"""Systems of nonlinear equations solved by Newton's method in the graph, from a guess.

A step is shortened where it diverges: where the next step with the same derivatives would not be shorter, relative to the
unknowns. Residuals are not a measure, as a row that is nearly solved may outweigh all that are not.
P. Deuflhard, Newton Methods for Nonlinear Problems, Springer 2004, section 3.3 (the natural test of monotonicity).
When steps have become small, one more makes the result exact to rounding; numeric code skips the remaining
steps (compiler/program/branches.py). Its derivatives are those of the implicit function, not of the steps: for one unknown
those of a further step from it, for several those of n steps, which are exact up to the order 2^n - 1 (``Graph.derived``).
With more equations than unknowns the steps are those of least squares, and all equations must hold. Where none is found the
result is not a number.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property, reduce

from msgspec import Struct
from msgspec.structs import replace

from .. import operations as ops
from ..differentiate import jacobian
from ..node import Graph, Node
from ..rewrite import substitute
from ..solution import Solution, SolutionPart
from .eliminate import solve

STEPS = 30
"""Most steps of the iteration, those that are taken back included."""

PLAIN = 6
"""Whole steps before these: nearly always they suffice, and they need no more than the rows and their derivatives."""

MOST_PLAIN = 3
"""Unknowns of systems that are solved so: code for more is so long that it is rolled up, with all steps computed."""

SMALL = 1e-9
"""Step, as a share of the unknown, at which the iteration ends; an unknown whose steps stay larger is not determined."""

VANISHING = 1e-5
"""An unknown smaller than this share of the largest value on its way is measured against that value."""

ROUNDING = 1e-15
"""Residual, as a share of its terms, that no step makes smaller."""

NOTHING = 1e-13
"""Step, as a share of what changes a row by all of its terms, that may be rounding."""

Nodes = tuple[Node, ...]


class _Point(Struct, frozen=True):
    """``residual`` and ``matrix`` (rows of derivatives) at ``values``; ``sizes`` of the terms of each row, ``largest``
    of each unknown so far."""

    values: Nodes
    residual: Nodes
    matrix: tuple[Nodes, ...]
    sizes: Nodes
    largest: Nodes


def newton(
    graph: Graph,
    rows: Sequence[Node],
    unknowns: Sequence[Node],
    guess: Sequence[Node],
    polish: int = 1,
    *,
    along: bool = False,
) -> Nodes:
    """Return what makes all rows vanish, found from a guess, with the derivatives of so many last steps. Raises DivisionByZero where
    they determine nothing there. ``along``: steps are solved along the structure, each row for its own unknown, so that the cost grows with
    the number of unknowns and not with its cube; their derivatives must not vanish."""
    system = _System(graph, rows, unknowns, along=along)
    point = system.at(tuple(guess), tuple(map(graph.abs, guess)))
    if system.linear:
        scale = system.scale(point)
        step = system.step(point)
        point = system.at(tuple(map(graph.add, point.values, step)), point.largest)
        rest = system.step(point)  # of what rounding leaves beside the guess
        return system.checked(tuple(map(graph.add, point.values, rest)), system.small(point, rest, scale))
    if len(rows) == len(unknowns) <= MOST_PLAIN:
        close, start = system.plainly(point)
        result = tuple(map(graph.select, (close,) * len(start), start, system.shortened(start)))
    else:
        result = system.shortened(tuple(guess))
    formulas = tuple(graph.derived(n, graph.zero) for n in result)
    solution = system.solution(tuple(guess))
    for k, n in enumerate(formulas):
        graph.solutions.setdefault(n, SolutionPart(solution, k))
    for _ in range(1 if system.alone else polish):
        last = system.at(formulas, tuple(map(graph.abs, formulas)))
        formulas = tuple(map(graph.add, formulas, system.step(last)))
    return tuple(map(graph.derived, result, formulas))


def linear_solution(graph: Graph, rows: Sequence[Node], unknowns: Sequence[Node]) -> Nodes:
    """Return what makes rows vanish that are affine in the unknowns; it is affine in what the rows are affine in."""
    zeros = (graph.zero,) * len(unknowns)
    system = _System(graph, rows, unknowns)
    point = system.at(zeros, zeros)
    if len(rows) == len(unknowns) == 1:
        return system.step(point)
    sizes = tuple(graph.sum(map(graph.abs, line)) for line in point.matrix)
    return system.step(replace(point, sizes=sizes))


def linearised(
    graph: Graph, rows: Sequence[Node], unknowns: Sequence[Node]
) -> tuple[tuple[Nodes, ...], Nodes]:
    """Return the derivatives of rows by unknowns, row by row, and the sizes of the terms of rows."""
    point = _System(graph, rows, unknowns).at(tuple(unknowns), tuple(map(graph.abs, unknowns)))
    return point.matrix, point.sizes


class _System:
    def __init__(
        self, graph: Graph, rows: Sequence[Node], unknowns: Sequence[Node], *, along: bool = False
    ) -> None:
        self.graph, self.rows, self.unknowns = graph, list(rows), list(unknowns)
        self.alone = len(rows) == len(unknowns) == 1
        self.along = along
        self.slopes = jacobian(graph, self.rows, self.unknowns)
        self.terms = [terms_of(graph, row) for row in rows]
        symbols = set(unknowns)
        self.linear = not any(
            symbols & set(graph.support(slope)) for row in self.slopes for slope in row.values()
        )

    def solution(self, guess: Nodes) -> Solution:
        """Return what is solved, for programs that repeat steps in a loop."""
        number, terms = len(self.graph.solutions), tuple(map(tuple, self.terms))
        return Solution(number, tuple(self.unknowns), guess, tuple(self.rows), tuple(self.slopes), terms)

    def plainly(self, point: _Point) -> tuple[Node, Nodes]:
        """Return whether whole steps become small soon, and what they lead to: the solution, or the last point of those that came nearer."""
        graph = self.graph
        found: list[tuple[Node, Nodes, Nodes, Node]] = []
        for k in range(PLAIN):
            step = self.step(point)
            end = tuple(map(graph.add, point.values, step))
            small = graph.one
            for x, d in zip(point.values, step, strict=True):
                limit = graph.mul(graph.constant(SMALL), graph.abs(x))
                small = graph.logical_and(small, graph.less_equal(graph.abs(d), limit))
            if k == PLAIN - 1:  # whether the last one came nearer is not asked
                found.append((small, end, point.values, graph.zero))
                break
            tried = self.at(end, point.largest)
            found.append((small, end, point.values, self.nearer(tried, point, step)))
            point = tried
        close, result = graph.zero, point.values
        for small, end, start, better in reversed(found):
            close = graph.select(small, graph.one, graph.select(better, close, graph.zero))
            result = tuple(
                graph.select(small, a, graph.select(better, b, c))
                for a, b, c in zip(end, result, start, strict=True)
            )
        return close, result

    def shortened(self, guess: Nodes) -> Nodes:
        """Return the solution that steps lead to, shortened where they lead away."""
        graph = self.graph
        point = self.at(guess, tuple(map(graph.abs, guess)))
        scale = self.scale(point)
        fraction = graph.one
        found: list[tuple[Node, Nodes]] = []
        for _ in range(STEPS):
            step = self.step(point)
            found.append((self.small(point, step, scale), tuple(map(graph.add, point.values, step))))
            moved = tuple(
                graph.add(x, graph.mul(fraction, d)) for x, d in zip(point.values, step, strict=True)
            )
            tried = self.at(moved, point.largest)
            better = self.nearer(tried, point, step)
            longer = graph.minimum(graph.one, graph.mul(graph.two, fraction))
            fraction = graph.select(better, longer, graph.mul(graph.mul(graph.half, graph.half), fraction))
            point = self.chosen(better, tried, point)
        nowhere = undefined(graph, point.values[0])
        result: Nodes = (nowhere,) * len(guess)
        for small, end in reversed(found):
            result = tuple(graph.select(small, a, b) for a, b in zip(end, result, strict=True))
        return result

    def at(self, values: Nodes, largest: Nodes) -> _Point:
        graph = self.graph
        places = dict(zip(self.unknowns, values, strict=True))
        residual = substitute(graph, self.rows, places)
        largest = tuple(map(graph.maximum, largest, map(graph.abs, values)))
        matrix, sizes = [], []
        for row, terms in zip(self.slopes, self.terms, strict=True):
            slopes = dict(zip(row, substitute(graph, list(row.values()), places), strict=True))
            line = tuple(slopes.get(j, graph.zero) for j in range(len(values)))
            size = graph.zero
            for term in substitute(graph, terms, places):
                size = graph.add(size, graph.abs(term))
            for j, slope in sorted(slopes.items()):
                size = graph.add(size, graph.mul(graph.abs(slope), largest[j]))
            matrix.append(line)
            sizes.append(size)
        return _Point(values, tuple(residual), tuple(matrix), tuple(sizes), largest)

    def chosen(self, condition: Node, a: _Point, b: _Point) -> _Point:
        def choose(x: Nodes, y: Nodes) -> Nodes:
            return tuple(self.graph.select(condition, m, n) for m, n in zip(x, y, strict=True))

        return _Point(
            choose(a.values, b.values),
            choose(a.residual, b.residual),
            tuple(choose(x, y) for x, y in zip(a.matrix, b.matrix, strict=True)),
            choose(a.sizes, b.sizes),
            choose(a.largest, b.largest),
        )

    @cached_property
    def _structured(self) -> tuple[Nodes, Nodes]:
        """Return symbols for residuals, and the step for them by the derivatives at the unknowns."""
        graph = self.graph
        steps = [graph.symbol(f"#step {k}") for k in range(len(self.unknowns))]
        left = tuple(graph.symbol(f"#residual {k}") for k in range(len(self.rows)))
        equations = [
            graph.add(graph.dot(list(row.values()), [steps[j] for j in row]), h)
            for row, h in zip(self.slopes, left, strict=True)
        ]
        return left, solve(graph, equations, steps).solutions

    def _share(self, value: Node, size: Node) -> Node:
        """Return a share of a size; the value where all terms vanish together."""
        graph = self.graph
        return graph.div(value, graph.select(graph.less(graph.zero, size), size, graph.one))

    def nearer(self, tried: _Point, point: _Point, step: Nodes) -> Node:
        """Tell whether a point is nearer to a solution than the one from where a step led to it."""
        if self.alone:
            return self.graph.less(self.graph.abs(tried.residual[0]), self.graph.abs(point.residual[0]))
        rest = self._solved(point, tried.residual)
        return self._fewer(rest, step, tried.largest)

    def _fewer(self, a: Nodes, b: Nodes, sizes: Nodes) -> Node:
        """Compare sums of squares, in shares of sizes."""
        totals = []
        for values in (a, b):
            total = self.graph.zero
            for x, size in zip(values, sizes, strict=True):
                share = self._share(x, size)
                total = self.graph.add(total, self.graph.mul(share, share))
            totals.append(total)
        return self.graph.less(*totals)

    def small(self, point: _Point, step: Nodes, scale: Nodes) -> Node:
        """Tell whether a step changes nothing any more; or, of an unknown that is zero, nothing of its ``scale``, and all rows are rounding
        of their terms. All rows of more than unknowns have to agree."""
        graph, result, still = self.graph, self.graph.one, self.graph.one
        for x, d, largest, whole in zip(point.values, step, point.largest, scale, strict=True):
            size = graph.maximum(graph.abs(x), graph.mul(graph.constant(VANISHING), largest))
            limits = graph.mul(graph.constant(SMALL), size), graph.mul(graph.constant(NOTHING), whole)
            result, still = (
                graph.logical_and(found, graph.less_equal(graph.abs(d), limit))
                for found, limit in zip((result, still), limits, strict=True)
            )
        if len(self.rows) > len(self.unknowns):
            return graph.logical_and(result, self._vanishing(point, SMALL))
        return graph.logical_or(result, graph.logical_and(still, self._vanishing(point, ROUNDING)))

    def scale(self, point: _Point) -> Nodes:
        """Return the change of each unknown that changes a row by the sum of its terms."""
        graph = self.graph
        found = []
        for j in range(len(self.unknowns)):
            sizes = [
                graph.div(size, graph.abs(line[j]))
                for size, line in zip(point.sizes, point.matrix, strict=True)
                if line[j] != graph.zero
            ]
            found.append(reduce(graph.minimum, sizes) if sizes else graph.zero)
        return tuple(found)

    def _vanishing(self, point: _Point, share: float) -> Node:
        """Tell whether all rows are at most such a share of their terms."""
        graph, result = self.graph, self.graph.one
        for h, size in zip(point.residual, point.sizes, strict=True):
            limit = graph.mul(graph.constant(share), size)
            result = graph.logical_and(result, graph.less_equal(graph.abs(h), limit))
        return result

    def checked(self, values: Nodes, small: Node) -> Nodes:
        """Return the values where they are a solution, else no numbers."""
        graph = self.graph
        nowhere = undefined(graph, values[0])
        return tuple(graph.select(small, x, nowhere) for x in values)

    def step(self, point: _Point) -> Nodes:
        """Return the step of Newton's method."""
        return self._solved(point, point.residual)

    def _solved(self, point: _Point, residual: Nodes) -> Nodes:
        """Return what makes a residual vanish by the derivatives of a point, rows as shares of their sizes."""
        graph, count = self.graph, len(self.unknowns)
        if self.alone:
            return (graph.neg(graph.div(residual[0], point.matrix[0][0])),)
        if self.along:
            symbols, solutions = self._structured
            places = dict(zip(self.unknowns, point.values, strict=True))
            places |= zip(symbols, residual, strict=True)
            return tuple(substitute(graph, solutions, places))
        rows = [
            [self._share(x, size) for x in (*line, graph.neg(h))]
            for line, h, size in zip(point.matrix, residual, point.sizes, strict=True)
        ]
        if len(rows) > count:
            columns = list(zip(*rows, strict=True))
            rows = [[graph.dot(columns[i], columns[j]) for j in range(count + 1)] for i in range(count)]
        return pivoted(graph, rows)


def undefined(graph: Graph, x: Node) -> Node:
    """Return what is not a number whatever a number is: no constant, which would be computed before the run."""
    return graph.acos(graph.add(graph.two, graph.abs(x)))


def pivoted(graph: Graph, rows: list[list[Node]]) -> Nodes:
    """Solve linear equations, the right side after each row, by elimination with the largest pivots."""
    count = len(rows)
    for k in range(count):
        for i in range(k + 1, count):
            if rows[i][k] == graph.zero:
                continue
            larger = graph.less(graph.abs(rows[k][k]), graph.abs(rows[i][k]))
            pairs = list(zip(rows[k], rows[i], strict=True))
            rows[k] = [graph.select(larger, b, a) for a, b in pairs]
            rows[i] = [graph.select(larger, a, b) for a, b in pairs]
        for i in range(k + 1, count):
            if rows[i][k] == graph.zero:
                continue
            factor = graph.div(rows[i][k], rows[k][k])
            rows[i] = [
                graph.sub(b, graph.mul(factor, a)) if j > k else graph.zero
                for j, (a, b) in enumerate(zip(rows[k], rows[i], strict=True))
            ]
    found: dict[int, Node] = {}
    for k in reversed(range(count)):
        rest = rows[k][count]
        for j in range(k + 1, count):
            rest = graph.sub(rest, graph.mul(rows[k][j], found[j]))
        found[k] = graph.div(rest, rows[k][k])
    return tuple(found[k] for k in range(count))


def terms_of(graph: Graph, node: Node) -> list[Node]:
    """Return what a node is a sum of."""
    found, pending = [], [node]
    while pending:
        n = pending.pop()
        if graph.op(n) in (ops.ADD, ops.SUB, ops.NEG):
            pending.extend(graph.args(n))
        else:
            found.append(n)
    return found

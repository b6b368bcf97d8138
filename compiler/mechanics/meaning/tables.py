"""Values of a table at an argument: its points and values are numbers that nothing can change."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

from mechc.lang.diagnostics import Reporter

from ...flat.model import Expression
from ...graph import Graph, Node
from ...graph.table import monotone_table


class Tables:
    """Tables of one model. ``numbers`` gives the entries of an expression in row-major order."""

    def __init__(
        self, graph: Graph, numbers: Callable[[Expression], Sequence[Node]], reporter: Reporter
    ) -> None:
        self._graph = graph
        self._numbers = numbers
        self._reporter = reporter

    def value(self, argument: Expression, places: Expression, heights: Expression) -> Node:
        """Return the value at an argument of the table with some heights at some places."""
        points, values = self._constants(places), self._constants(heights)
        if len(points) != len(values) or len(points) < 2:
            raise self._reporter.fail(
                "E0310",
                f"a table needs as many values as points, at least two: {len(points)} and {len(values)}",
                places.span,
            )
        if any(b <= a for a, b in pairwise(points)):
            raise self._reporter.fail(
                "E0311", "the points of a table must increase", places.span, caption="these do not"
            )
        (at,) = self._numbers(argument)
        return self._graph.lookup(self._graph.add_table(monotone_table(points, values)), at)

    def _constants(self, expression: Expression) -> tuple[float, ...]:
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

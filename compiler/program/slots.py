"""Expressions in the form in which their Taylor series are cheap: constants and signs in front of products, and powers
of one base as one power."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from fractions import Fraction
from typing import Final

from ..graph import Graph, Node, Samples, Table
from ..graph import operations as ops
from ..graph.operations import ADD, CONST, DIV, FLOOR, MUL, NEG, POW, SELECT, SQRT, SUB
from .model import Literal, Load, Lookup, Operate, ProgramFunction, Store


class NoSeries(Exception):
    """A function has no Taylor series, or none that is known. The message says which and why."""


def rates_of(
    function: ProgramFunction, tables: Sequence[Table | Samples], *, located: bool
) -> tuple[SlotGraph, list[Node]]:
    """Return the rates of a function of one body; states whose rates are zero, as the spin of a symmetric top, count as constants.
    Raises NoSeries."""
    form = SlotGraph(tables, located=located)
    rates = form.read(function)
    still = {i for i, rate in enumerate(rates) if form.graph.is_constant(rate) and not form.graph.value(rate)}
    if still:
        form = SlotGraph(tables, still, located=located)
        rates = form.read(function)
    return form, rates


class SlotGraph:
    """A graph of its own, without the rules by which others recognise equal values: here the form is the purpose.

    ``symbols``: of the arrays of the function that is read; what depends on p, z and the states that are ``still`` alone is
    ``constant`` in time. So are whole parts where events are ``located`` whenever one changes. ``refusals``: why a node has no series.
    """

    def __init__(
        self, tables: Sequence[Table | Samples] = (), still: Collection[int] = (), *, located: bool = False
    ) -> None:
        self.graph = Graph(by_value=False)
        self.graph.tables = list(tables)
        self.located = located
        self.refusals: dict[Node, str] = {}
        self.still = still
        self.symbols: dict[tuple[str, int], Node] = {}
        self._constant: dict[Node, bool] = {}
        self._power_of: dict[Node, tuple[Node, Fraction]] = {}

    def symbol(self, array: str, index: int) -> Node:
        """Return the symbol of a number of an array."""
        key = (array, index)
        if key not in self.symbols:
            self.symbols[key] = n = self.graph.symbol(f"{array}[{index}]")
            self._constant[n] = array in ("p", "z") or (array == "y" and index in self.still)
        return self.symbols[key]

    def constant(self, n: Node) -> bool:
        """Whether a node is the same at all times."""
        known = self._constant
        for a in self.graph.reach([n], known) if n not in known else ():
            if a not in known:
                known[a] = all(known[b] for b in self.graph.args(a))
        return known[n]

    def read(self, function: ProgramFunction) -> list[Node]:
        """Return the results of a function of one body."""
        (body,) = function.bodies
        results = [self.graph.zero] * function.n_out
        values: list[Node] = []
        for statement in body:
            value = self.graph.zero
            match statement:
                case Load(array, index):
                    value = self.symbol(array, index)
                case Literal(number):
                    value = self.graph.constant(number)
                case Operate(code, operands):
                    value = self.operation(code, [values[k] for k in operands])
                case Lookup(table, order, operand):
                    value = self.graph.lookup(table, values[operand], order)
                    if not self.constant(values[operand]):
                        self.refusals[value] = (
                            "its rates hold a look-up table, which is made of pieces without a common Taylor series"
                        )
                case Store(_, index, operand):
                    results[index] = values[operand]
            values.append(value)
        return results

    def operation(self, code: int, args: Sequence[Node]) -> Node:
        """Return an operation in the form that suits series."""
        graph = self.graph
        if code == ADD:
            return graph.add(*args)
        if code == SUB:
            return graph.sub(*args)
        if code == MUL:
            return self.mul(*args)
        if code == DIV:
            return self.div(*args)
        if code == SQRT:
            return self.power(args[0], Fraction(1, 2))
        if code == POW and graph.op(args[1]) == CONST:
            return self.power(args[0], graph.value(args[1]))
        n = graph.apply(code, *args)
        if all(self.constant(a) for a in args):
            return n
        if code == FLOOR and self.located:
            self._constant[n] = True
        elif code == SELECT and not self.constant(args[0]):
            self.refusals[n] = (
                "its rates hold a choice that depends on the motion, which has no Taylor series where it changes"
            )
        elif code in PIECEWISE:
            self.refusals[n] = (
                f"its rates hold '{ops.OPERATIONS[code].name}', which has no Taylor series where its pieces meet"
            )
        return n

    def mul(self, x: Node, y: Node) -> Node:
        graph = self.graph
        if graph.op(x) == NEG:
            return graph.neg(self.mul(graph.args(x)[0], y))
        if graph.op(y) == NEG:
            return graph.neg(self.mul(x, graph.args(y)[0]))
        if self.constant(y):
            x, y = y, x
        if self.constant(x):
            factor, rest = self._factor(y)
            if factor is None or self.constant(y):
                return graph.mul(x, y)
            return self.mul(graph.mul(x, factor), rest)
        for p, q in ((x, y), (y, x)):
            factor, rest = self._factor(p)
            if factor is not None:
                return self.mul(factor, self.mul(rest, q))
        (a, i), (b, j) = (self._power_of.get(n, (n, Fraction(1))) for n in (x, y))
        if a == b and (i != 1 or j != 1):
            return self.power(a, i + j)
        for n, base, exponent in ((y, a, i), (x, b, j)):
            if exponent == -1:  # one quotient instead of an inverse and a product
                return graph.div(n, base)
        return graph.mul(x, y)

    def _factor(self, n: Node) -> tuple[Node | None, Node]:
        """Return the constant factor of a product, if it has one, and the other one."""
        if self.graph.op(n) == MUL:
            x, y = self.graph.args(n)
            if self.constant(x):
                return x, y
            if self.constant(y):
                return y, x
        return None, n

    def div(self, x: Node, y: Node) -> Node:
        graph = self.graph
        if self.constant(x) and self.constant(y):
            return graph.div(x, y)
        if self.constant(y):
            return self.mul(graph.div(graph.one, y), x)
        if graph.op(y) == NEG:
            return graph.neg(self.div(x, graph.args(y)[0]))
        if graph.op(x) == NEG:
            return graph.neg(self.div(graph.args(x)[0], y))
        factor, rest = self._factor(y)
        if factor is not None:
            return self.mul(graph.div(graph.one, factor), self.div(x, rest))
        base, exponent = self._power_of.get(y, (y, Fraction(1)))
        if exponent != 1:
            return self.mul(x, self.power(base, -exponent))
        if self.constant(x):
            return self.mul(x, self.power(y, Fraction(-1)))
        return graph.div(x, y)

    def power(self, base: Node, exponent: Fraction) -> Node:
        graph = self.graph
        if base in self._power_of:
            base, inner = self._power_of[base]
            exponent *= inner
        if exponent.denominator == 1 and exponent >= 0:
            return graph.power(base, exponent)
        if exponent == HALF:
            n = graph.sqrt(base)
        elif exponent == -1:
            n = graph.div(graph.one, base)
        else:
            n = graph._opaque(POW, base, graph.constant(exponent))
        if not self.constant(n):
            self._power_of[n] = (base, exponent)
        return n


HALF: Final = Fraction(1, 2)

PIECEWISE: Final = frozenset(row.code for row in ops.OPERATIONS if row.jumps or row.kinks or row.condition)
"""Operations without one series for all values of their arguments."""

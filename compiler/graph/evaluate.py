"""Evaluate nodes with numbers: floats or mpmath, through one table of functions each.

For tests and numerical checks at compile time; the targets write their own code. As in C, nothing raises:
1/0 is infinite, sqrt(-1) is NaN, and a select drops what it does not choose.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from copy import copy
from fractions import Fraction
from functools import partial
from typing import Any

from msgspec import Struct

from . import operations as ops
from .node import Graph, Node
from .table import Samples, Table


class Numbers(Struct, frozen=True):
    """A kind of number: how constants become one, the functions by code, and interpolation of tables."""

    constant: Callable[[Fraction], Any]
    functions: Mapping[int, Callable[..., Any]]
    interpolate: Callable[[Any, Any, int], Any]


def evaluate(
    graph: Graph, outputs: Sequence[Node], environment: Mapping[Node, Any], numbers: Numbers | None = None
) -> list[Any]:
    """Return the values of the outputs. Raises KeyError for a symbol that ``environment`` does not have.

    ``environment`` may also give values of inner nodes, which then are not computed.
    """
    values = evaluate_all(graph, outputs, environment, numbers)
    return [values[n] for n in outputs]


def evaluate_all(
    graph: Graph, outputs: Iterable[Node], environment: Mapping[Node, Any], numbers: Numbers | None = None
) -> dict[Node, Any]:
    """Return the values of the outputs, of all that they depend on, and of the environment."""
    return Tape(graph, outputs, environment, numbers)(environment)


class Tape:
    """The steps that lead from known nodes to outputs, found once and played for many values."""

    def __init__(
        self, graph: Graph, outputs: Iterable[Node], known: Iterable[Node], numbers: Numbers | None = None
    ) -> None:
        """Raises KeyError for a symbol that is not among the known nodes."""
        numbers = numbers or FLOATS
        self._outputs = frozenset(outputs := list(outputs))
        self._exact = numbers is not FLOATS
        self._constants: dict[Node, Any] = {}
        self._steps: list[tuple[Node, Callable[..., Any], tuple[Node, ...]]] = []
        for n in graph.reach(outputs, known):
            code = graph.op(n)
            if code == ops.CONST:
                self._constants[n] = numbers.constant(graph.value(n))
            elif code == ops.SYMBOL:
                raise KeyError(graph.name(n))
            elif code == ops.LOOKUP:
                index, order = graph.table_of(n)
                look_up = partial(_look_up, numbers.interpolate, graph.tables[index], order)
                self._steps.append((n, look_up, graph.args(n)[:1]))
            else:
                self._steps.append((n, numbers.functions[code], graph.args(n)))

    def __call__(self, environment: Mapping[Node, Any]) -> dict[Node, Any]:
        """Return the values of the environment, of the outputs, and of all between them."""
        values = self._numbers(environment) | self._constants
        read = values.__getitem__
        for n, function, arguments in self._steps:
            values[n] = function(*map(read, arguments))
        return values

    def settled(self, environment: Mapping[Node, Any]) -> Tape:
        """Return a tape that is played many times for the rest of what is known: what these values decide is computed here.

        It gives the values of the outputs, not of all between them.
        """
        values = self._numbers(environment) | self._constants
        left = []
        for n, function, arguments in self._steps:
            if all(a in values for a in arguments):
                values[n] = function(*[values[a] for a in arguments])
            else:
                left.append((n, function, arguments))
        used = self._outputs.union(*(arguments for _, _, arguments in left))
        tape = copy(self)
        tape._steps, tape._constants = left, {n: x for n, x in values.items() if n in used}
        return tape

    def function(self, argument: Node, outputs: Sequence[Node]) -> Callable[[Any], tuple[Any, ...]]:
        """Return the values of outputs as a function of the one node that is left: a call takes a fifth of the time, making it that
        of a hundred calls."""
        held: dict[str, Any] = {f"v{n}": x for n, x in self._constants.items()}
        lines = [f"def values(v{argument}):"]
        for k, (n, function, arguments) in enumerate(self._steps):
            held[f"f{k}"] = function
            lines.append(f"    v{n} = f{k}({', '.join(f'v{a}' for a in arguments)})")
        lines.append(f"    return ({' '.join(f'v{n},' for n in outputs)})")
        exec("\n".join(lines), held)
        made: Callable[[Any], tuple[Any, ...]] = held["values"]
        return made

    def _numbers(self, environment: Mapping[Node, Any]) -> dict[Node, Any]:
        if self._exact:
            return dict(environment)
        # NumPy's scalars would warn, and know no difference of truth values
        return {n: float(value) for n, value in environment.items()}


def _look_up(interpolate: Callable[[Any, Any, int], Any], table: Table | Samples, order: int, x: Any) -> Any:
    return interpolate(table, x, order)


FLOATS = Numbers(
    float,
    {row.code: row.value for row in ops.OPERATIONS if row.value is not None},
    lambda table, x, order: table(x, order),
)


def multiprecision(context: Any) -> Numbers:
    """Return the numbers of an mpmath context (``mpmath.mp``); tables are evaluated in floats."""

    def real(f: Callable[..., Any]) -> Callable[..., Any]:
        def checked(*x: Any) -> Any:
            try:
                y = f(*x)
            except (ZeroDivisionError, ValueError):
                return context.nan
            return context.nan if isinstance(y, context.mpc) else y

        return checked

    return Numbers(
        lambda c: context.mpf(c.numerator) / c.denominator,
        {
            **FLOATS.functions,
            **{row.code: real(row.digits(context)) for row in ops.OPERATIONS if row.digits is not None},
        },
        lambda table, x, order: context.mpf(table(float(x), order)),
    )

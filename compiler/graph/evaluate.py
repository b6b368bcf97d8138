"""Evaluate nodes with numbers: floats or mpmath, through one table of functions each.

For tests and numerical checks at compile time; the targets write their own code. As in C, nothing raises:
1/0 is infinite, sqrt(-1) is NaN, and a select drops what it does not choose.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from fractions import Fraction
from functools import partial
from typing import Any

from msgspec import Struct

from . import operations as ops
from .node import Graph, Node
from .table import Table


class Numbers(Struct, frozen=True):
    """A kind of number: how constants become one, the functions by code, and interpolation of tables."""

    constant: Callable[[Fraction], Any]
    functions: Mapping[int, Callable[..., Any]]
    interpolate: Callable[[Table, Any, int], Any]


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
        values = dict(environment)
        if not self._exact:  # NumPy's scalars would warn, and know no difference of truth values
            values = {n: float(value) for n, value in environment.items()}
        values |= self._constants
        for n, function, arguments in self._steps:
            values[n] = function(*[values[a] for a in arguments])
        return values


def _look_up(interpolate: Callable[[Table, Any, int], Any], table: Table, order: int, x: Any) -> Any:
    return interpolate(table, x, order)


def _or_nan(f: Callable[..., float]) -> Callable[..., float]:
    """Return the function with NaN outside its domain and infinity where it overflows."""

    def safe(*x: float) -> float:
        try:
            return f(*x)
        except ValueError:
            return math.nan
        except OverflowError:
            return math.inf

    return safe


def _divide(a: float, b: float) -> float:
    if b:
        return a / b
    return math.copysign(math.inf, math.copysign(1.0, a) * math.copysign(1.0, b)) if a else math.nan


def _log(x: float) -> float:
    if x > 0.0:
        return math.log(x)
    return -math.inf if x == 0.0 else math.nan


def _atanh(x: float) -> float:
    return math.copysign(math.inf, x) if abs(x) == 1.0 else _or_nan(math.atanh)(x)


def _sign(x: float) -> float:
    return (x > 0) - (x < 0) if x == x else x


def _power(a: float, b: float) -> float:
    if a == 0.0 and b < 0.0:
        return math.inf
    return math.pow(a, b)


def _sinh(x: float) -> float:
    try:
        return math.sinh(x)
    except OverflowError:
        return math.copysign(math.inf, x)


ARITHMETIC: dict[int, Callable[..., Any]] = {
    ops.ADD: lambda a, b: a + b,
    ops.SUB: lambda a, b: a - b,
    ops.MUL: lambda a, b: a * b,
    ops.NEG: lambda a: -a,
    ops.LESS: lambda a, b: a < b,
    ops.LESS_EQUAL: lambda a, b: a <= b,
    ops.EQUAL: lambda a, b: a == b,
}

_SCALAR = ARITHMETIC | {
    ops.AND: lambda a, b: bool(a) and bool(b),
    ops.OR: lambda a, b: bool(a) or bool(b),
    ops.NOT: lambda a: not a,
    ops.SELECT: lambda c, a, b: a if c else b,
    # C's fmin and fmax drop NaN; these keep it, like NumPy
    ops.MINIMUM: lambda a, b: a if a < b or a != a else b,
    ops.MAXIMUM: lambda a, b: a if a > b or a != a else b,
}

FLOATS = Numbers(
    float,
    _SCALAR
    | {
        ops.DIV: _divide,
        ops.SIN: _or_nan(math.sin),
        ops.COS: _or_nan(math.cos),
        ops.TAN: _or_nan(math.tan),
        ops.ASIN: _or_nan(math.asin),
        ops.ACOS: _or_nan(math.acos),
        ops.ATAN: math.atan,
        ops.SINH: _sinh,
        ops.COSH: _or_nan(math.cosh),
        ops.TANH: math.tanh,
        ops.ASINH: math.asinh,
        ops.ACOSH: _or_nan(math.acosh),
        ops.ATANH: _atanh,
        ops.EXP: _or_nan(math.exp),
        ops.LOG: _log,
        ops.SQRT: _or_nan(math.sqrt),
        ops.ABS: abs,
        ops.SIGN: _sign,
        ops.FLOOR: lambda x: float(math.floor(x)) if math.isfinite(x) else x,
        ops.ATAN2: math.atan2,
        ops.MODULO: lambda a, b: a - b * math.floor(a / b) if b and math.isfinite(a / b) else math.nan,
        ops.POW: _or_nan(_power),
    },
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

    names = {
        ops.SIN: "sin",
        ops.COS: "cos",
        ops.TAN: "tan",
        ops.ASIN: "asin",
        ops.ACOS: "acos",
        ops.ATAN: "atan",
        ops.SINH: "sinh",
        ops.COSH: "cosh",
        ops.TANH: "tanh",
        ops.ASINH: "asinh",
        ops.ACOSH: "acosh",
        ops.ATANH: "atanh",
        ops.EXP: "exp",
        ops.LOG: "log",
        ops.SQRT: "sqrt",
        ops.SIGN: "sign",
        ops.FLOOR: "floor",
        ops.ATAN2: "atan2",
        ops.POW: "power",
    }
    functions = {code: real(getattr(context, name)) for code, name in names.items()}
    functions[ops.ABS] = abs
    functions[ops.DIV] = real(lambda a, b: a / b)
    functions[ops.MODULO] = real(lambda a, b: a - b * context.floor(a / b))
    return Numbers(
        lambda c: context.mpf(c.numerator) / c.denominator,
        _SCALAR | functions,
        lambda table, x, order: context.mpf(table(float(x), order)),
    )

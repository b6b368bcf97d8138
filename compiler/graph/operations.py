"""The operations of the graph, one row each: what all of ``graph/`` knows of an operation stands there.

A code is a small int, so that the constructors and sweeps compare machine integers. Codes are dense
and start with the two leaves; everything from ``ADD`` on counts as one operation. The texts of targets are
theirs (``targets/*_forms.py``, ``symbolic/express.py``).
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from enum import Enum
from fractions import Fraction
from operator import attrgetter
from typing import Any, Final

from msgspec import Struct

from . import floats, fold

CONST: Final = 0
SYMBOL: Final = 1
ADD: Final = 2
SUB: Final = 3
MUL: Final = 4
NEG: Final = 5
DIV: Final = 6
SIN: Final = 7
COS: Final = 8
TAN: Final = 9
ASIN: Final = 10
ACOS: Final = 11
ATAN: Final = 12
SINH: Final = 13
COSH: Final = 14
TANH: Final = 15
ASINH: Final = 16
ACOSH: Final = 17
ATANH: Final = 18
EXP: Final = 19
LOG: Final = 20
SQRT: Final = 21
ABS: Final = 22
SIGN: Final = 23
FLOOR: Final = 24
ATAN2: Final = 25
MINIMUM: Final = 26
MAXIMUM: Final = 27
MODULO: Final = 28
POW: Final = 29
LESS: Final = 30
LESS_EQUAL: Final = 31
EQUAL: Final = 32
AND: Final = 33
OR: Final = 34
NOT: Final = 35
SELECT: Final = 36
LOOKUP: Final = 37

Partial = Callable[[Any, tuple[Any, ...], Any], Any]
"""Derivative with respect to one argument: (graph, arguments, the node itself) -> node. (The graph is built on this
table, which therefore does not know its type.)"""


class Parity(Enum):
    """Behaviour of a unary function under a change of sign of its argument."""

    NONE = "none"
    EVEN = "even"
    ODD = "odd"


class Operation(Struct, frozen=True):
    """One row of the table.

    ``partials`` has one rule for each argument, or is empty where the derivative is zero everywhere
    it exists (comparisons, logic, sign, floor). SELECT has none: its derivative is a SELECT of the
    derivatives of its branches (differentiate.py).
    """

    code: int
    name: str
    arity: int
    partials: tuple[Partial, ...] = ()
    parity: Parity = Parity.NONE
    value: Callable[..., Any] | None = None
    """What it gives for floats; None: no function of numbers alone (leaves, tables)."""
    digits: Callable[[Any], Callable[..., Any]] | None = None
    """The same for many digits, from an mpmath context; None: ``value`` does for any kind of number."""
    exact: Callable[..., Fraction | None] | None = None
    """The result for constants where it is rational, else None. (The four kinds of arithmetic fold as they are built.)"""
    regular: Callable[..., bool] | None = None
    """Tells where it has a value and a derivative; None: everywhere. (abs and its like are defined everywhere.)"""
    jumps: bool = False
    """Its value jumps where it is regular: events are looked for there."""
    build: str = ""
    """Its constructor in ``Graph`` (node.py); empty: it has the name of the operation."""


def _one(g: Any, x: tuple[Any, ...], n: Any) -> Any:
    return g.one


def _minus_one(g: Any, x: tuple[Any, ...], n: Any) -> Any:
    return g.minus_one


def _less(g: Any, a: Any, b: Any) -> Any:
    """Return 1 where a < b, else 0."""
    return g.select(g.less(a, b), g.one, g.zero)


def _square_plus(g: Any, a: Any, b: Any) -> Any:
    return g.add(g.mul(a, a), g.mul(b, b))


OPERATIONS: Final[tuple[Operation, ...]] = (
    Operation(CONST, "constant", 0),
    Operation(SYMBOL, "symbol", 0),
    Operation(ADD, "add", 2, (_one, _one), value=operator.add),
    Operation(SUB, "sub", 2, (_one, _minus_one), value=operator.sub),
    Operation(MUL, "mul", 2, (lambda g, x, n: x[1], lambda g, x, n: x[0]), value=operator.mul),
    Operation(NEG, "neg", 1, (_minus_one,), Parity.ODD, value=operator.neg),
    Operation(
        DIV,
        "div",
        2,
        (lambda g, x, n: g.div(g.one, x[1]), lambda g, x, n: g.neg(g.div(n, x[1]))),
        value=floats.divide,
        digits=lambda context: operator.truediv,
        regular=lambda a, b: b != 0,
    ),
    Operation(
        SIN,
        "sin",
        1,
        (lambda g, x, n: g.cos(x[0]),),
        Parity.ODD,
        value=floats.quiet(math.sin),
        digits=attrgetter("sin"),
        exact=fold.sine,
    ),
    Operation(
        COS,
        "cos",
        1,
        (lambda g, x, n: g.neg(g.sin(x[0])),),
        Parity.EVEN,
        value=floats.quiet(math.cos),
        digits=attrgetter("cos"),
        exact=fold.cosine,
    ),
    Operation(
        TAN,
        "tan",
        1,
        (lambda g, x, n: g.add(g.one, g.mul(n, n)),),
        Parity.ODD,
        value=floats.quiet(math.tan),
        digits=attrgetter("tan"),
        exact=fold.only(0, 0),
        regular=lambda x: math.cos(x) != 0,
    ),
    Operation(
        ASIN,
        "asin",
        1,
        (lambda g, x, n: g.div(g.one, g.sqrt(g.sub(g.one, g.mul(x[0], x[0])))),),
        Parity.ODD,
        value=floats.quiet(math.asin),
        digits=attrgetter("asin"),
        exact=fold.only(0, 0),
        regular=lambda x: abs(x) < 1,
    ),
    Operation(
        ACOS,
        "acos",
        1,
        (lambda g, x, n: g.neg(g.div(g.one, g.sqrt(g.sub(g.one, g.mul(x[0], x[0]))))),),
        value=floats.quiet(math.acos),
        digits=attrgetter("acos"),
        exact=fold.only(1, 0),
        regular=lambda x: abs(x) < 1,
    ),
    Operation(
        ATAN,
        "atan",
        1,
        (lambda g, x, n: g.div(g.one, g.add(g.one, g.mul(x[0], x[0]))),),
        Parity.ODD,
        value=math.atan,
        digits=attrgetter("atan"),
        exact=fold.only(0, 0),
    ),
    Operation(
        SINH,
        "sinh",
        1,
        (lambda g, x, n: g.cosh(x[0]),),
        Parity.ODD,
        value=floats.sinh,
        digits=attrgetter("sinh"),
        exact=fold.only(0, 0),
    ),
    Operation(
        COSH,
        "cosh",
        1,
        (lambda g, x, n: g.sinh(x[0]),),
        Parity.EVEN,
        value=floats.quiet(math.cosh),
        digits=attrgetter("cosh"),
        exact=fold.only(0, 1),
    ),
    Operation(
        TANH,
        "tanh",
        1,
        (lambda g, x, n: g.sub(g.one, g.mul(n, n)),),
        Parity.ODD,
        value=math.tanh,
        digits=attrgetter("tanh"),
        exact=fold.only(0, 0),
    ),
    Operation(
        ASINH,
        "asinh",
        1,
        (lambda g, x, n: g.div(g.one, g.sqrt(g.add(g.one, g.mul(x[0], x[0])))),),
        Parity.ODD,
        value=math.asinh,
        digits=attrgetter("asinh"),
        exact=fold.only(0, 0),
    ),
    # its derivative: the product of two roots keeps the branch x >= 1 and both factors well conditioned near 1
    Operation(
        ACOSH,
        "acosh",
        1,
        (lambda g, x, n: g.div(g.one, g.mul(g.sqrt(g.sub(x[0], g.one)), g.sqrt(g.add(x[0], g.one)))),),
        value=floats.quiet(math.acosh),
        digits=attrgetter("acosh"),
        exact=fold.only(1, 0),
        regular=lambda x: x > 1,
    ),
    Operation(
        ATANH,
        "atanh",
        1,
        (lambda g, x, n: g.div(g.one, g.sub(g.one, g.mul(x[0], x[0]))),),
        Parity.ODD,
        value=floats.atanh,
        digits=attrgetter("atanh"),
        exact=fold.only(0, 0),
        regular=lambda x: abs(x) < 1,
    ),
    Operation(
        EXP,
        "exp",
        1,
        (lambda g, x, n: n,),
        value=floats.quiet(math.exp),
        digits=attrgetter("exp"),
        exact=fold.only(0, 1),
    ),
    Operation(
        LOG,
        "log",
        1,
        (lambda g, x, n: g.div(g.one, x[0]),),
        value=floats.log,
        digits=attrgetter("log"),
        exact=fold.only(1, 0),
        regular=lambda x: x > 0,
    ),
    Operation(
        SQRT,
        "sqrt",
        1,
        (lambda g, x, n: g.div(g.half, n),),
        value=floats.quiet(math.sqrt),
        digits=attrgetter("sqrt"),
        exact=fold.root,
        regular=lambda x: x > 0,
    ),
    Operation(ABS, "abs", 1, (lambda g, x, n: g.sign(x[0]),), Parity.EVEN, value=abs, exact=abs),
    Operation(
        SIGN,
        "sign",
        1,
        (),
        Parity.ODD,
        value=floats.sign,
        digits=attrgetter("sign"),
        exact=fold.sign,
        jumps=True,
    ),
    Operation(
        FLOOR, "floor", 1, value=floats.floor, digits=attrgetter("floor"), exact=fold.whole, jumps=True
    ),
    Operation(
        ATAN2,
        "atan2",
        2,
        (
            lambda g, x, n: g.div(x[1], _square_plus(g, x[0], x[1])),
            lambda g, x, n: g.neg(g.div(x[0], _square_plus(g, x[0], x[1]))),
        ),
        value=math.atan2,
        digits=attrgetter("atan2"),
        exact=lambda y, x: Fraction(0) if y == 0 and x > 0 else None,
        regular=lambda y, x: y != 0 or x > 0,
    ),
    # at a tie both rules choose the second argument, so that the two partial derivatives sum to one
    Operation(
        MINIMUM,
        "minimum",
        2,
        (lambda g, x, n: _less(g, x[0], x[1]), lambda g, x, n: g.select(g.less(x[0], x[1]), g.zero, g.one)),
        value=floats.minimum,
        exact=min,
    ),
    Operation(
        MAXIMUM,
        "maximum",
        2,
        (lambda g, x, n: _less(g, x[1], x[0]), lambda g, x, n: g.select(g.less(x[1], x[0]), g.zero, g.one)),
        value=floats.maximum,
        exact=max,
    ),
    Operation(
        MODULO,
        "modulo",
        2,
        (_one, lambda g, x, n: g.neg(g.floor(g.div(x[0], x[1])))),
        value=floats.modulo,
        digits=lambda context: lambda a, b: a - b * context.floor(a / b),
        exact=fold.modulo,
        regular=lambda a, b: b != 0,
        jumps=True,
    ),
    Operation(
        POW,
        "pow",
        2,
        (lambda g, x, n: g.mul(x[1], g.pow(x[0], g.sub(x[1], g.one))), lambda g, x, n: g.mul(g.log(x[0]), n)),
        value=floats.power,
        digits=attrgetter("power"),
        regular=lambda a, b: a > 0,
    ),
    Operation(LESS, "less", 2, value=operator.lt, exact=lambda a, b: Fraction(a < b), jumps=True),
    Operation(
        LESS_EQUAL, "less_equal", 2, value=operator.le, exact=lambda a, b: Fraction(a <= b), jumps=True
    ),
    Operation(EQUAL, "equal", 2, value=operator.eq, exact=lambda a, b: Fraction(a == b), jumps=True),
    Operation(AND, "and", 2, value=lambda a, b: bool(a) and bool(b), build="logical_and"),
    Operation(OR, "or", 2, value=lambda a, b: bool(a) or bool(b), build="logical_or"),
    Operation(NOT, "not", 1, value=operator.not_, build="logical_not"),
    Operation(SELECT, "select", 3, value=lambda c, a, b: a if c else b),
    Operation(LOOKUP, "lookup", 1, (lambda g, x, n: g.lookup_slope(n),)),
)
"""The table, indexed by code."""

PARTIAL: Final = frozenset(row.code for row in OPERATIONS if row.regular is not None)
"""Operations that have no value, or no derivative, for some arguments."""

SINGULAR: Final = 1
"""The trait of what has such an operation somewhere."""

POSITION, VELOCITY, ACCELERATION, PARAMETER, TIME, RATE, OTHER = 2, 4, 8, 16, 32, 64, 128
"""Kinds of symbols, and the traits of what depends on one: what lacks a trait of a symbol does not depend on it."""

JUMPING: Final = frozenset(row.code for row in OPERATIONS if row.jumps)
"""Operations whose value jumps."""

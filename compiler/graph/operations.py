"""The operations of the graph, one row each: code, name, arity, symmetry and derivative rule.

A code is a small int, so that the constructors and sweeps compare machine integers. Codes are dense
and start with the two leaves; everything from ``ADD`` on counts as one operation.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum
from typing import TYPE_CHECKING, Final

from msgspec import Struct

if TYPE_CHECKING:
    from .node import Graph, Node

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

PARTIAL: Final = frozenset({DIV, TAN, ASIN, ACOS, ACOSH, ATANH, LOG, SQRT, ATAN2, MODULO, POW})
"""Operations that have no value, or no derivative, for some arguments. (abs and its like are defined everywhere.)"""

Partial = Callable[["Graph", tuple["Node", ...], "Node"], "Node"]
"""Derivative with respect to one argument: (graph, arguments, the node itself) -> node."""


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


def _one(g: Graph, x: tuple[Node, ...], n: Node) -> Node:
    return g.one


def _minus_one(g: Graph, x: tuple[Node, ...], n: Node) -> Node:
    return g.minus_one


def _less(g: Graph, a: Node, b: Node) -> Node:
    """Return 1 where a < b, else 0."""
    return g.select(g.less(a, b), g.one, g.zero)


def _square_plus(g: Graph, a: Node, b: Node) -> Node:
    return g.add(g.mul(a, a), g.mul(b, b))


OPERATIONS: Final[tuple[Operation, ...]] = (
    Operation(CONST, "constant", 0),
    Operation(SYMBOL, "symbol", 0),
    Operation(ADD, "add", 2, (_one, _one)),
    Operation(SUB, "sub", 2, (_one, _minus_one)),
    Operation(MUL, "mul", 2, (lambda g, x, n: x[1], lambda g, x, n: x[0])),
    Operation(NEG, "neg", 1, (_minus_one,), Parity.ODD),
    Operation(DIV, "div", 2, (lambda g, x, n: g.div(g.one, x[1]), lambda g, x, n: g.neg(g.div(n, x[1])))),
    Operation(SIN, "sin", 1, (lambda g, x, n: g.cos(x[0]),), Parity.ODD),
    Operation(COS, "cos", 1, (lambda g, x, n: g.neg(g.sin(x[0])),), Parity.EVEN),
    Operation(TAN, "tan", 1, (lambda g, x, n: g.add(g.one, g.mul(n, n)),), Parity.ODD),
    Operation(
        ASIN, "asin", 1, (lambda g, x, n: g.div(g.one, g.sqrt(g.sub(g.one, g.mul(x[0], x[0])))),), Parity.ODD
    ),
    Operation(
        ACOS, "acos", 1, (lambda g, x, n: g.neg(g.div(g.one, g.sqrt(g.sub(g.one, g.mul(x[0], x[0]))))),)
    ),
    Operation(ATAN, "atan", 1, (lambda g, x, n: g.div(g.one, g.add(g.one, g.mul(x[0], x[0]))),), Parity.ODD),
    Operation(SINH, "sinh", 1, (lambda g, x, n: g.cosh(x[0]),), Parity.ODD),
    Operation(COSH, "cosh", 1, (lambda g, x, n: g.sinh(x[0]),), Parity.EVEN),
    Operation(TANH, "tanh", 1, (lambda g, x, n: g.sub(g.one, g.mul(n, n)),), Parity.ODD),
    Operation(
        ASINH,
        "asinh",
        1,
        (lambda g, x, n: g.div(g.one, g.sqrt(g.add(g.one, g.mul(x[0], x[0])))),),
        Parity.ODD,
    ),
    Operation(
        ACOSH,
        "acosh",
        1,
        # the product of two roots keeps the branch x >= 1 and both factors well conditioned near 1
        (lambda g, x, n: g.div(g.one, g.mul(g.sqrt(g.sub(x[0], g.one)), g.sqrt(g.add(x[0], g.one)))),),
    ),
    Operation(
        ATANH, "atanh", 1, (lambda g, x, n: g.div(g.one, g.sub(g.one, g.mul(x[0], x[0]))),), Parity.ODD
    ),
    Operation(EXP, "exp", 1, (lambda g, x, n: n,)),
    Operation(LOG, "log", 1, (lambda g, x, n: g.div(g.one, x[0]),)),
    Operation(SQRT, "sqrt", 1, (lambda g, x, n: g.div(g.half, n),)),
    Operation(ABS, "abs", 1, (lambda g, x, n: g.sign(x[0]),), Parity.EVEN),
    Operation(SIGN, "sign", 1, (), Parity.ODD),
    Operation(FLOOR, "floor", 1),
    Operation(
        ATAN2,
        "atan2",
        2,
        (
            lambda g, x, n: g.div(x[1], _square_plus(g, x[0], x[1])),
            lambda g, x, n: g.neg(g.div(x[0], _square_plus(g, x[0], x[1]))),
        ),
    ),
    # at a tie both rules choose the second argument, so that the two partial derivatives sum to one
    Operation(
        MINIMUM,
        "minimum",
        2,
        (
            lambda g, x, n: _less(g, x[0], x[1]),
            lambda g, x, n: g.select(g.less(x[0], x[1]), g.zero, g.one),
        ),
    ),
    Operation(
        MAXIMUM,
        "maximum",
        2,
        (
            lambda g, x, n: _less(g, x[1], x[0]),
            lambda g, x, n: g.select(g.less(x[1], x[0]), g.zero, g.one),
        ),
    ),
    Operation(MODULO, "modulo", 2, (_one, lambda g, x, n: g.neg(g.floor(g.div(x[0], x[1]))))),
    Operation(
        POW,
        "pow",
        2,
        (
            lambda g, x, n: g.mul(x[1], g.pow(x[0], g.sub(x[1], g.one))),
            lambda g, x, n: g.mul(g.log(x[0]), n),
        ),
    ),
    Operation(LESS, "less", 2),
    Operation(LESS_EQUAL, "less_equal", 2),
    Operation(EQUAL, "equal", 2),
    Operation(AND, "and", 2),
    Operation(OR, "or", 2),
    Operation(NOT, "not", 1),
    Operation(SELECT, "select", 3),
    Operation(LOOKUP, "lookup", 1, (lambda g, x, n: g.lookup_slope(n),)),
)
"""The table, indexed by code."""

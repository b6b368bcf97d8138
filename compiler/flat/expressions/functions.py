"""Type rules of the mathematical functions: one function of the table ``RULES`` for each signature."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction

from mechc.lang.builtins import BUILTINS
from mechc.lang.source import Span
from mechc.lang.units import Dimension

from .. import types
from ..model import Apply, Expression, Kind, Literal, Type
from ..values import matrices
from ..values.evaluate import (
    constant,
    elements,
    flat,
    pick,
    rows_of,
    to_expression,
    whole_number,
)
from .choices import array
from .signature import ElaboratedCall

Rule = Callable[[ElaboratedCall], Expression]


def _of_numbers(types_of: str) -> Rule:
    """Return the rule of a function of angles and numbers, from what ``Builtin.types`` says."""
    given, _, result = types_of.partition(" -> ")
    words = given.split(", ")

    def rule(call: ElaboratedCall) -> Expression:
        for k, word in enumerate(words):
            if word == "angle":
                call.number(k, "an angle or a number")
            else:
                call.number(k)
        return _folded_whole(call) if result == "whole" else call.apply(RESULTS[result])

    return rule


RESULTS = {"number": types.NUMBER, "angle": types.ANGLE}


def _folded_whole(call: ElaboratedCall) -> Expression:
    value = constant(call.arguments[0])
    if isinstance(value, Fraction):
        folded = constant(call.apply(types.INTEGER))
        assert isinstance(folded, Fraction)
        return Literal(type=types.INTEGER, span=call.node.span, value=folded)
    return call.apply(types.INTEGER)


def _atan2(call: ElaboratedCall) -> Expression:
    call.scalar(0), call.scalar(1)
    call.same(0, 1)
    return call.apply(types.ANGLE)


def _sqrt(call: ElaboratedCall) -> Expression:
    type = call.scalar(0)
    return call.apply(types.real(type.dimension ** Fraction(1, 2)))


def _abs(call: ElaboratedCall) -> Expression:
    return _folded(call, call.scalar(0))


def _sign(call: ElaboratedCall) -> Expression:
    call.scalar(0)
    return _folded(call, types.NUMBER)


def _mod(call: ElaboratedCall) -> Expression:
    a, b = call.scalar(0), call.scalar(1)
    type = call.same(0, 1)
    return _folded(call, types.INTEGER if a.kind is b.kind is Kind.INTEGER else type)


def _div(call: ElaboratedCall) -> Expression:
    call.scalar(0), call.scalar(1)
    call.same(0, 1)
    return _folded(call, types.INTEGER)


def _folded(call: ElaboratedCall, type: Type) -> Expression:
    """Return a function of literals as a literal where its value is exact."""
    result = call.apply(type)
    if all(isinstance(a, Literal) for a in call.arguments):
        value = constant(result)
        if isinstance(value, Fraction):
            return Literal(type=type, span=call.node.span, value=value)
    return result


def _alike(call: ElaboratedCall) -> Expression:
    """``clamp`` and ``deadzone``: single values of one dimension."""
    for k in range(len(call.arguments)):
        call.scalar(k)
        type = call.same(0, k)
    return call.apply(types.INTEGER if _all_whole(call.arguments) else type)


def _extreme(call: ElaboratedCall) -> Expression:
    """``min`` and ``max`` of several values or of one array."""
    if len(call.arguments) == 1:
        call.arguments = entries(call, 0)
        if len(call.arguments) == 1:
            return call.arguments[0]
        type = types.numeric(call.arguments[0].type)
        return call.apply(types.INTEGER if _all_whole(call.arguments) else type)
    for k in range(len(call.arguments)):
        call.scalar(k)
    type = call.same(0, 0)
    for k in range(1, len(call.arguments)):
        common = call.same(0, k)
        if types.is_zero(call.arguments[0]):
            type = common
    return _folded(call, types.INTEGER if _all_whole(call.arguments) else type)


def _all_whole(values: Sequence[Expression]) -> bool:
    return all(value.type.kind is Kind.INTEGER for value in values)


def entries(call: ElaboratedCall, index: int) -> list[Expression]:
    """Return the single numbers of an array argument in row-major order."""
    argument = call.arguments[index]
    if argument.type.kind not in types.NUMERIC or not argument.type.shape:
        raise call.wrong(index, "an array or several values", "E0305")
    items = flat(argument)
    if not items:
        raise call.scope.fail("E0305", f"'{call.name}' of an array without elements", call.node.span)
    return items


def _sum(call: ElaboratedCall) -> Expression:
    return combined(entries(call, 0), "add", call.node.span)


def _product(call: ElaboratedCall) -> Expression:
    return combined(entries(call, 0), "multiply", call.node.span)


def combined(items: list[Expression], operator: str, span: Span) -> Expression:
    """Return the sum or product of values as a balanced tree, so that long ones are not deep."""
    while len(items) > 1:
        pairs = []
        for a, b in zip(items[::2], items[1::2], strict=False):
            if a.type.kind is b.type.kind is Kind.INTEGER:
                type = types.make(Kind.INTEGER, a.type.shape or b.type.shape)
            elif operator == "add":
                type = types.numeric(b.type if types.is_zero(a) else a.type)
            else:
                shape = a.type.shape or b.type.shape
                type = types.real(a.type.dimension * b.type.dimension, shape)
            pairs.append(Apply(type=type, span=span, function=operator, arguments=(a, b)))
        items = [*pairs, items[-1]] if len(items) % 2 else list(pairs)
    return items[0]


# ---------------------------------------------------------------- vectors and matrices


def _dot(call: ElaboratedCall) -> Expression:
    a = call.vector(0)
    b = call.vector(1)
    if a.shape != b.shape:
        raise call.wrong(1, f"two vectors of one length, the first has {a.shape[0]} components", "E0305")
    return call.apply(types.real(a.dimension * b.dimension))


def _cross(call: ElaboratedCall) -> Expression:
    a = call.vector(0, (2, 3))
    b = call.vector(1, a.shape)
    return call.apply(types.real(a.dimension * b.dimension, () if a.shape == (2,) else (3,)))


def _norm(call: ElaboratedCall) -> Expression:
    type = call.vector(0)
    return call.apply(types.real(type.dimension, angle=type.angle))


def _matrix(call: ElaboratedCall) -> Type:
    type = call.arguments[0].type
    if type.kind not in types.NUMERIC or len(type.shape) != 2:
        raise call.wrong(0, "a matrix", "E0305")
    return type


def _transpose(call: ElaboratedCall) -> Expression:
    type = _matrix(call)
    return call.apply(types.with_shape(type, type.shape[::-1]))


def _square(call: ElaboratedCall, wanted: str = "a square matrix") -> Type:
    type = types.numeric(call.arguments[0].type)
    if type.kind is not Kind.REAL or len(type.shape) != 2 or type.shape[0] != type.shape[1]:
        help = "rows and columns are of one number"
        if call.name == "solve":
            help = "a system has as many equations as unknowns; least squares of more are 'solve(transpose(A)*A, transpose(A)*b)'"
        raise call.wrong(0, wanted, "E0305", help)
    return type


def _known(call: ElaboratedCall, type: Type) -> Expression:
    """Return a function of matrices, its value where they are known; long formulas of others are refused."""
    result = call.apply(type)
    value = constant(result)
    if value is not None:
        return to_expression(value, type, call.node.span)
    most = _MOST_ROWS[call.name]
    rows = call.arguments[0].type.shape[0]
    if rows > most:
        raise call.scope.fail(
            "E0422",
            f"'{call.name}' of {rows} rows would be a formula that is too long",
            call.node.span,
            help=f"at most {most} rows are possible; a matrix that is known when compiling may be larger",
        )
    return result


_MOST_ROWS = {"det": 10, "inverse": 30, "solve": 40, "eigenvalues": 8}
"""Of matrices that are not known when compiling."""


def _det(call: ElaboratedCall) -> Expression:
    type = _square(call)
    return _known(call, types.real(type.dimension ** Fraction(type.shape[0])))


def _inverse(call: ElaboratedCall) -> Expression:
    type = _square(call)
    return _known(call, types.real(type.dimension ** Fraction(-1), type.shape))


def _solve(call: ElaboratedCall) -> Expression:
    a = _square(call)
    b = types.numeric(call.arguments[1].type)
    if b.kind is not Kind.REAL or len(b.shape) not in (1, 2) or b.shape[0] != a.shape[0]:
        raise call.wrong(1, f"a vector of {a.shape[0]} elements or a matrix of as many rows", "E0305")
    return _known(call, types.real(b.dimension / a.dimension, b.shape))


def _trace(call: ElaboratedCall) -> Expression:
    size = _square(call).shape[0]
    return combined([pick(call.arguments[0], (i, i)) for i in range(size)], "add", call.node.span)


def _eigenvalues(call: ElaboratedCall) -> Expression:
    type = _square(call)
    rows = constant(call.arguments[0])
    result = types.real(type.dimension, type.shape[:1])
    if rows is None:  # of parameters: known when the equations are formed
        return _known(call, result)
    found = matrices.eigenvalues(rows_of(rows))
    if found is None:
        raise call.scope.fail("E0305", "this matrix has complex eigenvalues", call.nodes[0].span)
    return to_expression(tuple(found), result, call.node.span)


def _size(call: ElaboratedCall) -> Expression:
    shape = call.arguments[0].type.shape
    if not shape:
        raise call.wrong(0, "an array", "E0305")
    index = whole_number(call.scope, call.nodes[1], "which index of an array is meant")
    if not 1 <= index <= len(shape):
        raise call.scope.fail(
            "E0314",
            f"'{call.nodes[0].span.text}' has {len(shape)} ind{'ices' if len(shape) > 1 else 'ex'}, not {index}",
            call.nodes[1].span,
        )
    return Literal(type=types.INTEGER, span=call.node.span, value=Fraction(shape[index - 1]))


def _concat(call: ElaboratedCall) -> Expression:
    rest = max((a.type.shape[1:] for a in call.arguments if a.type.shape), key=len, default=None)
    if rest is None:
        raise call.wrong(0, "an array, or '{a, b}' for single values", "E0305")
    items: list[Expression] = []
    for k, argument in enumerate(call.arguments):
        if argument.type.shape == rest and not rest:
            items.append(argument)
        elif argument.type.shape[1:] == rest and argument.type.shape:
            items += elements(argument)
        else:
            raise call.wrong(k, f"arrays whose elements have the shape {types.shape_text(rest)}", "E0305")
    return array(call.scope, call.node, items)


def _outer(call: ElaboratedCall) -> Expression:
    a, b = call.vector(0), call.vector(1)
    return call.apply(types.real(a.dimension * b.dimension, a.shape + b.shape))


def _identity(call: ElaboratedCall) -> Expression:
    size = whole_number(call.scope, call.nodes[0], "the size of a matrix")
    if not 1 <= size <= 1000:
        raise call.scope.fail("E0422", f"a matrix cannot have {size} rows", call.nodes[0].span)
    argument = Literal(type=types.INTEGER, span=call.nodes[0].span, value=Fraction(size))
    return call.apply(types.real(shape=(size, size)), argument)


def _diag(call: ElaboratedCall) -> Expression:
    type = call.vector(0)
    size = type.shape[0]
    return call.apply(types.real(type.dimension, (size, size)))


def _linspace(call: ElaboratedCall) -> Expression:
    call.scalar(0), call.scalar(1)
    type = call.same(0, 1)
    count = whole_number(call.scope, call.nodes[2], "the number of values")
    if not 1 <= count <= 100_000:
        raise call.scope.fail("E0422", f"'linspace' cannot give {count} values", call.nodes[2].span)
    first, last = constant(call.arguments[0]), constant(call.arguments[1])
    result = types.with_shape(type, (count,))
    if isinstance(first, Fraction) and isinstance(last, Fraction):
        step = (last - first) / max(count - 1, 1)
        return to_expression(tuple(first + k * step for k in range(count)), result, call.node.span)
    number = Literal(type=types.INTEGER, span=call.nodes[2].span, value=Fraction(count))
    return call.apply(result, call.arguments[0], call.arguments[1], number)


# ---------------------------------------------------------------- poses and events


def _trans(call: ElaboratedCall) -> Expression:
    type = call.vector(0, (2, 3), "a vector of 2 or 3 lengths")
    if type.dimension != call.dimension(types.LENGTH) and not types.is_zero(call.arguments[0]):
        raise call.wrong(0, "a vector of lengths")
    call.require_space(type.shape[0], f"a displacement of {type.shape[0]} components")
    return call.apply(types.POSE)


def _turn(size: int) -> Rule:
    def rule(call: ElaboratedCall) -> Expression:
        call.number(0, "an angle")
        call.require_space(size)
        return call.apply(types.POSE)

    return rule


def _axis_angle(call: ElaboratedCall) -> Expression:
    call.vector(0, (3,))
    call.number(1, "an axis and an angle")
    call.require_space(3)
    return call.apply(types.POSE)


def _quat(call: ElaboratedCall) -> Expression:
    call.require_space(3)
    if len(call.arguments) == 1:
        if not call.vector(0, (4,)).dimension.is_none:
            raise call.wrong(0, "four numbers")
        return call.apply(types.POSE, *elements(call.arguments[0]))
    if len(call.arguments) != 4:
        raise call.scope.fail("E0309", "'quat' takes a vector of 4 numbers, or 4 numbers", call.node.span)
    for k in range(4):
        call.number(k)
    return call.apply(types.POSE)


def _sample(call: ElaboratedCall) -> Expression:
    """``sample(period)`` and ``sample(period, start)``: always (period, start) in the flat model."""
    time = call.scope.flattening.time_type.dimension
    for k in range(len(call.arguments)):
        if call.scalar(k).dimension != time and not types.is_zero(call.arguments[k]):
            raise call.wrong(k, "times")
    if len(call.arguments) == 2:
        return call.apply(types.BOOLEAN)
    start = Literal(type=types.real(time), span=call.node.span, value=Fraction(0))
    return call.apply(types.BOOLEAN, call.arguments[0], start)


def _initial(call: ElaboratedCall) -> Expression:
    return Apply(type=types.BOOLEAN, span=call.node.span, function="initial", arguments=())


def _delay(call: ElaboratedCall) -> Expression:
    type = types.numeric(call.arguments[0].type)
    if type.kind is not Kind.REAL:
        raise call.wrong(0, "a number or an array of numbers", "E0308")
    time = call.scope.flattening.time_type.dimension
    _require_time(call, time)
    return call.apply(type)


def _require_time(call: ElaboratedCall, time: Dimension) -> None:
    """Report a second argument that is not a time."""
    if call.scalar(1).dimension == time or types.is_zero(call.arguments[1]):
        return
    text = call.nodes[1].span.text
    bare = isinstance(call.arguments[1], Literal) and call.arguments[1].type.dimension.is_none
    raise call.wrong(
        1,
        "a time",
        help=f"write '{text} s'" if bare else f"as in '{call.name}({call.nodes[0].span.text}, 0.1 s)'",
    )


def _noise(call: ElaboratedCall) -> Expression:
    if call.arguments[0].type.kind is not Kind.INTEGER or call.arguments[0].type.shape:
        help = "write a whole number, as in 'noise(1, 0.1 s)'; another one is another signal"
        raise call.wrong(0, "a whole number as seed", "E0308", help)
    _require_time(call, call.scope.flattening.time_type.dimension)
    return call.apply(types.NUMBER)


RULES: dict[str, Rule] = {
    **{name: _of_numbers(builtin.types) for name, builtin in BUILTINS.items() if builtin.types},
    **dict.fromkeys(("clamp", "deadzone"), _alike),
    **dict.fromkeys(("min", "max"), _extreme),
    "atan2": _atan2,
    "sqrt": _sqrt,
    "abs": _abs,
    "sign": _sign,
    "mod": _mod,
    "div": _div,
    "sum": _sum,
    "product": _product,
    "dot": _dot,
    "cross": _cross,
    "norm": _norm,
    "transpose": _transpose,
    "outer": _outer,
    "identity": _identity,
    "diag": _diag,
    "det": _det,
    "inverse": _inverse,
    "solve": _solve,
    "trace": _trace,
    "eigenvalues": _eigenvalues,
    "size": _size,
    "concat": _concat,
    "linspace": _linspace,
    "trans": _trans,
    "rot": _turn(2),
    "rotx": _turn(3),
    "roty": _turn(3),
    "rotz": _turn(3),
    "axis_angle": _axis_angle,
    "quat": _quat,
    "sample": _sample,
    "initial": _initial,
    "delay": _delay,
    "noise": _noise,
}

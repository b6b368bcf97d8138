"""Operators of plain arrays, and what applies a function to their numbers one by one."""

from __future__ import annotations

import math
import operator
from array import array
from collections.abc import Callable, Iterable
from itertools import repeat
from typing import Any

from .plain import CODES, MOST, RANK, NotPlain, Plain, kind_in, new, operand
from .strided import Shape, common, spread, taken


def spread_numbers(value: Any, shape: Shape) -> Iterable[Any]:
    """Give the numbers of an array, or one number over and over, so that they fill a shape."""
    if not isinstance(value, Plain):
        return repeat(value, math.prod(shape))
    if value.shape == shape:
        return value.numbers()
    steps = spread(shape, value.shape, value.steps)
    if steps is None:
        raise ValueError(f"an array of shape {value.shape} does not fill {shape}")
    return taken(value.block, value.first, shape, steps)


def shape_of(*values: Any) -> Shape:
    """Give the shape that arrays and numbers fill together. Raises NotPlain for more than ``MOST`` numbers."""
    shape: Shape = ()
    for value in values:
        if isinstance(value, Plain):
            found = common(shape, value.shape)
            if found is None:
                raise ValueError(f"arrays of shapes {shape} and {value.shape} do not fit")
            shape = found
    if math.prod(shape) > MOST:
        raise NotPlain
    return shape


def each(kind: str, function: Callable[..., Any], *values: Any) -> Plain:
    """Apply a function to the numbers of arrays, one by one."""
    shape = shape_of(*values)
    numbers = array(CODES[kind], map(function, *(spread_numbers(value, shape) for value in values)))
    return new(numbers, shape, kind)


def _quotient(a: float, b: float) -> float:
    if b != 0:
        return a / b
    return math.nan if a == 0 or a != a else math.copysign(math.inf, a) * math.copysign(1.0, b)


def quotient(a: Any, b: Any) -> Plain:
    """Divide as C does: by zero, too."""
    try:
        return each("d", operator.truediv, a, b)
    except ZeroDivisionError:
        return each("d", _quotient, a, b)


def _sum_like(function: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Plain]:
    def call(a: Any, b: Any) -> Plain:
        kind = max(kind_in(a), kind_in(b), key=RANK.index)
        if kind in "?B":  # sums of bytes and truths have rules of their own
            raise NotPlain
        return each(kind, function, a, b)

    return call


def _compared(function: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Plain]:
    return lambda a, b: each("?", function, a, b)


def _of_truths(function: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Plain]:
    def call(a: Any, b: Any) -> Plain:
        if (kind_in(a), kind_in(b)) != ("?", "?"):
            raise NotPlain
        return each("?", function, a, b)

    return call


def _power(a: Any, b: Any) -> Plain:
    if b != 2 or kind_in(a) != "d":
        raise NotPlain
    return each("d", operator.mul, a, a)


def _operator(
    name: str, function: Callable[[Any, Any], Plain], *, turned: bool = False
) -> Callable[[Plain, Any], Any]:
    """Give the method of an operator; what is not known here NumPy does."""
    by_numpy = getattr(operator, name)

    def call(self: Plain, other: Any) -> Any:
        try:
            return function(operand(other), self) if turned else function(self, operand(other))
        except NotPlain:
            mine = self.numpy()
            theirs = other.numpy() if isinstance(other, Plain) else other
            return by_numpy(theirs, mine) if turned else by_numpy(mine, theirs)

    return call


def _in_place(function: Callable[[Plain, Any], Any]) -> Callable[[Plain, Any], Plain]:
    def call(self: Plain, other: Any) -> Plain:
        self[...] = function(self, other)
        return self

    return call


def _unknown(_: Any, __: Any) -> Plain:
    raise NotPlain


_OPERATORS: dict[str, Callable[[Any, Any], Plain]] = {
    "add": _sum_like(operator.add),
    "sub": _sum_like(operator.sub),
    "mul": _sum_like(operator.mul),
    "truediv": quotient,
    "and_": _of_truths(operator.and_),
    "or_": _of_truths(operator.or_),
    "xor": _of_truths(operator.xor),
    "pow": _power,
    "floordiv": _unknown,
    "mod": _unknown,
    "matmul": _unknown,
}
for _name, _function in _OPERATORS.items():
    _bare = _name.rstrip("_")
    setattr(Plain, f"__{_bare}__", _operator(_name, _function))
    setattr(Plain, f"__r{_bare}__", _operator(_name, _function, turned=True))
    setattr(Plain, f"__i{_bare}__", _in_place(getattr(Plain, f"__{_bare}__")))
for _name in ("lt", "le", "gt", "ge", "eq", "ne"):
    setattr(Plain, f"__{_name}__", _operator(_name, _compared(getattr(operator, _name))))


def _unary(name: str, kinds: str, function: Callable[[Any], Any]) -> Callable[[Plain], Any]:
    def call(self: Plain) -> Any:
        if self.kind not in kinds or self.size > MOST:
            return getattr(operator, name)(self.numpy())
        return each(self.kind, function, self)

    return call


for _name, _kinds, _of_one in (
    ("neg", "dq", operator.neg),
    ("abs", "dq", abs),
    ("invert", "?", operator.not_),
):
    setattr(Plain, f"__{_name}__", _unary(_name, _kinds, _of_one))

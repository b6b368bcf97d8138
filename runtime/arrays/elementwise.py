"""Functions of plain arrays, number by number, and searches in them, by NumPy's names and rules."""

from __future__ import annotations

import builtins
import math
import operator
from array import array
from bisect import bisect_left, bisect_right
from collections.abc import Callable
from typing import Any

from .operators import each, quotient, spread_numbers
from .plain import MOST, RANK, NotPlain, Plain, kind_in, new, operand

_built_abs = builtins.abs


def absolute(values: Any) -> Any:
    return _built_abs(operand(values))


def isfinite(values: Any) -> Any:
    return _truths(math.isfinite, values)


def _truths(function: Callable[[float], bool], values: Any) -> Any:
    given = operand(values)
    return each("?", function, given) if isinstance(given, Plain) else function(given)


def sqrt(values: Any) -> Any:
    given = operand(values)
    if isinstance(given, Plain):
        try:
            return each("d", math.sqrt, given)
        except ValueError:
            return each("d", lambda x: math.sqrt(x) if x >= 0 else math.nan, given)
    return math.sqrt(given) if given >= 0 else math.nan


def exp(values: Any) -> Any:
    return _each_real(_exp, values)


def log(values: Any) -> Any:
    return _each_real(_log, values)


def _each_real(function: Callable[[float], float], values: Any) -> Any:
    given = operand(values)
    return each("d", function, given) if isinstance(given, Plain) else function(given)


def _exp(x: float) -> float:
    return math.exp(x) if x < 709.0 or x != x else math.inf if x > 709.79 else math.exp(x / 2) ** 2


def _log(x: float) -> float:
    return math.log(x) if x > 0 else math.nan if x else -math.inf


def larger(a: Any, b: Any) -> Any:
    return a if a >= b or a != a else b


def smaller(a: Any, b: Any) -> Any:
    return a if a <= b or a != a else b


class Extreme:
    """``np.maximum`` and ``np.minimum``: of two not-a-number where one is none."""

    def __init__(self, function: Callable[[Any, Any], Any]) -> None:
        self._function = function

    def __call__(self, a: Any, b: Any, out: Plain | None = None) -> Any:
        one, other = operand(a), operand(b)
        if not (isinstance(one, Plain) or isinstance(other, Plain)):
            return self._function(one, other)
        found = each(_widest(one, other), self._function, one, other)
        if out is None:
            return found
        out[...] = found
        return out

    def accumulate(self, values: Any) -> Plain:
        """Give the extreme one so far."""
        from itertools import accumulate

        given = operand(values)
        if not isinstance(given, Plain) or given.ndim != 1:
            raise NotPlain
        numbers = given.numbers()[: given.size]
        return new(array(numbers.typecode, accumulate(numbers, self._function)), given.shape, given.kind)


maximum, minimum = Extreme(larger), Extreme(smaller)


def where(condition: Any, one: Any, other: Any) -> Plain:
    truths, a, b = operand(condition), operand(one), operand(other)
    return each(_widest(a, b), lambda wanted, x, y: x if wanted else y, truths, a, b)


def clip(values: Any, low: Any, high: Any) -> Any:
    return minimum(maximum(values, low), high)


def divide(a: Any, b: Any, out: Plain | None = None, where: Any = True) -> Plain:
    """Divide where that is wanted; elsewhere ``out`` keeps what it has."""
    found = quotient(operand(a), operand(b))
    if out is None:
        if where is not True:
            raise NotPlain
        return found
    if where is not True:
        wanted = spread_numbers(operand(where), out.shape)
        pairs = zip(wanted, spread_numbers(found, out.shape), out.numbers(), strict=False)
        found = new(array("d", [x if take else kept for take, x, kept in pairs]), out.shape, "d")
    out[...] = found
    return out


def outer(a: Any, b: Any) -> Plain:
    one, other = operand(a), operand(b)
    return each("d", operator.mul, one.reshape(-1, 1), other.reshape(1, -1))


def diff(values: Any, axis: int = -1) -> Any:
    given = operand(values)
    if given.ndim == 1:
        return given[1:] - given[:-1]
    if axis != 0:
        raise NotPlain
    return given[1:] - given[:-1]


def flatnonzero(values: Any) -> Plain:
    numbers = operand(values).numbers()
    found = array("q", [k for k, x in enumerate(numbers[: operand(values).size]) if x])
    return new(found, (len(found),), "q")


def searchsorted(rising: Any, values: Any, side: str = "left") -> Any:
    """Find the places of values among numbers that rise."""
    given, wanted = operand(rising), operand(values)
    if not isinstance(given, Plain):
        raise NotPlain
    numbers = given.numbers()[: given.size]
    search = bisect_left if side == "left" else bisect_right
    if not isinstance(wanted, Plain):
        return search(numbers, wanted)
    if wanted.size > MOST:
        raise NotPlain
    places = array("q", [search(numbers, x) for x in wanted.numbers()[: wanted.size]])
    return new(places, wanted.shape, "q")


def isin(values: Any, among: Any) -> Plain:
    known = set(operand(among).tolist())
    return each("?", known.__contains__, operand(values))


def norm(values: Any, axis: int | None = None, *, keepdims: bool = False) -> Any:
    """Give the length of a vector, or of each along the last axis, summed in the order of its numbers."""
    given = operand(values)
    if given.kind != "d" or not (given.ndim == 1 if axis is None else axis == -1):
        raise NotPlain
    squares = (given * given).sum(axis=None if axis is None else given.ndim - 1)
    if not isinstance(squares, Plain):
        return math.sqrt(squares) if not keepdims else sqrt(new(array("d", [squares]), (1,), "d"))
    return sqrt(squares.reshape(*squares.shape, 1) if keepdims else squares)


def _widest(*values: Any) -> str:
    kinds = (kind_in(x) for x in values)
    return builtins.max(kinds, key=RANK.index)

"""Plain arrays made smaller: sums, extremes and truths along axes, by NumPy's names and rules."""

from __future__ import annotations

import builtins
import math
import operator
from array import array
from collections.abc import Callable
from typing import Any

from .elementwise import larger, smaller
from .plain import CODES, MOST, NotPlain, Plain, new, operand

NONE = object()


def max(values: Any, axis: Any = None, *, initial: Any = NONE) -> Any:
    return _reduced(_greatest, values, axis, initial, pairwise=larger)


def min(values: Any, axis: Any = None, *, initial: Any = NONE) -> Any:
    return _reduced(_least, values, axis, initial, pairwise=smaller)


def nanmax(values: Any, axis: Any = None) -> Any:
    return _reduced(lambda numbers: _greatest([x for x in numbers if x == x] or [math.nan]), values, axis)


def sum(values: Any, axis: Any = None) -> Any:
    given = operand(values)
    if isinstance(given, Plain) and given.kind in "?B":
        given = given.astype(int)
    return _reduced(_added, given, axis, pairwise=operator.add)


def mean(values: Any, axis: Any = None) -> Any:
    given = operand(values)
    if not isinstance(given, Plain) or not given.size:
        raise NotPlain
    total = sum(given, axis)
    return total / (given.size // (total.size if isinstance(total, Plain) else 1))


def any(values: Any, axis: Any = None) -> Any:
    return _reduced(_some, values, axis, kind="?")


def all(values: Any, axis: Any = None) -> Any:
    return _reduced(_every, values, axis, kind="?")


def argmax(values: Any) -> int:
    """Give the first place of the largest number, or of the first that is none."""
    given = operand(values)
    numbers = given.numbers().tolist() if isinstance(given, Plain) else [given]
    largest = _greatest(numbers)
    return next(k for k, x in enumerate(numbers) if x == largest or x != x)


def argmin(values: Any) -> int:
    """Give the first place of the least number, or of the first that is none."""
    given = operand(values)
    numbers = given.numbers().tolist() if isinstance(given, Plain) else [given]
    least = _least(numbers)
    return next(k for k, x in enumerate(numbers) if x == least or x != x)


def _added(numbers: list[Any]) -> Any:
    total: Any = 0 if not numbers or isinstance(numbers[0], int) else 0.0
    for number in numbers:  # the builtin one carries what rounding loses, from Python 3.12 on
        total += number
    return total


def _greatest(numbers: list[Any]) -> Any:
    return _extreme(numbers, builtins.max)


def _least(numbers: list[Any]) -> Any:
    return _extreme(numbers, builtins.min)


def _extreme(numbers: list[Any], choose: Callable[[list[Any]], Any]) -> Any:
    """Give the largest or least number, or not-a-number where one is none."""
    if not numbers:
        raise ValueError("no numbers, and no 'initial': there is no extreme one")
    wrong = builtins.sum(numbers) != builtins.sum(numbers)  # of infinities as well
    return math.nan if wrong and builtins.any(x != x for x in numbers) else choose(numbers)


def _some(numbers: list[Any]) -> bool:
    return builtins.any(numbers)


def _every(numbers: list[Any]) -> bool:
    return builtins.all(numbers)


def _reduced(
    reduce: Callable[[list[Any]], Any],
    values: Any,
    axis: Any,
    initial: Any = NONE,
    kind: str | None = None,
    pairwise: Callable[[Any, Any], Any] | None = None,
) -> Any:
    """Reduce along an axis, several, or all; ``pairwise`` does the same with two numbers."""
    given = operand(values)
    if not isinstance(given, Plain) or given.size > MOST:
        raise NotPlain
    first = [] if initial is NONE else [initial]
    if axis is None:
        found = reduce(given.numbers().tolist() + first)
        return found != 0 if kind is None and given.kind == "?" else found
    axes = [k % given.ndim for k in (axis if isinstance(axis, tuple) else (axis,))]
    kept = [k for k in range(given.ndim) if k not in axes]
    shape = tuple(given.shape[k] for k in kept)
    numbers = given.transposed([*kept, *axes]).numbers().tolist()
    width = math.prod(given.shape[k] for k in axes)
    kind = kind or given.kind
    if not shape:
        return reduce(numbers + first)
    if pairwise is not None and 0 < width < math.prod(shape):  # a few columns rather than many rows
        found = numbers[0::width]
        for column in (*(numbers[k::width] for k in range(1, width)), *([one] * len(found) for one in first)):
            found = list(map(pairwise, found, column))
    else:
        found = [reduce(numbers[k * width : (k + 1) * width] + first) for k in range(math.prod(shape))]
    return new(array(CODES[kind], found), shape, kind)


def _method(function: Callable[..., Any], name: str) -> Callable[..., Any]:
    def call(self: Plain, *arguments: Any, **options: Any) -> Any:
        try:
            return function(self, *arguments, **options)
        except (NotPlain, TypeError):  # an option that only NumPy has
            return getattr(self.numpy(), name)(*arguments, **options)

    return call


for _function in (max, min, sum, mean, any, all, argmax, argmin):
    setattr(Plain, _function.__name__, _method(_function, _function.__name__))

"""Plain arrays made anew, joined and repeated, by NumPy's names and rules."""

from __future__ import annotations

import math
from array import array
from typing import Any

from .loading import numpy
from .plain import CODES, KINDS, RANK, NotPlain, Plain, array_of, kind_of, new, operand
from .strided import Shape, spread

MOST_HELD = 4_000_000
"""Numbers that are kept without NumPy; how many are computed with is ``MOST`` of ``plain.py``."""


def _filled(shape: Any, value: Any, kind: str) -> Plain:
    wanted: Shape = (shape,) if isinstance(shape, int) else tuple(shape)
    size = math.prod(wanted)
    if size > MOST_HELD:
        raise NotPlain
    return new(array(CODES[kind], [value]) * size, wanted, kind)


def empty(shape: Any, dtype: Any = float) -> Plain:
    return _filled(shape, 0, kind_of(dtype))


def zeros(shape: Any, dtype: Any = float) -> Plain:
    return _filled(shape, 0, kind_of(dtype))


def ones(shape: Any, dtype: Any = float) -> Plain:
    return _filled(shape, 1, kind_of(dtype))


def full(shape: Any, value: Any, dtype: Any = None) -> Plain:
    if not isinstance(value, float | int):
        raise NotPlain
    return _filled(shape, value, kind_of(type(value) if dtype is None else dtype))


def zeros_like(values: Any) -> Plain:
    given = _array(values)
    return _filled(given.shape, 0, given.kind)


def ones_like(values: Any) -> Plain:
    given = _array(values)
    return _filled(given.shape, 1, given.kind)


def full_like(values: Any, value: Any) -> Plain:
    given = _array(values)
    return _filled(given.shape, value, given.kind)


def array_(values: Any, dtype: Any = None) -> Plain:
    """Make an array with numbers of its own."""
    if isinstance(values, Plain):
        return values.copy() if dtype is None or kind_of(dtype) == values.kind else values.astype(dtype)
    if not isinstance(values, list | tuple):
        raise NotPlain
    return array_of(values, dtype)


def asarray(values: Any, dtype: Any = None) -> Plain:
    """Give an array as it is, or make one."""
    if isinstance(values, Plain) and (dtype is None or kind_of(dtype) == values.kind):
        return values
    return array_(values, dtype)


def ascontiguousarray(values: Any, dtype: Any = None) -> Plain:
    """Give an array whose numbers stand one behind the other."""
    given = asarray(values, dtype)
    return given.reshape(given.shape)


def arange(begin: Any, end: Any = None, dtype: Any = None) -> Plain:
    if not isinstance(begin, int) or not (end is None or isinstance(end, int)):
        raise NotPlain
    listed = range(begin) if end is None else range(begin, end)
    kind = "q" if dtype is None else kind_of(dtype)
    return new(array(CODES[kind], listed), (len(listed),), kind)


def linspace(begin: Any, end: Any, count: int) -> Plain:
    """Spread numbers evenly, with the rounding of NumPy."""
    if not (isinstance(begin, float | int) and isinstance(end, float | int)) or count > MOST_HELD:
        raise NotPlain
    span, parts = end - begin, count - 1
    step = span / parts if parts > 0 else math.nan
    if parts > 0 and step == 0:
        numbers = [k / parts * span + begin for k in range(count)]
    else:
        numbers = [k * step + begin for k in range(count)] if parts > 0 else [0.0 * span + begin] * count
    if parts > 0:
        numbers[-1] = end
    return new(array("d", numbers), (count,), "d")


def broadcast_to(values: Any, shape: Any) -> Plain:
    given = _array(values)
    wanted: Shape = (shape,) if isinstance(shape, int) else tuple(shape)
    steps = spread(wanted, given.shape, given.steps)
    if steps is None:
        raise ValueError(f"an array of shape {given.shape} does not fill {wanted}")
    return Plain(given.block, wanted, given.kind, given.first, steps)


def concatenate(parts: Any, axis: int = 0) -> Plain:
    """Put arrays one behind the other, along an axis."""
    given = [_array(one) for one in parts]
    if axis:
        order = [axis, *(k for k in range(given[0].ndim) if k != axis)]
        joined = concatenate([one.transposed(order) for one in given])
        return joined.transposed([*range(1, axis + 1), 0, *range(axis + 1, joined.ndim)])
    rest = given[0].shape[1:]
    if any(one.shape[1:] != rest for one in given):
        raise ValueError("arrays that are joined have the same rows")
    kind = max((one.kind for one in given), key=RANK.index)
    numbers = array(CODES[kind])
    for one in given:
        part = one.numbers()[: one.size]
        numbers.extend(part if part.typecode == numbers.typecode else part.tolist())
    return new(numbers, (sum(one.shape[0] for one in given), *rest), kind)


def vstack(parts: Any) -> Plain:
    given = [_array(one) for one in parts]
    return concatenate([one.reshape(1, -1) if one.ndim == 1 else one for one in given])


def hstack(parts: Any) -> Plain:
    given = [_array(one) for one in parts]
    return concatenate(given, axis=0 if given[0].ndim == 1 else 1)


def column_stack(parts: Any) -> Plain:
    given = [_array(one) for one in parts]
    return concatenate([one.reshape(-1, 1) if one.ndim == 1 else one for one in given], axis=1)


def append(values: Any, more: Any) -> Plain:
    return concatenate([_array(values).ravel(), at_least_one(more).ravel()])


def tile(values: Any, times: Any) -> Plain:
    given = _array(values)
    if given.ndim != 1 or not (isinstance(times, tuple) and len(times) == 2 and times[1] == 1):
        raise NotPlain
    return new(given.numbers() * times[0], (times[0], given.size), given.kind)


def repeat(values: Any, times: Any, axis: int | None = None) -> Plain:
    """Give each row so many times."""
    given = _array(values)
    if axis is None:
        given = given.ravel()
    elif axis != 0:
        raise NotPlain
    if not isinstance(times, int):
        raise NotPlain
    wanted = (given.shape[0], times, *given.shape[1:])
    spread_out = Plain(given.block, wanted, given.kind, given.first, (given.steps[0], 0, *given.steps[1:]))
    return new(spread_out.numbers(), (given.shape[0] * times, *given.shape[1:]), given.kind)


class Joined:
    """``np.r_``: numbers and arrays one behind the other."""

    def __getitem__(self, parts: Any) -> Any:
        try:
            return concatenate([at_least_one(one) for one in parts])
        except (NotPlain, TypeError):
            return numpy().r_[parts]


def at_least_one(value: Any) -> Plain:
    """Give an array of a number, or an array as it is."""
    return array_of([value]) if isinstance(value, float | int) else _array(value)


def _array(value: Any) -> Plain:
    given = operand(value)
    if not isinstance(given, Plain):
        raise NotPlain
    return given


KNOWN_TYPES = {"float64": float, "intp": int, "bool_": bool, "uint8": "uint8"}
"""What stands for NumPy's types of numbers, so that it is not loaded for a name."""
assert all(kind in KINDS for kind in KNOWN_TYPES.values())

"""Parts of plain arrays: views by indices, slices and new axes, copies by one list of places or truths."""

from __future__ import annotations

from array import array
from typing import Any, NamedTuple

from .operators import spread_numbers
from .plain import CODES, NotPlain, Plain, array_of, new, operand
from .strided import Shape, put, taken


class _View(NamedTuple):
    """Where the numbers stand; ``axis`` along which ``rows`` are picked out of it, None where none are."""

    first: int
    shape: Shape
    steps: Shape
    axis: int | None = None
    rows: list[int] = []  # noqa: RUF012, read only


def part(of: Plain, key: Any) -> Any:
    """Give a number, a view, or a copy of the rows that are listed. NumPy does what goes by several lists."""
    if type(key) is int and of.ndim == 1:
        return _number(of, key)
    if isinstance(key, Plain) and key.kind == "?" and key.shape == of.shape and of.ndim > 1:
        of, key = of.ravel(), key.ravel()
    try:
        view = _viewed(of, key)
    except NotPlain:
        return of.numpy()[_for_numpy(key)]
    if view.axis is None:
        if view.shape:
            return Plain(of.block, view.shape, of.kind, view.first, view.steps)
        value = of.block[view.first]
        return value != 0 if of.kind == "?" else value
    front = _axis_in_front(of, view)
    rest, steps = front.shape[1:], front.steps[1:]
    numbers = array(CODES[of.kind])
    for row in view.rows:
        numbers += (
            taken(of.block, front.first + row * front.steps[0], rest, steps)
            if rest
            else (of.block[front.first + row * front.steps[0] : front.first + row * front.steps[0] + 1])
        )
    picked = new(numbers, (len(view.rows), *rest), of.kind)
    return picked.transposed([*range(1, view.axis + 1), 0, *range(view.axis + 1, picked.ndim)])


def _number(of: Plain, key: int) -> Any:
    size = of.shape[0]
    if not -size <= key < size:
        raise IndexError(f"{key} is no index of {size} numbers")
    value = of.block[of.first + (key if key >= 0 else key + size) * of.steps[0]]
    return value != 0 if of.kind == "?" else value


def put_part(of: Plain, key: Any, value: Any) -> None:
    """Write a number, or an array that fills it, to a part."""
    try:
        view = _viewed(of, key)
        given = operand(value)
    except NotPlain:
        of.numpy()[_for_numpy(key)] = value.numpy() if isinstance(value, Plain) else value
        return
    if view.axis is None:
        put(
            of.block, view.first, view.shape, view.steps, _filling(of, given, view.shape)
        ) if view.shape else (of.block.__setitem__(view.first, _filling(of, given, ())[0]))
        return
    size = len(view.rows)
    wanted = (*view.shape[: view.axis], size, *view.shape[view.axis + 1 :])
    filling = Plain(_filling(of, given, wanted), wanted, of.kind)
    target = _axis_in_front(of, view)
    source = _axis_in_front(filling, _View(0, wanted, filling.steps, view.axis))
    for k, row in enumerate(view.rows):
        values = (
            taken(source.block, k * source.steps[0], source.shape[1:], source.steps[1:])
            if source.ndim > 1
            else (source.block[k : k + 1])
        )
        at = target.first + row * target.steps[0]
        if target.ndim > 1:
            put(of.block, at, target.shape[1:], target.steps[1:], values)
        else:
            of.block[at] = values[0]


def _filling(of: Plain, value: Any, shape: Shape) -> Any:
    """Give numbers of the kind of an array that fill a shape; leading axes of one row may be there in vain."""
    if isinstance(value, Plain):
        while value.ndim > len(shape) and value.shape[0] == 1:
            value = value.reshape(value.shape[1:])
        if value.kind != of.kind and of.kind != "d":
            value = value.astype({"q": int, "?": bool, "B": "uint8"}[of.kind])
    numbers = spread_numbers(value, shape) if shape else [value]
    code = CODES[of.kind]
    if isinstance(numbers, array) and numbers.typecode == code:
        return numbers[:] if numbers is of.block else numbers
    return array(code, numbers)


def _axis_in_front(of: Plain, view: _View) -> Plain:
    assert view.axis is not None
    order = [view.axis, *(k for k in range(len(view.shape)) if k != view.axis)]
    return Plain(of.block, view.shape, of.kind, view.first, view.steps).transposed(order)


def _for_numpy(key: Any) -> Any:
    if isinstance(key, tuple):
        return tuple(_for_numpy(one) for one in key)
    return key.numpy() if isinstance(key, Plain) else key


def _viewed(of: Plain, key: Any) -> _View:
    keys = list(key) if isinstance(key, tuple) else [key]
    used = sum(one is not None and one is not Ellipsis for one in keys)
    if used > of.ndim:
        raise NotPlain  # NumPy says what is wrong with it, or takes several axes by one list of truths
    missing = [slice(None)] * (of.ndim - used)
    at = next((k for k, one in enumerate(keys) if one is Ellipsis), len(keys))
    keys = [*keys[:at], *missing, *keys[at + 1 :]]
    first, source = of.first, 0
    shape: list[int] = []
    steps: list[int] = []
    axis: int | None = None
    rows: list[int] = []
    numbers = 0
    for one in keys:
        if one is None:
            shape.append(1)
            steps.append(0)
            continue
        size, step = of.shape[source], of.steps[source]
        source += 1
        if isinstance(one, bool):
            raise NotPlain
        if isinstance(one, int):
            if not -size <= one < size:
                raise IndexError(f"{one} is no index of {size} rows")
            first += (one if one >= 0 else one + size) * step
            numbers += 1
        elif isinstance(one, slice):
            begin, end, stride = one.indices(size)
            count = len(range(begin, end, stride))
            first += begin * step if count else 0
            shape.append(count)
            steps.append(step * stride)
        else:
            if axis is not None:
                raise NotPlain
            axis, rows = len(shape), _rows(one, size)
            shape.append(size)
            steps.append(step)
    if axis is not None and numbers and len(keys) > 2:
        raise NotPlain  # where the new axis goes is another matter then
    return _View(first, tuple(shape), tuple(steps), axis, rows)


def _rows(key: Any, size: int) -> list[int]:
    """Give the rows that a list of places or truths names."""
    listed = key if isinstance(key, Plain) else array_of(key) if isinstance(key, list) else None
    if listed is None or listed.ndim != 1 or listed.kind not in "q?":
        if listed is not None and not listed.size and listed.ndim == 1:
            return []
        raise NotPlain
    values = listed.tolist()
    if listed.kind == "?":
        if len(values) != size:
            raise IndexError(f"{len(values)} truths for {size} rows")
        return [k for k, wanted in enumerate(values) if wanted]
    if any(not -size <= value < size for value in values):
        raise IndexError(f"an index is none of {size} rows")
    return [value if value >= 0 else value + size for value in values]


setattr(Plain, "__getitem__", part)  # noqa: B010, for type checkers the class has them
setattr(Plain, "__setitem__", put_part)  # noqa: B010

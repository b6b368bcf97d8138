"""Numbers of an array in one block of memory: where they stand, and how they are taken out and put in.

A place is (first, shape, steps): the index of the first number, and how far it is from one to the next along each axis.
"""

from __future__ import annotations

from array import array
from math import prod
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    Block = array[Any]
else:
    Block = array
Shape = tuple[int, ...]


def steps_of(shape: Shape) -> Shape:
    """Give the steps of numbers that stand one behind the other, the last axis fastest."""
    steps = [1] * len(shape)
    for axis in range(len(shape) - 1, 0, -1):
        steps[axis - 1] = steps[axis] * shape[axis]
    return tuple(steps)


def is_whole(shape: Shape, steps: Shape) -> bool:
    """Whether numbers stand one behind the other."""
    expected = 1
    for size, step in zip(reversed(shape), reversed(steps), strict=True):
        if size != 1 and step != expected:
            return False
        expected *= size
    return True


def taken(block: Block, first: int, shape: Shape, steps: Shape) -> Block:
    """Give the numbers in a block of their own."""
    if 0 in shape:
        return block[:0]
    return _taken(block, first, *_joined(shape, steps))


def _joined(shape: Shape, steps: Shape) -> tuple[Shape, Shape]:
    """Take axes together along which numbers stand at equal distances."""
    sizes: list[int] = []
    apart: list[int] = []
    for size, step in zip(shape, steps, strict=True):
        if size == 1:
            continue
        if sizes and apart[-1] == size * step:
            sizes[-1] *= size
            apart[-1] = step
        else:
            sizes.append(size)
            apart.append(step)
    return tuple(sizes), tuple(apart)


def _taken(block: Block, first: int, shape: Shape, steps: Shape) -> Block:
    if not shape:
        return block[first : first + 1]
    size, step = shape[0], steps[0]
    if len(shape) == 1:
        return block[first : first + 1] * size if step == 0 else block[_slice(first, size, step)]
    if step == 0:
        return _taken(block, first, shape[1:], steps[1:]) * size
    last = shape[-1]
    if last < size:  # a few columns rather than many rows
        found = block[:1] * prod(shape)
        for k in range(last):
            found[k::last] = _taken(block, first + k * steps[-1], *_joined(shape[:-1], steps[:-1]))
        return found
    found = block[:0]
    for k in range(size):
        found += _taken(block, first + k * step, shape[1:], steps[1:])
    return found


def put(block: Block, first: int, shape: Shape, steps: Shape, values: Block) -> None:
    """Write ``values``, which stand one behind the other, to a place."""
    if 0 in shape:
        return
    if is_whole(shape, steps):
        block[first : first + len(values)] = values
    elif len(shape) == 1:
        block[_slice(first, shape[0], steps[0])] = values
    else:
        each = len(values) // shape[0]
        for k in range(shape[0]):
            put(block, first + k * steps[0], shape[1:], steps[1:], values[k * each : (k + 1) * each])


def _slice(first: int, size: int, step: int) -> slice:
    end = first + size * step
    return slice(first, end if end >= 0 else None, step)


def common(one: Shape, other: Shape) -> Shape | None:
    """Give the shape to which both spread, None where they do not."""
    longest = max(len(one), len(other))
    pairs = zip((1,) * (longest - len(one)) + one, (1,) * (longest - len(other)) + other, strict=True)
    shape = []
    for a, b in pairs:
        if a != b and a != 1 and b != 1:
            return None
        shape.append(b if a == 1 else a)
    return tuple(shape)


def spread(shape: Shape, own: Shape, steps: Shape) -> Shape | None:
    """Give the steps by which an array of ``own`` shape and ``steps`` fills ``shape``, None where it does not."""
    if common(own, shape) != shape:
        return None
    lacking = len(shape) - len(own)
    wide = zip(own, steps, shape[lacking:], strict=True)
    return (0,) * lacking + tuple(0 if size == 1 and full != 1 else step for size, step, full in wide)

"""Arrays without NumPy: numbers in one block of memory, which C reads and writes, with the operators that reports need.

They behave as NumPy's. What they do not know themselves NumPy does, with their memory, and gives arrays of its own; from
then on it is there. So do operations on more than ``MOST`` numbers, for which NumPy is worth its import.
"""

from __future__ import annotations

import math
import operator
import sys
from array import array
from collections.abc import Iterable, Iterator, Sequence
from itertools import repeat
from typing import TYPE_CHECKING, Any, NamedTuple

from .loading import numpy
from .strided import Block, Shape, is_whole, steps_of, taken

MOST = 32_768
"""Numbers that one operation goes through: as many take some milliseconds, and the import of NumPy eighty."""

CODES = {"d": "d", "q": "q", "?": "B", "B": "B"}
"""Code of a block by the kind of its numbers: real, integer, truth, byte."""
NUMPY = {"d": "f8", "q": "i8", "?": "b1", "B": "u1"}
KINDS = {float: "d", int: "q", bool: "?", "uint8": "B", None: "d"}
"""Kind by what is given as ``dtype``."""
RANK = "?Bqd"
"""Kinds, from the narrowest to the widest."""


class NotPlain(Exception):
    """NumPy has to do it."""


class Address(NamedTuple):
    """``data``: the address of the first number."""

    data: int


class Plain:
    """Numbers [shape] of one ``kind``, at a place in a ``block`` that others may share."""

    __slots__ = ("__weakref__", "block", "first", "kind", "shape", "steps")
    __hash__ = None  # type: ignore[assignment]

    def __init__(self, block: Block, shape: Shape, kind: str, first: int = 0, steps: Shape | None = None):
        self.block, self.shape, self.kind, self.first = block, shape, kind, first
        self.steps = steps_of(shape) if steps is None else steps

    # ---- what it is

    @property
    def size(self) -> int:
        return math.prod(self.shape)

    @property
    def nbytes(self) -> int:
        return self.size * self.block.itemsize

    @property
    def ndim(self) -> int:
        return len(self.shape)

    @property
    def T(self) -> Plain:
        return Plain(self.block, self.shape[::-1], self.kind, self.first, self.steps[::-1])

    @property
    def ctypes(self) -> Address:
        return Address(self.block.buffer_info()[0] + self.first * self.block.itemsize)

    @property
    def __array_interface__(self) -> dict[str, Any]:
        size = self.block.itemsize
        return {
            "version": 3,
            "typestr": ("<" if sys.byteorder == "little" else ">") + NUMPY[self.kind],
            "shape": self.shape,
            "strides": tuple(step * size for step in self.steps),
            "data": (self.ctypes.data, False),
        }

    def numpy(self) -> Any:
        """Give NumPy's array of the same memory."""
        return numpy().asarray(self)

    def __array_ufunc__(
        self, function: Any, method: str, *inputs: Any, out: Any = None, **options: Any
    ) -> Any:
        """Let a function of NumPy read this memory, and write to it."""
        given = {name: _for_numpy(value) for name, value in options.items()}
        if out is not None:
            given["out"] = tuple(map(_for_numpy, out))
        return getattr(function, method)(*map(_for_numpy, inputs), **given)

    def __getattr__(self, name: str) -> Any:
        """Give a method that only NumPy has; those for reducing are set in ``reductions.py``."""
        if name.startswith("__"):
            raise AttributeError(name)
        return getattr(self.numpy(), name)

    def __len__(self) -> int:
        return self.shape[0]

    def __iter__(self) -> Iterator[Any]:
        if len(self.shape) == 1:
            return iter(self.tolist())
        return (self[k] for k in range(self.shape[0]))

    def __bool__(self) -> bool:
        (value,) = self.numbers()
        return bool(value)

    def __float__(self) -> float:
        (value,) = self.numbers()
        return float(value)

    def __repr__(self) -> str:
        return f"array({self.tolist()!r})"

    def __reduce__(self) -> tuple[Any, ...]:
        return Plain, (self.numbers(), self.shape, self.kind)

    # ---- its numbers

    def numbers(self) -> Block:
        """Give the numbers one behind the other: its own block, if it holds nothing else."""
        if len(self.block) == self.size and is_whole(self.shape, self.steps):
            return self.block
        return taken(self.block, self.first, self.shape, self.steps)

    def tolist(self) -> list[Any]:
        values = self.numbers().tolist()
        if self.kind == "?":
            values = [value != 0 for value in values]
        return _nested(values, self.shape)

    def copy(self) -> Plain:
        return new(self.numbers()[:], self.shape, self.kind)

    def astype(self, dtype: Any) -> Plain:
        kind = kind_of(dtype)
        values: Iterable[Any] = self.numbers()
        if kind == "q" and self.kind == "d":
            values = map(int, values)
        elif kind == "?":
            values = map(operator.ne, values, repeat(0))
        return new(array(CODES[kind], values), self.shape, kind)

    def reshape(self, *shape: Any) -> Plain:
        wanted: Shape = tuple(shape[0]) if len(shape) == 1 and not isinstance(shape[0], int) else shape
        if -1 in wanted:
            rest = -math.prod(wanted)
            wanted = tuple((self.size // rest if rest else 0) if size == -1 else size for size in wanted)
        if math.prod(wanted) != self.size:
            raise ValueError(f"cannot reshape an array of shape {self.shape} to {wanted}")
        if is_whole(self.shape, self.steps):
            return Plain(self.block, wanted, self.kind, self.first)
        return new(self.numbers(), wanted, self.kind)

    def ravel(self) -> Plain:
        return self.reshape(-1)

    def transposed(self, axes: Sequence[int]) -> Plain:
        """Give the same numbers with its axes in another order."""
        shape, steps = (tuple(of[axis] for axis in axes) for of in (self.shape, self.steps))
        return Plain(self.block, shape, self.kind, self.first, steps)

    def resize(self, *shape: Any, refcheck: bool = True) -> None:
        """Take another shape in a block of its own, with the numbers that it has, then zeros."""
        wanted: Shape = tuple(shape[0]) if isinstance(shape[0], Sequence) else shape
        kept = self.numbers()[: math.prod(wanted)]
        more = bytes(kept.itemsize * (max(math.prod(wanted), 1) - len(kept)))
        self.block, self.first = kept + array(kept.typecode, more), 0
        self.shape, self.steps = wanted, steps_of(wanted)

    if TYPE_CHECKING:  # parts.py has them

        def __getitem__(self, key: Any) -> Any: ...
        def __setitem__(self, key: Any, value: Any) -> None: ...


def _for_numpy(value: Any) -> Any:
    return value.numpy() if isinstance(value, Plain) else value


def _nested(values: list[Any], shape: Shape) -> list[Any]:
    if len(shape) < 2:
        return values
    size = math.prod(shape[1:])
    return [_nested(values[k * size : (k + 1) * size], shape[1:]) for k in range(shape[0])]


def new(values: Block, shape: Shape, kind: str) -> Plain:
    """Give an array of numbers that stand one behind the other. C is never given the address of nothing."""
    return Plain(values if values else array(CODES[kind], [0]), shape, kind)


def kind_of(dtype: Any) -> str:
    """Give the kind that is asked for. Raises NotPlain for one that only NumPy has."""
    try:
        return KINDS[dtype]
    except (KeyError, TypeError):
        raise NotPlain from None


def operand(value: Any) -> Any:
    """Give an array or a number of Python. Raises NotPlain for everything that only NumPy knows."""
    if isinstance(value, Plain | float | int):
        return value
    if isinstance(value, list | tuple):
        return array_of(value)
    raise NotPlain


def array_of(values: Sequence[Any], dtype: Any = None) -> Plain:
    """Make an array of numbers, or of sequences of equal length. Raises NotPlain for others."""
    parts: list[Any] = [operand(value) for value in values]
    if all(isinstance(part, float | int) for part in parts):
        shape: Shape = (len(parts),)
        kind = max((kind_in(part) for part in parts), key=RANK.index, default="d")
        numbers: Iterable[Any] = parts
    elif all(isinstance(part, Plain) and part.shape == parts[0].shape for part in parts):
        shape = (len(parts), *parts[0].shape)
        kind = max((part.kind for part in parts), key=RANK.index)
        numbers = array(CODES[kind])
        for part in parts:
            same = CODES[part.kind] == CODES[kind]
            numbers.extend(part.numbers()[: part.size] if same else part.tolist())
    else:
        raise NotPlain
    try:
        made = new(array(CODES[kind], numbers), shape, kind)
    except OverflowError:
        raise NotPlain from None
    return made if dtype is None or kind_of(dtype) == kind else made.astype(dtype)


def kind_in(value: Any) -> str:
    """Give the kind of an array or of a number of Python."""
    if isinstance(value, Plain):
        return value.kind
    return "?" if isinstance(value, bool) else "q" if isinstance(value, int) else "d"

"""NumPy by its usual name, loaded when it is first needed; or plain arrays before it, for whoever shows no array to anyone."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from ctypes import addressof, c_char
from functools import cache, wraps
from typing import TYPE_CHECKING, Any

from .loading import Quiet, numpy, when_loaded

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    Flags = NDArray[np.bool_]
    Bytes = NDArray[np.uint8]
else:
    Array = Flags = Bytes = object  # their names alone are needed where NumPy is not loaded

    class _NumPy:
        """The names of NumPy, each found when it is first used."""

        def __getattr__(self, name):
            value = getattr(numpy(), name)
            setattr(self, name, value)
            return value

    np = _NumPy()

__all__ = ["Array", "Bytes", "Flags", "address_of", "memory_of", "np", "plain_arrays"]

MADE = (
    "empty zeros ones full zeros_like ones_like full_like asarray ascontiguousarray arange linspace broadcast_to "
    "concatenate vstack hstack column_stack append tile repeat"
)
EACH = "isfinite sqrt exp log where clip divide outer diff flatnonzero searchsorted isin"
REDUCED = "max min nanmax sum mean any all argmax argmin"


def memory_of(values: Array) -> Any:
    """Give the memory of an array that holds nothing else, as ctypes takes it."""
    return getattr(values, "block", values)


def address_of(values: Any) -> int:
    """Give the address of the first number of an array, sooner than NumPy does."""
    if values.size:
        try:
            return addressof(c_char.from_buffer(values))
        except (TypeError, ValueError):  # plain, or only to be read
            pass
    return int(values.ctypes.data)


@contextmanager
def plain_arrays(*, beside_numpy: bool = False, until_needed: bool = True) -> Iterator[None]:
    """Let what runs within work with plain arrays until something needs NumPy. Where that is loaded already it saves nothing,
    and is done only if it is asked for; so are further ones behind what needed it."""
    if "numpy" in sys.modules and not beside_numpy:
        yield
        return
    names: dict[str, Any] = vars(np)
    before = dict(names)

    def end() -> None:
        names.clear()
        names.update(before)

    names.update(plain_names())
    if until_needed:
        when_loaded.append(end)
    try:
        yield
    finally:
        if end in when_loaded:
            when_loaded.remove(end)
        end()


@cache
def plain_names() -> dict[str, Any]:
    """Give what stands for the names of NumPy."""
    import math

    from . import elementwise, making, operators, parts, reductions

    assert operators and parts  # give plain arrays what is written with signs

    named: dict[str, Callable[..., Any]] = {"array": making.array_, "abs": elementwise.absolute}
    for room, listed in ((making, MADE), (elementwise, EACH), (reductions, REDUCED)):
        named |= {name: getattr(room, name) for name in listed.split()}
    return {
        **{name: _or_by_numpy(function, _finding(name)) for name, function in named.items()},
        "maximum": _Extreme(elementwise.maximum, "maximum"),
        "minimum": _Extreme(elementwise.minimum, "minimum"),
        "linalg": _LinearAlgebra(),
        "r_": making.Joined(),
        "errstate": Quiet,
        "inf": math.inf,
        "nan": math.nan,
        **making.KNOWN_TYPES,
    }


def _finding(name: str) -> Callable[[], Any]:
    return lambda: getattr(numpy(), name)


def _or_by_numpy(function: Callable[..., Any], find: Callable[[], Any]) -> Callable[..., Any]:
    """Let NumPy do what a function does not know; ``find`` gives its function."""
    from .plain import NotPlain, Plain

    @wraps(function)
    def call(*arguments: Any, **options: Any) -> Any:
        try:
            return function(*arguments, **options)
        except (
            NotPlain,
            TypeError,
            AttributeError,
        ):  # others for an option or an argument that only NumPy takes
            shared = {n: w.numpy() if isinstance(w, Plain) else w for n, w in options.items()}  # out=
            return find()(*arguments, **shared)

    return call


class _Extreme:
    """``np.maximum`` with its ``accumulate``."""

    def __init__(self, function: Any, name: str) -> None:
        self._call = _or_by_numpy(function.__call__, _finding(name))
        self.accumulate = _or_by_numpy(function.accumulate, lambda: getattr(numpy(), name).accumulate)

    def __call__(self, *arguments: Any, **options: Any) -> Any:
        return self._call(*arguments, **options)


class _LinearAlgebra:
    """``np.linalg``, of which lengths are all that is plain."""

    def __init__(self) -> None:
        from .elementwise import norm

        self.norm = _or_by_numpy(norm, lambda: numpy().linalg.norm)

    def __getattr__(self, name: str) -> Any:
        return getattr(numpy().linalg, name)

"""How much work is done by code of libtcc before a question begins again with that of gcc.

It counts evaluations, never time, so that the same question is answered by the same code each time.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

LITTLE = 40_000
"""Evaluations of the derivatives of a model. By libtcc they take two to seven times as long as by gcc, so that they cost a run of ten
million three percent at most; to compile the model takes gcc the time of a hundred thousand of its own and more."""

_left: ContextVar[list[int] | None] = ContextVar("left", default=None)


class BetterCodePays(Exception):
    """The answer takes more than a little work."""


@contextmanager
def little_work() -> Iterator[None]:
    """Raise BetterCodePays once all runs by libtcc within have taken ``LITTLE`` evaluations."""
    token = _left.set([LITTLE])
    try:
        yield
    finally:
        _left.reset(token)


def count_work(evaluations: int) -> None:
    """Tell of evaluations by libtcc. Raises BetterCodePays where they were too many."""
    left = _left.get()
    if left is not None:
        left[0] -= evaluations
        if left[0] < 0:
            raise BetterCodePays

"""What is made of a problem once, however often it runs."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import TypeVar

from .interface import ModelInterface

MOST = 16
"""Problems whose values are kept, the last ones: each is held as long as that."""

Made = TypeVar("Made")
Of = TypeVar("Of", bound=ModelInterface)


def once(make: Callable[[Of], Made]) -> Callable[[Of], Made]:
    """Let a function of a problem alone give what it gave for this very problem before."""
    kept: dict[int, tuple[Of, Made]] = {}
    last: tuple[Of, Made] | tuple[None] = (None,)

    @functools.wraps(make)
    def found(problem: Of) -> Made:
        nonlocal last
        known = last
        if known[0] is problem:  # mostly
            return known[1]
        again = kept.get(id(problem))
        if again is None:  # a problem that is kept is alive: no other one has its number
            again = problem, make(problem)
            while len(kept) >= MOST:
                kept.pop(next(iter(kept)), None)
            kept[id(problem)] = again
        last = again
        return again[1]

    return found

"""What is made of a problem or a compilation once, however often it is asked for."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import TypeVar

MOST = 16
"""Those whose values are kept, the last ones: each is held as long as that."""

Made = TypeVar("Made")
Of = TypeVar("Of")


def once(make: Callable[[Of], Made]) -> Callable[[Of], Made]:
    """Let a function of one value alone give what it gave for this very value before."""
    kept: dict[int, tuple[Of, Made]] = {}
    last: tuple[Of, Made] | None = None

    @functools.wraps(make)
    def found(problem: Of) -> Made:
        nonlocal last
        known = last
        if known is not None and known[0] is problem:  # mostly
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

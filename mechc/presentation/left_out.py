"""What tables of a report leave out: never what the model declares itself as an output, nor what was asked for."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

from .style import Style

T = TypeVar("T")


def is_own(name: str) -> bool:
    """Tell whether a quantity belongs to the model itself, not to one of its parts."""
    return "." not in name


def first_and_asked(items: Sequence[T], most: int, asked: Callable[[T], bool]) -> list[T]:
    """Return what is asked for, and as many of the first others as make up ``most`` together, in the order of ``items``."""
    room = most - sum(map(asked, items))
    found = []
    for item in items:
        if not asked(item):
            if room <= 0:
                continue
            room -= 1
        found.append(item)
    return found


def left_out(count: int, what: str, style: Style) -> str:
    """Return the row that says how many are left out, and how to see them."""
    return style.dim(f"  ... and {count} more {what}; 'mechc run --outputs NAME,...' shows those it names")

"""Loops whose sines and cosines are formed ahead, a block of iterations at once."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TypeGuard

from msgspec import Struct

from ..graph.operations import COS, SIN
from ..program.loops.rolled import Carried, Compute, Local, Loop, Operand, Put, Read, Rolled
from ..program.model import Operate
from .sincos_batch import EARLY, WIDTH

FEWEST_TRIPS = 4 * WIDTH
"""Iterations from which on blocks are worth it."""

TURN = ("angle", "sine", "cosine")
"""What a block holds of each angle: arrays of these names."""


class Ahead(Struct, frozen=True):
    """What a block of iterations does first: ``angles``, and by number the statements that they are made by and what these
    carry; what the rest of an iteration reads or stores of them is ``needed``."""

    angles: tuple[Operand, ...]
    statements: frozenset[int]
    carried: frozenset[int]
    needed: frozenset[int]


def ahead(loop: Loop) -> Ahead | None:
    """Return what is done ahead in a loop; None where that waits for more than sums of what the function is given."""
    items = [item for item in loop.body if not isinstance(item, Loop)]
    if len(items) < len(loop.body) or loop.trips.table >= 0 or loop.trips.strides:
        return None
    angles = tuple(dict.fromkeys(item.operands[0] for item in items if is_turn(item)))
    if not angles or loop.trips.base < FEWEST_TRIPS:
        return None
    computed = {item.number: item for item in items if isinstance(item, Compute)}
    written = _written(items)
    sources = {carry.number: carry.source for carry in loop.carried}
    found: set[int] = set()
    carried: set[int] = set()
    pending = [*angles]
    while pending:
        operand = pending.pop()
        if isinstance(operand, Local) and operand.number in computed:
            item = computed[operand.number]
            if not isinstance(item.statement, Operate) or item.statement.code not in EARLY:
                return None
            if item.number not in found:
                found.add(item.number)
                pending += item.operands
        elif isinstance(operand, Carried):
            carried.add(operand.number)
            pending.append(Local(sources[operand.number]))
        elif isinstance(operand, Read) and operand.array in written:
            return None
    others = [item for item in items if not is_turn(item) and _number(item) not in found]
    operands = [o for item in others for o in operands_of(item)]
    if any(isinstance(o, Carried) and o.number in carried for o in operands):
        return None
    read = {o.number for o in operands if isinstance(o, Local)}
    stored = {number for number in found if computed[number].place is not None}
    later = {source for number, source in sources.items() if number not in carried}
    return Ahead(angles, frozenset(found), frozenset(carried), frozenset(found & (read | stored | later)))


def is_turn(item: Compute | Put) -> TypeGuard[Compute]:
    """Whether an item is a sine or a cosine."""
    return (
        isinstance(item, Compute)
        and isinstance(item.statement, Operate)
        and item.statement.code in (SIN, COS)
    )


def is_cosine(turn: Compute) -> bool:
    return isinstance(turn.statement, Operate) and turn.statement.code == COS


def operands_of(item: Compute | Put) -> tuple[Operand, ...]:
    return item.operands if isinstance(item, Compute) else (item.operand,)


def are_turned(rolled: Rolled) -> bool:
    """Whether some loop forms sines and cosines ahead."""
    pending = [*rolled.items]
    while pending:
        item = pending.pop()
        if isinstance(item, Loop):
            if ahead(item) is not None:
                return True
            pending += item.body
    return False


def _number(item: Compute | Put) -> int:
    return item.number if isinstance(item, Compute) else -1


def _written(items: Iterable[Compute | Put]) -> set[str]:
    """Return the arrays that items write."""
    return {
        item.array if isinstance(item, Put) else "w" for item in items if isinstance(item, Put) or item.place
    }

"""Which loops compilers do in vectors, and what is put side by side for them at the head of a function."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from msgspec import Struct

from ..graph.operations import ADD, DIV, MUL, NEG, SQRT, SUB
from ..program.loops.rolled import Compute, Index, Item, Local, Loop, LoopRegister, Read, Rolled
from ..program.model import Operate

COSTLY = (DIV, SQRT)
PLAIN = (ADD, SUB, MUL, NEG, *COSTLY)
"""Operations that processors have for several numbers at once."""

Way = tuple[str, int, int]
"""An array, where a loop begins to read it, and with which stride."""


class Copy(Struct, frozen=True):
    """Numbers that a loop reads with a stride, side by side under another name."""

    name: str
    count: int


def in_blocks(loop: Loop) -> bool:
    """Whether the iterations of a loop are done side by side: they are apart, and cost enough."""
    if not loop.apart:
        return False
    sums = {number for number, _ in loop.kept}
    costly = False
    for item in loop.body:
        if isinstance(item, Loop):
            return False
        if isinstance(item, Compute):
            if not isinstance(item.statement, Operate) or item.statement.code not in PLAIN:
                return False
            costly |= item.statement.code in COSTLY
        operands = item.operands if isinstance(item, Compute) else (item.operand,)
        if any(isinstance(o, Local) and o.number in sums for o in operands):
            return False
    return costly


def are_apart(rolled: Rolled) -> bool:
    """Whether some loop is done side by side."""
    pending = [*rolled.items]
    while pending:
        item = pending.pop()
        if isinstance(item, Loop):
            if in_blocks(item):
                return True
            pending += item.body
    return False


def are_sums(loop: Loop) -> bool:
    """Whether what a loop keeps in registers is only added to and taken from, so that parts may be summed apart."""
    kept = [item for item in loop.body if isinstance(item, Compute) and item.kept]
    return bool(kept) and all(
        isinstance(item.statement, Operate)
        and (
            item.statement.code == ADD
            or (item.statement.code == SUB and isinstance(item.operands[0], LoopRegister))
        )
        for item in kept
    )


def way_of(read: Read, counter: int) -> Way | None:
    """Return how a loop reads an array that nobody writes, where it does so with a stride and alike each time it runs."""
    index = read.index
    if read.array not in ("y", "u", "z") or index.table >= 0 or len(index.strides) != 1:
        return None
    ((moving, stride),) = index.strides
    return (read.array, index.base, stride) if moving == counter and abs(stride) > 1 else None


def copies_of(rolled: Rolled, sizes: Mapping[str, int], room: int) -> dict[Way, Copy]:
    """Return what loops inside others read again and again with a stride; nothing where that is more than ``room`` numbers."""
    counts: dict[Way, int] = {}
    again: set[Way] = set()
    for loop, trips, inside in _blocks(rolled.items, rolled.tables, {}):
        for item in loop.body:
            assert not isinstance(item, Loop)
            for operand in item.operands if isinstance(item, Compute) else (item.operand,):
                way = way_of(operand, loop.counter) if isinstance(operand, Read) else None
                if way is not None:
                    counts[way] = max(counts.get(way, 0), trips)
                    again |= {way} if inside else set()
    ends = {way: way[1] + way[2] * (count - 1) for way, count in counts.items()}
    held = {way: count for way, count in counts.items() if way in again and 0 <= ends[way] < sizes[way[0]]}
    if sum(held.values()) > room:
        return {}
    return {way: Copy(f"c{k}", count) for k, (way, count) in enumerate(held.items())}


def _blocks(
    items: Sequence[Item], tables: Sequence[Sequence[int]], most: Mapping[int, int]
) -> Iterator[tuple[Loop, int, bool]]:
    """Yield the loops in blocks, with the most iterations that one of their runs may have, and whether they stand in others."""
    for item in items:
        if isinstance(item, Loop):
            trips = _most(item.trips, tables, most)
            if in_blocks(item):
                yield item, trips, bool(most)
            yield from _blocks(item.body, tables, {**most, item.counter: trips})


def _most(index: Index, tables: Sequence[Sequence[int]], most: Mapping[int, int]) -> int:
    """Return the largest value of an index, or more."""
    last = max(tables[index.table]) if index.table >= 0 else 0
    return index.base + last + sum(max(0, stride * (most[c] - 1)) for c, stride in index.strides)


def copying(copies: Mapping[Way, Copy]) -> Iterator[str]:
    """Yield the lines that make copies."""
    for (array, base, stride), copy in copies.items():
        sign = "-" if stride < 0 else "+"
        yield f"mech_real {copy.name}[{copy.count}];"
        yield f"for (int k = 0; k < {copy.count}; k++) {{"
        yield f"    {copy.name}[k] = {array}[{base} {sign} {abs(stride)} * k];"
        yield "}"

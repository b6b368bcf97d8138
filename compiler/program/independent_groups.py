"""Which states have to do with each other: groups of which none feels another one.

Sizes are shared within a group only: a length of nanometres says nothing about one of kilometres in another machine that
stands in the same model.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

from .model import Load, Operate, ProgramFunction, Statement, Store, operands_of


class _Classes:
    """Numbers put together (union-find); None stands for what depends on no state."""

    def __init__(self, n: int) -> None:
        self.above = list(range(n))
        self.count = n

    def of(self, i: int) -> int:
        while self.above[i] != i:
            self.above[i] = self.above[self.above[i]]
            i = self.above[i]
        return i

    def join(self, one: int | None, other: int | None) -> int | None:
        if one is None or one == other:
            return other
        if other is None:
            return one
        a, b = self.of(one), self.of(other)
        if a == b:
            return a
        low, high = min(a, b), max(a, b)
        self.above[high] = low
        self.count -= 1
        return low


def groups(rhs: ProgramFunction, accounts: Collection[int], ny: int) -> tuple[int, ...]:
    """Number the group of each state by its derivatives; empty if there is one. ``accounts`` belong to none: all of the
    energy goes into them, and nothing follows from them."""
    classes = _Classes(ny)
    kept: dict[int, int | None] = {}
    for body in rhs.bodies:
        found: list[int | None] = []
        for statement in body:
            if type(statement) is not Operate:
                found.append(_class_of(statement, found, kept, classes, accounts))
                continue
            joined: int | None = None
            for operand in statement.operands:
                other = found[operand]
                if other != joined:  # most are alike
                    joined = classes.join(joined, other)
            found.append(joined)
            if classes.count == 1 + len(accounts):
                return ()
    roots = [classes.of(i) for i in range(ny)]
    numbers: dict[int, int] = {}
    return tuple(numbers.setdefault(root, len(numbers)) for root in roots)


def _class_of(
    statement: Statement,
    found: Sequence[int | None],
    kept: dict[int, int | None],
    classes: _Classes,
    accounts: Collection[int],
) -> int | None:
    match statement:
        case Load(array="y", index=i):
            return i
        case Load(array="w", index=i):
            return kept.get(i)
        case Store(array="out", index=i, value=value):
            if i < len(classes.above) and i not in accounts:
                classes.join(i, found[value])
        case Store(array="w", index=i, value=value):
            kept[i] = found[value]
        case _:
            for operand in operands_of(statement):
                return found[operand]
    return None

"""The error of a stage whose value is not what the stage promises."""

from __future__ import annotations

from collections.abc import Callable, Sequence

AROUND = 3
"""Lines shown before and after the one that is wrong."""


class Malformed(Exception):
    """A value of a stage breaks its own rules: a mistake of the compiler, never of the user.

    ``nearby``: what surrounds the place, line by line.
    """

    def __init__(self, where: str, what: str, nearby: Sequence[str] = ()) -> None:
        super().__init__("\n".join([f"{where}: {what}", *(f"    {line}" for line in nearby)]))


def excerpt(count: int, at: int, show: Callable[[int], str], also: Sequence[int] = ()) -> list[str]:
    """Return the lines around number ``at`` of ``count``, that one marked, and those that it refers to (``also``)."""
    near = range(max(0, at - AROUND), min(count, at + AROUND + 1))
    lines: list[str] = []
    before = -1
    for k in sorted({*near, *(k for k in also if 0 <= k < count)}):
        if k > before + 1:
            lines.append("   ...")
        lines.append(f"{'->' if k == at else '  '} {show(k)}")
        before = k
    return [*lines, "   ..."] if before + 1 < count else lines

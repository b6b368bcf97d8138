"""Mechanisms with closed loops, of any size: each a model with the structural parameter n."""

from __future__ import annotations

from pathlib import Path

from msgspec import Struct

MODELS = Path(__file__).parent.parent / "tests" / "models" / "loops"


class Loops(Struct, frozen=True):
    """``bound``: most operations for each ``unit`` of n, at the largest of ``sizes``; hoisted ones not counted."""

    name: str
    file: str
    unit: str
    bound: float
    sizes: tuple[int, ...]

    @property
    def text(self) -> str:
        return (MODELS / self.file).read_text(encoding="utf-8")


LOOPS = (
    Loops("closed chain of bars", "closed_chain.mech", "bar", 118, (10, 50, 100, 200)),
    Loops("ladder of four-bars", "ladder.mech", "cell", 400, (5, 10, 15, 20)),
    Loops("closed spatial chain of hinges", "spatial_chain.mech", "joint", 630, (10, 20, 50, 100)),
)

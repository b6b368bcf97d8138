"""What surrounds a place, from the word to the whole text: each step of a selection that grows."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from ..lang.source import Placed
from .document import Document
from .names import word_at


def around(document: Document, offset: int) -> list[tuple[int, int]]:
    """Return the ranges [start, end) around a place, the smallest first: word, expressions, statements, blocks, all."""
    found = {(0, len(document.text))}
    word = word_at(document.text, offset)
    if word is not None:
        found.add((word.start, word.end))
    if not document.broken and document.tree is not None:
        found |= {
            (n.span.start, n.span.end) for n in _nodes(document.tree) if n.span.start <= offset <= n.span.end
        }
    ordered = sorted(found, key=lambda r: r[1] - r[0])
    nested = ordered[:1]
    for place in ordered[1:]:
        if place[0] <= nested[-1][0] and nested[-1][1] <= place[1] and place != nested[-1]:
            nested.append(place)
    return nested


def _nodes(root: Any) -> Iterator[Placed]:
    """Yield what a tree consists of."""
    pending = [root]
    while pending:
        at = pending.pop()
        if isinstance(at, tuple):
            pending += at
        elif hasattr(at, "__struct_fields__"):
            if isinstance(at, Placed):
                yield at
            pending += [
                getattr(at, name) for name in at.__struct_fields__ if name not in ("span", "name_span")
            ]

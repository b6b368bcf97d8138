"""Further curves of one problem: the search is driven away from those that are known (Farrell, Birkisson, Funke 2015)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..problem import Array
from .posed import Posed
from .search import Answer, Failed, search
from .starts import Source, evaluate

MOST = 12
"""Curves that are looked for."""
WAVES = (1, 2, 3)
SHARES = (0.5, -0.5, 1.5, -1.5)
"""Shapes that are added to a guess: half waves, as shares of how far the coordinates range."""
APART = 1e-5
"""Curves are different that are further apart than this share of their size."""


def further(posed: Posed, first: Answer) -> list[Answer]:
    """Return stationary curves beside the first one, those of lower value first."""
    known = [first]
    for source in _starts(posed, first):
        if len(known) >= MOST:
            break
        for away in (known, []):
            try:
                found = search(posed, deflated=away, start=source, once=True)
            except Failed:
                continue
            if all(_apart(found, other) for other in known):
                known.append(found)
                break
    return sorted(known[1:], key=lambda a: a.value)


def _starts(posed: Posed, first: Answer) -> Iterator[Source]:
    yield posed.guess
    n = posed.curve.coordinates
    s = np.linspace(0, 1, 201)
    at = evaluate(first.discrete, first.solved, s, 0)[:n]
    spans = np.maximum(np.ptp(at, axis=1), 0.3 * np.max(np.abs(at), axis=1))
    spans = np.where(spans > 0, spans, max(float(spans.max()), 1.0))
    for share in SHARES:
        for wave in WAVES:
            for shape in (np.sin, np.cos):

                def bent(s: Array, share: float = share, wave: int = wave, shape: np.ufunc = shape) -> Array:
                    added: Array = share * spans[:, None] * shape(np.pi * wave * s)[None, :]
                    return posed.guess(s) + added

                yield bent


def _apart(a: Answer, b: Answer) -> bool:
    n = a.discrete.layout.n
    s = np.linspace(0, 1, 201)
    x, y = evaluate(a.discrete, a.solved, s, 0)[:n], evaluate(b.discrete, b.solved, s, 0)[:n]
    size = np.maximum(np.max(np.abs(x), axis=1), np.max(np.abs(y), axis=1))
    off = np.max(np.abs(x - y), axis=1)
    return bool(np.any(off > APART * np.maximum(size, float(size.max()) * 1e-3)))

"""Further curves of one problem: the search is driven away from those that are known (Farrell, Birkisson, Funke 2015)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ..problem import Array
from .posed import Posed
from .search import Failed, FoundCurve, search
from .starts import Source, evaluate, spans, with_waves

MOST = 12
"""Curves that are looked for."""
SHARES = (0.5, -0.5, 1.5, -1.5)
"""Of half waves that are added to a guess: shares of how far the coordinates range."""
APART = 1e-5
"""Curves are different that are further apart than this share of their size."""


def further(
    posed: Posed, first: FoundCurve, shares: Sequence[float] = SHARES, patience: int | None = None
) -> list[FoundCurve]:
    """Return stationary curves beside the first one, those of lower value first.

    ``shares`` of waves that are tried; ``patience``: after how many starts without a new curve the search ends.
    """
    known = [first]
    s = np.linspace(0, 1, 201)
    at = evaluate(first.discrete, first.solved, s, 0)[: posed.curve.coordinates]
    size = np.maximum(spans(posed, posed.guess(s)), spans(posed, at))
    idle = 0
    for source in _starts(posed, size, shares):
        if len(known) >= MOST or idle == patience:
            break
        idle += 1
        # known curves are points of the search only where all are passed at the same speed
        for away, weights in ((known, first.discrete.gauge), ([], None)):
            try:
                found = search(posed, deflated=away, start=source, once=True, weights=weights)
            except Failed:
                continue
            if all(_apart(found, other, size) for other in known):
                known.append(found)
                idle = 0
                break
    return sorted(known[1:], key=lambda a: a.value)


def _starts(posed: Posed, size: Array, shares: Sequence[float]) -> Iterator[Source]:
    yield posed.guess
    yield from (start for _, start in with_waves(posed.guess, size, shares))


def _apart(a: FoundCurve, b: FoundCurve, least: Array) -> bool:
    """Tell whether two curves differ; ``least``: sizes below which a coordinate counts as zero."""
    x, y = _passed(a, a.discrete.gauge), _passed(b, a.discrete.gauge)
    size = np.maximum(least, np.maximum(np.max(np.abs(x), axis=1), np.max(np.abs(y), axis=1)))
    off = np.max(np.abs(x - y), axis=1)
    return bool(np.any(off > APART * np.maximum(size, float(size.max()) * 1e-3)))


def _passed(answer: FoundCurve, weights: Array) -> Array:
    """Return a curve at equal steps; where its speed is free, of its length in coordinates of these weights."""
    n, s = answer.discrete.layout.n, np.linspace(0, 1, 201)
    if not len(weights):
        return evaluate(answer.discrete, answer.solved, s, 0)[:n]
    fine = np.linspace(0, 1, 20 * 200 + 1)
    at = evaluate(answer.discrete, answer.solved, fine, 0)[:n]
    steps = np.sqrt(weights @ np.diff(at, axis=1) ** 2)
    length = np.concatenate([[0.0], np.cumsum(steps)])
    return np.array([np.interp(s * length[-1], length, row) for row in at])

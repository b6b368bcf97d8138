"""Guesses with waves added: where a guess decides nothing, or hides other curves."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ..problem import Array
from .posed import Posed
from .starts import Source

WAVES = (1, 2, 3)
SHAPES = (np.sin, np.cos)
SHARE = 0.6
"""Of the range that a coordinate of its unit is taken to move."""


def spans(posed: Posed, at: Array) -> Array:
    """Return how far each coordinate ranges over places, (n, places); and for one of the unit of the range at
    least a share of that;
    zero for the independent variable itself."""
    found = np.maximum(np.ptp(at, axis=1), 0.3 * np.max(np.abs(at), axis=1))
    a, b = posed.range(posed.ends)
    alike = [q.measure == posed.problem.time.measure for q in posed.problem.states[: len(found)]]
    least = np.where(alike, SHARE * (b - a), 0.0)
    size = np.where(found > 0, np.maximum(found, least), np.where(alike, b - a, float(found.max()) or 1.0))
    if posed.curve.exchanged:
        size[-1] = 0.0
    return size


def with_waves(source: Source, size: Array, shares: Sequence[float]) -> Iterator[tuple[str, Source]]:
    """Yield a source with half waves added, as ``shares`` of ``size``, with words for each."""
    for shape in SHAPES:
        for wave in WAVES:
            for share in shares:

                def made(s: Array, share: float = share, wave: int = wave, shape: np.ufunc = shape) -> Array:
                    added: Array = share * size[:, None] * shape(np.pi * wave * s)[None, :]
                    return source(s) + added

                sign = "+" if share > 0 else "-"
                number = "" if wave == 1 else f"{wave} "
                wave_text = f"{shape.__name__}({number}pi s)"
                yield f"the guess {sign} {abs(share):g} {wave_text} of its size", made

"""Guesses with waves added: where a guess decides nothing, or hides other curves."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ..problem import Array
from .posed import Posed
from .starts import Source

WAVES = (1, 2, 3)
SHAPES = (np.sin, np.cos)


def spans(posed: Posed, at: Array) -> Array:
    """Return how far each coordinate ranges over places, (n, places); the length of the range for one that does not."""
    found = np.maximum(np.ptp(at, axis=1), 0.3 * np.max(np.abs(at), axis=1))
    a, b = posed.range(posed.ends)
    over = posed.problem.time.unit
    units = [q.unit for q in posed.problem.states[: len(found)]]
    other = float(found.max()) or 1.0
    return np.array(
        [x if x > 0 else b - a if unit == over else other for x, unit in zip(found, units, strict=True)]
    )


def bent(source: Source, size: Array, shares: Sequence[float]) -> Iterator[tuple[str, Source]]:
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

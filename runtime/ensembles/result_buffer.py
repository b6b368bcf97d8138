"""The results of an ensemble so far, filled piece by piece in any order."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from ..problem import Array

Piece = Mapping[str, Any]
"""The results of members that follow each other: arrays of the names in ``FIELDS``, and the ``texts`` that its reasons number."""

FIELDS = ("numbers", "number_errors", "rows", "outcomes", "reasons", "ends", "errors", "steps")


class ResultBuffer(Struct, eq=False):
    """A row for each member; of those that are not made yet the outcome is 0."""

    numbers: Array
    number_errors: Array
    rows: Array
    outcomes: NDArray[np.int8]
    reasons: NDArray[np.int32]
    ends: Array
    errors: Array
    steps: NDArray[np.int64]
    texts: list[str]

    @staticmethod
    def empty(n: int, numbers: int, series: int, times: int) -> ResultBuffer:
        return ResultBuffer(
            np.full((n, numbers), np.nan),
            np.full((n, numbers), np.nan),
            np.full((n, series, times), np.nan),
            np.zeros(n, dtype=np.int8),
            np.full(n, -1, dtype=np.int32),
            np.full(n, np.nan),
            np.full(n, np.nan),
            np.zeros(n, dtype=np.int64),
            [],
        )

    def take(self, first: int, last: int, piece: Piece) -> None:
        """Put the results of some members where they belong."""
        rows = slice(first, last)
        for name in FIELDS:
            if name != "reasons":
                getattr(self, name)[rows] = piece[name]
        texts = [str(text) for text in piece["texts"]]
        self.texts += [text for text in texts if text not in self.texts]
        own = np.array([self.texts.index(text) for text in texts] or [0], dtype=np.int32)
        self.reasons[rows] = np.where(piece["reasons"] >= 0, own[piece["reasons"]], -1)

    def gaps(self) -> list[tuple[int, int]]:
        """Give the members that are not made, as ranges."""
        waits = np.concatenate(([False], self.outcomes == 0, [False]))
        edges = np.flatnonzero(waits[1:] != waits[:-1])
        return [(int(first), int(last)) for first, last in edges.reshape(-1, 2)]

    def number_reasons(self) -> None:
        """Number the reasons in the order of the members, whatever the order in which these were made."""
        known, firsts = np.unique(self.reasons, return_index=True)
        order = [int(k) for k in known[np.argsort(firsts)] if k >= 0]
        places = np.full(len(self.texts) + 1, -1, dtype=np.int32)  # the last one is that of -1
        places[order] = np.arange(len(order), dtype=np.int32)
        self.reasons[:] = places[self.reasons]
        self.texts[:] = [self.texts[k] for k in order]

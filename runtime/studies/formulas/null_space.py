"""Which combinations of quantities are constant: null spaces of their rates, told from rounding, in few terms."""

from __future__ import annotations

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray
from scipy.linalg import qr, solve_triangular

from ...numerics.rank import GRADIENTS, condition, decomposed, decomposed_columns, rank
from ...problem import Array

DEPENDENT = 1e-8
"""Share of a column that is not made of those before it, below which it is made of them."""

CLEAR = 1e3
"""A gap between singular values is at least so wide; where there is none, nothing is told to be constant."""

SMALLEST = 1e-8
"""Relative to the largest: no larger singular value counts as zero."""

FAINT = 1e-6
"""Rates smaller than so much of the sizes of their columns are not made larger: they may be rounding alone."""

CONFIRMED = 1e-8
"""Largest rate of a combination at states that it was not found from, relative to the sum of the sizes of its terms."""

NEGLIGIBLE = 1e-8
"""Share of the largest coefficient that is rounding."""

ROUNDING = 1e-13
"""Largest rate of a combination relative to the sum of the sizes of its terms that is rounding."""

THIN = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7)
"""Shares of the largest coefficient below which terms are looked at whether they are needed."""

TRIALS = 80
"""Bases of a null space that are tried for combinations of few terms."""


class Null(Struct, frozen=True, eq=False):
    """``vectors`` [k, n]: combinations of the columns that vanish. ``largest_zero`` and ``next``: singular values
    relative to the largest, on both sides of the gap (0 and 1 where a side is empty)."""

    vectors: Array
    largest_zero: float
    next: float

    @property
    def clear(self) -> bool:
        """Whether there is a gap between what counts as zero and what does not."""
        return self.next > CLEAR * max(self.largest_zero, 1e-16)


def independent_columns(values: Array) -> list[int]:
    """Return the columns [n, k] that are not combinations of a constant and of columns before them."""
    scale = np.abs(values).max(axis=0)
    filled = np.flatnonzero(scale > 0)
    columns = np.hstack([np.ones((len(values), 1)), values[:, filled] / scale[filled]])
    columns /= np.linalg.norm(columns, axis=0)
    corner = np.abs(np.diag(np.linalg.qr(columns, mode="r")))
    return [int(k) for k, size in zip(filled, corner[1:], strict=True) if size > DEPENDENT]


def null_space(rates: Array, sizes: Array, values: Array | None = None) -> Null:
    """Return the combinations of the columns of ``rates`` [n, k] that vanish; ``sizes`` [k] of the columns.

    ``values`` [m, k]: rates are measured against how much combinations differ themselves, so that those of functions that are
    nearly alike, which hardly differ, do not count as constant for that.
    """
    if rates.shape[1] == 0:
        return Null(np.empty((0, 0)), 0.0, 1.0)
    scaled = rates / sizes
    norms = np.linalg.norm(scaled, axis=1)
    scaled = scaled / np.maximum(norms, FAINT)[:, None]
    plain, right = _singular(scaled)
    measured = plain
    if values is not None and len(values) > scaled.shape[1]:
        spread = np.asarray(np.linalg.qr((values - values.mean(axis=0)) / sizes, mode="r"))
        measured, _ = _singular(solve_triangular(spread / np.sqrt(len(values)), scaled.T, trans="T").T)
    count = _zeros(measured)
    kept = len(measured) - count
    return Null(
        right[kept:] / sizes,
        float(measured[kept]) if count else 0.0,
        float(measured[kept - 1]) if kept else 1.0,
    )


def _singular(rows: Array) -> tuple[Array, Array]:
    """Return the singular values relative to the largest, one for each column, and the directions that belong to them."""
    found = decomposed_columns(rows)
    values = np.zeros(rows.shape[1])
    values[: len(found.values)] = found.values / max(found.values[0], FAINT * np.sqrt(len(rows)))
    return values, found.right


def _zeros(values: Array) -> int:
    """Return how many singular values, largest first, count as zero: those below the widest gap under the limit."""
    floor = np.maximum(values, 1e-16)
    edges = [k for k in range(1, len(values)) if values[k] < SMALLEST]
    if len(values) and values[0] <= 0:
        return len(values)
    if not edges:
        return 0
    widest = max(edges, key=lambda k: floor[k - 1] / floor[k])
    return len(values) - widest if floor[widest - 1] / floor[widest] >= CLEAR else 0


def confirmed(vector: Array, rates: Array, sizes: Array) -> float:
    """Return the largest rate of a combination relative to the sum of the sizes of its terms; zero is perfect."""
    terms = rates * vector
    size = np.abs(terms).sum(axis=1) + np.abs(vector * sizes).sum()
    worst = np.abs(terms.sum(axis=1)) / np.where(size > 0, size, 1.0)
    return float(worst.max(initial=0.0))


class Refining:
    """Combinations freed of terms that rounding brought in: of functions that are nearly alike, small shares change no rate.

    ``rates`` and other ones to ``check`` with, [n, k] each; ``sizes`` [k].
    """

    def __init__(self, rates: Array, check: Array, sizes: Array) -> None:
        scaled = np.asarray(rates / sizes)
        norms = np.linalg.norm(scaled, axis=1)
        self.triangle = np.asarray(np.linalg.qr(scaled / np.maximum(norms, FAINT)[:, None], mode="r"))
        self.check, self.sizes = check, sizes

    def refined(self, scaled: Array) -> Array:
        """Return a combination, in sizes of its terms, solved for again with its larger terms alone, if these vanish as well."""
        shares = np.abs(scaled) / np.abs(scaled).max(initial=0.0)
        tried = np.count_nonzero(scaled)
        for share in THIN:
            places = np.flatnonzero(shares >= share)
            if len(places) >= tried:
                continue
            right = decomposed(self.triangle[:, places]).right
            own = np.zeros_like(scaled)
            own[places] = right[-1] / right[-1][np.abs(right[-1]).argmax()]
            alone = np.abs(own) >= NEGLIGIBLE
            if alone.sum() == len(places) and confirmed(own / self.sizes, self.check, self.sizes) < ROUNDING:
                return own
        return scaled


def sparse_basis(
    vectors: Array,
    costs: Array,
    sizes: Array,
    known: Array | None = None,
    refining: Refining | None = None,
) -> Array:
    """Return a basis [k, n] of the same space with few terms; what ``known`` [m, n] spans already is left out.

    Of many reduced echelon forms, with pivots chosen at random, the cheapest independent rows are taken: no basis
    made of these rows is cheaper, as independent sets are a matroid. ``costs`` [n] of a term; ``sizes``: see above. ``refining``
    frees each row of what is rounding.
    """
    count, n = vectors.shape
    if count == 0:
        return vectors
    scaled = vectors * sizes
    random = np.random.default_rng(5)
    rows: list[Array] = []
    for trial in range(TRIALS if count > 1 else 1):
        weights = np.exp(random.uniform(-6, 6, n)) if trial else 1.0 / costs
        _, _, pivots = qr(scaled * weights, mode="economic", pivoting=True)
        square = scaled[:, pivots[:count]]
        if condition(square) > 1 / GRADIENTS:
            continue
        rows += list(np.linalg.solve(square, scaled))
    cleaned = []
    for row in rows:
        row = row / np.abs(row).max()
        row = np.where(np.abs(row) < NEGLIGIBLE, 0.0, row)
        cleaned.append(row if refining is None else refining.refined(row))
    prices = [float(costs[row != 0].sum()) for row in cleaned]
    order = sorted(range(len(cleaned)), key=lambda k: (prices[k], tuple(np.flatnonzero(cleaned[k]))))
    before = [] if known is None else list(_orthonormal(known * sizes))
    chosen: list[Array] = []
    count -= len(before)
    seen: set[tuple[int, ...]] = set()
    for k in order:
        support = tuple(int(j) for j in np.flatnonzero(cleaned[k]))
        if support in seen:
            continue
        seen.add(support)
        if len(chosen) >= count:
            break
        tried = np.array([*before, *chosen, cleaned[k]])
        if rank(tried / np.linalg.norm(tried, axis=1)[:, None], GRADIENTS) == len(tried):
            chosen.append(cleaned[k])
    return np.array(chosen).reshape(-1, n) / sizes


def _orthonormal(rows: Array) -> Array:
    """Return an orthonormal basis of the space that rows span."""
    rows = rows / np.linalg.norm(rows, axis=1)[:, None]
    found = decomposed(rows)
    return found.right[: found.rank(GRADIENTS)]


def sizes_of(values: Array, rates: Array, time: float) -> Array:
    """Return a size for each column [n, k]: of its rate, and of its change over ``time``, whichever is larger."""
    change = values - values.mean(axis=0)
    found: Array = np.sqrt((rates**2).mean(axis=0)) + np.sqrt((change**2).mean(axis=0)) / time
    return np.where(found > 0, found, 1.0)


def support(vector: Array) -> NDArray[np.intp]:
    """Return where a combination has terms."""
    return np.flatnonzero(vector)

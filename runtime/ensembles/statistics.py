"""What part of the variance of a number each varied quantity explains alone."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..problem import Array

FEWEST = 30
"""Members from which indices are estimated."""


def first_order(values: Array, where: Array, names: Sequence[str]) -> dict[str, float]:
    """Give, for each varied quantity, the share of the variance of ``values`` [n] that it explains; ``where`` [n, names].

    On a product it is the variance of the means over its values. On a cloud of independent values it is estimated from the
    same members: means over bins of equal counts, with the variance that the means of n / bins members have by chance
    taken off. Raises ValueError where fewer than ``FEWEST`` members have the number.
    """
    good = np.isfinite(values)
    if good.sum() < FEWEST:
        raise ValueError(f"{good.sum()} members have the number: for its Sobol' indices {FEWEST} are needed")
    variance = float(values[good].var())
    return {
        one: _explained(where[good, k], values[good]) / variance if variance > 0 else float("nan")
        for k, one in enumerate(names)
    }


def _explained(x: Array, values: Array) -> float:
    """Give the variance of the conditional means of ``values`` over x, one for each value of x or for each bin."""
    group: NDArray[np.intp]
    levels, group = np.unique(x, return_inverse=True)
    if levels.size > values.size ** (1 / 2):
        bins = max(2, round(values.size ** (1 / 3)))
        group = np.empty(values.size, dtype=np.intp)
        group[np.argsort(x, kind="stable")] = np.arange(values.size) * bins // values.size
    counts = np.bincount(group)
    means = np.bincount(group, values) / counts
    within = np.bincount(group, values**2) / counts - means**2
    shares = counts / values.size
    chance = float((shares * within / np.maximum(counts - 1, 1)).sum())
    return max(0.0, float((shares * (means - values.mean()) ** 2).sum()) - chance)

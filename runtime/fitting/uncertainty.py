"""What a solution of a search is worth: standard errors, intervals, correlation, and what the data cannot tell."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from msgspec import Struct

from ..numerics.rank import MOTIONS, decomposed_columns
from ..problem import Array
from .identifiability import Unseen, unseen
from .residuals import counted
from .search import FitSearch, SearchResult

CONFIDENCE = 0.95
LEAST = 1e-3
"""Of the size with which a search begins: the least size of an unknown that ends at zero."""
HOPELESS = 1e-3
"""Of the noise: a direction whose whole size moves the data less is undetermined by a factor of a thousand."""


class FitErrors(Struct, frozen=True, eq=False):
    """``errors`` [k] are standard errors, infinite for what the data cannot tell; ``half`` [k] half the widths of the
    intervals; ``correlation`` [k, k] not-a-number there; ``relative``: root mean square of residuals over their noise."""

    errors: Array
    half: Array
    correlation: Array
    unseen: Unseen
    relative: float


def judge(search: FitSearch, found: SearchResult, names: Sequence[str]) -> FitErrors:
    """Tell it from the derivatives at the solution. ``names`` [k]: the unknowns in words."""
    from scipy.special import ndtri, stdtrit  # scipy.stats has the same numbers, and takes a second to load

    motions = search.motions
    computed = motions.at(found.x)
    known = np.isfinite(search.given)
    sigma = np.where(known, search.given, search.noise(found))
    sizes = np.maximum(np.abs(found.x), LEAST * search.sizes)
    r = motions.residuals(computed, 1.0 / sigma)
    slopes = motions.jacobian(computed, 1.0 / sigma) * sizes * np.sqrt(counted(r, search.loss))[:, None]
    hidden = unseen(names, found.x, slopes, HOPELESS, MOTIONS)
    seen = np.array([name not in hidden.names for name in names])
    covariance = _covariance(slopes, HOPELESS)
    scale = np.sqrt(np.where(seen, np.diag(covariance), np.nan))
    errors = np.where(seen, scale * sizes, np.inf)
    freedom = max(r.size - len(names), 1)
    share = 0.5 + CONFIDENCE / 2
    quantile = float(ndtri(share) if known.all() else stdtrit(freedom, share))
    return FitErrors(
        errors, quantile * errors, covariance / np.outer(scale, scale), hidden, float(np.sqrt(np.mean(r**2)))
    )


def _covariance(slopes: Array, noise: float) -> Array:
    """Give the covariance [k, k] of the unknowns over their sizes; along directions that are not seen they stay where they
    are, which changes nothing for unknowns that are not part of these."""
    found = decomposed_columns(slopes)
    s, v = found.values, found.right[: found.values.size]
    there = s > max(noise, MOTIONS * float(s.max(initial=0.0)))
    covariance: Array = (v[there].T / s[there] ** 2) @ v[there]
    return covariance

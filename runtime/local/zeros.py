"""Poles and zeros of a linear system, with what their figures are off at most.

A. Emami-Naeini, P. Van Dooren, Computation of zeros of linear multivariable systems, Automatica 18 (1982), 415.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from ..numerics.rank import FORMULAS, decomposed
from ..problem import Array

Complex = NDArray[np.complex128]
EPSILON = float(np.finfo(float).eps)
DEFECTIVE = 1e-7
"""An eigenvalue whose condition is above one over this has no independent vector within rounding."""


def poles(a: Array, units: Sequence[str] = ()) -> tuple[Complex, list[float | None]]:
    """Return the eigenvalues of A, those with small real and imaginary part last, and a bound of the error of each.

    The bound is the condition of the eigenvalue times the rounding of the entries; None for a defective one. ``units`` of
    the states: an entry that is what rounding leaves of zero is as uncertain as the largest of its row in columns of
    its unit, however small it is; balancing would make it large.
    """
    if not a.size:
        return np.zeros(0, dtype=complex), []
    balanced, scales = _balanced(a)
    values, left, right = scipy.linalg.eig(balanced, left=True, right=True)
    norm = float(np.linalg.norm(balanced))
    order = np.lexsort((-values.imag, -values.real.round(12)))
    errors: list[float | None] = []
    rounding = 4 * EPSILON * _largest_of_a_unit(a, units) / scales[:, None] * scales
    for k in order:
        overlap = abs(np.vdot(left[:, k], right[:, k]))
        moved = max(4 * EPSILON * norm, float(np.abs(left[:, k]) @ rounding @ np.abs(right[:, k])))
        errors.append(None if overlap < DEFECTIVE else moved / overlap)
    return values[order], errors


def _largest_of_a_unit(a: Array, units: Sequence[str]) -> Array:
    """Return for each entry the largest of its row in columns of one unit, or itself."""
    result = np.abs(a)
    for unit in set(units):
        columns = [j for j, one in enumerate(units) if one == unit]
        result[:, columns] = result[:, columns].max(axis=1, keepdims=True)
    return result


def zeros(a: Array, b: Array, c: Array, d: Array) -> Complex | None:
    """Return the transmission zeros; None where inputs and outputs are different in number."""
    if b.shape[1] != c.shape[0] or not b.shape[1]:
        return None
    if not a.size:
        return np.zeros(0, dtype=complex)
    scaled, scales = _balanced(a)
    system = scaled, b / scales[:, None], c * scales, d
    a, b, c, d = _reduced(*system)
    a, c, b, d = (m.T for m in _reduced(a.T, c.T, b.T, d.T))
    if not a.size:
        return np.zeros(0, dtype=complex)
    if not d.size:
        return np.asarray(np.linalg.eigvals(a), dtype=complex)
    found: Complex = np.asarray(np.linalg.eigvals(a - b @ np.linalg.solve(d, c)), dtype=complex)
    return found[np.lexsort((found.imag, found.real))]


def _balanced(a: Array) -> tuple[Array, Array]:
    """Return the matrix scaled by powers of two so that its rows and columns are alike in size, and the scales.

    SciPy also casts the scales to whole numbers, for a permutation that is not asked for here. Entries of rounding let scales
    grow beyond these (a disc that rolls along an axis), of which NumPy warns.
    """
    with np.errstate(invalid="ignore"):
        balanced, (scales, _) = scipy.linalg.matrix_balance(a, permute=False, separate=True)
    return balanced, scales


def _reduced(a: Array, b: Array, c: Array, d: Array) -> tuple[Array, Array, Array, Array]:
    """Take away states that outputs see at once, until D has full row rank; zeros stay as they are."""
    while True:
        size = max((float(np.abs(m).max(initial=0.0)) for m in (a, b, c, d)), default=0.0)
        found = decomposed(d)
        rank = found.rank(FORMULAS, size)
        c, d = found.left.T @ c, found.left.T @ d
        seen, c, d = c[rank:], c[:rank], d[:rank]
        if not len(seen):
            return a, b, c, d
        found = decomposed(seen)
        gone, right = found.rank(FORMULAS, size), found.right
        if not gone:
            return a, b, c, d
        turn = np.vstack([right[gone:], right[:gone]]).T
        a, b, c = turn.T @ a @ turn, turn.T @ b, c @ turn
        kept = a.shape[0] - gone
        c, d = np.vstack([c[:, :kept], a[kept:, :kept]]), np.vstack([d, b[kept:]])
        a, b = a[:kept, :kept], b[:kept]

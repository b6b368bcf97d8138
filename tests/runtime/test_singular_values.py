"""Singular values without NumPy against those of NumPy (LAPACK)."""

from __future__ import annotations

import numpy as np
import pytest

from mechc.runtime.start import singular_values as module
from mechc.runtime.start.singular_values import singular_values


@pytest.mark.parametrize("shape", [(1, 1), (3, 1), (2, 2), (5, 3), (9, 9), (20, 18)])
@pytest.mark.parametrize("kind", ["any", "dependent", "far apart", "zero"])
def test_are_those_of_numpy(shape: tuple[int, int], kind: str) -> None:
    """Within a few units of rounding of the largest one, also of matrices without full rank; graded ones to their own."""
    matrix = np.random.default_rng(7).normal(size=shape)
    if kind == "dependent":
        matrix[:, -1] = matrix[:, 0]
    if kind == "far apart":
        matrix *= 10.0 ** -np.arange(shape[1])
    if kind == "zero":
        matrix *= 0.0
    found, expected = singular_values(matrix), np.linalg.svd(matrix, compute_uv=False)
    assert found == sorted(found, reverse=True) and len(found) == shape[1]
    assert np.abs(found - expected).max() <= 40 * np.finfo(float).eps * max(expected[0], 0.0)


def test_numpy_does_those_of_large_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    matrix = np.random.default_rng(8).normal(size=(30, 30))
    monkeypatch.setattr(module, "_turn", lambda *_: pytest.fail("too many"))
    assert singular_values(matrix) == np.linalg.svd(matrix, compute_uv=False).tolist()

"""Linear systems of the implicit methods, against numpy on random matrices of several structures."""

from __future__ import annotations

import ctypes
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from mechc.runtime.native.build import build_shared, find_compiler, kernel_flags
from mechc.runtime.native.kernel import kernel_sources

Pattern = NDArray[np.int32]


@cache
def library() -> ctypes.CDLL:
    if find_compiler() is None:
        pytest.skip("no C compiler")
    sources = {
        k: v for k, v in kernel_sources().items() if k.endswith(".h") or k in ("linear.c", "shifted.c")
    }
    folder = Path(__file__).parents[1] / "support"
    sources["driver.c"] = (folder / "linear_driver.c").read_text(encoding="utf-8")
    return ctypes.CDLL(str(build_shared(sources, kernel_flags(), name="linear")))


def solve(
    pattern: Pattern, values: NDArray[np.float64], n: int, sigma: complex, r: NDArray[np.complex128]
) -> tuple[int, NDArray[np.complex128]]:
    """Give the number of unknowns that were factorised, and d."""
    rows, columns = (np.ascontiguousarray(pattern[:, k], dtype=np.int32) for k in (0, 1))
    re, im = r.real.copy(), r.imag.copy()
    pointers = [ctypes.c_void_p(a.ctypes.data) for a in (rows, columns, values)]
    left = library().shifted(
        n, len(rows), *pointers, ctypes.c_double(sigma.real), ctypes.c_double(sigma.imag),
        ctypes.c_void_p(re.ctypes.data), ctypes.c_void_p(im.ctypes.data),
    )  # fmt: skip
    return left, re + 1j * im


def second_order(n: int, extra: int) -> list[tuple[int, int]]:
    """Entries of q' = v, v' = a(q, v, x), x' = f(q, v, x)."""
    full = [(i, j) for i in range(n, 2 * n + extra) for j in range(2 * n + extra)]
    return [*((i, n + i) for i in range(n)), *full]


STRUCTURES = {
    "one": ([(0, 0)], 1, 1),
    "dense": ([(i, j) for i in range(6) for j in range(6)], 6, 6),
    "second order": (second_order(4, 0), 8, 4),
    "second order and states": (second_order(3, 2), 8, 5),
    "chain of integrators": ([(0, 1), (1, 2), (2, 3), (3, 0)], 4, 2),
    "two rates of one": ([(0, 2), (1, 2), (2, 0), (2, 1), (2, 2)], 3, 1),
    "rows without entries": ([(0, 2), (2, 0)], 4, 3),
    "constant": ([], 3, 3),
    "diagonal": ([(i, i) for i in range(5)], 5, 5),
    "large": (second_order(30, 3), 63, 33),
}


@pytest.mark.parametrize("name", STRUCTURES)
@pytest.mark.parametrize("sigma", [3.7 + 0j, 2.7 + 3.1j, 1e-3 + 2e3j, 1e9 + 0j])
def test_shifted_systems(name: str, sigma: complex) -> None:
    entries, n, expected = STRUCTURES[name]
    random = np.random.default_rng(len(name))
    pattern = np.array(entries, dtype=np.int32).reshape(-1, 2)
    random.shuffle(pattern)
    for scale in (1.0, 1e6):
        values = random.normal(size=len(pattern))
        alone = np.bincount(pattern[:, 0], minlength=n) == 1
        values[~alone[pattern[:, 0]]] *= scale  # stiffness is in the accelerations, not in q' = v
        matrix = sigma * np.eye(n, dtype=complex)
        for (i, j), value in zip(pattern, values, strict=True):
            matrix[i, j] -= value
        r = random.normal(size=n) + 1j * random.normal(size=n) * (sigma.imag != 0)
        left, d = solve(pattern, values, n, sigma, r)
        assert left <= (expected if name != "chain of integrators" else 3)
        exact = np.linalg.solve(matrix, r)
        assert np.abs(d - exact).max() < 2e-15 * n * np.linalg.cond(matrix) * np.abs(exact).max()


def test_pivots_are_chosen() -> None:
    """sigma - J with a zero on its diagonal: no solution without an exchange of rows."""
    pattern = np.array([(0, 0), (0, 1), (1, 0), (1, 1)], dtype=np.int32)
    left, d = solve(pattern, np.array([2.0, 1.0, 1.0, 0.0]), 2, 2 + 0j, np.array([1.0, 0.0], dtype=complex))
    assert left == 2
    assert d == pytest.approx([-2, -1])


def test_singular_matrices_are_told() -> None:
    pattern = np.array([(0, 0), (0, 1), (1, 0), (1, 1)], dtype=np.int32)
    assert solve(pattern, np.array([0.0, 2.0, 2.0, 0.0]), 2, 2 + 0j, np.ones(2, dtype=complex))[0] == -1
    assert solve(pattern, np.full(4, np.nan), 2, 2 + 0j, np.ones(2, dtype=complex))[0] == -1
    assert solve(pattern, np.full(4, np.nan), 2, 2 + 1j, np.ones(2, dtype=complex))[0] == -1

"""Systems of equations, inverses and determinants as formulas, against NumPy and mpmath."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
import pytest

from mechc.compiler.graph import DivisionByZero, Graph, Node, matrices
from mechc.compiler.graph.evaluate import evaluate
from mechc.compiler.graph.kinks import COMPARING


def symbols(n: int, zeros: Any = None) -> tuple[Graph, tuple[tuple[Node, ...], ...]]:
    g = Graph()
    known = np.zeros((n, n), bool) if zeros is None else zeros
    return g, tuple(
        tuple(g.zero if known[i, j] else g.symbol(f"a{i},{j}") for j in range(n)) for i in range(n)
    )


def given(a: tuple[tuple[Node, ...], ...], values: Any, g: Graph) -> dict[Node, float]:
    return {
        x: float(values[i, j]) for i, row in enumerate(a) for j, x in enumerate(row) if not g.is_constant(x)
    }


def conditioned(n: int, condition: float, seed: int) -> Any:
    rng = np.random.default_rng(seed)
    left, right = (np.linalg.qr(rng.normal(size=(n, n)))[0] for _ in range(2))
    return left @ np.diag(np.logspace(0, -np.log10(condition), n)) @ right


@pytest.mark.parametrize("n", [1, 2, 3, 4, 6, 9])
@pytest.mark.parametrize("condition", [10, 1e6, 1e12])
def test_backward_errors_are_those_of_rounding(n: int, condition: float) -> None:
    g, a = symbols(n)
    b = tuple(g.symbol(f"b{i}") for i in range(n))
    (x,) = matrices.solve(g, a, (b,))
    assert not any(g.op(node) in COMPARING for node in g.reach(x)), "pivots would be surfaces"
    for seed in range(5):
        m = conditioned(n, condition, seed)
        right = m @ np.random.default_rng(seed).normal(size=n)
        found = np.array(evaluate(g, list(x), given(a, m, g) | dict(zip(b, map(float, right), strict=True))))
        residual = np.linalg.norm(m @ found - right)
        assert residual <= 1e-15 * n * np.linalg.norm(m) * np.linalg.norm(found)


@pytest.mark.parametrize("n", [2, 3, 5, 8])
def test_determinants(n: int) -> None:
    g, a = symbols(n)
    value = matrices.determinant(g, a)
    for seed in range(5):
        m = np.random.default_rng(seed).normal(size=(n, n))
        with mpmath.workdps(40):
            wanted = float(mpmath.det(mpmath.matrix(m.tolist())))
        scale = float(np.prod(np.linalg.norm(m, axis=1)))
        assert abs(evaluate(g, [value], given(a, m, g))[0] - wanted) <= 1e-15 * n * scale


def test_inverses_where_a_pivot_would_vanish() -> None:
    g, a = symbols(3)
    inverse = matrices.inverse(g, a)
    m = np.array([[0, 1, 2], [1, 0, 3], [4, -3, 8]], float)
    found = np.array(evaluate(g, [x for row in inverse for x in row], given(a, m, g))).reshape(3, 3)
    wanted = np.linalg.inv(m)
    assert np.abs(found - wanted).max() < 1e-16 * np.linalg.cond(m) * np.abs(wanted).max()


def test_known_zeros_cost_nothing() -> None:
    n = 12
    apart = np.kron(np.eye(n // 2), np.ones((2, 2))) == 0
    g, a = symbols(n, apart)
    b = tuple(g.symbol(f"b{i}") for i in range(n))
    blocks = len([*g.reach(matrices.solve(g, a, (b,))[0])])
    g, a = symbols(n)
    b = tuple(g.symbol(f"b{i}") for i in range(n))
    assert 10 * blocks < len([*g.reach(matrices.solve(g, a, (b,))[0])])


def test_a_matrix_that_is_always_singular() -> None:
    g, a = symbols(4)
    with pytest.raises(DivisionByZero):
        matrices.inverse(g, (*a[:3], (g.zero,) * 4))

"""Vectors, matrices and rotations of nodes."""

import math

import numpy as np
import pytest

from mechc.compiler.graph import Graph
from mechc.compiler.graph import vector as vec
from mechc.compiler.graph.differentiate import jvp
from mechc.compiler.graph.evaluate import evaluate
from mechc.compiler.graph.vector import Matrix, Vector


@pytest.fixture
def g() -> Graph:
    return Graph()


def symbols(g: Graph, name: str, count: int = 3) -> Vector:
    return tuple(g.symbol(f"{name}{i}") for i in range(count))


def numbers(g: Graph, matrix: Matrix, environment: dict[str, float]) -> np.ndarray:
    at = {g.symbol(k): v for k, v in environment.items()}
    return np.array([evaluate(g, row, at) for row in matrix])


def test_products_agree_with_numpy(g: Graph) -> None:
    a, b = symbols(g, "a"), symbols(g, "b")
    m = tuple(symbols(g, f"m{i}") for i in range(3))
    rng = np.random.default_rng(1)
    na, nb, nm = rng.standard_normal(3), rng.standard_normal(3), rng.standard_normal((3, 3))
    at = {f"a{i}": na[i] for i in range(3)} | {f"b{i}": nb[i] for i in range(3)}
    at |= {f"m{i}{j}": nm[i, j] for i in range(3) for j in range(3)}

    def check(v: Vector, expected: np.ndarray) -> None:
        np.testing.assert_allclose(numbers(g, (v,), at)[0], expected, rtol=1e-14, atol=1e-14)

    check(vec.cross(g, a, b), np.cross(na, nb))
    check(vec.matvec(g, vec.skew(g, a), b), np.cross(na, nb))
    check(vec.matvec(g, m, a), nm @ na)
    check(vec.transpose_matvec(g, m, a), nm.T @ na)
    check((vec.dot(g, a, b), vec.norm(g, a)), np.array([na @ nb, np.linalg.norm(na)]))
    check(vec.subtract(g, vec.scale(g, g.two, a), vec.negate(g, b)), 2 * na + nb)
    np.testing.assert_allclose(numbers(g, vec.matmul(g, m, m), at), nm @ nm, rtol=1e-14, atol=1e-14)
    check((vec.cross_planar(g, a[:2], b[:2]),), np.array([na[0] * nb[1] - na[1] * nb[0]]))


def test_structural_zeros_vanish(g: Graph) -> None:
    a = symbols(g, "a")
    ex = vec.unit_vector(g, 0)
    assert vec.cross(g, ex, ex) == (g.zero,) * 3
    assert vec.matvec(g, vec.identity(g), a) == a
    assert vec.dot(g, ex, a) == a[0]
    assert vec.add(g, (g.zero,) * 3, a) == a


@pytest.mark.parametrize("axis", range(3))
def test_rotations_about_axes(g: Graph, axis: int) -> None:
    q = g.symbol("q")
    m = vec.axis_rotation(g, axis, q)
    assert vec.matmul(g, m, vec.transpose(m)) == vec.identity(g)
    general = vec.rotation_about(g, vec.unit_vector(g, axis), q)
    assert all(g.identical(x, y) for r, s in zip(m, general, strict=True) for x, y in zip(r, s, strict=True))
    # a quarter turn about z takes x to y
    turned = vec.matvec(
        g, vec.axis_rotation(g, axis, g.constant(math.pi / 2)), vec.unit_vector(g, (axis + 1) % 3)
    )
    assert turned == vec.unit_vector(g, (axis + 2) % 3)


def test_quaternions_are_rotations(g: Graph) -> None:
    p = symbols(g, "p", 4)
    m = vec.quaternion_rotation(g, p)
    rng = np.random.default_rng(2)
    v = rng.standard_normal(4)
    v /= np.linalg.norm(v)
    r = numbers(g, m, {f"p{i}": v[i] for i in range(4)})
    np.testing.assert_allclose(r @ r.T, np.eye(3), atol=1e-15)
    # by its axis and angle (Rodrigues)
    angle = 2 * math.atan2(np.linalg.norm(v[1:]), v[0])
    axis = v[1:] / np.linalg.norm(v[1:])
    general = vec.rotation_about(g, symbols(g, "n"), g.symbol("angle"))
    s = numbers(g, general, {"angle": angle} | {f"n{i}": axis[i] for i in range(3)})
    np.testing.assert_allclose(r, s, atol=1e-15)


def test_the_rate_of_a_quaternion_is_the_angular_velocity_of_the_body(g: Graph) -> None:
    """R' = R skew(w), at a random unit quaternion (the formula for R assumes |p| = 1)."""
    p, w = symbols(g, "p", 4), symbols(g, "w")
    m = vec.quaternion_rotation(g, p)
    tangents = dict(zip(p, vec.quaternion_rate(g, p, w), strict=True))
    rate = tuple(tuple(jvp(g, row, tangents)) for row in m)
    expected = vec.matmul(g, m, vec.skew(g, w))
    rng = np.random.default_rng(3)
    v = rng.standard_normal(4)
    v /= np.linalg.norm(v)
    at = {f"p{i}": v[i] for i in range(4)} | {f"w{i}": float(i + 1) for i in range(3)}
    np.testing.assert_allclose(numbers(g, rate, at), numbers(g, expected, at), atol=1e-14)


def test_only_three_axes(g: Graph) -> None:
    with pytest.raises(ValueError):
        vec.axis_rotation(g, 3, g.zero)

"""Products that are smooth where a root in them vanishes, and those that are not."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mechc.compiler.graph import Graph, Node
from mechc.compiler.graph.differentiate import jacobian, jvp, vjp
from mechc.compiler.graph.evaluate import evaluate

SMOOTH: dict[str, Callable[[Graph, Node, Node, Node], Node]] = {
    "a component": lambda g, x, y, k: g.mul(x, g.mul(k, _norm(g, x, y))),
    "a negative one": lambda g, x, y, k: g.mul(k, g.neg(g.mul(_norm(g, x, y), y))),
    "a component and an arm": lambda g, x, y, k: g.mul(g.mul(k, x), _norm(g, x, y)),
    "two components": lambda g, x, y, k: g.mul(g.mul(x, g.mul(y, y)), _norm(g, x, y)),
    "of products": lambda g, x, y, k: g.mul(g.mul(k, x), _norm(g, g.mul(k, x), g.mul(k, y))),
    "of more than is squared": lambda g, x, y, k: g.mul(x, g.sqrt(g.add(g.mul(x, x), g.one))),
    "of itself": lambda g, x, y, k: g.mul(g.mul(k, x), g.sqrt(g.mul(g.mul(k, k), g.mul(x, x)))),
}
"""Functions of x and y that are zero, with their slopes, where x and y are; but for the sixth, whose slope is 1."""

NOT: dict[str, Callable[[Graph, Node, Node, Node], Node]] = {
    "alone": lambda g, x, y, k: _norm(g, x, y),
    "times a number": lambda g, x, y, k: g.mul(k, _norm(g, x, y)),
    "of one, times another": lambda g, x, y, k: g.mul(g.add(y, k), _norm(g, x, x)),
    "of a difference": lambda g, x, y, k: g.mul(x, g.sqrt(g.sub(g.mul(x, x), g.mul(y, y)))),
    "of a part of a product": lambda g, x, y, k: g.mul(x, g.sqrt(g.mul(g.mul(k, k), g.mul(x, x)))),
    "of what is not a square": lambda g, x, y, k: g.mul(x, g.sqrt(g.add(g.mul(x, x), g.mul(k, y)))),
}
"""Products with roots about whose slopes nothing is seen."""


def _norm(g: Graph, x: Node, y: Node) -> Node:
    return g.sqrt(g.add(g.mul(x, x), g.mul(y, y)))


def _slopes(make: Callable[[Graph, Node, Node, Node], Node], at: dict[str, float]) -> list[list[float]]:
    """Return the derivatives by x and y in all ways."""
    g = Graph()
    x, y, k = (g.symbol(name) for name in "xyk")
    n = make(g, x, y, k)
    (row,) = jacobian(g, [n], [x, y])
    ways = [
        [jvp(g, [n], {s: g.one})[0] for s in (x, y)],
        vjp(g, [(n, g.one)], [x, y]),
        [row.get(j, g.zero) for j in range(2)],
    ]
    there = {x: at["x"], y: at["y"], k: at["k"]}
    return [list(evaluate(g, way, there)) for way in ways]


@pytest.mark.parametrize("name", SMOOTH)
def test_slopes_where_the_root_vanishes(name: str) -> None:
    expected = [1.0, 0.0] if name == "of more than is squared" else [0.0, 0.0]
    for slopes in _slopes(SMOOTH[name], {"x": 0.0, "y": 0.0, "k": 1.7}):
        assert slopes == expected


@pytest.mark.parametrize("name", NOT)
def test_slopes_that_are_not_seen_stay_undefined(name: str) -> None:
    for slopes in _slopes(NOT[name], {"x": 0.0, "y": 0.0, "k": 1.7}):
        assert not np.all(np.isfinite(slopes))


@pytest.mark.parametrize("name", SMOOTH)
@given(x=st.floats(-3, 3), y=st.floats(0.1, 3))
def test_slopes_elsewhere(name: str, x: float, y: float) -> None:
    """By differences in the complex plane: z^(1/2) there is that of Python."""
    k, h = 1.7, 1e-30
    make = SMOOTH[name]
    for slopes in _slopes(make, {"x": x, "y": y, "k": k}):
        expected = [_value(make, x + 1j * h, y, k).imag / h, _value(make, x, y + 1j * h, k).imag / h]
        assert slopes == pytest.approx(expected, rel=1e-12, abs=1e-12)


def _value(make: Callable[..., Node], x: complex, y: complex, k: float) -> complex:
    """Evaluate a function with complex numbers, by operators alone."""
    plain = _Plain()
    found: complex = make(plain, x, y, k)
    return found


class _Plain:
    """The few operations of a graph, done at once."""

    one = 1.0

    def add(self, a: complex, b: complex) -> complex:
        return a + b

    def mul(self, a: complex, b: complex) -> complex:
        return a * b

    def neg(self, a: complex) -> complex:
        return -a

    def sqrt(self, a: complex) -> complex:
        return complex(a) ** 0.5

"""Solutions of Newton's method in the graph: derivatives of any order are those of the implicit function."""

from __future__ import annotations

from collections.abc import Callable

import mpmath
import pytest

from mechc.compiler.graph import Graph, Node
from mechc.compiler.graph.differentiate import jvp, vjp
from mechc.compiler.graph.elimination.newton import newton
from mechc.compiler.graph.evaluate import evaluate
from mechc.compiler.program.formulas import Formulas


def forward(g: Graph, n: Node, s: Node) -> Node:
    return jvp(g, [n], {s: g.one})[0]


def reverse(g: Graph, n: Node, s: Node) -> Node:
    return vjp(g, [(n, g.one)], [s])[0]


@pytest.mark.parametrize("derivative", [forward, reverse])
def test_derivatives_of_one_unknown(derivative: Callable[[Graph, Node, Node], Node]) -> None:
    """x^3 + x = sin(s), up to the fifth derivative, against mpmath; measured: 4e-16. Without a solution in the place of its value the
    second derivative is off by its own size."""

    g = Graph()
    s, x = g.symbol("s"), g.symbol("x")
    (n,) = newton(g, [g.sub(g.add(g.power(x, 3), x), g.sin(s))], [x], [s])
    exact = [mpmath.mpf(0)] * 6
    with mpmath.workdps(50):
        for k in range(6):
            exact[k] = mpmath.diff(lambda s: mpmath.findroot(lambda x: x**3 + x - mpmath.sin(s), s), 0.7, k)
    for k in range(6):
        (found,) = evaluate(g, [n], {s: 0.7})
        assert found == pytest.approx(float(exact[k]), rel=3e-15)
        n = derivative(g, n, s)


def test_derivatives_do_not_go_through_the_steps() -> None:
    """A first derivative holds no more operations than the rows and their derivatives do, beside those of the solution."""
    g = Graph()
    s, x = g.symbol("s"), g.symbol("x")
    (n,) = newton(g, [g.sub(g.add(x, g.exp(x)), s)], [x], [s])
    slope = reverse(g, n, s)
    assert len(set(g.reach([slope])) - set(g.reach([n]))) < 12


def test_derivatives_of_two_unknowns() -> None:
    """x + y^3 = s, x y = 1: of several unknowns two steps more give derivatives up to the third."""
    g = Graph()
    s, x, y = (g.symbol(c) for c in "sxy")
    rows = [g.sub(g.add(x, g.power(y, 3)), s), g.sub(g.mul(x, y), g.one)]
    n, _ = newton(g, rows, [x, y], [g.constant(2), g.half], 2)
    with mpmath.workdps(50):
        for k in range(4):
            exact = mpmath.diff(lambda s: mpmath.findroot(lambda x: x + x**-3 - s, 2), 2.5, k)
            (found,) = evaluate(g, [n], {s: 2.5})
            assert found == pytest.approx(float(exact), rel=1e-13)
            n = forward(g, n, s)


def test_what_libraries_differentiate_has_the_same_derivatives() -> None:
    """The formulas that programs for CasADi hold, differentiated step by step as it does, even from the solution itself."""
    g = Graph()
    s, guess, x = (g.symbol(c) for c in ("s", "guess", "x"))
    (n,) = newton(g, [g.sub(g.add(g.power(x, 3), x), s)], [x], [guess], 2)
    (n,) = Formulas(g, loops=False).of([n])
    with mpmath.workdps(50):
        for k in range(3):
            exact = mpmath.diff(lambda s: mpmath.findroot(lambda x: x**3 + x - s, 1), 2.0, k)
            for begin in (1.0, 1.3):
                (found,) = evaluate(g, [n], {s: 2.0, guess: begin})
                assert found == pytest.approx(float(exact), rel=1e-13)
            n = forward(g, n, s)

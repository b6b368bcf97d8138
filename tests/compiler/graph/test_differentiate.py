"""Forward and reverse derivatives, operation by operation and on random expressions."""

from collections.abc import Callable
from fractions import Fraction

import mpmath
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mechc.compiler.graph import Graph, Node, monotone_table
from mechc.compiler.graph.dependence import FEW
from mechc.compiler.graph.differentiate import gradient, jacobian, jvp, vjp
from mechc.compiler.graph.evaluate import evaluate, multiprecision
from mechc.compiler.graph.operations import POSITION, VELOCITY

TABLE = monotone_table((0.0, 1.0, 2.5, 3.0), (0.0, 2.0, 2.5, -1.0))

UNARY: list[tuple[str, Callable[[Graph, Node], Node]]] = [
    *((name, getattr(Graph, name)) for name in ("sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh")),
    *(
        (name, getattr(Graph, name))
        for name in ("tanh", "asinh", "atanh", "exp", "log", "sqrt", "abs", "neg")
    ),
    ("acosh", lambda g, x: g.acosh(g.add(g.two, x))),
    ("floor", lambda g, x: g.mul(x, g.floor(g.mul(g.constant(7), x)))),
    ("sign", lambda g, x: g.mul(x, g.sign(x))),
    ("lookup", lambda g, x: g.lookup(g.add_table(TABLE), g.mul(g.constant(4), x))),
    ("cube root", lambda g, x: g.power(x, Fraction(1, 3))),
    *((f"power {k} 1/2", lambda g, x, k=k: g.power(x, k + Fraction(1, 2))) for k in (1, 2, 3)),
    ("inverse square", lambda g, x: g.power(x, -2)),
    ("exponential power", lambda g, x: g.pow(g.constant(3), x)),
]

BINARY: list[tuple[str, Callable[[Graph, Node, Node], Node]]] = [
    *((name, getattr(Graph, name)) for name in ("add", "sub", "mul", "div", "atan2", "minimum", "maximum")),
    *((name, getattr(Graph, name)) for name in ("modulo", "pow")),
    ("square", lambda g, x, y: g.mul(g.add(x, y), g.add(x, y))),
    ("select", lambda g, x, y: g.select(g.less(x, y), g.mul(x, y), g.sin(x))),
    ("select else", lambda g, x, y: g.select(g.less(y, x), g.mul(x, y), g.div(x, y))),
]

POINTS = [{"x": 0.3, "y": 0.7}, {"x": 0.62, "y": 0.41}]


def difference(graph: Graph, n: Node, at: dict[Node, float], x: Node) -> float:
    """Return a central difference in 50 digits: an error of 1e-20 times the third derivative."""
    with mpmath.workdps(50):
        step = mpmath.mpf("1e-20") if not graph.tables else mpmath.mpf("1e-6")
        numbers = multiprecision(mpmath.mp)
        exact = {k: mpmath.mpf(v) for k, v in at.items()}
        up = evaluate(graph, [n], exact | {x: exact[x] + step}, numbers)[0]
        down = evaluate(graph, [n], exact | {x: exact[x] - step}, numbers)[0]
        return float((up - down) / (2 * step))


@pytest.mark.parametrize("point", POINTS)
@pytest.mark.parametrize(("name", "build"), UNARY, ids=[name for name, _ in UNARY])
def test_derivative_of_a_function(
    name: str, build: Callable[[Graph, Node], Node], point: dict[str, float]
) -> None:
    g = Graph()
    x = g.symbol("x")
    n = build(g, x)
    at = {x: point["x"]}
    forward = jvp(g, [n], {x: g.one})
    reverse = gradient(g, n, [x])
    # tables are evaluated in floats, so their differences keep 10 digits only
    tolerance = 1e-9 if g.tables else 1e-14
    expected = pytest.approx(difference(g, n, at, x), rel=tolerance, abs=tolerance)
    assert evaluate(g, forward, at)[0] == expected
    assert evaluate(g, reverse, at)[0] == expected


@pytest.mark.parametrize("point", POINTS)
@pytest.mark.parametrize(("name", "build"), BINARY, ids=[name for name, _ in BINARY])
def test_derivative_of_an_operation(
    name: str, build: Callable[[Graph, Node, Node], Node], point: dict[str, float]
) -> None:
    g = Graph()
    x, y = g.symbol("x"), g.symbol("y")
    n = build(g, x, y)
    at = {x: point["x"], y: point["y"]}
    for symbol, reverse in zip((x, y), gradient(g, n, [x, y]), strict=True):
        forward = jvp(g, [n], {symbol: g.one})[0]
        expected = pytest.approx(difference(g, n, at, symbol), rel=1e-14, abs=1e-14)
        assert evaluate(g, [forward, reverse], at) == [expected, expected]


def test_second_derivatives_by_repeated_sweeps() -> None:
    g = Graph()
    q, u, a = g.symbol("q"), g.symbol("u"), g.symbol("a")
    rate = jvp(g, [g.sin(q)], {q: u})
    second = jvp(g, rate, {q: u, u: a})[0]
    expected = g.sub(g.mul(g.cos(q), a), g.mul(g.sin(q), g.mul(u, u)))
    assert g.identical(second, expected)


def test_tangents_of_inner_nodes() -> None:
    g = Graph()
    x, y = g.symbol("x"), g.symbol("y")
    s = g.sin(x)
    n = g.mul(g.mul(s, s), x)
    # s and x count as independent
    assert jvp(g, [n], {s: y})[0] == g.mul(g.two, g.mul(g.mul(s, x), y))
    assert vjp(g, [(n, y)], [s])[0] == g.mul(g.two, g.mul(g.mul(s, x), y))


@pytest.mark.parametrize("k", [1, 2, 3, 5])
def test_powers_by_halves_have_a_derivative_at_zero(k: int) -> None:
    """They are made of products and a root, which by itself has none there."""
    g = Graph()
    x = g.symbol("x")
    n = g.power(x, k + Fraction(1, 2))
    slopes = [jvp(g, [n], {x: g.one})[0], vjp(g, [(n, g.one)], [x])[0]]
    for at, expected in ((0.0, 0.0), (4.0, (k + 0.5) * 4.0 ** (k - 0.5))):
        assert evaluate(g, slopes, {x: at}) == pytest.approx([expected] * 2, rel=1e-14)


def test_root_beside_what_it_is_of_may_be_independent() -> None:
    g = Graph()
    x, y = g.symbol("x"), g.symbol("y")
    root, square = g.sqrt(x), g.mul(x, x)
    assert jvp(g, [g.mul(x, root)], {root: y})[0] == g.mul(x, y)
    assert vjp(g, [(g.mul(x, root), y)], [root])[0] == g.mul(x, y)
    assert jvp(g, [g.mul(square, root)], {square: y})[0] == g.mul(y, root)
    assert vjp(g, [(g.mul(square, root), y)], [square])[0] == g.mul(y, root)


def test_seeds_may_depend_on_what_is_differentiated() -> None:
    """As in the central form: the cotangents are constants of the sweep."""
    g = Graph()
    x = g.symbol("x")
    assert vjp(g, [(g.mul(x, x), x), (x, g.one)], [x]) == [g.add(g.mul(g.two, g.mul(x, x)), g.one)]


def test_a_symbol_that_does_not_occur_has_derivative_zero() -> None:
    g = Graph()
    x, late = g.symbol("x"), g.symbol("late")
    assert jvp(g, [x], {late: g.one}) == [g.zero]
    assert vjp(g, [(x, g.one)], [late, x]) == [g.zero, g.one]
    assert vjp(g, [], [x]) == [g.zero]


def test_of_many_seeds_some_depend_on_nothing_that_is_asked_for() -> None:
    """What lacks the kinds of the symbols asked for is not walked through, and may be the last of the graph."""
    g = Graph()
    x, y = g.symbol("x", POSITION), g.symbol("y", VELOCITY)
    square = g.mul(x, x)
    others = [y]
    for _ in range(2 * FEW):
        others.append(g.sin(g.add(others[-1], g.one)))
    seeds = [(square, g.one), *((n, g.one) for n in others)]
    assert vjp(g, seeds, [x]) == [g.mul(g.two, x)]


def test_jacobian_is_sparse() -> None:
    g = Graph()
    x = [g.symbol(f"x{i}") for i in range(3)]
    rows = jacobian(g, [g.mul(x[0], x[1]), g.sin(x[2]), g.one], x)
    assert rows == [{0: x[1], 1: x[0]}, {2: g.cos(x[2])}, {}]


def test_nothing_flows_into_a_branch_that_is_not_taken() -> None:
    """d/dx of sqrt(x) for x > 0, else 0: at x = -1 the square root and its derivative are NaN."""
    g = Graph()
    x, y = g.symbol("x"), g.symbol("y")
    n = g.mul(y, g.select(g.less(g.zero, x), g.sqrt(g.mul(x, y)), g.zero))
    for derivative in (jvp(g, [n], {x: g.one})[0], gradient(g, n, [x])[0]):
        assert evaluate(g, [derivative], {x: -1.0, y: 2.0}) == [0.0]
        assert evaluate(g, [derivative], {x: 2.0, y: 2.0})[0] == pytest.approx(2.0 * 2.0 / (2.0 * 2.0))


def test_nested_branches_in_reverse() -> None:
    g = Graph()
    x, y = g.symbol("x"), g.symbol("y")
    inner = g.select(g.less(y, g.zero), g.log(g.neg(g.mul(x, y))), g.sqrt(g.mul(x, y)))
    n = g.select(g.less(g.zero, x), inner, g.mul(x, x))
    dx, dy = gradient(g, n, [x, y])
    assert evaluate(g, [dx, dy], {x: 2.0, y: -0.5}) == pytest.approx([0.5, -2.0])
    assert evaluate(g, [dx, dy], {x: 2.0, y: 8.0}) == pytest.approx([1.0, 0.25])
    assert evaluate(g, [dx, dy], {x: -3.0, y: 5.0}) == pytest.approx([-6.0, 0.0])


def test_slopes_of_tables_end_with_the_third() -> None:
    g = Graph()
    x = g.symbol("x")
    n = g.lookup(g.add_table(TABLE), x)
    for order in range(1, 4):
        n = jvp(g, [n], {x: g.one})[0]
        assert g.table_of(n) == (0, order)
    assert jvp(g, [n], {x: g.one}) == [g.zero]


@st.composite
def expressions(draw: st.DrawFn) -> tuple[Graph, list[Node], list[Node]]:
    """Return a graph, three symbols and a few smooth expressions of them."""
    g = Graph()
    x = [g.symbol(c) for c in "xyz"]
    pool = [*x, g.one, g.constant(3)]
    for _ in range(draw(st.integers(1, 14))):
        a, b = (draw(st.sampled_from(pool)) for _ in range(2))
        match draw(st.integers(0, 5)):
            case 0:
                n = g.add(a, b)
            case 1:
                n = g.sub(a, b)
            case 2:
                n = g.mul(a, b)
            case 3:
                n = g.div(a, g.add(g.two, g.mul(b, b)))
            case 4:
                n = g.sin(a)
            case _:
                n = g.select(g.less(a, b), g.cos(a), g.mul(a, b))
        pool.append(n)
    return g, x, pool[-3:]


@given(expressions(), st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=3))
@settings(max_examples=150, deadline=None)
def test_forward_and_reverse_agree(model: tuple[Graph, list[Node], list[Node]], values: list[float]) -> None:
    g, x, outputs = model
    at = dict(zip(x, values, strict=True))
    rows = jacobian(g, outputs, x)
    for output, row in zip(outputs, rows, strict=True):
        reverse = gradient(g, output, x)
        for j, symbol in enumerate(x):
            forward = jvp(g, [output], {symbol: g.one})[0]
            entries = [forward, reverse[j], row.get(j, g.zero)]
            first, *others = evaluate(g, entries, at)
            # up to 14 operations, each of which may square the values
            assert others == pytest.approx([first, first], rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("sign", [1, -1])
def test_gradients_of_sums_come_from_the_one_part_that_depends(sign: int) -> None:
    g = Graph()
    x, y, w = (g.symbol(name) for name in "xyw")
    inner = g.div(g.mul(g.sin(x), w), g.sqrt(g.add(g.mul(x, x), g.mul(y, y))))
    potential = inner if sign > 0 else g.neg(inner)
    first = gradient(g, potential, [x, y])
    count = len(g)
    kinetic = g.mul(w, w)
    for whole, factor in (
        (g.sub(kinetic, potential), -1),
        (g.add(potential, kinetic), 1),
        (g.neg(potential), -1),
    ):
        found = gradient(g, whole, [x, y])
        assert found == vjp(g, [(whole, g.one)], [x, y])
        assert found == (first if factor > 0 else [g.neg(n) for n in first])
    chosen = g.select(g.less(x, y), inner, g.mul(w, x))
    gradient(g, chosen, [x, y])
    whole = g.sub(kinetic, chosen)
    assert gradient(g, whole, [x, y]) == vjp(g, [(whole, g.one)], [x, y])
    assert gradient(g, potential, [y]) == first[1:]
    assert gradient(g, kinetic, [x, y]) == [g.zero, g.zero]
    two = g.add(potential, g.mul(x, y))
    assert gradient(g, two, [x, y]) == [g.add(first[0], y), g.add(first[1], x)]
    assert len(g) > count

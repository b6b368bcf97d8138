"""Substitution and transfer between graphs."""

import pytest

from mechc.compiler.graph import DivisionByZero, Graph, Node, monotone_table
from mechc.compiler.graph.evaluate import evaluate
from mechc.compiler.graph.rewrite import substitute, transfer


def everything(g: Graph) -> list[Node]:
    """Return expressions that use every operation."""
    x, y = g.symbol("x"), g.symbol("y")
    unary = [
        g.sin,
        g.cos,
        g.tan,
        g.asin,
        g.acos,
        g.atan,
        g.sinh,
        g.cosh,
        g.tanh,
        g.asinh,
        g.atanh,
        g.exp,
        g.log,
    ]
    unary += [g.sqrt, g.abs, g.sign, g.floor, g.neg]
    binary = [g.add, g.sub, g.mul, g.div, g.atan2, g.minimum, g.maximum, g.modulo, g.pow]
    logic = [g.less, g.less_equal, g.equal]
    table = g.add_table(monotone_table((0.0, 1.0), (1.0, 3.0)))
    conditions = [f(x, y) for f in logic]
    conditions += [
        g.logical_and(*conditions[:2]),
        g.logical_or(*conditions[1:]),
        g.logical_not(conditions[0]),
    ]
    return [
        *(f(x) for f in unary),
        g.acosh(g.add(x, g.two)),
        *(f(x, y) for f in binary),
        *(g.select(c, x, y) for c in conditions),
        g.lookup(table, x),
        g.lookup_slope(g.lookup(table, y)),
    ]


def test_substitution_replaces_all_at_once() -> None:
    g = Graph()
    x, y = g.symbol("x"), g.symbol("y")
    assert substitute(g, [g.sub(x, g.sin(y))], {x: y, y: x}) == [g.sub(y, g.sin(x))]


def test_substitution_reaches_every_operation() -> None:
    g = Graph()
    x, y, s, t = (g.symbol(c) for c in "xyst")
    outputs = everything(g)
    moved = substitute(g, outputs, {x: s, y: t})
    assert evaluate(g, moved, {s: 0.3, t: 0.6}) == evaluate(g, outputs, {x: 0.3, y: 0.6})
    assert not {x, y} & set(g.reach(moved))


def test_substitution_keeps_what_it_does_not_touch() -> None:
    g = Graph()
    x, y = g.symbol("x"), g.symbol("y")
    n = g.add(g.exp(x), y)
    size = len(g)
    assert substitute(g, [n], {g.symbol("z"): x}) == [n]
    assert len(g) == size + 1


def test_substitution_of_inner_nodes() -> None:
    g = Graph()
    x, y = g.symbol("x"), g.symbol("y")
    assert substitute(g, [g.mul(g.sin(x), x)], {g.sin(x): y}) == [g.mul(x, y)]


def test_substitution_can_divide_by_zero() -> None:
    g = Graph()
    x, y = g.symbol("x"), g.symbol("y")
    with pytest.raises(DivisionByZero):
        substitute(g, [g.div(x, y)], {y: g.zero})


def test_transfer_reaches_every_operation() -> None:
    g, other = Graph(), Graph(by_value=False, seed=3)
    outputs = everything(g)
    other.add_table(monotone_table((0.0, 2.0), (5.0, 6.0)))
    moved = transfer(g, outputs, other)
    here = evaluate(g, outputs, {g.symbol("x"): 0.3, g.symbol("y"): 0.6})
    assert evaluate(other, moved, {other.symbol("x"): 0.3, other.symbol("y"): 0.6}) == here


def test_a_quotient_in_a_branch_that_is_never_taken_needs_no_value() -> None:
    g = Graph()
    x, v = g.symbol("x"), g.symbol("v")
    guarded = g.select(g.less(g.zero, v), g.div(x, v), g.mul(x, x))
    inside = g.add(g.sin(g.select(g.less(g.zero, v), g.exp(g.div(x, v)), x)), v)
    assert substitute(g, [guarded, inside], {v: g.zero}) == [g.mul(x, x), g.sin(x)]
    for open_one in (g.div(x, v), g.select(g.less(g.zero, x), g.div(x, v), x), g.add(guarded, g.div(x, v))):
        with pytest.raises(DivisionByZero):
            substitute(g, [open_one], {v: g.zero})

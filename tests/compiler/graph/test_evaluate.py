"""Evaluation in floats, arrays and many digits."""

import math
from fractions import Fraction

import mpmath
import numpy as np
import pytest
from array_numbers import ARRAYS

from mechc.compiler.graph import Graph
from mechc.compiler.graph.evaluate import Tape, evaluate, evaluate_all, multiprecision

from .test_rewrite import everything


def test_the_three_kinds_of_numbers_agree() -> None:
    g = Graph()
    outputs = everything(g)
    x, y = g.symbol("x"), g.symbol("y")
    floats = [float(v) for v in evaluate(g, outputs, {x: 0.3, y: 0.6})]
    arrays = evaluate(g, outputs, {x: np.array([0.3, 0.2]), y: np.array([0.6, 0.9])}, ARRAYS)
    # library functions of C and NumPy may differ in the last digits
    assert floats == pytest.approx([float(v[0]) for v in arrays], rel=1e-14)
    with mpmath.workdps(50):
        at = {x: mpmath.mpf(0.3), y: mpmath.mpf(0.6)}
        exact = [float(v) for v in evaluate(g, outputs, at, multiprecision(mpmath.mp))]
    assert floats == pytest.approx(exact, rel=1e-14)


def test_nothing_raises_outside_the_domain() -> None:
    g = Graph()
    x = g.symbol("x")
    names = ("sqrt", "log", "asin", "acosh", "atanh", "exp", "sinh", "sin")
    outputs = [*(getattr(g, n)(x) for n in names), g.div(g.one, g.add(x, g.one)), g.power(x, Fraction(1, 3))]
    nan = pytest.approx(math.nan, nan_ok=True)
    assert evaluate(g, outputs, {x: -1.0})[:2] == [nan, nan]
    assert evaluate(g, outputs, {x: -1.0})[8:] == [math.inf, nan]
    assert evaluate(g, outputs, {x: -1000.0})[6] == -math.inf
    assert evaluate(g, outputs, {x: 1000.0})[5] == math.inf
    assert evaluate(g, outputs, {x: math.inf})[7] == nan
    assert evaluate(g, outputs[:2], {x: 0.0}) == [0.0, -math.inf]


def test_a_select_drops_what_it_does_not_choose() -> None:
    g = Graph()
    x = g.symbol("x")
    n = g.select(g.less(x, g.zero), g.zero, g.sqrt(x))
    assert evaluate(g, [n], {x: -1.0}) == [0.0]
    np.testing.assert_array_equal(evaluate(g, [n], {x: np.array([-1.0, 4.0])}, ARRAYS)[0], [0.0, 2.0])
    assert evaluate(g, [n], {x: mpmath.mpf(-1)}, multiprecision(mpmath.mp)) == [0]


def test_a_missing_symbol_is_named() -> None:
    g = Graph()
    with pytest.raises(KeyError, match="stiffness"):
        evaluate(g, [g.sin(g.symbol("stiffness"))], {})


def test_inner_values_may_be_given() -> None:
    g = Graph()
    s = g.sin(g.symbol("x"))
    assert evaluate(g, [g.add(s, g.one)], {s: 5.0}) == [6.0]
    assert set(evaluate_all(g, [g.add(s, g.one)], {s: 5.0, g.symbol("x"): 0.0})) >= {s, g.one}


def test_scalars_of_numpy_are_taken_as_floats() -> None:
    g = Graph()
    x = g.symbol("x")
    values = evaluate(g, [g.sign(x), g.div(g.log(x), g.log(g.mul(x, g.constant(2))))], {x: np.float64(0.0)})
    assert values[0] == 0
    assert math.isnan(values[1])


def test_what_is_settled_is_computed_once() -> None:
    g = Graph()
    outputs = everything(g)
    x, y = g.symbol("x"), g.symbol("y")
    tape = Tape(g, [*outputs, y, g.sin(x)], [x, y])
    rest = tape.settled({x: 0.3})
    whole, left = tape({x: 0.3, y: 0.6}), rest({y: 0.6})
    assert [left[n] for n in (*outputs, y, g.sin(x))] == [whole[n] for n in (*outputs, y, g.sin(x))]
    assert len(left) < len(whole)
    assert tape({x: 0.3, y: 0.6}) == whole


def test_a_function_of_one_node_gives_what_the_tape_gives() -> None:
    g = Graph()
    x, y = g.symbol("x"), g.symbol("y")
    jump = g.select(g.less(x, y), g.sin(g.mul(x, y)), g.floor(g.add(x, y)))
    tape = Tape(g, [jump, x, g.sqrt(y)], [x, y]).settled({y: 0.7})
    values = tape.function(x, [jump, x, g.sqrt(y)])
    for at in (0.3, 5.4):
        assert values(at) == (
            math.sin(at * 0.7) if at < 0.7 else math.floor(at + 0.7),
            at,
            math.sqrt(0.7),
        )

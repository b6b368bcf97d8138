"""Formulas as text mean what the graph holds."""

from __future__ import annotations

import math
import random
from fractions import Fraction
from typing import Any

import pytest

from mechc.compiler.graph import Graph
from mechc.compiler.graph.evaluate import evaluate
from mechc.compiler.graph.show import LONGEST, show_formulas


def test_shared_parts_are_named_and_parentheses_kept() -> None:
    g = Graph()
    a, b, c = (g.symbol(name) for name in "abc")
    quotient = g.div(g.sub(a, g.sub(b, c)), g.neg(g.mul(g.add(a, b), c)))
    half = g.mul(g.constant(Fraction(1, 2)), g.sin(quotient))
    assert list(show_formulas(g, [("x", quotient), ("k", half)])) == [
        "%1 = (a - (b - c))/(c*(a + b))",
        "x = -%1",
        "k = -1/2*sin(%1)",
    ]


def test_text_evaluates_to_the_same_number() -> None:
    random.seed(3)
    g = Graph()
    symbols = [g.symbol(name) for name in ("p", "q", "r")]
    values = dict(zip(symbols, (0.7, 1.3, -0.4), strict=True))
    pool = [*symbols, g.constant(Fraction(3, 7)), g.constant(-2)]
    for _ in range(60):
        x, y = random.choice(pool), random.choice(pool)
        pool.append(random.choice([g.add, g.sub, g.mul])(x, y) if random.random() < 0.8 else g.sin(g.neg(x)))
    names: dict[str, Any] = {"sin": math.sin, "p": 0.7, "q": 1.3, "r": -0.4}
    for line in show_formulas(g, [("last", pool[-1]), ("other", pool[-2])]):
        name, _, formula = line.partition(" = ")
        assert len(formula) <= 3 * LONGEST
        names[name.replace("%", "n")] = eval(formula.replace("%", "n"), {}, names)
    expected = evaluate(g, [pool[-1], pool[-2]], values)
    assert [names["last"], names["other"]] == pytest.approx(expected, rel=1e-12, abs=1e-12)


def test_a_long_sum_is_cut_into_named_parts() -> None:
    g = Graph()
    total = g.zero
    for i in range(200):
        total = g.add(total, g.symbol(f"quantity_{i}"))
    lines = list(show_formulas(g, [("total", total)]))
    assert len(lines) > 10 and max(len(line) for line in lines) < 2 * LONGEST

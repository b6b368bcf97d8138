"""Like terms of Lagrange's operator are taken together, and nothing else changes."""

from __future__ import annotations

import random

import pytest
import sympy as sp

from mechc.compiler.equations.rows.residual import combined
from mechc.compiler.graph import Graph, Node
from mechc.compiler.graph.evaluate import evaluate
from mechc.compiler.pipeline import compile_source
from mechc.compiler.program.model import Operate
from mechc.lang.source import SourceFile

CASES = [
    ("p*(x + y) - p*x", "p*y"),
    ("p*x - p*(x - y)", "p*y"),
    ("2*p*x - 2*p*(x - y) + q", "2*p*y + q"),
    ("p*r*(x - y) + q - x*p*r", "q - p*r*y"),
    ("p*(x + y + r) - p*x - p*r", "p*y"),
    ("p*(3*x - y*r) - 3*p*x", "-p*r*y"),
    ("p*(x + 1) - p", "p*x"),
]
OTHERS = ["p*(x + y) - q*x", "p*(x + y) + p*x", "p*x + q*y", "p*(x - y) - 2*p*x", "p", "p*(x + y)"]


def _graph(text: str) -> tuple[Graph, Node]:
    """Return the expression as it is written, by structure alone: by value it would be one node from the beginning."""
    graph = Graph(by_value=False)

    def build(e: sp.Expr) -> Node:
        if e.is_Symbol:
            return graph.symbol(e.name)
        if e.is_Number:
            return graph.constant(int(e))
        return graph.sum(map(build, e.args)) if e.is_Add else graph.product(map(build, e.args))

    return graph, build(sp.sympify(text, evaluate=False))


@pytest.mark.parametrize(("text", "expected"), CASES)
def test_one_half_cancels(text: str, expected: str) -> None:
    graph, node = _graph(text)
    other, wanted = _graph(expected)
    found = combined(graph, node)
    assert graph.count_operations([found]) <= other.count_operations([wanted])
    values = {name: random.Random(name).uniform(-2, 2) for name in "pqrxy"}
    there = [{g.symbol(name): value for name, value in values.items()} for g in (graph, other)]
    assert evaluate(graph, [found], there[0])[0] == pytest.approx(
        evaluate(other, [wanted], there[1])[0], rel=1e-14
    )


@pytest.mark.parametrize("text", OTHERS)
def test_what_has_no_like_terms_stays(text: str) -> None:
    graph, node = _graph(text)
    assert combined(graph, node) == node


def test_a_double_pendulum_has_squares_of_its_rates() -> None:
    """As every textbook writes it: sin(a - b) b'^2 and sin(a - b) a'^2."""
    text = """
    model M
      coordinate Angle a;
      coordinate Angle b;
      kinetic 1/2*2 kg*(1 m*der(a))^2 + 1/2*1 kg*(1 m*der(b))^2 + 1 kg*(1 m)^2*der(a)*der(b)*cos(a - b);
      potential -9.81 m/s^2*1 m*(2 kg*cos(a) + 1 kg*cos(b));
    end M;
    """
    program = compile_source(SourceFile("model.mech", text)).program
    assert program is not None
    rhs = program.function("rhs")
    assert rhs is not None
    assert sum(type(s) is Operate for body in rhs.bodies for s in body) == 21

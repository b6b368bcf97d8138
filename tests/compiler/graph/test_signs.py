"""Signs that the structure of a formula shows, against values at random places."""

from __future__ import annotations

import random

import pytest

from mechc.compiler.graph import Graph, Node
from mechc.compiler.graph.evaluate import evaluate
from mechc.compiler.graph.signs import one_sign


def formulas(graph: Graph) -> dict[str, tuple[Node, bool]]:
    """Formulas of v, w and c > 0, and whether they are seen never to be positive."""
    v, w, c = (graph.symbol(n) for n in ("v", "w", "c"))
    square, minus = graph.mul(v, v), graph.neg(c)
    return {
        "-c v^2": (graph.mul(minus, square), True),
        "c v^2": (graph.mul(c, square), False),
        "-c v": (graph.mul(minus, v), False),
        "-c v |v| v": (graph.mul(v, graph.mul(minus, graph.mul(v, graph.abs(v)))), True),
        "-v tanh(v/c)": (graph.neg(graph.mul(v, graph.tanh(graph.div(v, c)))), True),
        "-v tanh(w)": (graph.neg(graph.mul(v, graph.tanh(w))), False),
        "-v^2 - |w|": (graph.sub(graph.neg(square), graph.abs(w)), True),
        "-v^2 + |w|": (graph.add(graph.neg(square), graph.abs(w)), False),
        "-v^2/(1 + w^2)": (graph.neg(graph.div(square, graph.add(graph.one, graph.mul(w, w)))), True),
        "-v^2 (1 - w^2)": (graph.neg(graph.mul(square, graph.sub(graph.one, graph.mul(w, w)))), False),
        "min(w, -v^2)": (graph.minimum(w, graph.neg(square)), True),
        "max(w, -v^2)": (graph.maximum(w, graph.neg(square)), False),
        "if w < 0 then -v^2 else -|v|": (
            graph.select(graph.less(w, graph.zero), graph.neg(square), graph.neg(graph.abs(v))),
            True,
        ),
        "if w < 0 then -v^2 else v": (graph.select(graph.less(w, graph.zero), graph.neg(square), v), False),
        "v (if w < 0 then -c v else 0)": (
            graph.mul(v, graph.select(graph.less(w, graph.zero), graph.mul(minus, v), graph.zero)),
            True,
        ),
        "v (if w < 0 then 0 else c v)": (
            graph.mul(v, graph.select(graph.less(w, graph.zero), graph.zero, graph.mul(c, v))),
            False,
        ),
        "-v^3": (graph.neg(graph.mul(square, v)), False),
        "-(v - w) v": (graph.neg(graph.mul(graph.sub(v, w), v)), False),
        "-(v - w)^2": (graph.neg(graph.mul(graph.sub(v, w), graph.sub(v, w))), True),
        "-v (c v + v |v|)": (
            graph.neg(graph.mul(v, graph.add(graph.mul(c, v), graph.mul(v, graph.abs(v))))),
            True,
        ),
        "-v (c v + w)": (graph.neg(graph.mul(v, graph.add(graph.mul(c, v), w))), False),
        "v (if w < 0 then -v else -c v)": (
            graph.mul(v, graph.select(graph.less(w, graph.zero), graph.neg(v), graph.mul(minus, v))),
            True,
        ),
        "0": (graph.sub(v, v), True),
    }


@pytest.mark.parametrize("name", list(formulas(Graph())))
def test_never_positive(name: str) -> None:
    graph = Graph()
    node, expected = formulas(graph)[name]
    assert one_sign(graph, [(graph.one, node)], {graph.symbol("c"): 2.0}, -1) is expected
    rng = random.Random(1)
    values = [
        evaluate(graph, [node], {graph.symbol("c"): 2.0} | {graph.symbol(n): rng.gauss(0, 2) for n in "vw"})[
            0
        ]
        for _ in range(200)
    ]
    assert (max(values) <= 0) is expected


def test_sign_of_a_number_counts() -> None:
    graph = Graph()
    node = graph.mul(graph.symbol("c"), graph.mul(graph.symbol("v"), graph.symbol("v")))
    assert one_sign(graph, [(graph.one, node)], {graph.symbol("c"): -2.0}, -1)
    assert not one_sign(graph, [(graph.one, node)], {graph.symbol("c"): 0.0}, -1)
    assert not one_sign(graph, [(graph.one, node)], {}, -1)

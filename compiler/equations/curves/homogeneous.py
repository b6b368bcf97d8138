"""Integrands over a parameter: sqrt(1 + (dy/dx)^2) dx as sqrt(dx^2 + dy^2), which no direction of the curve spoils."""

from __future__ import annotations

from collections.abc import Sequence

from ...graph import Graph, Node
from ...graph import operations as ops
from ...graph.differentiate import gradient, is_affine
from ...graph.rewrite import substitute
from .forms import Forms


def over_a_parameter(forms: Forms, nodes: Sequence[Node]) -> list[Node]:
    """Return formulas in x times dx as formulas in s times ds."""
    return [_one(forms, n) for n in nodes]


def _one(forms: Forms, node: Node) -> Node:
    graph = forms.graph
    v = set(forms.rates[1])
    roots = {
        n: graph.symbol(f"#root {k}")
        for k, n in enumerate(
            n for n in graph.reach([node]) if graph.op(n) == ops.SQRT and v.intersection(graph.support(n))
        )
    }
    squares = {n: _square(forms, graph.args(n)[0]) for n in roots}
    if roots and all(square is not None for square in squares.values()):
        symbols = list(roots.values())
        (open_,) = substitute(graph, [node], roots)
        if is_affine(graph, [open_], set(symbols)):
            (rest,) = substitute(graph, [open_], dict.fromkeys(symbols, graph.zero))
            slopes = gradient(graph, open_, symbols)
            over = forms.over_s([rest, *slopes])
            terms = [graph.mul(forms.length, over[0])]
            for slope, square in zip(over[1:], squares.values(), strict=True):
                assert square is not None
                terms.append(graph.mul(slope, graph.sqrt(square)))
            return graph.sum(terms)
    return graph.mul(forms.length, forms.over_s([node])[0])


def _square(forms: Forms, node: Node) -> Node | None:
    """Return a quadratic formula of dy/dx times dx^2, as one of dx and dy; None for others."""
    graph: Graph = forms.graph
    v = [n for n in forms.rates[1] if n in set(graph.support(node))]
    nothing = dict.fromkeys(v, graph.zero)
    first = gradient(graph, node, v)
    second = [gradient(graph, g, v) for g in first]
    if set(v).intersection(graph.support(*(n for row in second for n in row))):
        return None
    constant, *linear = forms.over_s(substitute(graph, [node, *first], nothing))
    dx = forms.length
    dy = [graph.mul(dx, n) for n in forms.over_s(v)]
    terms = [graph.mul(constant, graph.mul(dx, dx))]
    terms += [graph.mul(graph.mul(c, w), dx) for c, w in zip(linear, dy, strict=True)]
    for row, a in zip(second, dy, strict=True):
        terms += [
            graph.mul(graph.mul(graph.half, c), graph.mul(a, b))
            for c, b in zip(forms.over_s(row), dy, strict=True)
        ]
    return graph.sum(terms)

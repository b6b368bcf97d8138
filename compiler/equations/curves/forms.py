"""The formulas of a curve over the unit interval: x = a + (b - a) s, with derivatives by s.

Integrands over a parameter become homogeneous: sqrt(1 + (dy/dx)^2) dx is sqrt(dx^2 + dy^2), which no direction of the curve spoils.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from ...flat.model import Role, Variable
from ...graph import Graph, Node
from ...graph import operations as ops
from ...graph.differentiate import gradient, is_affine
from ...graph.kinks import kinks_of
from ...graph.rewrite import substitute
from ...mechanics.meaning.symbols import Scalar
from ...mechanics.system import Curve, MechanicalSystem


class Forms(NamedTuple):
    """Symbols of a curve: ``s``; ``by_s[k][i]`` the k-th derivative by s of coordinate i; ``rates`` those by x; ``length``
    is dx/ds; ``guessing`` stands for ``known`` where no curve is known yet."""

    graph: Graph
    scalars: tuple[Scalar, ...]
    s: Node
    length: Node
    by_s: tuple[tuple[Node, ...], ...]
    rates: tuple[tuple[Node, ...], ...]
    known: dict[Node, Node]
    guessing: dict[Node, Node]

    @property
    def exchanged(self) -> bool:
        """Whether x is a coordinate, too."""
        return len(self.scalars) > len(self.rates[0])

    def over_s(self, nodes: Sequence[Node]) -> list[Node]:
        """Return formulas in x and derivatives by x as formulas in s and derivatives by s."""
        return list(substitute(self.graph, nodes, self.known))

    def of_guess(self, nodes: Sequence[Node]) -> list[Node]:
        """Return formulas in x as formulas in s, x passed steadily."""
        return list(substitute(self.graph, nodes, self.guessing))


DEEPEST = 4
"""The highest derivative that formulas may contain."""


def forms_of(system: MechanicalSystem, curve: Curve, *, exchanged: bool = False) -> Forms:
    """Return the symbols of a curve, over x and over s; ``exchanged``: x is the last coordinate over s."""
    graph = system.graph
    fixed = {s.node for s in curve.unknown}
    coordinates = [c for c in system.symbols.coordinates if c.q[0].node not in fixed]
    scalars = tuple(s for c in coordinates for s in c.q)
    rates: list[tuple[Node, ...]] = [
        tuple(s.node for s in scalars),
        tuple(s.node for c in coordinates for s in c.v),
        tuple(a for c in coordinates for a in c.a),
    ]
    while len(rates) <= DEEPEST:
        rates.append(tuple(system.rate(n) for n in rates[-1]))
    s = graph.symbol("#s")
    length = graph.sub(curve.upper, curve.lower)
    steady = graph.add(curve.lower, graph.mul(length, s))
    time = system.symbols.time
    by_s = [rates[0]]
    known = {time: steady}
    if exchanged:
        x = graph.symbol("#x")
        scalars = (*scalars, Scalar(x, system.model.independent, independent(system), ()))
        by_s = [(*rates[0], x)]
        known = {time: x}
        length = graph.symbol(f"#1 {system.model.independent}")
    scale = graph.one
    for k in range(1, DEEPEST + 1):
        scale = graph.mul(scale, length)
        row = tuple(graph.symbol(f"#{k} {c.name}") for c in scalars)
        if not exchanged or k == 1:
            known |= {n: graph.div(w, scale) for n, w in zip(rates[k], row, strict=False)}
        by_s.append(row)
    return Forms(graph, scalars, s, length, tuple(by_s), tuple(rates), known, known | {time: steady})


def independent(system: MechanicalSystem) -> Variable:
    """Return the independent variable as if it were a coordinate."""
    variation = system.model.variation
    assert variation is not None
    known = next(
        (e for e in (variation.upper, variation.lower) if not e.type.dimension.is_none), variation.upper
    )
    return Variable(system.model.independent, Role.COORDINATE, known.type, variation.origin)


def kinks(graph: Graph, nodes: Sequence[Node], time: Node, fixed: frozenset[Node]) -> tuple[list[Node], bool]:
    """Return formulas of x that are zero where formulas bend, and whether they bend in other places, too.

    ``fixed``: symbols that are the same along the curve.
    """
    found: dict[Node, None] = {}
    bends = False
    for n in graph.reach(nodes):
        code = graph.op(n)
        arguments: list[Node] = []
        if code in (ops.ABS, ops.SIGN):
            arguments = [graph.args(n)[0]]
        elif code in (ops.MINIMUM, ops.MAXIMUM, ops.LESS, ops.LESS_EQUAL):
            arguments = [graph.sub(*graph.args(n))]
        elif code == ops.LOOKUP:
            at = graph.args(n)[0]
            arguments = [graph.sub(at, graph.constant(p)) for p in kinks_of(graph, n)]
        elif code in (ops.FLOOR, ops.MODULO):
            bends = True
        for argument in arguments:
            support = set(graph.support(argument))
            if not support <= fixed | {time}:
                bends = True
            elif time in support:
                found[argument] = None
    return list(found), bends


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

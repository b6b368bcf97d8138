"""Definite integrals inside expressions: split at kinks, by a rule that was seen to suffice, with an estimate of its error.

A rule is chosen when the model is compiled, with the default values of parameters and a few values of all that moves.
As these change, the estimate, which is formed in the same way at run time, is what tells.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Mapping, Sequence
from fractions import Fraction
from functools import partial, reduce

from msgspec import Struct

from mechc.lang.diagnostics import Reporter
from mechc.lang.source import Span

from ...flat.model import Expression, Quadrature
from ...graph import Graph, Node
from ...graph.differentiate import jvp
from ...graph.evaluate import evaluate
from ...graph.rewrite import substitute
from .pieces import Integrand, pieces_of, place_in
from .quadrature import BENT, Points, Rule
from .rule_choice import chosen_rule, tell
from .symbols import Symbols

PLACES, INNER_PLACES = 25_000, 510
"""Places of the innermost integrand that integrals inside of each other may take together, and those of one inside that follows the
place of the outer, with those that tell its error. Each is written out: a rule that needs more gives way to a shorter one, and what
that leaves is told."""


class IntegralTerm(Struct, frozen=True):
    """One integral as it stands in the model: ``error`` is its estimated error over the integral of |integrand|, ``inside`` a
    part of the integrand at some place, which is found wherever the integral stands, also where kinks have become switches.

    ``slope`` gives that of its derivative along some symbols, which is larger where the integrand bends: that jumps."""

    span: Span
    inside: Node
    error: Node
    slope: Callable[[Sequence[Node]], Node]

    def where(self, graph: Graph, known: Mapping[Node, Node]) -> IntegralTerm:
        """Return it with formulas instead of symbols, as of one in the equations for them; no motion follows its slope."""
        inside, error = substitute(graph, (self.inside, self.error), known)
        return IntegralTerm(self.span, inside, error, lambda _: graph.zero)


class Integrals:
    """The definite integrals of a model. ``errors``: what is known of each, by its variable; of one inside of another, the worst of
    a few places of that."""

    def __init__(
        self,
        graph: Graph,
        symbols: Symbols,
        numbers: Callable[[Expression], Sequence[Node]],
        reporter: Reporter,
    ) -> None:
        """``numbers`` gives the entries of an expression in row-major order."""
        self._graph = graph
        self._parameters = {s.node: s for s in symbols.parameters}
        self._numbers = numbers
        self._reporter = reporter
        self._rules: dict[str, Rule] = {}
        self._depth = 0
        self._within: dict[str, list[IntegralTerm]] | None = None
        self._places = 0  # at which integrands were asked for
        self.errors: dict[str, IntegralTerm] = {}

    def value(self, expression: Quadrature, integrand: Integrand, lower: Node, upper: Node) -> Node:
        """Return an integral by the rule that is chosen once for each that stands in the text."""
        graph, name = self._graph, expression.variable
        s = graph.symbol(f"?{name}")
        self._depth += 1
        if name not in self._rules:
            most = self._places_left(integrand, s)
            self._rules[name], error = chosen_rule(graph, integrand, s, lower, upper, self.settled, most)
            tell(self._reporter, expression.span, error, self._rules[name])
        pieces, bent = pieces_of(graph, integrand, s, lower, upper)
        rule = self._rules[name]
        around, self._within = self._within, None
        before = self._places
        value = _total(graph, integrand, pieces, rule.points)
        if self._places == before and self._follows(value):
            self._places += (len(pieces) - 1) * len(rule.points)
        if self._depth == 1 or around is not None:
            found = self._known(expression, integrand, pieces, bent)
            if around is None:
                self.errors |= {inner: _worst(graph, there) for inner, there in found.items()}
            else:
                for inner, there in found.items():
                    around.setdefault(inner, []).extend(there)
        self._within = around
        self._depth -= 1
        return value

    def _known(
        self, expression: Quadrature, integrand: Integrand, pieces: Sequence[Node], bent: bool
    ) -> dict[str, list[IntegralTerm]]:
        """Return what is known of an integral and, at a few of its places, of those inside of it."""
        graph, rule = self._graph, self._rules[expression.variable]
        self._within = {}
        for at in _looked_at(graph, pieces, rule.points):
            integrand(at)
        within, self._within = self._within, None
        inside = _inside(graph, integrand, pieces[0], pieces[1], rule.points)
        error = error_of(graph, integrand, pieces, bent, rule)
        slope = partial(slope_error, graph, integrand, pieces, rule) if bent else lambda _: graph.zero
        return {expression.variable: [IntegralTerm(expression.span, inside, error, slope)], **within}

    def _places_left(self, integrand: Integrand, s: Node) -> int:
        """Return at how many places an integrand may be asked for."""
        body = integrand(s)  # which chooses the rules of what is inside
        before = self._places
        integrand(s)
        if self._places > before:
            return PLACES // (self._places - before)
        return INNER_PLACES if self._follows(body, s) else PLACES

    def _follows(self, n: Node, own: Node | None = None) -> bool:
        """Tell whether a formula follows the place of an integral around it."""
        found = self._graph.support(n) if self._depth > 1 else ()
        return any(x != own and self._graph.name(x).startswith("?") for x in found)

    def settled(self, symbols: Iterable[Node]) -> dict[Node, float]:
        """Return the values of those symbols that are parameters with a value, and of what these depend on."""
        found: dict[Node, float] = {}
        for symbol in symbols:
            scalar = self._parameters.get(symbol)
            if scalar is None or scalar.variable.value is None:
                continue
            numbers = self._numbers(scalar.variable.value)
            ours = [n for n, s in self._parameters.items() if s.variable is scalar.variable]
            value = numbers[ours.index(symbol) if len(numbers) > 1 else 0]
            known = self.settled(self._graph.support(value))
            if known.keys() >= set(self._graph.support(value)):
                found[symbol] = float(evaluate(self._graph, [value], known)[0])
        return found


def _worst(graph: Graph, there: Sequence[IntegralTerm]) -> IntegralTerm:
    """Return what is known of an integral from a few places of the one around it: the worst."""

    def slope(along: Sequence[Node]) -> Node:
        return reduce(graph.maximum, (integral.slope(along) for integral in there))

    first, error = there[0], reduce(graph.maximum, (integral.error for integral in there))
    return IntegralTerm(first.span, first.inside, error, slope)


def error_of(graph: Graph, integrand: Integrand, pieces: Sequence[Node], bent: bool, rule: Rule) -> Node:
    """Return the estimated error of a rule over the integral of |integrand|."""
    value, size = _total(graph, integrand, pieces, rule.points), graph.zero
    others = [_total(graph, integrand, pieces, points) for points in rule.seen(bent)]
    for a, b in itertools.pairwise(pieces):
        size = graph.add(size, graph.abs(_sum(graph, lambda s: graph.abs(integrand(s)), a, b, rule.points)))
    if graph.is_zero(size):  # nothing to integrate, or nowhere
        return graph.zero
    off = reduce(graph.maximum, (graph.abs(graph.sub(value, other)) for other in others))
    off = graph.mul(graph.constant(BENT), off) if bent else off
    return graph.select(graph.less(graph.zero, size), graph.div(off, size), graph.zero)


def slope_error(
    graph: Graph, integrand: Integrand, pieces: Sequence[Node], rule: Rule, along: Sequence[Node]
) -> Node:
    """Return the estimated error of the derivative of a rule along all of some symbols at once, over the integral of its size."""
    tangents = {w: graph.constant(1 + Fraction(k, 10)) for k, w in enumerate(along)}

    def slope(n: Node) -> Node:
        return jvp(graph, [n], tangents)[0]

    value, *others = (
        slope(_total(graph, integrand, pieces, points)) for points in (rule.points, *rule.companions)
    )
    size = graph.zero
    for a, b in itertools.pairwise(pieces):
        size = graph.add(
            size, graph.abs(_sum(graph, lambda s: graph.abs(slope(integrand(s))), a, b, rule.points))
        )
    if graph.is_zero(size):
        return graph.zero
    off = reduce(graph.maximum, (graph.abs(graph.sub(value, other)) for other in others))
    return graph.select(
        graph.less(graph.zero, size), graph.div(graph.mul(graph.constant(BENT), off), size), graph.zero
    )


def _total(graph: Graph, integrand: Integrand, pieces: Sequence[Node], points: Points) -> Node:
    parts = (_sum(graph, integrand, a, b, points) for a, b in itertools.pairwise(pieces))
    return reduce(graph.add, parts, graph.zero)


def _sum(graph: Graph, integrand: Integrand, a: Node, b: Node, points: Points) -> Node:
    width, result = graph.sub(b, a), graph.zero
    for place, weight in points:
        at = place_in(graph, a, b, place)
        result = graph.add(result, graph.mul(graph.mul(graph.constant(weight), width), integrand(at)))
    return result


def _inside(graph: Graph, integrand: Integrand, a: Node, b: Node, points: Points) -> Node:
    """Return the first formula of the integrand that depends on the place and on what moves; else the integrand itself."""
    here, there = (integrand(place_in(graph, a, b, points[k][0])) for k in (len(points) // 2, 0))
    elsewhere = set(graph.reach([there]))
    parts = (n for n in graph.reach([here]) if n not in elsewhere and not graph.is_constant(n))
    return next(parts, here)


def _looked_at(graph: Graph, pieces: Sequence[Node], points: Points) -> list[Node]:
    """Return the first, the last and a middle place of each piece."""
    places = [points[k][0] for k in (0, len(points) // 2, -1)]
    return [place_in(graph, a, b, place) for a, b in itertools.pairwise(pieces) for place in places]

"""Definite integrals inside expressions: split at kinks, by a rule that was seen to suffice, with an estimate of its error.

A rule is chosen when the model is compiled, with the default values of parameters and a few values of all that moves.
As these change, the estimate, which is formed in the same way at run time, is what tells.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from fractions import Fraction
from functools import partial, reduce

from msgspec import Struct

from mechc.lang.diagnostics import Reporter
from mechc.lang.source import Span

from ...flat.model import Expression, Quadrature
from ...graph import Graph, Node
from ...graph import operations as ops
from ...graph.differentiate import jvp
from ...graph.evaluate import Tape, evaluate
from ...graph.rewrite import substitute
from .quadrature import BENT, Points, Rule, rules
from .symbols import Symbols

ENOUGH = 1e-12
"""Error, relative to the integral of |integrand|, with which a rule is taken and no finer one is tried."""
WORTH_A_WORD = 1e-9
"""Error that is told when the model is compiled."""
MOST_KINKS = 6
"""Kinks at which an integral is split; of more, the others are left to the rule."""
OTHERWISE = 2.0
"""A rule that finds the integral of |integrand| smaller or larger by this factor misses, or sees twice, a part of it."""
AT_THE_END = Fraction(1, 100_000)
"""Places so close to the upper end are reckoned from it, which keeps their distance exact where that end is 0."""
SAMPLES = (0.618, -0.414, 0.271)
"""Values of what moves, at which rules are compared: of no consequence but that they are of no special kind."""

WIDEST = -5
"""The rule that looks at the most places: where one of the first agrees with it, no later one is tried."""
PLACES, INNER_PLACES = 25_000, 510
"""Places of the innermost integrand that integrals inside of each other may take together, and those of one inside that follows the
place of the outer, with those that tell its error. Each is written out: a rule that needs more gives way to a shorter one, and what
that leaves is told."""

Integrand = Callable[[Node], Node]


class Integral(Struct, frozen=True):
    """One integral as it stands in the model: ``error`` is its estimated error over the integral of |integrand|, ``inside`` a
    part of the integrand at some place, which is found wherever the integral stands, also where kinks have become switches.

    ``slope`` gives that of its derivative along some symbols, which is larger where the integrand bends: that jumps."""

    span: Span
    inside: Node
    error: Node
    slope: Callable[[Sequence[Node]], Node]

    def where(self, graph: Graph, known: Mapping[Node, Node]) -> Integral:
        """Return it with formulas in the place of symbols, as of one in the equations for them; no motion follows its slope."""
        inside, error = substitute(graph, (self.inside, self.error), known)
        return Integral(self.span, inside, error, lambda _: graph.zero)


class Integrals:
    """The definite integrals of a model. ``errors``: what is known of each, by its variable; of one inside of another, the worst of
    all places of that."""

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
        self._within: dict[str, list[Integral]] | None = None
        self._places = 0  # at which integrands were asked for
        self.errors: dict[str, Integral] = {}

    def value(self, expression: Quadrature, integrand: Integrand, lower: Node, upper: Node) -> Node:
        """Return an integral by the rule that is chosen once for each that stands in the text."""
        graph, name = self._graph, expression.variable
        s = graph.symbol(f"?{name}")
        self._depth += 1
        if name not in self._rules:
            most = self._places_left(integrand, s)
            self._rules[name], error = chosen_rule(graph, integrand, s, lower, upper, self.settled, most)
            tell(self._reporter, expression.span, error, self._rules[name])
        pieces, bent = _pieces(graph, integrand, s, lower, upper)
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
    ) -> dict[str, list[Integral]]:
        """Return what is known of an integral and, at a few of its places, of those inside of it."""
        graph, rule = self._graph, self._rules[expression.variable]
        self._within = {}
        for at in _looked_at(graph, pieces, rule.points):
            integrand(at)
        within, self._within = self._within, None
        inside = _inside(graph, integrand, pieces[0], pieces[1], rule.points)
        error = error_of(graph, integrand, pieces, bent, rule)
        slope = partial(slope_error, graph, integrand, pieces, rule) if bent else lambda _: graph.zero
        return {expression.variable: [Integral(expression.span, inside, error, slope)], **within}

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


def _worst(graph: Graph, there: Sequence[Integral]) -> Integral:
    """Return what is known of an integral at all places of the one around it."""

    def slope(along: Sequence[Node]) -> Node:
        return reduce(graph.maximum, (integral.slope(along) for integral in there))

    first, error = there[0], reduce(graph.maximum, (integral.error for integral in there))
    return Integral(first.span, first.inside, error, slope)


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
        at = _place(graph, a, b, place)
        result = graph.add(result, graph.mul(graph.mul(graph.constant(weight), width), integrand(at)))
    return result


def _inside(graph: Graph, integrand: Integrand, a: Node, b: Node, points: Points) -> Node:
    """Return the first formula of the integrand that depends on the place and on what moves; else the integrand itself."""
    here, there = (integrand(_place(graph, a, b, points[k][0])) for k in (len(points) // 2, 0))
    elsewhere = set(graph.reach([there]))
    parts = (n for n in graph.reach([here]) if n not in elsewhere and not graph.is_constant(n))
    return next(parts, here)


def _looked_at(graph: Graph, pieces: Sequence[Node], points: Points) -> list[Node]:
    """Return the first, the last and a middle place of each piece."""
    places = [points[k][0] for k in (0, len(points) // 2, -1)]
    return [_place(graph, a, b, place) for a, b in itertools.pairwise(pieces) for place in places]


def _place(graph: Graph, a: Node, b: Node, place: Fraction) -> Node:
    """Return a place between a, at 0, and b, at 1."""
    width = graph.sub(b, a)
    if 1 - place < AT_THE_END:
        return graph.sub(b, graph.mul(graph.constant(1 - place), width))
    return graph.add(a, graph.mul(graph.constant(place), width))


def _pieces(graph: Graph, integrand: Integrand, s: Node, lower: Node, upper: Node) -> tuple[list[Node], bool]:
    """Return the ends of the pieces: the bounds, and between them, in order, the kinks that the formula shows; and whether
    it may bend elsewhere."""
    found, bent = _kinks(graph, integrand(s), s)
    kinks, bent = found[:MOST_KINKS], bent or len(found) > MOST_KINKS
    if not kinks:
        return [lower, upper], bent
    low, high = graph.minimum(lower, upper), graph.maximum(lower, upper)
    inside = [graph.minimum(graph.maximum(kink, low), high) for kink in kinks]
    for end in range(len(inside) - 1, 0, -1):  # bubbles, as the order is not known before
        for i in range(end):
            a, b = inside[i], inside[i + 1]
            inside[i], inside[i + 1] = graph.minimum(a, b), graph.maximum(a, b)
    turned = graph.less(upper, lower)
    ordered = [graph.select(turned, b, a) for a, b in zip(inside, reversed(inside), strict=True)]
    return [lower, *ordered, upper], bent


def _kinks(graph: Graph, body: Node, s: Node) -> tuple[list[Node], bool]:
    """Return where relations, absolute values and extremes change inside a formula, and the points of tables, as far as
    they are linear in s; and whether there are others."""
    found: dict[Node, None] = {}
    others = False
    for n in graph.reach([body], [s]):
        places: tuple[float, ...] = (0.0,)
        match graph.op(n):
            case ops.LOOKUP:
                argument, places = graph.args(n)[0], graph.tables[graph.table_of(n)[0]].points
            case ops.ABS | ops.SIGN:
                argument = graph.args(n)[0]
            case ops.MINIMUM | ops.MAXIMUM | ops.LESS | ops.LESS_EQUAL:
                argument = graph.sub(*graph.args(n))
            case ops.FLOOR:
                others = True
                continue
            case _:
                continue
        (slope,) = jvp(graph, [argument], {s: graph.one})
        if s in graph.support(slope):
            others = True
        if slope == graph.zero or s in graph.support(slope):
            continue
        (start,) = substitute(graph, [argument], {s: graph.zero})
        flat = graph.equal(slope, graph.zero)
        divisor = graph.select(flat, graph.one, slope)
        for place in places:
            off = graph.sub(start, graph.constant(place)) if place else start
            found[graph.neg(graph.div(off, divisor))] = None
    return list(found), others


def chosen_rule(
    graph: Graph,
    integrand: Integrand,
    s: Node,
    lower: Node,
    upper: Node,
    defaults: Callable[[Iterable[Node]], Mapping[Node, float]],
    most: int = PLACES,
) -> tuple[Rule, float]:
    """Return the first rule that is good enough, or the best, and its error over the integral of |integrand|.

    ``defaults`` gives the values of those symbols that have one before a run, ``most`` the number of places that a rule may take in
    all pieces; where none does with so few, the shortest is taken.
    """
    bounds, bent = _pieces(graph, integrand, s, lower, upper)
    body = integrand(s)
    settled = defaults(n for n in graph.support(body, *bounds) if n != s)
    moving = [n for n in graph.support(body, *bounds) if n != s and n not in settled]
    sampled = [
        {**settled, **{n: value * (1 + 0.1 * k) for k, n in enumerate(moving)}}
        for value in (SAMPLES if moving else SAMPLES[:1])
    ]
    tables = any(graph.op(n) == ops.LOOKUP for n in graph.reach([body], [s]))
    tried = _within_reach(rules(pieces=tables), bent, most // (len(bounds) - 1))
    seen = [_errors(graph, body, s, bounds, bent, values, tried) for values in sampled]
    defined = [found for found in seen if min(found) < math.inf] or seen[
        :1
    ]  # some values may lie out of its domain
    errors = [max(found) for found in zip(*defined, strict=True)]
    best = min(range(len(errors)), key=lambda k: (max(errors[k], ENOUGH), k))
    return tried[best], errors[best]


def _within_reach(all_rules: Sequence[Rule], bent: bool, most: int) -> Sequence[Rule]:
    """Return the rules that take no more places than that, with their companions; else the shortest that there is."""
    return [rule for rule in all_rules if rule.places(bent) <= most] or rules(pieces=True)[:1]


def _errors(
    graph: Graph,
    body: Node,
    s: Node,
    bounds: Sequence[Node],
    bent: bool,
    values: Mapping[Node, float],
    tried: Sequence[Rule],
) -> list[float]:
    """Return the error of each rule over the integral of |integrand|: its difference from the one that agrees best with
    its companions, and the error that these tell of that one; ``bent``: the integrand may bend inside of pieces."""
    ends = evaluate(graph, list(bounds), values)
    still = {n: x for n, x in values.items() if n != s}
    tape = Tape(graph, [body], [*still, s]).settled(still)

    def at(place: float) -> float:
        return float(tape({s: place})[body])

    def total(points: Points) -> tuple[float, float]:
        value, size = 0.0, 0.0
        for a, b in itertools.pairwise(ends):
            terms = [
                float(w)
                * (b - a)
                * at(b - float(1 - x) * (b - a) if 1 - x < AT_THE_END else a + float(x) * (b - a))
                for x, w in points
            ]
            value, size = value + math.fsum(terms), size + abs(math.fsum(map(abs, terms)))
        return value, size

    last = next((k for k, rule in enumerate(tried) if rule == rules()[WIDEST]), len(tried) - 1)
    widest = total(tried[last].points)
    short = next((k for k, rule in enumerate(tried) if rule == rules()[0]), last)
    for k in range(min(short + 1, last) if math.isfinite(widest[1]) else 0):
        close = abs(total(tried[k].companions[0])[0] - widest[0]) <= WORTH_A_WORD * widest[1] or k == short
        if close and abs(total(tried[k].points)[0] - widest[0]) <= ENOUGH * widest[1]:
            return [math.inf] * k + [0.0] * (len(tried) - k)
    found = [(*total(rule.points), *(total(x)[0] for x in rule.seen(bent))) for rule in tried]
    finite = [k for k, numbers in enumerate(found) if all(map(math.isfinite, numbers))]
    if not finite:
        return [math.inf] * len(found)
    size = found[last if last in finite else finite[-1]][1]
    if size == 0:
        return [0.0 if found[k][1] == 0 else math.inf for k in range(len(found))]
    seeing = [k for k in finite if size < OTHERWISE * found[k][1] < OTHERWISE**2 * size]
    off = [(BENT if bent else 1.0) * max(abs(value - x) for x in others) for value, _, *others in found]
    best = min(reversed(seeing), key=lambda k: off[k])
    return [
        (abs(value - found[best][0]) + off[best]) / size if k in seeing else math.inf
        for k, (value, *_) in enumerate(found)
    ]


def tell(reporter: Reporter, span: Span, error: float, rule: Rule) -> None:
    """Warn of an integral that no rule gives to nine digits."""
    if error <= WORTH_A_WORD:
        return
    known = error < 0.01
    amount = f"known to {error:.0e} of its size only" if known else "not known"
    look = rule.words if known else "512 places in each of its pieces, which do not show its shape"
    reporter.warning(
        "W0538",
        f"this integral is {amount}",
        span,
        caption=f"with the default values and {look}",
        help="split it where the integrand has a peak or a kink, or write what is singular in another variable",
    )

"""The rule that an integral is formed by: the first that is good enough, looked at with numbers when the model is compiled."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Mapping, Sequence

from mechc.lang.diagnostics import Reporter
from mechc.lang.source import Span

from ...graph import Graph, Node
from ...graph import operations as ops
from ...graph.evaluate import Tape, evaluate
from .pieces import AT_THE_END, Integrand, pieces_of
from .quadrature import BENT, Points, Rule, rules

ENOUGH = 1e-12
"""Error, relative to the integral of |integrand|, with which a rule is taken and no finer one is tried."""
WORTH_A_WORD = 1e-9
"""Error that is told when the model is compiled."""
OTHERWISE = 2.0
"""A rule that finds the integral of |integrand| smaller or larger by this factor misses, or sees twice, a part of it."""
SAMPLES = (0.618, -0.414, 0.271)
"""Values of what moves, at which rules are compared: of no consequence but that they are of no special kind."""

WIDEST = -5
"""The rule that looks at the most places: where one of the first agrees with it, no later one is tried."""


def chosen_rule(
    graph: Graph,
    integrand: Integrand,
    s: Node,
    lower: Node,
    upper: Node,
    defaults: Callable[[Iterable[Node]], Mapping[Node, float]],
    most: int,
) -> tuple[Rule, float]:
    """Return the first rule that is good enough, or the best, and its error over the integral of |integrand|.

    ``defaults`` gives the values of those symbols that have one before a run, ``most`` the number of places that a rule may take in
    all pieces; where none does with so few, the shortest is taken.
    """
    bounds, bent = pieces_of(graph, integrand, s, lower, upper)
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
    look = rule.words if known else "512 points in each of its pieces, which do not resolve its shape"
    reporter.warning(
        "W0538",
        f"this integral is {amount}",
        span,
        caption=f"with the default values and {look}",
        help="split it where the integrand has a peak or a kink, or write what is singular in another variable",
    )

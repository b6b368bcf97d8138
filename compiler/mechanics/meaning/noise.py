"""What ``noise(seed, period)`` means: a cubic through standard normal numbers at multiples of the period.

Between two of them it is the cubic of Catmull and Rom, by the two and their neighbours: its rate is continuous, and any time alone
tells its value, so that it is the same in whatever order it is asked for.
"""

from __future__ import annotations

from fractions import Fraction

from mechc.lang.diagnostics import Reporter
from mechc.lang.source import Span

from ...flat.model import Origin
from ...graph import Graph, Node
from .symbols import Symbols


def noise(graph: Graph, seed: Node, x: Node) -> Node:
    """Return the signal at x, the time over the period."""
    k = graph.floor(x)
    s = graph.sub(x, k)
    a, b, c, d = (graph.normal(seed, graph.add(k, graph.constant(i))) for i in range(-1, 3))

    def total(*terms: tuple[Fraction, Node]) -> Node:
        found = graph.zero
        for share, n in terms:
            found = graph.add(found, graph.mul(graph.constant(share), n))
        return found

    half = Fraction(1, 2)
    slope = total((half, c), (-half, a))
    bend = total((Fraction(1), a), (Fraction(-5, 2), b), (Fraction(2), c), (-half, d))
    twist = total((3 * half, b), (-3 * half, c), (half, d), (-half, a))
    return graph.add(b, graph.mul(s, graph.add(slope, graph.mul(s, graph.add(bend, graph.mul(s, twist))))))


def check_noise(
    graph: Graph, symbols: Symbols, seed: Node, period: Node, span: Span, reporter: Reporter
) -> None:
    """Report a seed or a period that changes, and a period that is not positive."""
    if not {s.node for s in symbols.parameters}.issuperset(graph.support(seed, period)):
        raise reporter.fail(
            "E0584",
            "the seed and the period of a noise cannot change during a run",
            span,
            caption="one of them depends on what changes",
            help="multiply the noise by what changes, or add several",
        )
    if graph.is_constant(period) and not graph.value(period) > 0:
        raise reporter.fail(
            "E0584",
            f"a noise with the period {float(graph.value(period)):g} s is none",
            span,
            caption="a period is positive",
            help="write the time from one random number to the next, as in 'noise(1, 0.1 s)'",
        )


def positive_period(graph: Graph, period: Node, span: Span) -> tuple[Node, str, Origin]:
    """Return what must hold of a period that a parameter tells, its words and its place."""
    return graph.less(graph.zero, period), "the period of a noise is positive", Origin(span)


def over_period(graph: Graph, time: Node, period: Node) -> Node:
    """Return the time over the period; of one that is not positive nothing is asked but that it is refused."""
    return graph.div(time, graph.select(graph.less(graph.zero, period), period, graph.one))

"""What ``delay(e, T)`` means: e in which every number that changes stands as it was T ago.

Such a number (a coordinate, a rate, a state, an input, a discrete variable, the time) has a symbol, a number in z that the kernel
writes from the history of the run. A formula of these has kinks and jumps of its own, which are located like others.
"""

from __future__ import annotations

from collections.abc import Sequence

from msgspec import Struct

from mechc.lang.diagnostics import Reporter
from mechc.lang.source import Span

from ...flat.model import Query
from ...graph import Graph, Node
from ...graph.operations import RATE
from ..kinematics.rates import TotalDerivative
from .symbols import Scalar, Symbols


class Delayed(Struct, frozen=True):
    """``source`` as it was ``delay`` ago; ``name`` and ``span``: as the user would write it, and where it is written."""

    source: Node
    delay: Node
    name: str
    span: Span


class Delays:
    """All that looks back in one model. ``found``: by the symbol that stands for it; ``driven``: of what is prescribed or balanced, which
    its formula gives."""

    def __init__(
        self,
        graph: Graph,
        symbols: Symbols,
        rate: TotalDerivative,
        unknown_rates: dict[Node, Scalar | Query | Delayed],
    ) -> None:
        self._graph = graph
        self._rate = rate
        self._unknown_rates = unknown_rates
        self.found: dict[Node, Delayed] = {}
        self.driven: dict[Node, Delayed] = {}
        self._symbols: dict[tuple[Node, Node], Node] = {}
        self._parameters = {s.node for s in symbols.parameters}
        others = (*symbols.states, *symbols.inputs, *symbols.discretes)
        self._sources = {symbols.time, *symbols.positions, *symbols.velocities, *(s.node for s in others)}

    def images(self, nodes: Sequence[Node], delay: Node, span: Span, reporter: Reporter) -> dict[Node, Node]:
        """Return what stands, a delay ago, for each number in formulas that changes; report what nobody keeps, and a delay
        that changes or is not positive."""
        graph = self._graph
        if not self._parameters.issuperset(graph.support(delay)):
            raise reporter.fail(
                "E0580",
                "a delay cannot change during a run",
                span,
                caption="this one depends on what changes",
                help="write a number or a formula of parameters",
            )
        if graph.is_constant(delay) and not graph.value(delay) > 0:
            raise reporter.fail(
                "E0580",
                f"a delay of {float(graph.value(delay)):g} s is none",
                span,
                caption="it must be positive",
                help="without a delay write the expression itself",
            )
        changing = [n for n in graph.support(*nodes) if n not in self._parameters]
        for symbol in changing:
            if symbol not in self._sources and symbol not in self.found:
                raise reporter.fail(
                    "E0581",
                    f"'{graph.name(symbol).lstrip('?#')}' cannot be delayed",
                    span,
                    caption="only coordinates, their rates, states, inputs, discrete variables and the time are kept",
                    help="let a 'state' follow it, as in 'equation der(y) = (e - y)/tau;', and delay that",
                )
        return {symbol: self.symbol(symbol, delay, span) for symbol in changing}

    def symbol(self, source: Node, delay: Node, span: Span) -> Node:
        """Return the symbol of a source as it was; of what was delayed before, the delays add up."""
        graph = self._graph
        if source in self.found:
            before = self.found[source]
            source, delay = before.source, graph.add(before.delay, delay)
        key = (source, delay)
        if key not in self._symbols:
            name = graph.name(source)
            others = sum(d.source == source for d in self.found.values())
            known = f"delay({name})" if not others else f"delay({name}) {others + 1}"
            symbol = self._symbols[key] = graph.symbol(known)
            self.found[symbol] = Delayed(source, delay, name, span)
            rate = graph.symbol(f"#rate of {known}", RATE)
            self._rate.define(symbol, rate)
            self._unknown_rates[rate] = self.found[symbol]
        return self._symbols[key]

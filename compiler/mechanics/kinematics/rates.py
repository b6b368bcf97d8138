"""Total derivatives along the motion, remembered from node to node.

Positions of a chain share all but their last term; remembering makes the velocities of n bodies cost n, not n^2.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from ...graph import Graph, Node
from ...graph.differentiate import tangent
from ...graph.operations import SYMBOL


class TotalDerivative:
    """``rates[s]`` is the time derivative of the symbol s; symbols that are not named are constant."""

    def __init__(self, graph: Graph, rates: Mapping[Node, Node]) -> None:
        self._graph = graph
        self._known: dict[Node, Node] = dict(rates)
        self._later: dict[Node, Callable[[], Node]] = {}

    def define(self, symbol: Node, rate: Node) -> None:
        """State the derivative of a further symbol, before anything that depends on it is differentiated."""
        self._known[symbol] = rate

    def define_later(self, symbol: Node, rate: Callable[[], Node]) -> None:
        """State how the derivative of a further symbol is found when something first needs it."""
        self._later[symbol] = rate

    def offer(self, node: Node, rate: Callable[[], Node]) -> None:
        """Say how the derivative of a formula is found more cheaply than term by term; asked for when needed."""
        if self._graph.op(node) > SYMBOL and node not in self._known:
            self._later.setdefault(node, rate)

    def formed(self, node: Node) -> bool:
        """Return whether something has asked for the derivative of a formula, or of what contains it."""
        return node in self._known

    def __call__(self, node: Node) -> Node:
        known, graph, later = self._known, self._graph, self._later
        if node in known:
            return known[node]
        pending = [node]
        while pending:
            at = pending[-1]
            if at in known:
                pending.pop()
                continue
            if at in later:
                known[at] = later.pop(at)()
                continue
            missing = [x for x in graph.args(at) if x not in known]
            if missing:
                pending.extend(missing)
                continue
            pending.pop()
            known[at] = tangent(graph, at, tuple(known[x] for x in graph.args(at)))
        return known[node]

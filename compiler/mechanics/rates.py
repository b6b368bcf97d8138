"""Total derivatives along the motion, remembered from node to node.

Positions of a chain share all but their last term; remembering makes the velocities of n bodies cost n, not n^2.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from ..graph import Graph, Node
from ..graph.operations import ADD, DIV, MUL, NEG, OPERATIONS, SELECT, SUB, SYMBOL


class TotalDerivative:
    """``rates[s]`` is the time derivative of the symbol s; symbols that are not named are constant."""

    def __init__(self, graph: Graph, rates: Mapping[Node, Node]) -> None:
        self._graph = graph
        self._known: dict[Node, Node] = dict(rates)
        self._later: dict[Node, Callable[[], Node]] = {}

    def define(self, symbol: Node, rate: Node) -> None:
        """State the derivative of a further symbol, before anything that depends on it is differentiated."""
        self._known[symbol] = rate

    def offer(self, node: Node, rate: Callable[[], Node]) -> None:
        """Say how the derivative of a formula is found more cheaply than term by term; asked for when needed."""
        if self._graph.op(node) > SYMBOL and node not in self._known:
            self._later.setdefault(node, rate)

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
            known[at] = self._step(at)
        return known[node]

    def _step(self, n: Node) -> Node:
        """Return the derivative of a node whose arguments are known."""
        graph, known, code = self._graph, self._known, self._graph.op(n)
        arguments = graph.args(n)
        tangents = tuple(known[x] for x in arguments)
        zero = graph.zero
        if code <= SYMBOL or all(t == zero for t in tangents):
            return zero
        match code:
            case c if c == ADD:
                return graph.add(*tangents)
            case c if c == SUB:
                return graph.sub(*tangents)
            case c if c == NEG:
                return graph.neg(*tangents)
            case c if c == MUL:
                (x, y), (dx, dy) = arguments, tangents
                if x == y:
                    return graph.mul(graph.mul(graph.two, x), dx)
                return graph.add(graph.mul(dx, y), graph.mul(x, dy))
            case c if c == DIV:
                _, y = arguments
                dx, dy = tangents
                return graph.div(graph.sub(dx, graph.mul(n, dy)), y)
            case c if c == SELECT:
                return graph.select(arguments[0], tangents[1], tangents[2])
        total = zero
        # not strict: an operation without rules has derivative zero
        for partial, t in zip(OPERATIONS[code].partials, tangents, strict=False):
            if t != zero:
                total = graph.add(total, graph.mul(partial(graph, arguments, n), t))
        return total

"""Names for what stands in several places of long equations, so that these stay as short as what computes them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence

import sympy as sp

from ..graph import Graph, Node
from ..graph import operations as ops
from .express import express

LONGEST = 24
"""A part with more operations gets a name though it stands in one place only."""

LETTERS = ("w", "e", "z", "h", "abbreviation")
"""The first of which no name of the model begins with, before a number."""


class Abbreviations:
    """Parts of ``outputs`` with their names; ``defined`` goes from the innermost outwards."""

    def __init__(
        self, graph: Graph, outputs: Sequence[Node], symbols: Mapping[Node, sp.Expr], *, latex: bool
    ) -> None:
        self.graph = graph
        self.known = dict(symbols)
        chosen = list(_parts(graph, outputs, symbols))
        letter = _letter({str(s) for s in symbols.values()})
        pattern = f"{letter}_{{%d}}" if latex and len(letter) == 1 else f"{letter}%d"
        self.defined: list[tuple[str, Node, sp.Expr]] = []
        for number, part in enumerate(chosen, 1):
            (expression,) = express(graph, [part], self.known)
            symbol = sp.Symbol(pattern % number)
            self.defined.append((symbol.name, part, expression))
            self.known[part] = symbol

    def express(self, node: Node) -> sp.Expr:
        """Return a node in terms of symbols and of the names given to parts."""
        (expression,) = express(self.graph, [node], self.known)
        return expression

    def size(self, outputs: Sequence[Node]) -> int:
        """Count the operations in the text of all parts and outputs."""
        written = [*(e for _, _, e in self.defined), *(self.express(n) for n in outputs)]
        return sum(int(sp.count_ops(e)) for e in written)


def written_size(graph: Graph, outputs: Iterable[Node], known: Iterable[Node] = ()) -> int:
    """Count the operations in the text of the longest of some expressions, each part as often as it stands there."""
    sizes: dict[Node, int] = {}
    outputs = list(outputs)
    leaves = set(known)
    for node in graph.reach(outputs, leaves):
        own = 0 if graph.op(node) in (ops.CONST, ops.SYMBOL) else 1
        sizes[node] = own + sum(sizes.get(a, 0) for a in graph.args(node))
    return max((sizes.get(n, 0) for n in outputs), default=0)


def _parts(graph: Graph, outputs: Sequence[Node], known: Mapping[Node, sp.Expr]) -> Iterator[Node]:
    """Yield what is worth a name, each after what it contains."""
    order = graph.reach(outputs, known)
    uses = Counter(a for node in order for a in graph.args(node))
    uses.update(outputs)
    written: dict[Node, int] = {}
    for node in order:
        code = graph.op(node)
        if code in (ops.CONST, ops.SYMBOL):
            written[node] = 0
            continue
        size = 1 + sum(written.get(a, 0) for a in graph.args(node))
        worth = uses[node] > 1 and (size > 1 or code not in _CHEAP)
        if (worth and code != ops.NEG) or size > LONGEST:
            yield node
            size = 0
        written[node] = size


_CHEAP = frozenset((ops.ADD, ops.SUB, ops.MUL, ops.NEG, ops.DIV))
"""A single one of these on symbols is as short as a name."""


def _letter(taken: Iterable[str]) -> str:
    beginnings = {name[:1] for name in taken}
    return next((letter for letter in LETTERS if letter not in beginnings), LETTERS[-1])

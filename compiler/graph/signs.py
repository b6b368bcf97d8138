"""Which sign a formula can have, as far as its structure shows it: squares, sizes, and odd functions of one thing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from . import operations as ops
from .node import Graph, Node
from .operation import Sign

_Factors = tuple[int, frozenset[Node]]
"""Sign of a product, and the factors of unknown sign that stand in it an odd number of times."""


def one_sign(
    graph: Graph, products: Sequence[tuple[Node, Node]], known: Mapping[Node, float], sign: int
) -> bool:
    """Tell whether each product of two formulas is seen to be zero or of the ``sign`` 1 or -1; no node is made for that.

    ``known``: numbers of symbols; zero counts as positive.
    """
    factors: dict[Node, _Factors] = {}
    for n in graph.reach([n for pair in products for n in pair]):
        factors[n] = _of(graph, n, known, factors)
    for pair in products:
        (a, first), (b, second) = (factors[n] for n in pair)
        if graph.zero not in pair and (a * b != sign or first != second):
            return False
    return True


def _of(graph: Graph, n: Node, known: Mapping[Node, float], factors: Mapping[Node, _Factors]) -> _Factors:
    """Return the factors of a formula, from those of its arguments."""
    arguments = [factors[a] for a in graph.args(n)]
    code = graph.op(n)
    match code:
        case ops.CONST:
            return (-1 if graph.value(n) < 0 else 1), frozenset()
        case ops.SYMBOL if n in known:
            return (-1 if known[n] < 0 else 1), frozenset()
        case ops.NEG:
            return -arguments[0][0], arguments[0][1]
        case ops.MUL | ops.DIV:
            (a, first), (b, second) = arguments
            return a * b, first ^ second
        case ops.SELECT if graph.zero in graph.args(n)[1:]:
            return arguments[1] if graph.args(n)[2] == graph.zero else arguments[2]
        case ops.ADD | ops.SELECT | ops.MINIMUM | ops.MAXIMUM:
            one, other = arguments[-2:]  # a condition has no say
            if one == other:
                return one
            if code == ops.MAXIMUM and (1, frozenset()) in arguments:
                return 1, frozenset()
            if code == ops.MINIMUM and (-1, frozenset()) in arguments:
                return -1, frozenset()
        case ops.SUB if arguments[0] == (-arguments[1][0], arguments[1][1]):
            return arguments[0]
        case ops.POW if arguments[0] == (1, frozenset()):
            return arguments[0]
        case _ if ops.OPERATIONS[code].sign is Sign.OF_ARGUMENT:
            return arguments[0]
        case _ if ops.OPERATIONS[code].sign is Sign.NEVER_NEGATIVE:
            return 1, frozenset()
    return 1, frozenset({n})

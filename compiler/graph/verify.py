"""What holds for every graph."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence

from ..malformed import Malformed, excerpt
from . import operations as ops
from .dependence import Node
from .field import HALF, P, hashed, of_fraction
from .interning import NONE
from .node import Graph, point_of
from .operations import (
    ADD,
    CONST,
    COS,
    DIV,
    LOOKUP,
    MUL,
    NEG,
    OPERATIONS,
    PARTIAL,
    SELECT,
    SIN,
    SINGULAR,
    SUB,
    SYMBOL,
)
from .table import answers

SYMMETRIC = frozenset({ADD, MUL, ops.MINIMUM, ops.MAXIMUM, ops.EQUAL, ops.AND, ops.OR})
"""Operations whose operands stand in ascending order, so that both orders are one node."""


FEW = 200
"""Nodes up to which columns take longer than one by one."""


def verify(graph: Graph) -> None:
    """Raise Malformed where a graph is not what interning.py says.

    Arguments are older than what is made of them, operations have their number of operands, and leaves what they
    stand for; values in the field are those of the operations; equal nodes are one but for the exceptions of interning.py.
    """
    _Check(graph).run()


def shown(graph: Graph, n: int) -> str:
    """Return one node as a line, whatever is wrong with it."""
    code = graph._code[n]
    if not 0 <= code < len(OPERATIONS):
        return f"%{n} = operation {code}"
    at = Node(n)
    words = [OPERATIONS[code].name]
    if code == CONST:
        words.append(str(graph._constants.get(at, "?")))
    elif code == SYMBOL:
        words.append(graph._names.get(at, "?"))
    elif code == LOOKUP:
        words.append(str(graph._lookups.get(at, "?")))
    return f"%{n} = {' '.join([*words, *(f'%{a}' for a in _operands(graph, n))])}"


def nearby(graph: Graph, n: int) -> list[str]:
    """Return a node, its operands and its neighbours as lines."""
    return excerpt(len(graph), n, lambda k: shown(graph, k), _operands(graph, n))


def way(graph: Graph, n: Node, symbol: Node) -> list[str]:
    """Return the nodes that lead from a node to a symbol in it as lines."""
    lines = [shown(graph, n)]
    while n != symbol:
        n = next(a for a in graph.args(n) if symbol in graph.support(a))
        lines.append(shown(graph, n))
    return lines


def _operands(graph: Graph, n: int) -> list[int]:
    third = graph._third.get(Node(n), NONE)
    return [a for a in (graph._left[n], graph._right[n], third) if a != NONE]


def _to_look_at(graph: Graph) -> Sequence[int]:
    """Return the nodes to look at one by one: leaves, and what is not plainly an operation whose operands are older, in order and as many
    as it takes, and whose traits are theirs."""
    if len(graph) <= FEW:
        return range(len(graph))
    import numpy as np

    at, codes = np.arange(len(graph)), np.array(graph._code)
    known = (codes >= 0) & (codes < len(OPERATIONS))
    safe = np.where(known, codes, CONST)
    third, has_third = np.full(len(graph), NONE), np.zeros(len(graph), bool)
    for n, last in graph._third.items():
        if 0 <= n < len(graph):
            third[n], has_third[n] = last, True
    operands = (np.array(graph._left), np.array(graph._right), third)
    there = [operand != NONE for operand in operands]
    older = [~a | ((operand >= 0) & (operand < at)) for a, operand in zip(there, operands, strict=True)]
    right = known & np.logical_and.reduce(older)
    right &= np.array([op.arity for op in OPERATIONS])[safe] == sum(a.astype(int) for a in there)
    right &= there[0] & (has_third == (codes == SELECT)) & ~np.isin(codes, (CONST, SYMBOL))
    right &= ~np.isin(codes, list(SYMMETRIC)) | (operands[0] <= operands[1])
    first = codes[np.where(right, operands[0], 0)]
    right &= (codes != NEG) | ~np.isin(first, (NEG, CONST))
    traits = np.frombuffer(bytes(graph._traits), np.uint8)
    expected = np.where(np.isin(codes, list(PARTIAL)), SINGULAR, 0)
    for a, operand in zip(there, operands, strict=True):
        expected |= np.where(right & a, traits[np.where(right & a, operand, 0)], 0)
    right &= (traits == expected) & np.isin(codes, list(graph._used))
    found: list[int] = np.flatnonzero(~right).tolist()
    return found


class _Check:
    def __init__(self, graph: Graph) -> None:
        self.graph = graph

    def run(self) -> None:
        graph = self.graph
        columns = (graph._left, graph._right, graph._values, graph._traits)
        if any(len(column) != len(graph) for column in columns):
            raise Malformed("graph", f"its columns have {len(graph)} and {[len(c) for c in columns]} rows")
        for n in _to_look_at(graph):
            self.operation(n)
            self.traits(n)
        self.leaves()
        self.fixed()
        self.unique()
        if graph.by_value:
            for n in self.of_other_value():
                self.fail(n, "has another value in the field than its operation gives")
            self.interned()
        self.indices()

    def fail(self, n: int, what: str) -> None:
        raise Malformed(f"graph, node {n}", what, nearby(self.graph, n))

    def operation(self, n: int) -> None:
        graph, operands = self.graph, _operands(self.graph, n)
        code = graph._code[n]
        if not 0 <= code < len(OPERATIONS):
            self.fail(n, f"there is no operation {code}")
        if not all(0 <= a < n for a in operands):
            self.fail(n, "reads a node that is not older")
        if len(operands) != OPERATIONS[code].arity or (graph._left[n] == NONE and operands):
            self.fail(
                n, f"has {len(operands)} operands, {OPERATIONS[code].name} takes {OPERATIONS[code].arity}"
            )
        if (Node(n) in graph._third) != (code == SELECT):
            self.fail(n, "has a third operand where its operation has none, or none where it has one")
        if code in SYMMETRIC and operands != sorted(operands):
            self.fail(n, f"has its operands in descending order, but {OPERATIONS[code].name} is symmetric")
        if code == NEG and graph._code[operands[0]] in (NEG, CONST):
            self.fail(n, "is minus a constant, or minus a negative")

    def traits(self, n: int) -> None:
        graph = self.graph
        traits = graph._traits
        expected = SINGULAR if graph._code[n] in PARTIAL else 0
        for a in _operands(graph, n):
            expected |= traits[a]
        if (traits[n] ^ expected) & SINGULAR:
            self.fail(
                n,
                f"{'has' if expected & SINGULAR else 'has no'} states in which it is undefined, but says otherwise",
            )
        kinds = traits[n] & ~SINGULAR
        if graph._code[n] == SYMBOL:
            if kinds == 0 or kinds & (kinds - 1):
                self.fail(n, "is a symbol of no kind, or of several")
        elif kinds != expected & ~SINGULAR:
            self.fail(n, "says that it depends on other kinds of symbols than its operands do")
        if graph._code[n] not in graph._used:
            self.fail(n, "has an operation that the graph does not know of")

    def leaves(self) -> None:
        """Leaves have what they stand for, and nothing else has."""
        graph = self.graph
        for code, known, what in (
            (CONST, graph._constants, "a value"),
            (SYMBOL, graph._names, "a name"),
            (LOOKUP, graph._lookups, "a table"),
        ):
            wrong = known.keys() ^ {n for n, c in enumerate(graph._code) if c == code}
            if wrong:
                self.fail(
                    min(*wrong, len(graph) - 1),
                    f"lacks {what}, or has {what} that its operation has no place for",
                )
        for n, (table, order) in graph._lookups.items():
            if not 0 <= table < len(graph.tables) or not answers(graph.tables[table], order):
                self.fail(n, f"asks question {order} of table {table} of {len(graph.tables)}")

    def fixed(self) -> None:
        graph = self.graph
        stated = (graph.zero, graph.one, graph.minus_one, graph.two, graph.half)
        values = [graph._constants.get(n) for n in stated]
        if stated != (0, 1, 2, 3, 4) or [v and float(v) for v in values] != [0, 1, -1, 2, 0.5]:
            raise Malformed("graph", f"the first nodes are not 0, 1, -1, 2, 1/2 but {values}")

    def unique(self) -> None:
        """Names, constants and tables are there once; without values, operations too."""
        graph = self.graph
        for what, values in (("symbol", graph._names.values()), ("constant", graph._constants.values())):
            ((value, count),) = Counter(values).most_common(1) or [("", 0)]
            if count > 1:
                known = graph._names if what == "symbol" else graph._constants
                self.fail(max(n for n, v in known.items() if v == value), f"{what} {value} exists twice")
        if len(set(graph.tables)) != len(graph.tables):
            raise Malformed("graph", "a table exists twice")
        seen: dict[object, int] = {}
        for n in range(len(graph)):
            if graph._code[n] > SYMBOL and (not graph.by_value or graph._code[n] == NEG):
                first = seen.setdefault(self.key(n), n)
                if first != n:
                    self.fail(n, f"is node {first} once more")

    def key(self, n: int) -> object:
        return self.graph._code[n], *_operands(self.graph, n), self.graph._lookups.get(Node(n))

    def of_other_value(self) -> Iterator[int]:
        """Yield the nodes whose values in the field are not those of their operations."""
        graph, values = self.graph, self.graph._values
        for n, (code, a, b, v) in enumerate(zip(graph._code, graph._left, graph._right, values, strict=True)):
            if code == MUL:
                right = v == values[a] * values[b] % P
            elif code == ADD:
                right = v == (values[a] + values[b]) % P
            elif code == SUB:
                right = v == (values[a] - values[b]) % P
            elif code == NEG:
                right = v == -values[a] % P
            elif code == DIV:
                right = v * values[b] % P == values[a]
            elif code == CONST:
                right = v == of_fraction(graph._constants[Node(n)])
            elif code == SYMBOL:
                right = v == hashed("symbol", graph._names[Node(n)], graph.seed)
            elif code in (COS, SIN):
                right = v == point_of(graph, a)[code == SIN]
            else:
                operands = [values[k] for k in _operands(graph, n)]
                right = v == hashed(
                    OPERATIONS[code].name, operands, graph._lookups.get(Node(n), ()), graph.seed
                )
            if not right:
                yield n

    def interned(self) -> None:
        """A further node of one value is there only where the one before may not stand for it."""
        graph = self.graph
        last: dict[int, Node] = {}
        for n in map(Node, range(len(graph))):
            code, v = graph._code[n], graph._values[n]
            if code == NEG:
                continue
            key = v if v <= HALF else P - v
            found = last.get(key)
            if found is not None and code > SYMBOL and graph._may_stand(found, code, *self.pair(n)):
                self.fail(n, f"has the value of node {found} ({shown(graph, found)}), which may stand for it")
            if found is None or graph._code[found] != CONST:
                last[key] = n

    def pair(self, n: Node) -> tuple[Node, Node]:
        return self.graph._left[n], self.graph._right[n]

    def indices(self) -> None:
        """What finds nodes by name, value or structure finds what it says."""
        for what, wrong in self.lost():
            raise Malformed("graph", f"{what} leads to another node", nearby(self.graph, wrong))

    def lost(self) -> Iterator[tuple[str, int]]:
        graph = self.graph
        count = len(graph)
        for name, n in graph._symbols.items():
            if graph._names.get(n) != name:
                yield f"the name {name}", min(n, count - 1)
        if len(graph._symbols) != len(graph._names):
            yield "no name", next(n for n in graph._names if graph._symbols.get(graph._names[n]) != n)
        for key, n in graph._classes.items():
            if not n < count or key not in (graph._values[n], P - graph._values[n]):
                yield f"the value {key}", min(n, count - 1)
        for a, n in graph._negatives.items():
            if not n < count or not (graph._code[n] in (NEG, SUB) and a < count):
                yield f"the negative of node {a}", min(n, count - 1)
        for cached, n in graph._cache.items():
            if not n < count:
                yield f"what was made of {cached}", count - 1

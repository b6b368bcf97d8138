"""A graph as columns of numbers: how it is written and read."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction

from msgspec import Struct

from .dependence import Node
from .field import HALF, P
from .interning import NONE
from .node import Graph
from .operations import CONST, LOOKUP, NEG, OTHER, PARTIAL, SELECT, SINGULAR, SYMBOL
from .table import Samples, Table

_BYTES = 16
"""Of a value in the field."""


class GraphColumns(Struct, frozen=True, array_like=True):
    """One row for each node, ascending; arguments are numbers of rows, -1 for none.

    ``third`` holds the last argument of each SELECT, ``names``, ``constants`` and ``lookups`` what the leaves and
    look-ups stand for, each in the order of their rows. ``values`` are those in the field, 16 bytes each.
    """

    by_value: bool
    seed: int
    codes: bytes
    left: tuple[int, ...]
    right: tuple[int, ...]
    third: tuple[int, ...]
    names: tuple[str, ...]
    constants: tuple[Fraction, ...]
    lookups: tuple[tuple[int, int], ...]
    tables: tuple[Table | Samples, ...]
    values: bytes


def columns(graph: Graph, outputs: Iterable[Node]) -> tuple[GraphColumns, dict[Node, int]]:
    """Return what outputs depend on, and the row of each node."""
    kept = graph.reach([*outputs, graph.zero, graph.one, graph.minus_one, graph.two, graph.half])
    row: dict[Node, int] = {n: k for k, n in enumerate(kept)}
    row[NONE] = -1
    code = graph._code
    made = GraphColumns(
        graph.by_value,
        graph.seed,
        bytes(code[n] for n in kept),
        tuple([row[graph._left[n]] for n in kept]),
        tuple([row[graph._right[n]] for n in kept]),
        tuple([row[graph._third[n]] for n in kept if code[n] == SELECT]),
        tuple([graph.name(n) for n in kept if code[n] == SYMBOL]),
        tuple([graph.value(n) for n in kept if code[n] == CONST]),
        tuple([graph.table_of(n) for n in kept if code[n] == LOOKUP]),
        tuple(graph.tables),
        b"".join([graph._values[n].to_bytes(_BYTES, "little") for n in kept]) if graph.by_value else b"",
    )
    del row[NONE]
    return made, row


def graph_of(made: GraphColumns) -> Graph:
    """Return the graph, in which expressions can be built as in the one that was written."""
    graph = Graph(by_value=made.by_value, seed=made.seed)
    codes, left, right, raw = made.codes, made.left, made.right, made.values
    rows = range(len(codes))
    of = {code: [Node(n) for n in rows if codes[n] == code] for code in (CONST, SYMBOL, NEG, SELECT, LOOKUP)}
    graph.tables = list(made.tables)
    graph._code = list(codes)
    graph._left, graph._right = [*map(Node, left)], [*map(Node, right)]
    starts = range(0, len(raw), _BYTES)
    graph._values = [int.from_bytes(raw[k : k + _BYTES], "little") for k in starts] or [0] * len(codes)
    graph._third = dict(zip(of[SELECT], map(Node, made.third), strict=True))
    graph._names = dict(zip(of[SYMBOL], made.names, strict=True))
    graph._constants = dict(zip(of[CONST], made.constants, strict=True))
    graph._lookups = dict(zip(of[LOOKUP], made.lookups, strict=True))
    graph._traits, graph._used = _traits(graph), set(codes) | graph._used
    graph._symbols = {name: n for n, name in graph._names.items()}
    graph._negatives = {Node(left[n]): n for n in of[NEG]}
    graph._cache = {("constant", c.numerator, c.denominator): n for n, c in graph._constants.items()}
    graph._classes = _classes(graph, of[CONST]) if made.by_value else {}
    graph._cache |= _structures(graph, of[SELECT] if made.by_value else rows)
    return graph


def _traits(graph: Graph) -> bytearray:
    """Return the traits of all nodes (interning.py); the kinds of symbols are not kept."""
    traits = bytearray()
    third = graph._third
    for n, (code, a, b) in enumerate(zip(graph._code, graph._left, graph._right, strict=True)):
        own = SINGULAR if code in PARTIAL else OTHER if code == SYMBOL else 0
        if a >= 0:
            own |= traits[a]
        if b >= 0:
            own |= traits[b]
        traits.append(own | traits[third[Node(n)]] if code == SELECT else own)
    return traits


def _classes(graph: Graph, constants: list[Node]) -> dict[int, Node]:
    """Return what represents each value: a constant, else the last form (interning.py)."""
    code = graph._code
    last = {v if v <= HALF else P - v: Node(n) for n, v in enumerate(graph._values) if code[n] != NEG}
    values = graph._values
    for n in reversed(constants):
        v = values[n]
        last[v if v <= HALF else P - v] = n
    return last


def _structures(graph: Graph, rows: Iterable[int]) -> dict[tuple[object, ...], Node]:
    """Return what finds operations under the keys of ``_structural`` and ``_opaque``.

    That is all of them where there are no values in the field, and choices, which values alone do not find: whether
    their last argument is partial is known only once they are there.
    """
    found: dict[tuple[object, ...], Node] = {}
    for n in map(Node, rows):
        code, a, b = graph._code[n], graph._left[n], graph._right[n]
        found[code, a, b] = n
        found[code, a, b, graph._third.get(n, NONE), graph._lookups.get(n, ())] = n
    return found

"""The bodies of long functions, made of the graph in columns: the same statements as those of lower.py."""

from __future__ import annotations

from array import array
from collections.abc import Mapping, Sequence
from fractions import Fraction
from operator import itemgetter

import numpy as np
from numpy.typing import NDArray

from ..equations.model import Slot
from ..graph import Graph, Node
from ..graph.operations import CONST, LOOKUP, SELECT, SYMBOL
from .model import ARRAYS, LITERAL, LOAD, STORE, LongBody, Value

Numbers = NDArray[np.int32]


def long_body(
    graph: Graph,
    layout: Mapping[Node, Slot],
    stores: Sequence[tuple[str, int, Node, bool]],
    constants: Mapping[Node, int],
    order: Sequence[Node],
    *,
    in_order: bool,
) -> tuple[LongBody, Sequence[int]]:
    """Return the statements that compute the nodes of ``order``, with the stores as soon as each is known, or in their order; and
    the node of each of them."""
    nodes = np.array(order, np.int32)
    position = np.full(len(graph), -1, np.int32)
    position[nodes] = np.arange(len(nodes), dtype=np.int32)
    wanted = position[[n for _, _, n, _ in stores]]
    sorting = np.arange(len(stores)) if in_order else np.argsort(wanted, kind="stable")
    behind = np.maximum.accumulate(wanted[sorting])  # the place in ``order`` that a store follows
    nodes = nodes[: behind[-1] + 1]
    places = np.arange(len(nodes)) + np.searchsorted(behind, np.arange(len(nodes)))
    kept = behind + 1 + np.arange(len(stores))
    position[nodes] = places

    kinds, *operands = _columns(graph, nodes.tolist(), constants, layout)
    numbers = [graph.value(n) for n in nodes[kinds == LITERAL].tolist()]
    operands[0][kinds == LITERAL] = np.arange(len(numbers))
    read = kinds >= 0
    for k, column in enumerate(operands):
        chosen = read & (column >= 0) & ((kinds != LOOKUP) | (k == 0))
        column[chosen] = position[column[chosen]]

    size = len(nodes) + len(stores)
    all_kinds, columns = np.full(size, STORE, np.int8), [np.full(size, -1, np.int32) for _ in operands]
    all_kinds[places] = kinds
    for column, own in zip(columns, operands, strict=True):
        column[places] = own
    columns[0][kept] = position[[n for _, _, n, _ in stores]][sorting]
    columns[1][kept] = np.array([index for _, index, _, _ in stores], np.int32)[sorting]
    flags = [2 * ARRAYS.index(name) + guarded for name, _, _, guarded in stores]
    columns[2][kept] = np.array(flags, np.int32)[sorting]
    of_all = np.full(size, -1, np.int32)
    of_all[places] = nodes
    return _body(all_kinds, columns, numbers), array("i", of_all.tobytes())


def _columns(
    graph: Graph, nodes: Sequence[Node], constants: Mapping[Node, int], layout: Mapping[Node, Slot]
) -> tuple[NDArray[np.int8], Numbers, Numbers, Numbers]:
    """Return kinds, and columns that still hold the nodes of operands."""
    kinds = np.array(bytearray(_picked(graph._code, nodes)), np.int8)
    first, second = (
        np.array(array("i", _picked(column, nodes)), np.int32) for column in (graph._left, graph._right)
    )
    third = np.full(len(nodes), -1, np.int32)
    kinds[kinds == CONST] = LITERAL
    for k in np.flatnonzero(kinds == SYMBOL).tolist():
        slot = layout[nodes[k]] if nodes[k] not in constants else Slot("p", constants[nodes[k]])
        kinds[k], first[k], second[k] = LOAD, ARRAYS.index(slot.array), slot.index
    for k in np.flatnonzero(kinds == SELECT).tolist():
        third[k] = graph.args(nodes[k])[2]
    for k in np.flatnonzero(kinds == LOOKUP).tolist():
        second[k], third[k] = graph.table_of(nodes[k])
    if constants:
        given = np.zeros(len(graph), np.int32)
        given[list(constants)] = np.fromiter(constants.values(), np.int32) + 1
        places = given[np.array(nodes)]
        hoisted = places > 0
        kinds[hoisted], first[hoisted], second[hoisted] = LOAD, ARRAYS.index("p"), places[hoisted] - 1
        third[hoisted] = -1
    return kinds, first, second, third


def _picked(column: Sequence[int], nodes: Sequence[Node]) -> Sequence[int]:
    return itemgetter(*nodes)(column) if len(nodes) > 1 else [column[n] for n in nodes]


def _body(kinds: NDArray[np.int8], columns: Sequence[Numbers], numbers: Sequence[Fraction]) -> LongBody:
    first, second, third = (array("i", column.tobytes()) for column in columns)
    return LongBody(array("b", kinds.tobytes()), first, second, third, tuple(numbers))


def made_order(body: LongBody, nodes: Sequence[int]) -> Sequence[Value]:
    """Return the operations in the order of their nodes, each followed by its stores; those of leaves come last. What comes
    before a guarded store stays there: others read the parameter that it completes."""
    kinds, first, third = (np.array(column) for column in (body.kinds, body.first, body.third))
    position = np.arange(len(kinds))
    rank = np.array(nodes)
    behind = rank.max() + 1
    stores = kinds == STORE
    guarded = np.flatnonzero(stores & (third & 1 == 1))
    fixed = int(guarded[-1]) + 1 if guarded.size else 0
    stored = first[stores]
    of_leaf = (kinds[stored] < 0) | (stored < fixed)
    rank[stores] = np.where(of_leaf, behind, rank[stored])
    within = np.where(stores, position, -1)
    rank[:fixed], within[:fixed] = -1, position[:fixed]
    done = np.flatnonzero((kinds >= 0) | stores)
    order = done[np.lexsort((within[done], rank[done]))]
    return array("i", order.astype(np.int32).tobytes())

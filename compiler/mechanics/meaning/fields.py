"""Derivatives of fields by place, in cartesian coordinates: gradient, divergence, curl, Laplacian."""

from __future__ import annotations

from collections.abc import Sequence

from ...graph import Graph, Node
from ...graph.differentiate import jvp
from ...graph.rewrite import substitute
from .values import Value, each, elements, node


def derivative_of_field(graph: Graph, operator: str, field: Value, symbols: Value, place: Value) -> Value:
    """Return the derivative of ``field``, a formula of ``symbols``, where these have the values of ``place``."""
    by = tuple(elements(symbols))
    if operator == "laplacian":
        first = [slopes(graph, field, [s])[0] for s in by]
        seconds = [slopes(graph, slope, [s])[0] for slope, s in zip(first, by, strict=True)]
        result = _sum(graph, seconds)
    else:
        result = _OPERATORS[operator](graph, slopes(graph, field, by), isinstance(symbols, int))
    at = dict(zip(by, elements(place), strict=True))
    return each(lambda n: substitute(graph, [n], at)[0], result)


def slopes(graph: Graph, field: Value, by: Sequence[Node]) -> list[Value]:
    """Return the partial derivatives of a field by each of some symbols."""
    numbers = list(elements(field))
    found: list[Value] = []
    for symbol in by:
        slope = dict(zip(numbers, jvp(graph, numbers, {symbol: graph.one}), strict=True))
        found.append(each(slope.__getitem__, field))
    return found


def _sum(graph: Graph, values: Sequence[Value]) -> Value:
    result = values[0]
    for value in values[1:]:
        result = each(graph.add, result, value)
    return result


def _gradient(graph: Graph, partial: list[Value], single: bool) -> Value:
    """The index of the place comes last."""
    if single:
        return partial[0]
    return _joined(partial)


def _joined(partial: Sequence[Value]) -> Value:
    if not isinstance(partial[0], tuple):
        return tuple(partial)
    return tuple(_joined([_part(p, i) for p in partial]) for i in range(len(partial[0])))


def _part(value: Value, index: int) -> Value:
    assert isinstance(value, tuple)
    return value[index]


def _divergence(graph: Graph, partial: list[Value], single: bool) -> Value:
    """Contract the last index of the field with that of the place: div(F)[i] is the sum of dF[i, j]/dr[j]."""
    first = partial[0]
    assert isinstance(first, tuple)
    if not isinstance(first[0], tuple):
        return _sum(graph, [_part(p, j) for j, p in enumerate(partial)])
    return tuple(_divergence(graph, [_part(p, i) for p in partial], single) for i in range(len(first)))


def _curl(graph: Graph, partial: list[Value], single: bool) -> Value:
    def turn(j: int, k: int) -> Node:
        return graph.sub(node(_part(partial[j], k)), node(_part(partial[k], j)))

    if len(partial) == 2:
        return turn(0, 1)
    return turn(1, 2), turn(2, 0), turn(0, 1)


_OPERATORS = {"grad": _gradient, "div": _divergence, "curl": _curl}

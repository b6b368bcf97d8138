"""Initial values as formulas of parameters: what is stated, what is guessed, what is left at zero."""

from __future__ import annotations

from typing import TypedDict

from ..flat.model import FlatModel, StartValue, Variable
from ..graph import Graph, Node
from .lower import Lowering
from .symbols import Symbols, subscripts
from .system import Beginning
from .values import Placement, elements, quaternion_of


class Beginnings(TypedDict):
    start_q: tuple[Beginning, ...]
    start_v: tuple[Beginning, ...]
    start_x: tuple[Beginning, ...]


def beginnings(lowering: Lowering, model: FlatModel, symbols: Symbols) -> Beginnings:
    """Return the initial value of each coordinate, velocity and state; unspecified ones are guessed zero."""
    q: list[Beginning] = []
    v: list[Beginning] = []
    for coordinate in symbols.coordinates:
        variable = coordinate.variable
        if coordinate.is_rotation:
            q += _rotation(lowering, variable)
            v += _whole(lowering, variable.rate, [(k,) for k in range(3)], variable.rates)
        else:
            places = subscripts(variable.type.shape)
            q += _whole(lowering, variable.start, places, variable.starts)
            v += _whole(lowering, variable.rate, places, variable.rates)
    states: dict[str, Variable] = {s.variable.name: s.variable for s in symbols.states}
    x: list[Beginning] = []
    for variable in states.values():
        x += _whole(lowering, variable.start, subscripts(variable.type.shape), variable.starts)
    return Beginnings(start_q=tuple(q), start_v=tuple(v), start_x=tuple(x))


def _whole(
    lowering: Lowering,
    start: StartValue | None,
    places: list[tuple[int, ...]],
    single: object,
) -> list[Beginning]:
    zero = lowering.graph.constant(0)
    result = [Beginning(zero, False, None)] * len(places)
    if start is not None:
        values = lowering.numbers(start.value)
        values = values * len(places) if len(values) == 1 else values
        result = [Beginning(n, not start.guess, start) for n in values]
    assert hasattr(single, "items")
    for indices, one in single.items():
        values = lowering.numbers(one.value)
        covered = [k for k, place in enumerate(places) if place[: len(indices)] == indices]
        values = values * len(covered) if len(values) == 1 else values
        for k, n in zip(covered, values, strict=True):
            result[k] = Beginning(n, not one.guess, one)
    return result


def _rotation(lowering: Lowering, variable: Variable) -> list[Beginning]:
    graph = lowering.graph
    start = variable.start
    if start is None:
        return [Beginning(graph.constant(x), False, None) for x in (1, 0, 0, 0)]
    return [Beginning(n, not start.guess, start) for n in rotation_quaternion(graph, lowering, start)]


def rotation_quaternion(graph: Graph, lowering: Lowering, start: StartValue) -> tuple[Node, ...]:
    """Return the unit quaternion of a rotation given as a pose, or as four numbers (normalised)."""
    value = lowering.value(start.value)
    if isinstance(value, Placement):
        return quaternion_of(graph, value.pose)
    q = tuple(elements(value))
    square = graph.constant(0)
    for x in q:
        square = graph.add(square, graph.mul(x, x))
    size = graph.sqrt(square)
    return tuple(graph.div(x, size) for x in q)

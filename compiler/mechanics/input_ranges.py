"""Ranges that inputs state: ``min`` and ``max`` hold while a motion runs, whatever gives the values."""

from __future__ import annotations

from collections.abc import Iterator

from mechc.lang.units import unit_of

from ..flat.model import Attributes, Definition, DefinitionRole, FlatModel, Origin, Type
from ..flat.subscripts import element_name, subscripts
from ..graph import Graph, Node
from .meaning.lower import Lowering
from .meaning.symbols import Symbols
from .system import AssertionRow

SLACK = 1e-9
"""Of the larger end of a range: what units and the fit of a function round."""


def ranges(lowering: Lowering, model: FlatModel, symbols: Symbols) -> Iterator[AssertionRow]:
    """Yield what must hold of inputs, free ones and those that are bound to expressions, and of abbreviations."""
    for s in symbols.inputs:
        v = s.variable
        yield from _within(lowering.graph, "input", s.of, v.type, v.attributes, s.node, v.origin)
    for d in model.definitions:
        if d.role is DefinitionRole.LET and d.value is not None and _states(d.attributes):
            yield from _of_definition(lowering, d)


def _of_definition(lowering: Lowering, d: Definition) -> Iterator[AssertionRow]:
    assert d.value is not None
    for index, n in zip(subscripts(d.type.shape), lowering.reported(d.value), strict=True):
        name = element_name(d.name, index)
        yield from _within(lowering.graph, "value of", name, d.type, d.attributes, n, d.origin)


def _states(attributes: Attributes) -> bool:
    return attributes.minimum is not None or attributes.maximum is not None


def _within(
    graph: Graph, what: str, name: str, type: Type, attributes: Attributes, n: Node, origin: Origin
) -> Iterator[AssertionRow]:
    low, high = attributes.minimum, attributes.maximum
    slack = SLACK * max(abs(low or 0.0), abs(high or 0.0), attributes.nominal or 0.0)
    unit = unit_of(type.dimension, type.angle, attributes.display)
    if low is not None:
        holds = graph.less_equal(graph.constant(low - slack), n)
        yield AssertionRow(holds, f"the {what} '{name}' is below its minimum {low:g} {unit}".rstrip(), origin)
    if high is not None:
        holds = graph.less_equal(n, graph.constant(high + slack))
        yield AssertionRow(
            holds, f"the {what} '{name}' is above its maximum {high:g} {unit}".rstrip(), origin
        )

"""Inputs that drive: their first and second derivatives are inputs as well, which follow from the same table."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from msgspec.structs import replace

from ..flat import types
from ..flat.model import Attributes, Literal, Role, Variable
from ..graph import Graph, Node
from .kinematics.rates import TotalDerivative
from .meaning.symbols import Scalar, Symbols
from .system import DriveRow

SMOOTH = "spline"
"""The interpolation whose table has a continuous second derivative."""


def can_drive(scalar: Scalar) -> bool:
    """Tell whether an input has the derivatives that a drive needs."""
    return scalar.variable.attributes.options.get("interpolation") == SMOOTH


def with_rates(
    graph: Graph, rate: TotalDerivative, symbols: Symbols, drives: Sequence[DriveRow]
) -> tuple[Symbols, frozenset[Node]]:
    """Return the symbols with the derivatives of inputs that drive, and the nodes of these."""
    used = set(graph.support(*(n for row in drives for n in (*row.values, *row.rates))))
    driving = [s for s in symbols.inputs if s.node in used]
    if not driving:
        return symbols, frozenset()
    added = []
    for s in driving:
        first = rate(s.node)
        added.append(_derivative(s, first, SMOOTH))
        added.append(_derivative(added[-1], rate(first), "linear"))
    inputs = (*symbols.inputs, *added)
    return replace(symbols, inputs=inputs), frozenset(s.node for s in added)


def _derivative(scalar: Scalar, node: Node, interpolation: str) -> Scalar:
    """Return the derivative of an input as an input, zero unless a table says otherwise."""
    variable = scalar.variable
    kind = types.real(variable.type.dimension / types.TIME, angle=variable.type.angle)
    name = f"der({scalar.name})"
    declared = Variable(
        name,
        Role.INPUT,
        kind,
        variable.origin,
        Literal(span=variable.origin.span, type=kind, value=Fraction(0)),
        attributes=Attributes(options={"interpolation": interpolation}),
        doc=variable.doc,
    )
    return Scalar(node, name, declared, ())

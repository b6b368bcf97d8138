"""Inputs that drive: their first and second derivatives are inputs as well, which follow from the same table."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from fractions import Fraction

from msgspec.structs import replace

from ..flat import types
from ..flat.model import Attributes, Literal, Role, Variable
from ..graph import Graph, Node
from ..graph.differentiate import jvp
from .kinematics.rates import TotalDerivative
from .meaning.symbols import Scalar, Symbols
from .system import DriveRow, MechanicalSystem

SMOOTH = "spline"
"""The interpolation whose table has a continuous second derivative."""


def can_drive(scalar: Scalar) -> bool:
    """Tell whether an input has the derivatives that a drive needs."""
    return scalar.variable.attributes.options.get("interpolation") == SMOOTH


def steady_inputs(system: MechanicalSystem, formulas: Sequence[Node]) -> dict[Node, Node]:
    """Return zero for the rates of inputs whose default is a constant, if formulas or constraints need them: these stay as they are."""
    graph = system.graph
    fixed = {s.node for s in system.symbols.parameters}
    residuals = [n for rows in system.constraints for n in rows.residuals]
    held = [
        system.rate(c if rows.level == "velocity" else system.rate(c))
        for rows in system.constraints
        for c in rows.residuals
    ]
    found: dict[Node, Node] = {}
    for s in system.symbols.inputs:
        if s.variable.value is None or can_drive(s):
            continue
        if not fixed.issuperset(graph.support(*system.lowering.numbers(s.variable.value))):
            continue
        rates = (system.rate(s.node), system.rate(system.rate(s.node)))
        needed = graph.reached_among(formulas, rates) or graph.reached_among(residuals, (s.node, *rates))
        if needed or _depend(graph, held, rates):  # states that follow it may stand in constraints
            found |= dict.fromkeys(rates, graph.zero)
    return found


def _depend(graph: Graph, formulas: Sequence[Node], symbols: Sequence[Node]) -> bool:
    """Tell whether formulas depend on one of some symbols, which do not cancel."""
    return any(
        not all(map(graph.is_zero, jvp(graph, formulas, {n: graph.one})))
        for n in graph.reached_among(formulas, symbols)
    )


def held_inputs(system: MechanicalSystem, steady: Collection[Node]) -> tuple[int, ...]:
    """Return the inputs of which such a rate is zero."""
    return tuple(
        k
        for k, s in enumerate(system.symbols.inputs)
        if not can_drive(s) and {system.rate(s.node), system.rate(system.rate(s.node))} & set(steady)
    )


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

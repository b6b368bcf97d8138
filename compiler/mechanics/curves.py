"""What a model of a curve says: its range, what is stationary, and the conditions at ends, along it, and on the whole."""

from __future__ import annotations

from collections.abc import Sequence

from msgspec.structs import replace

from mechc.lang.units import DIMENSIONLESS, Dimension, preferred_unit

from ..flat.model import Derivative, Element, End, Expression, FlatModel, Name, Origin, Query, Variation
from ..flat.show import text
from ..graph import Node
from .energies import kinetic_energy, potential_energy
from .matter import Matter
from .meaning.lower import Lowering
from .meaning.symbols import Scalar, Symbols
from .system import Curve, CurveRows, WholeNumber

WHOLE = ("integral", "at")
"""Questions that are numbers of the whole curve."""

ACTION = "?action"


def curve_of(
    lowering: Lowering, model: FlatModel, variation: Variation, symbols: Symbols, matter: Matter
) -> Curve:
    """Return what a model says of its curve, but for the numbers that are asked for (``finished``)."""
    questions = lowering.questions
    action = variation.functional is None
    settled = questions.answer

    def answer(query: Query) -> Sequence[Node] | None:
        """Answer what energies decide where there are any; momenta follow from the whole, later."""
        return settled(query) if action and query.function not in ("momentum", "multiplier") else None

    questions.answer = answer
    first = {c.variable.name: c.q[0] for c in symbols.coordinates}
    unknown = tuple(first[name] for name in variation.unknown)
    if variation.functional is not None:
        functional = lowering.scalar(variation.functional)
        unit = _unit(variation.functional.type.dimension)
    else:
        functional, unit = lowering.graph.symbol(ACTION), "" if model.dimensionless else "J.s"
    rows = [_end(lowering, e) for e in variation.ends]
    rows += _constraints(lowering, model, symbols, unknown)
    return Curve(
        lower=lowering.scalar(variation.lower),
        upper=lowering.scalar(variation.upper),
        unknown=unknown,
        functional=functional,
        action=action,
        unit=unit,
        numbers=(_action(lowering, matter, variation, unit),) if action else (),
        rows=tuple(rows),
        origin=variation.origin,
    )


def finished(lowering: Lowering, curve: Curve) -> Curve:
    """Return a curve with every number of the whole that anything in the model asks for."""
    found: dict[Node, WholeNumber] = {n.symbol: n for n in curve.numbers}
    while waiting := [
        n for n, q in lowering.questions.asked.items() if n not in found and q.function in WHOLE
    ]:
        for symbol in waiting:
            query = lowering.questions.asked[symbol]
            found[symbol] = _number(lowering, symbol, query)
    return replace(curve, numbers=tuple(found.values()))


def _number(lowering: Lowering, symbol: Node, query: Query) -> WholeNumber:
    body = query.arguments[0]
    values = lowering.numbers(body)
    siblings = [n for n, q in lowering.questions.asked.items() if q is query]
    node = values[siblings.index(symbol)]
    name = " ".join(query.span.text.split())
    if len(siblings) > 1:
        name += f"[{siblings.index(symbol) + 1}]"
    place = None if query.function == "integral" else lowering.scalar(query.arguments[1])
    return WholeNumber(symbol, name, node, place, _unit(query.type.dimension), Origin(query.span))


def _action(lowering: Lowering, matter: Matter, variation: Variation, unit: str) -> WholeNumber:
    """Return the integral of L = T - V, and of further terms of it."""
    graph = lowering.graph
    kinetic, potential, further, _ = matter.energies()
    difference = graph.sub(kinetic_energy(matter, kinetic), potential_energy(matter, potential))
    lagrangian = graph.add(difference, further)
    return WholeNumber(graph.symbol(ACTION), "action", lagrangian, None, unit, variation.origin)


def _end(lowering: Lowering, end: End) -> CurveRows:
    residuals = _differences(lowering, end.target, end.value)
    name = _end_text(end.target)
    word = "final" if end.upper else "initial"
    units = (_unit(end.target.type.dimension),) * len(residuals)
    return CurveRows(f"{word} {name}", residuals, False, False, end.upper, units, end.origin)


def _end_text(target: Expression) -> str:
    """Return what an end is about as it is shown: with the components that it stands in, or as it is written."""
    inner = target.operand if isinstance(target, Derivative) else target
    base = inner.base if isinstance(inner, Element) else inner
    return text(target) if isinstance(base, Name) else " ".join(target.span.text.split())


def _constraints(
    lowering: Lowering, model: FlatModel, symbols: Symbols, unknown: Sequence[Scalar]
) -> list[CurveRows]:
    rows = []
    moving = {symbols.time, *symbols.positions, *symbols.velocities, *symbols.accelerations}
    moving -= {s.node for s in unknown}
    for constraint in model.constraints:
        residuals = _differences(lowering, constraint.left, constraint.right)
        along = bool(moving.intersection(lowering.graph.support(*residuals)))
        bound = constraint.asserted == "inequality"
        units = (_unit(constraint.left.type.dimension),) * len(residuals)
        rows.append(CurveRows(constraint.name, residuals, bound, along, None, units, constraint.origin))
    return rows


def _differences(lowering: Lowering, left: Expression, right: Expression) -> tuple[Node, ...]:
    graph = lowering.graph
    a, b = lowering.numbers(left), lowering.numbers(right)
    b = b * len(a) if len(b) == 1 else b
    return tuple(graph.sub(x, y) for x, y in zip(a, b, strict=True))


def _unit(dimension: Dimension) -> str:
    return "" if dimension == DIMENSIONLESS else preferred_unit(dimension, False)

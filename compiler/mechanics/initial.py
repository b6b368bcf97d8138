"""Initial values as formulas of parameters: what is stated, what is guessed, what is left at zero."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypedDict

from msgspec.structs import replace

from mechc.lang.diagnostics import Reporter
from mechc.lang.units import DIMENSIONLESS, parse_unit

from ..flat.model import FlatModel, Kind, Role, StartValue, Variable
from ..flat.subscripts import element_name, subscripts
from ..graph import DivisionByZero, Graph, Node
from ..graph.rewrite import substitute
from .meaning.lower import Lowering
from .meaning.symbols import Symbols, base_unit, rate_name, unit_text
from .meaning.values import elements
from .system import InitialRow, InitialValue


class InitialValues(TypedDict):
    start_q: tuple[InitialValue, ...]
    start_v: tuple[InitialValue, ...]
    start_x: tuple[InitialValue, ...]
    initials: tuple[InitialRow, ...]


def initial_values(
    lowering: Lowering, model: FlatModel, symbols: Symbols, reporter: Reporter
) -> InitialValues:
    """Return the initial value of each coordinate, velocity and state; unspecified ones are guessed zero.

    Initial values may be given by those of others; a circle of such values is reported.
    """
    q: list[InitialValue] = []
    v: list[InitialValue] = []
    for coordinate in symbols.coordinates:
        variable = coordinate.variable
        if coordinate.is_rotation:
            q += _rotation(lowering, variable)
            v += _starts(lowering, variable.rate, [(k,) for k in range(3)], variable.rates)
        else:
            places = subscripts(variable.type.shape)
            q += _starts(lowering, variable.start, places, variable.starts)
            v += _starts(lowering, variable.rate, places, variable.rates)
    states: dict[str, Variable] = {s.variable.name: s.variable for s in symbols.states}
    x: list[InitialValue] = []
    for variable in states.values():
        x += _starts(lowering, variable.start, subscripts(variable.type.shape), variable.starts)
    nodes = [s.node for c in symbols.coordinates for s in c.q]
    nodes += [s.node for c in symbols.coordinates for s in c.v]
    nodes += [s.node for s in symbols.states]
    settled = _settled(lowering.graph, dict(zip(nodes, [*q, *v, *x], strict=True)), reporter)
    return InitialValues(
        start_q=settled[: len(q)],
        start_v=settled[len(q) : len(q) + len(v)],
        start_x=settled[len(q) + len(v) :],
        initials=(*_conditions(lowering, model), *_of_closures(lowering, model, symbols, reporter)),
    )


def _conditions(lowering: Lowering, model: FlatModel) -> tuple[InitialRow, ...]:
    """Return one row for each number of a condition on an expression."""
    rows = []
    for condition in model.initials:
        target = condition.target
        left, right = lowering.numbers(target), lowering.numbers(condition.start.value)
        right = right * len(left) if len(right) == 1 else right
        text = " ".join(target.span.text.split())
        unit = base_unit(target)
        for k, (a, b) in enumerate(zip(left, right, strict=True)):
            name = f"{text}[{k + 1}]" if len(left) > 1 else text
            residual = lowering.graph.sub(a, b)
            rows.append(InitialRow(name, residual, not condition.start.guess, unit, condition.origin))
    return tuple(rows)


def _of_closures(
    lowering: Lowering, model: FlatModel, symbols: Symbols, reporter: Reporter
) -> tuple[InitialRow, ...]:
    """Return the known initial values of coordinates that closures compute; guesses of them decide nothing."""
    graph = lowering.graph
    unknowns = {c.variable.name for c in symbols.coordinates}
    computed = [v for v in model.variables if v.role is Role.COORDINATE and v.name not in unknowns]
    rows = []
    for variable in computed:
        name, type = variable.name, variable.type
        second = DIMENSIONLESS if model.dimensionless else parse_unit("s").dimension
        for start, single, order in (
            (variable.start, variable.starts, 0),
            (variable.rate, variable.rates, 1),
        ):
            known = next((s for s in (start, *single.values()) if s is not None and not s.guess), None)
            if known is None:
                continue
            if type.kind is Kind.ROTATION:
                reporter.error(
                    "E0517",
                    f"'{name}' is a rotation of a joint that closes a loop, so its start cannot be given",
                    known.origin.span,
                    help="give that of a joint of the tree",
                )
                continue
            places = subscripts(type.shape)
            values = elements(lowering.named(name, known.origin.span))
            begins = _starts(lowering, start, places, single)
            unit = unit_text(type.dimension / second**order)
            for place, value, begin in zip(places, values, begins, strict=True):
                if not begin.known or begin.start is None:
                    continue
                reached, title = value, element_name(name, place)
                if order:
                    reached, title = lowering.rate(value), rate_name(name, place)
                residual = graph.sub(reached, begin.value)
                rows.append(InitialRow(title, residual, True, unit, begin.start.origin))
    return tuple(rows)


def _settled(graph: Graph, starts: dict[Node, InitialValue], reporter: Reporter) -> tuple[InitialValue, ...]:
    """Replace initial values of others in initial values, until none is left."""
    for s, b in starts.items():
        if starts.keys() & set(graph.support(b.value)):
            starts[s] = replace(b, by_others=b.value)
    for _ in range(len(starts)):
        values = {s: b.value for s, b in starts.items()}
        open_ones = [s for s, n in values.items() if values.keys() & set(graph.support(n))]
        for s in open_ones:
            try:
                (n,) = substitute(graph, [values[s]], values)
            except DivisionByZero:
                start = starts[s].start
                raise reporter.fail(
                    "E0602",
                    f"the initial value of '{graph.name(s)}' divides by zero",
                    start.origin.span if start else None,
                    caption="with the initial values of the others",
                ) from None
            starts[s] = replace(starts[s], value=n)
        if not open_ones:
            break
    for s, b in starts.items():
        if starts.keys() & set(graph.support(b.value)) and b.start is not None:
            reporter.error(
                "E0601",
                f"the initial value of '{graph.name(s)}' depends on itself",
                b.start.origin.span,
                caption="through the initial values of others",
            )
    return tuple(starts.values())


def _starts(
    lowering: Lowering,
    start: StartValue | None,
    places: list[tuple[int, ...]],
    single: Mapping[tuple[int, ...], StartValue],
) -> list[InitialValue]:
    """Return the initial value of each place: of the whole, or its own among those of ``single`` elements."""
    zero = lowering.graph.constant(0)
    result = [InitialValue(zero, False, None)] * len(places)
    if start is not None:
        values = lowering.reported(start.value)
        values = values * len(places) if len(values) == 1 else values
        result = [InitialValue(n, not start.guess, start) for n in values]
    for place, one in single.items():
        (n,) = lowering.reported(one.value)
        result[places.index(place)] = InitialValue(n, not one.guess, one)
    return result


def _rotation(lowering: Lowering, variable: Variable) -> list[InitialValue]:
    from .meaning.quaternions import rotation_quaternion

    graph = lowering.graph
    start = variable.start
    if start is None:
        return [InitialValue(graph.constant(x), False, None) for x in (1, 0, 0, 0)]
    return [
        InitialValue(n, not start.guess, start) for n in rotation_quaternion(graph, lowering, start.value)
    ]

"""What a curve must fulfil, in numbers of the whole curve and at every place; and the symbols of the multipliers."""

from __future__ import annotations

from collections.abc import Sequence
from random import Random

from msgspec import Struct

from mechc.lang.diagnostics import Reporter
from mechc.runtime.interface import CurveRow

from ...flat.model import Query
from ...graph import Graph, Node
from ...graph.differentiate import gradient
from ...graph.evaluate import evaluate
from ...graph.rewrite import substitute
from ...mechanics.system import Curve, CurveRows, MechanicalSystem, WholeNumber
from ..model import origin
from .forms import Forms

TRIES = 6
"""Random places at which an integrand is asked whether it knows its parameter."""


class Conditions(Struct, frozen=True):
    """``integrals`` and ``places`` are numbers that decide the curve; ``further`` are only reported. ``order``: the highest
    derivative that decides it. ``wholes`` and ``points`` are residuals with their multipliers and densities.
    ``gauge``: nothing tells how fast the curve is passed, so that its speed is kept constant, by the last two integrals;
    ``parametric``: the model itself says nothing of that."""

    order: int
    functional: Node
    integrals: tuple[WholeNumber, ...]
    places: tuple[WholeNumber, ...]
    further: tuple[WholeNumber, ...]
    wholes: tuple[tuple[CurveRow, Node], ...]
    points: tuple[tuple[CurveRow, Node], ...]
    lam: tuple[Node, ...]
    multipliers: tuple[Node, ...]
    densities: tuple[Node, ...]
    gauge: bool
    parametric: bool

    @property
    def numbers(self) -> tuple[WholeNumber, ...]:
        """The numbers that decide the curve."""
        return (*self.integrals, *self.places)


def conditions_of(
    system: MechanicalSystem, curve: Curve, forms: Forms, reporter: Reporter, *, exchanged: bool = False
) -> Conditions:
    """Sort what a model says of its curve; report conditions that are none."""
    graph = system.graph
    numbers = list(curve.numbers)
    wholes: list[tuple[CurveRow, Node]] = []
    points: list[tuple[CurveRow, Node]] = []
    ends: dict[tuple[Node, bool], WholeNumber] = {}
    for rows in curve.rows:
        residuals: Sequence[Node] = rows.residuals
        if rows.upper is not None:
            residuals = _at_the_end(system, curve, forms, rows, ends)
        if rows.bound and curve.action:
            reporter.error(
                "E0558",
                f"the inequality '{rows.name}' stands beside an action",
                rows.origin.shown,
                caption="what is touched in time is a contact, which no action knows",
                help="find the motion from its start: 'contact gap restitution e;' in a model without a range",
            )
        for name, residual, unit in zip(_names(rows), residuals, rows.units, strict=True):
            kind = ("final" if rows.upper else "initial") if rows.upper is not None else "whole"
            if rows.on_the_curve:
                kind = "position" if _level(graph, forms, residual) == 0 else "velocity"
                points.append((CurveRow(name, kind, unit, rows.bound, origin(rows.origin.shown)), residual))
                continue
            if rows.bound:
                reporter.error(
                    "E0558",
                    f"the inequality '{name}' is about the whole curve",
                    rows.origin.shown,
                    caption="inequalities hold at every point",
                    help="if it is active, write it as an equation; if not, leave it out",
                )
            wholes.append((CurveRow(name, kind, unit, False, origin(rows.origin.shown)), residual))
    for joint in system.constraints:  # loops of joints close at every place
        for k, residual in enumerate(joint.residuals):
            name = f"{joint.name}[{k + 1}]" if len(joint.residuals) > 1 else joint.name
            points.append(
                (CurveRow(name, "position", joint.units[k], False, origin(joint.origin.shown)), residual)
            )
    if exchanged:
        for upper, place in ((False, curve.lower), (True, curve.upper)):
            residual = graph.sub(_value_at_the_end(system, curve, system.symbols.time, upper, ends), place)
            wholes.append(
                (CurveRow(system.model.independent, "range", "", False, origin(curve.origin.shown)), residual)
            )
    numbers += ends.values()
    deciding = _deciding(graph, numbers, [curve.functional, *(g for _, g in wholes)], [g for _, g in points])
    integrals = [w for w in deciding if w.place is None]
    places = [w for w in deciding if w.place is not None]
    further = sorted((w for w in numbers if w not in deciding), key=lambda w: w.place is not None)
    order = max(
        [1, *(_level(graph, forms, n) for n in (*(w.node for w in integrals), *(g for _, g in points)))]
    )
    _check_ends(graph, forms, curve, wholes, order, reporter)
    _check_places(system, curve, [*places, *further], reporter)
    functional = curve.functional
    if not exchanged:
        _check_moving(graph, forms, curve, integrals, points, reporter)
    parametric = not exchanged and _knows_no_parameter(
        system, curve, forms, integrals, [g for _, g in points], places, order
    )
    gauge = exchanged or parametric
    if gauge:
        two = [graph.symbol("?speed squared"), graph.symbol("?speed")]
        integrals += [
            WholeNumber(n, f"gauge {k}", graph.zero, None, "", curve.origin)
            for k, n in enumerate(two, start=1)
        ]
        spread = graph.sub(two[0], graph.mul(two[1], two[1]))
        functional = graph.add(functional, graph.mul(graph.half, spread))
    chosen = (*integrals, *places)
    return Conditions(
        order=order,
        functional=functional,
        integrals=tuple(integrals),
        places=tuple(places),
        further=tuple(further),
        wholes=tuple(wholes),
        points=tuple(points),
        lam=tuple(graph.symbol(f"#multiplier of number {k}") for k in range(len(chosen))),
        multipliers=tuple(graph.symbol(f"#multiplier of condition {k}") for k in range(len(wholes))),
        densities=tuple(graph.symbol(f"#density {k}") for k in range(len(points))),
        gauge=gauge,
        parametric=parametric,
    )


def _names(rows: CurveRows) -> list[str]:
    if len(rows.residuals) == 1:
        return [rows.name]
    return [f"{rows.name}[{k + 1}]" for k in range(len(rows.residuals))]


def _level(graph: Graph, forms: Forms, node: Node) -> int:
    """Return the highest derivative of a coordinate in a formula."""
    support = set(graph.support(node))
    return max((k for k, row in enumerate(forms.rates) if support.intersection(row)), default=0)


def _at_the_end(
    system: MechanicalSystem,
    curve: Curve,
    forms: Forms,
    rows: CurveRows,
    ends: dict[tuple[Node, bool], WholeNumber],
) -> Sequence[Node]:
    """Return the residuals of an end in numbers of the whole curve: the values that coordinates have there."""
    graph, upper = system.graph, bool(rows.upper)
    place = curve.upper if upper else curve.lower
    support = set(graph.support(*rows.residuals))
    known = {system.symbols.time: place}
    for row in forms.rates:
        known |= {n: _value_at_the_end(system, curve, n, upper, ends) for n in row if n in support}
    return substitute(graph, rows.residuals, known)


def _value_at_the_end(
    system: MechanicalSystem, curve: Curve, n: Node, upper: bool, ends: dict[tuple[Node, bool], WholeNumber]
) -> Node:
    """Return the number that a symbol is at an end."""
    if (n, upper) not in ends:
        name = f"{system.graph.name(n)} at the {'upper' if upper else 'lower'} end"
        place = curve.upper if upper else curve.lower
        ends[n, upper] = WholeNumber(system.graph.symbol(f"?{name}"), name, n, place, "", curve.origin)
    return ends[n, upper].symbol


def _deciding(
    graph: Graph, numbers: Sequence[WholeNumber], wholes: Sequence[Node], points: Sequence[Node]
) -> list[WholeNumber]:
    """Return the numbers on which the curve depends."""
    wanted = set(graph.support(*wholes, *points))
    found: list[WholeNumber] = []
    while more := [w for w in numbers if w.symbol in wanted and w not in found]:
        found += more
        wanted |= set(graph.support(*(w.node for w in more)))
    return [w for w in numbers if w in found]


# ---------------------------------------------------------------- what is not a condition


def _check_ends(
    graph: Graph,
    forms: Forms,
    curve: Curve,
    wholes: Sequence[tuple[CurveRow, Node]],
    order: int,
    reporter: Reporter,
) -> None:
    """Report an end at which a slope is given that no integral of first derivatives can keep."""
    for rows in curve.rows:
        if rows.upper is None:
            continue
        level = max(_level(graph, forms, n) for n in rows.residuals)
        if level >= order:
            which = "slope" if order == 1 else "derivative"
            reporter.error(
                "E0557",
                f"the {which} at an end cannot be given here",
                rows.origin.shown,
                caption="it follows from what is stationary",
                help="give the value at both ends; a curve whose integrand contains der(z, 2), as that of a bent rod, "
                "takes slopes at its ends too"
                if order == 1
                else f"give derivatives below the order {order}",
            )


def _check_places(
    system: MechanicalSystem, curve: Curve, places: Sequence[WholeNumber], reporter: Reporter
) -> None:
    known = {s.node for s in system.symbols.parameters}
    for w in places:
        if w.place is None or w.place in (curve.lower, curve.upper):
            continue
        if curve.unknown and set(system.graph.support(curve.lower, curve.upper)) & {
            s.node for s in curve.unknown
        }:
            reporter.error(
                "E0559",
                "a value inside a range with an unknown end",
                w.origin.shown,
                caption="an end of the range is to be found",
                help="in such a range, 'at' takes either end",
            )
        elif not set(system.graph.support(w.place)) <= known:
            reporter.error(
                "E0559",
                "the place of a value must be known",
                w.origin.shown,
                caption="this place depends on the curve",
                help="it is a formula of parameters",
            )


def _check_moving(
    graph: Graph,
    forms: Forms,
    curve: Curve,
    integrals: Sequence[WholeNumber],
    points: Sequence[tuple[CurveRow, Node]],
    reporter: Reporter,
) -> None:
    """Report coordinates on which nothing stationary depends, and conditions that no coordinate can fulfil."""
    support = set(graph.support(*(w.node for w in integrals), *(g for _, g in points)))
    for k, scalar in enumerate(forms.scalars):
        if support.isdisjoint({row[k] for row in forms.rates}):
            reporter.error(
                "E0560",
                f"nothing that is stationary depends on '{scalar.name}'",
                scalar.variable.origin.shown,
                caption="any curve would satisfy the problem",
                help="it belongs in an integral that is stationary, or into a constraint",
            )
    moving = {n.symbol for n in curve.numbers} | {s.node for s in curve.unknown}
    for rows in curve.rows:
        if rows.upper is not None or rows.on_the_curve:
            continue
        for name, residual in zip(_names(rows), rows.residuals, strict=True):
            if moving.isdisjoint(graph.support(residual)):
                reporter.error("E0503", f"constraint '{name}' contains no coordinate", rows.origin.shown)


def _knows_no_parameter(
    system: MechanicalSystem,
    curve: Curve,
    forms: Forms,
    integrals: Sequence[WholeNumber],
    points: Sequence[Node],
    places: Sequence[WholeNumber],
    order: int,
) -> bool:
    """Tell whether integrals are the same however fast the curve is passed: f = sum v df/dv, without the parameter."""
    graph = system.graph
    if curve.unknown or order != 1 or len(forms.scalars) < 2 or not integrals:
        return False
    if any(w.place not in (curve.lower, curve.upper) for w in places):
        return False
    nodes = [w.node for w in integrals]
    if system.symbols.time in graph.support(*nodes, *points) or any(_level(graph, forms, g) for g in points):
        return False
    v = forms.rates[1]
    off = [graph.sub(graph.dot(gradient(graph, f, v), v), f) for f in nodes]
    symbols = graph.support(*nodes)
    random = Random(7)
    seen = 0
    for _ in range(10 * TRIES):
        values = {s: random.uniform(0.3, 1.3) for s in symbols}
        found = evaluate(graph, [*off, *nodes], values)
        if any(x != x or abs(x) == float("inf") for x in found):
            continue
        rest, sizes = found[: len(off)], found[len(off) :]
        if any(abs(x) > 1e-9 * (abs(y) + 1e-9) for x, y in zip(rest, sizes, strict=True)):
            return False
        seen += 1
        if seen == TRIES:
            return True
    return False


def asked(system: MechanicalSystem, node: Node) -> list[tuple[Node, Query]]:
    """Return the questions in a formula that are not numbers of the whole curve."""
    queries = system.lowering.questions.asked
    return [
        (n, queries[n])
        for n in system.graph.support(node)
        if n in queries and queries[n].function not in ("integral", "at")
    ]

"""What is the same along a curve: momenta of cyclic coordinates, and the energy where no place is special."""

from __future__ import annotations

from collections.abc import Sequence

from mechc.lang.diagnostics import Reporter
from mechc.runtime.interface import CurveRow

from ...graph import Node
from ...graph.differentiate import gradient
from ...graph.operations import JUMPING
from ...graph.rewrite import substitute
from ...mechanics.energies import momenta_of, total_energy
from ...mechanics.system import Curve, MechanicalSystem, WholeNumber
from .conditions import Conditions, asked
from .forms import Forms, over_a_parameter


def density(system: MechanicalSystem, found: Conditions) -> Node:
    """Return the integrand of the whole: integrands with their multipliers, and conditions at every place with theirs."""
    graph = system.graph
    kept = found.integrals[: len(found.integrals) - 2 * found.gauge]
    terms = [graph.mul(m, w.node) for m, w in zip(found.lam, kept, strict=False)]
    terms += [graph.mul(m, g) for m, (_, g) in zip(found.densities, found.points, strict=True)]
    return graph.sum(terms)


def special_places(curve: Curve, found: Conditions) -> list[WholeNumber]:
    """Return the values inside of the range that decide the curve: momenta leap there, as at a point load."""
    return [w for w in found.places if w.place not in (curve.lower, curve.upper)]


def momenta(
    system: MechanicalSystem, forms: Forms, found: Conditions
) -> tuple[Sequence[Node], Sequence[Node]]:
    """Return dF/dq' - d/dx dF/dq'', and dF/dq''."""
    return momenta_of(system.graph, system.rate, density(system, found), forms.rates[1], forms.rates[2])


def first_integrals(
    system: MechanicalSystem, curve: Curve, forms: Forms, found: Conditions
) -> list[tuple[CurveRow, Node]]:
    """Return what stays the same along every stationary curve of the model."""
    graph = system.graph
    whole = density(system, found)
    firsts, seconds = momenta(system, forms, found)
    velocity_rows = any(row.kind == "velocity" for row, _ in found.points)
    if velocity_rows and found.order > 1:
        return []  # rates of multipliers would be needed
    if forms.exchanged:
        (over,) = over_a_parameter(forms, [whole])
        *firsts, belonging = gradient(graph, over, forms.by_s[1])
    rows = []
    by_q = gradient(graph, whole, [*forms.rates[0], system.symbols.time])
    within = special_places(curve, found)
    # no slope on either side of a step, and yet what follows from its place is not the same
    steps = [n for n in graph.reach([whole]) if graph.op(n) in JUMPING]
    leaps = set(graph.support(*(w.node for w in within), *steps))
    for k, scalar in enumerate(forms.scalars[: len(firsts)]):
        if graph.is_zero(by_q[k]) and not graph.is_zero(firsts[k]) and forms.rates[0][k] not in leaps:
            rows.append((CurveRow(f"momentum({scalar.name})", "momentum", ""), firsts[k]))
    still = graph.is_zero(by_q[-1]) and system.symbols.time not in leaps
    if still and found.order <= 2 and not within:
        if forms.exchanged:  # homogeneous: what belongs to x is minus the energy, without large differences
            energy = graph.neg(belonging)
        else:
            energy = total_energy(graph, whole, forms.rates[1], forms.rates[2], firsts, seconds)
        if not graph.is_zero(energy) and not found.parametric:
            rows.append((CurveRow("energy", "energy", ""), energy))
    return rows


def answered(
    system: MechanicalSystem, curve: Curve, forms: Forms, found: Conditions, node: Node, reporter: Reporter
) -> Node:
    """Return a formula with the answers to its questions about multipliers and momenta put in."""
    graph = system.graph
    known: dict[Node, Node] = {}
    for symbol, query in asked(system, node):
        siblings = [n for n, q in system.lowering.questions.asked.items() if q is query]
        k = siblings.index(symbol)
        name = f"{query.target}[{k + 1}]" if len(siblings) > 1 else query.target
        answer = None
        if query.function == "multiplier":
            for multipliers, rows in ((found.multipliers, found.wholes), (found.densities, found.points)):
                answer = next(
                    (m for m, (row, _) in zip(multipliers, rows, strict=True) if row.name == name), answer
                )
        elif query.function == "momentum":
            firsts, _ = momenta(system, forms, found)
            answer = next((p for p, s in zip(firsts, forms.scalars, strict=False) if s.name == name), None)
        if answer is None:
            reporter.error(
                "E0522",
                f"'{query.function}({query.target})' has no answer in this model",
                query.span,
                caption="it is about a motion, and this is a curve"
                if query.function not in ("multiplier", "momentum")
                else "nothing of this name",
            )
            return graph.zero
        known[symbol] = answer
    return substitute(graph, [node], known)[0] if known else node

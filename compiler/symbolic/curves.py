"""What there is to write about a curve: what is stationary, Euler-Lagrange equations, natural conditions, first integrals."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import sympy as sp
from msgspec.structs import replace

from mechc.lang.diagnostics import Reporter

from ..equations.curves.conditions import Conditions, conditions_of
from ..equations.curves.first_integrals import density, first_integrals, momenta, special_places
from ..equations.curves.forms import Forms, forms_of
from ..graph import Graph, Node
from ..graph.differentiate import gradient
from ..mechanics.energies import total_energy
from ..mechanics.system import Curve, MechanicalSystem
from .equations import SHOW_LIMIT, EquationLine, EquationList, EquationSection, decimals
from .express import express, factored
from .names import latex_name, symbols_of
from .trigonometry import shorten

SIMPLIFY_LIMIT = 400

Moments = tuple[Sequence[Node], Sequence[Node]]
"""dF/dq' - d/dx dF/dq'', and dF/dq'', of each coordinate."""
Write = Callable[[str, Node], EquationLine]


def curve_account(system: MechanicalSystem, curve: Curve, *, latex: bool) -> EquationList:
    """Return what there is to write about a curve, with symbols named for text or for LaTeX."""
    graph = system.graph
    forms = forms_of(system, curve)
    found = conditions_of(system, curve, forms, Reporter())
    symbols = _symbols(system, curve, forms, found, latex)

    def write(left: str, node: Node) -> EquationLine:
        (expression,) = express(graph, [node], symbols)
        operations = graph.count_operations([node])
        if operations > SHOW_LIMIT:
            return EquationLine(left, None, operations)
        if sp.count_ops(expression) <= SIMPLIFY_LIMIT:
            expression = factored(shorten(expression))
        return EquationLine(left, decimals(expression), operations)

    whole = density(system, found)
    for k, m in enumerate(found.densities):  # multipliers vary along the curve
        rate = graph.symbol(f"#rate of density {k}")
        symbols[rate] = sp.Symbol(f"{symbols[m].name}'" if not latex else rf"\dot{{{symbols[m].name}}}")
        system.rate.define(m, rate)
    firsts, seconds = momenta(system, forms, found)
    by_q = gradient(graph, whole, forms.rates[0])
    euler = tuple(write("0", graph.sub(system.rate(p), q)) for p, q in zip(firsts, by_q, strict=True))
    kept = found.integrals[: len(found.integrals) - 2 * found.gauge]
    over = system.model.independent or "x"
    integrands = tuple(
        write(f"d({symbols[w.symbol].name})/d{over}" if not latex else rf"\frac{{d {symbols[w.symbol].name}}}{{d {latex_name(over)}}}", w.node)
        for w in kept
    )  # fmt: skip
    sections = (
        EquationSection("Stationary", (write("J", curve.functional),)),
        EquationSection("Integrands", integrands),
        EquationSection("Conditions", tuple(write(row.name, g) for row, g in found.wholes), "each expression vanishes"),
        EquationSection("Constraints at every place", tuple(write(row.name, g) for row, g in found.points), "each expression vanishes, or is not negative where it is an inequality"),
        EquationSection("Euler-Lagrange equations", euler),
        *_natural(system, curve, forms, found, (firsts, seconds), write),
        _shared_ends(system, curve, found, symbols, write, latex),
        _corners(system, curve, forms, found, write),
        EquationSection("First integrals", tuple(write(row.name, n) for row, n in first_integrals(system, curve, forms, found)), "each is the same all along the curve"),
    )  # fmt: skip
    empty = EquationList(
        system.model.name, system.model.doc, EquationLine("L", None, 0), None, (), (), (), (), (), (), (), 0
    )
    return replace(empty, further=tuple(s for s in sections if s.statements))


def _symbols(
    system: MechanicalSystem, curve: Curve, forms: Forms, found: Conditions, latex: bool
) -> dict[Node, sp.Symbol]:
    symbols = symbols_of(system, latex)
    over = system.model.independent
    symbols[system.symbols.time] = sp.Symbol(latex_name(over) if latex else over)
    for order in (3, 4):
        for node, scalar in zip(forms.rates[order], forms.scalars, strict=True):
            name = latex_name(scalar.name) if latex else scalar.name
            symbols[node] = sp.Symbol(rf"{name}^{{({order})}}" if latex else name + "'" * order)
    lam = r"\lambda" if latex else "lambda"
    number = 0
    for w, m in zip(found.numbers, found.lam, strict=True):
        if w.place is None:
            number += 1
            name = "action" if w.name == "action" else f"I{number}"
            symbols[w.symbol] = sp.Symbol(latex_name(name) if latex else name)
            symbols[m] = sp.Symbol(rf"\partial J/\partial I_{{{number}}}" if latex else f"dJ/dI{number}")
        else:
            symbols[w.symbol] = sp.Symbol(rf"\mathrm{{{w.name}}}" if latex else f"({w.name})")
    for (row, _), m in zip(found.points, found.densities, strict=True):
        symbols[m] = sp.Symbol(rf"{lam}_{{{latex_name(row.name)}}}" if latex else f"{lam}[{row.name}]")
    for (row, _), m in zip(found.wholes, found.multipliers, strict=True):
        symbols[m] = sp.Symbol(rf"{lam}_{{{latex_name(row.name)}}}" if latex else f"{lam}[{row.name}]")
    return _with_plain_weights(system, found, symbols)


def _with_plain_weights(
    system: MechanicalSystem, found: Conditions, symbols: dict[Node, sp.Symbol]
) -> dict[Node, sp.Symbol]:
    """Write the multipliers of integrals as what they are where that is plain: 1, or the multiplier of a constraint."""
    graph = system.graph
    slopes = gradient(graph, _total(system, found), [w.symbol for w in found.integrals])
    for m, slope in zip(found.lam, slopes, strict=False):
        (expression,) = express(graph, [slope], symbols)
        symbols[m] = expression
    return symbols


def _total(system: MechanicalSystem, found: Conditions) -> Node:
    """Return what is stationary with the conditions on the whole and their multipliers."""
    graph = system.graph
    rows = (graph.mul(m, g) for m, (_, g) in zip(found.multipliers, found.wholes, strict=True))
    return graph.add(found.functional, graph.sum(rows))


def _natural(
    system: MechanicalSystem, curve: Curve, forms: Forms, found: Conditions, moments: Moments, write: Write
) -> list[EquationSection]:
    """Return what holds at ends that are free, or on which something else depends than that they are given."""
    graph, total = system.graph, _total(system, found)
    sections = []
    for upper, place in ((False, curve.lower), (True, curve.upper)):
        here = [w for w in found.places if w.place == place]
        weights = gradient(graph, total, [w.symbol for w in here])
        ends = graph.sum(graph.mul(m, w.node) for m, w in zip(weights, here, strict=True))
        rows = []
        for level, momenta_there in enumerate(moments[: found.order]):
            by = gradient(graph, ends, forms.rates[level])
            for p, b in zip(momenta_there, by, strict=True):
                rows.append(graph.add(p, b) if upper else graph.sub(b, p))
        rows += _transversal(system, curve, forms, found, moments, upper)
        word = "upper" if upper else "lower"
        kept = _without_mere_multipliers(graph, found, rows)
        sections.append(
            EquationSection(f"Natural conditions at the {word} end", tuple(write("0", node) for node in kept))
        )
    return sections


def _without_mere_multipliers(graph: Graph, found: Conditions, rows: list[Node]) -> list[Node]:
    """Return the rows but for those that only say what the multiplier of one end is."""
    ends = {m for m, (row, _) in zip(found.multipliers, found.wholes, strict=True) if row.kind != "whole"}
    supports = [ends.intersection(graph.support(node)) for node in rows]
    return [
        node
        for k, node in enumerate(rows)
        if not any(all(m not in s for i, s in enumerate(supports) if i != k) for m in supports[k])
    ]


def _transversal(
    system: MechanicalSystem, curve: Curve, forms: Forms, found: Conditions, moments: Moments, upper: bool
) -> list[Node]:
    """Return what holds because this end of the range is to be found: F - q' dF/dq' and what else depends on it."""
    graph = system.graph
    ends = (curve.lower, curve.upper)
    whole, rows = density(system, found), []
    energy = total_energy(graph, whole, forms.rates[1], forms.rates[2], *moments)
    for scalar in curve.unknown:
        moves = [gradient(graph, end, [scalar.node])[0] for end in ends]
        if graph.is_zero(moves[upper]):
            continue
        if not graph.is_zero(moves[not upper]):  # what both ends share is a condition of its own
            continue
        (explicit,) = gradient(graph, _total(system, found), [scalar.node])
        passed = graph.mul(moves[upper], energy)
        rows.append(graph.sub(explicit, passed) if upper else graph.add(explicit, passed))
    return rows


def _shared_ends(
    system: MechanicalSystem,
    curve: Curve,
    found: Conditions,
    symbols: dict[Node, sp.Symbol],
    write: Write,
    latex: bool,
) -> EquationSection:
    """Return what holds because both ends of the range move with a number that is to be found."""
    graph = system.graph
    energies = [graph.symbol(f"?energy at the {word} end") for word in ("lower", "upper")]
    shown = r"\mathrm{{{}}}" if latex else "({})"
    symbols |= {e: sp.Symbol(shown.format(graph.name(e)[1:])) for e in energies}
    rows = []
    for scalar in curve.unknown:
        moves = [gradient(graph, end, [scalar.node])[0] for end in (curve.lower, curve.upper)]
        if any(graph.is_zero(m) for m in moves):
            continue
        (explicit,) = gradient(graph, _total(system, found), [scalar.node])
        passed = [graph.mul(m, e) for m, e in zip(moves, energies, strict=True)]
        rows.append(write("0", graph.add(graph.sub(passed[0], passed[1]), explicit)))
    return EquationSection(
        "Ends that move together",
        tuple(rows),
        "the energy is q' dF/dq' - F of the integrand with its multipliers",
    )


def _corners(
    system: MechanicalSystem, curve: Curve, forms: Forms, found: Conditions, write: Write
) -> EquationSection:
    """Return by what momenta leap inside of the range, as at a point load."""
    graph, total = system.graph, _total(system, found)
    over, names = system.model.independent, symbols_of(system, False)
    statements = []
    for w in special_places(curve, found):
        assert w.place is not None
        (place,) = express(graph, [w.place], names)
        (weight,) = gradient(graph, total, [w.symbol])
        for level in range(found.order):
            leaps = gradient(graph, graph.mul(weight, w.node), forms.rates[level])
            for scalar, leap in zip(forms.scalars, leaps, strict=True):
                if graph.is_zero(leap):
                    continue
                primes = "'" * level
                statements.append(write(f"leap of p[{scalar.name}{primes}] at {over} = {place}", leap))
    meaning = "p = dF/dq' of the integrand with its multipliers, and with second derivatives what follows it"
    return EquationSection("Corner conditions", tuple(statements), meaning)

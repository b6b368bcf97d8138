"""What there is to write about a curve: what is stationary, Euler-Lagrange equations, natural conditions, first integrals."""

from __future__ import annotations

import sympy as sp
from msgspec.structs import replace

from mechc.lang.diagnostics import Reporter

from ..equations.curves.conditions import Conditions, conditions_of
from ..equations.curves.first_integrals import density, first_integrals, momenta
from ..equations.curves.forms import Forms, forms_of
from ..graph import Node
from ..graph.differentiate import gradient
from ..mechanics.system import Curve, MechanicalSystem
from .equations import SHOW_LIMIT, Account, Section, Statement, decimals
from .express import express
from .names import latex_name, symbols_of
from .trigonometry import shorten

SIMPLIFY_LIMIT = 400


def curve_account(system: MechanicalSystem, curve: Curve, *, latex: bool) -> Account:
    """Return what there is to write about a curve, with symbols named for text or for LaTeX."""
    graph = system.graph
    forms = forms_of(system, curve)
    found = conditions_of(system, curve, forms, Reporter())
    symbols = _symbols(system, curve, forms, found, latex)

    def write(left: str, node: Node) -> Statement:
        (expression,) = express(graph, [node], symbols)
        operations = graph.count_operations([node])
        if operations > SHOW_LIMIT:
            return Statement(left, None, operations)
        if sp.count_ops(expression) <= SIMPLIFY_LIMIT:
            expression = shorten(sp.nsimplify(expression, rational=True))
            expression = min(expression, sp.factor(expression), key=sp.count_ops)
        return Statement(left, decimals(expression), operations)

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
        Section("Stationary", (write("J", curve.functional),)),
        Section("Integrands", integrands),
        Section("Conditions", tuple(write(row.name, g) for row, g in found.wholes), "each expression vanishes"),
        Section("Constraints at every place", tuple(write(row.name, g) for row, g in found.points), "each expression vanishes, or is not negative where it is an inequality"),
        Section("Euler-Lagrange equations", euler),
        *_natural(forms, found, firsts, seconds, write),
        Section("First integrals", tuple(write(row.name, n) for row, n in first_integrals(system, curve, forms, found)), "each is the same all along the curve"),
    )  # fmt: skip
    empty = Account(
        system.model.name, system.model.doc, Statement("L", None, 0), None, (), (), (), (), (), (), (), 0
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
    total = graph.add(
        found.functional,
        graph.sum(graph.mul(m, g) for m, (_, g) in zip(found.multipliers, found.wholes, strict=True)),
    )
    slopes = gradient(graph, total, [w.symbol for w in found.integrals])
    for m, slope in zip(found.lam, slopes, strict=False):
        (expression,) = express(graph, [slope], symbols)
        symbols[m] = expression
    return symbols


def _natural(forms: Forms, found: Conditions, firsts, seconds, write) -> list[Section]:  # type: ignore[no-untyped-def]
    """Return what holds at ends that are free."""
    held: dict[bool, set[Node]] = {False: set(), True: set()}
    for w in found.places:
        held[w.name.endswith("upper end")].add(w.node)
    sections = []
    for upper in (False, True):
        rows = [write("0", p) for p, q in zip(firsts, forms.rates[0], strict=True) if q not in held[upper]]
        if found.order > 1:
            rows += [
                write("0", p) for p, v in zip(seconds, forms.rates[1], strict=True) if v not in held[upper]
            ]
        sections.append(
            Section(f"Natural conditions at the {'upper' if upper else 'lower'} end", tuple(rows))
        )
    return sections

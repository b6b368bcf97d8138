"""Forces that depend on forces: answers such as ``multiplier(floor)`` as unknowns beside accelerations and multipliers.

A force may follow a reaction: F = -0.3 N tanh(v/v0), or by a law that is not linear (force_laws.py). Each such answer s is an unknown with the row s - f(a, lam, s) = 0,
eliminated last. The forces of constraints K^T lam and the inertia stay what they are, so that projections and
impulses know nothing of s: what follows a force is finite, and no impulse.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from msgspec import Struct

from mechc.lang.diagnostics import Reporter

from ...flat.model import Query
from ...graph import Graph, Node
from ...mechanics.meaning.questions import title
from ...mechanics.system import MechanicalSystem
from .force_laws import Jumps, Laws, take_laws_out

if TYPE_CHECKING:
    from ..rows.signs import Side


class UnknownForces(Struct, frozen=True):
    """``symbols`` of answers that the equations contain, with the ``equations`` s - f = 0 that determine them.

    ``laws`` of forces that are not affine have symbols of their own in all equations.
    """

    symbols: tuple[Node, ...] = ()
    equations: tuple[Node, ...] = ()
    laws: Laws = Laws({}, ())


def unknown_forces(
    system: MechanicalSystem,
    formulas: Sequence[Node],
    rates: Sequence[Node],
    answers: Mapping[Node, Node],
    unknowns: Sequence[Node],
    sides: dict[Node, Side],
    reporter: Reporter,
) -> tuple[list[Node], UnknownForces]:
    """Return formulas with their questions about sides of forces answered (signs.py), and the forces in them.

    ``formulas`` are the residual and what determines multipliers. ``rates`` of states may ask for forces, too: after
    the solution, unless that makes forces depend on them. ``answers``: formulas of all answers about forces in the
    ``unknowns``, accelerations and multipliers, and each other.
    """
    graph = system.graph
    later = set(_needed(graph, rates, answers))
    back = later.intersection(graph.support(*(answers[s] for s in later)))
    inner = answers.values()  # a force that moves nothing may still act on what is asked for
    symbols = _needed(graph, (*formulas, *inner, *(rates if back else ())), answers)
    if not symbols:
        return list(formulas), UnknownForces()
    from ..rows.signs import take_sides

    rows = [graph.sub(s, answers[s]) for s in symbols]
    taken = [take_sides(graph, n, symbols, sides) for n in (*formulas, *rows)]
    try:
        affine, laws = take_laws_out(graph, taken, symbols, unknowns)
    except Jumps as jump:
        raise _report_jump(system, jump.symbol, reporter) from None
    _warn_of_waves(system, laws, reporter)
    return affine[: len(formulas)], UnknownForces(symbols, tuple(affine[len(formulas) :]), laws)


def _needed(graph: Graph, formulas: Sequence[Node], answers: Mapping[Node, Node]) -> tuple[Node, ...]:
    """Return the answers that formulas contain, with those that they contain themselves."""
    found: dict[Node, None] = {}
    pending = list(formulas)
    while pending and answers:
        new = [s for s in graph.support(*pending) if s in answers and s not in found]
        found |= dict.fromkeys(new)
        pending = [answers[s] for s in new]
    return tuple(found)


def _report_jump(system: MechanicalSystem, symbol: Node, reporter: Reporter) -> Exception:
    query = system.queries[symbol]
    return reporter.fail(
        "E0536",
        f"a force jumps with '{title(query)}'",
        query.span,
        caption="in some states no value of the force satisfies this law",
        help="use a comparison instead: it is a switch, which changes at events",
    )


def _warn_of_waves(system: MechanicalSystem, laws: Laws, reporter: Reporter) -> None:
    """Warn of laws that rise and fall with a force without end: several forces may agree with them."""
    graph = system.graph
    for n in laws.waves(graph)[:1]:
        for query in [system.queries[s] for s in graph.support(n) if s in system.queries][:1]:
            reporter.warning(
                "W0565",
                f"this force rises and falls with '{title(query)}', so that several may agree with its law",
                query.span,
                caption="asked for inside of 'sin', 'cos' or 'tan'",
                help="mechc follows the force while the law grows from zero to its full size; a monotonic law leaves no choice",
            )


def report_circle(
    system: MechanicalSystem, symbols: Sequence[Node], reporter: Reporter, *, contrary: bool = False
) -> Exception:
    """Report answers that determine each other, so that none of them can be found; ``contrary``: none fulfils the equations."""
    asked = [system.queries[s] for s in symbols if s in system.queries]
    queries: dict[str, Query] = {title(query): query for query in asked}
    names = " and ".join(f"'{name}'" for name in queries)
    first = next(iter(queries.values()))
    loads = {load.name.partition("[")[0]: load for load in system.model.loads}
    if (
        kept := next((loads[f"{q.target}.own"] for q in asked if f"{q.target}.own" in loads), None)
    ) is not None:
        return reporter.fail(
            "E0728",
            f"what keeps '{first.target}' does not reach it at once",
            kept.origin.shown,
            caption="this changes no acceleration that the constraint contains",
            help="act on what the constraint moves; what follows by way of springs, or of states such as a current, follows later: "
            "constrain that, or let a controller follow",
        )
    if contrary:
        return reporter.fail(
            "E0537",
            f"the equations for {names} contradict each other",
            first.span,
            caption="the force that contains this is as large as the force that it asks for, and something stands beside it",
            help="no answer fulfils them: multiply it by another factor, or write the force without it",
        )
    return reporter.fail(
        "E0537",
        f"nothing determines {names}",
        first.span,
        caption="the force that contains this is as large as the force that it asks for",
        help="every value satisfies this law: multiply it by another factor, or write the force without it",
    )

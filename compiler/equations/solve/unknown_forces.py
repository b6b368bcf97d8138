"""Forces that depend on forces: answers such as ``multiplier(floor)`` as unknowns beside accelerations and multipliers.

A force may follow a reaction: F = -0.3 N tanh(v/v0). Each such answer s is an unknown with the row s - f(a, lam, s) = 0,
eliminated last. The forces of constraints K^T lam and the inertia stay what they are, so that projections and
impulses know nothing of s: what follows a force is finite, and no impulse.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from msgspec import Struct

from mechc.lang.diagnostics import Reporter

from ...flat.model import Query
from ...graph import Node
from ...graph import operations as ops
from ...graph.differentiate import jacobian
from ...mechanics.questions import title
from ...mechanics.system import MechanicalSystem
from ..rows.signs import Side, take_sides


class UnknownForces(Struct, frozen=True):
    """``symbols`` of answers that the residual contains, with the ``equations`` s - f = 0 that determine them."""

    symbols: tuple[Node, ...] = ()
    equations: tuple[Node, ...] = ()


def unknown_forces(
    system: MechanicalSystem,
    residual: Sequence[Node],
    rates: Sequence[Node],
    answers: Mapping[Node, Node],
    sides: dict[Node, Side],
    reporter: Reporter,
) -> tuple[list[Node], UnknownForces]:
    """Return the residual with its questions about sides of forces answered (sides.py), and the unknowns in it.

    ``rates`` of states may ask for forces, too: after the solution, unless that makes forces depend on them.
    ``answers``: formulas of all answers about forces in accelerations, multipliers and each other.
    """
    graph = system.graph
    later = set(_needed(system, rates, answers))
    back = later.intersection(graph.support(*(answers[s] for s in later)))
    symbols = _needed(system, (*residual, *rates) if back else residual, answers)
    if not symbols:
        return list(residual), UnknownForces()
    rows = [graph.sub(s, answers[s]) for s in symbols]
    taken = [take_sides(graph, n, symbols, sides) for n in (*residual, *rows)]
    _check_affine(system, taken, symbols, reporter)
    return taken[: len(residual)], UnknownForces(symbols, tuple(taken[len(residual) :]))


def _needed(
    system: MechanicalSystem, residual: Sequence[Node], answers: Mapping[Node, Node]
) -> tuple[Node, ...]:
    """Return the answers that the residual contains, with those that they contain themselves."""
    found: dict[Node, None] = {}
    pending = list(residual)
    while pending:
        new = [s for s in system.lowering.questions.forces_in(pending) if s not in found and s in answers]
        found |= dict.fromkeys(new)
        pending = [answers[s] for s in new]
    return tuple(found)


def _check_affine(
    system: MechanicalSystem, nodes: Sequence[Node], symbols: Sequence[Node], reporter: Reporter
) -> None:
    graph = system.graph
    jumping = {ops.FLOOR, ops.MODULO, ops.EQUAL}
    for row in nodes:
        (derivatives,) = jacobian(graph, [row], symbols)
        bent = [s for s in symbols if s in graph.support(*derivatives.values())]
        bent += [
            s for n in graph.reach([row]) if graph.op(n) in jumping for s in symbols if s in graph.support(n)
        ]
        if bent:
            query = system.queries[bent[0]]
            raise reporter.fail(
                "E0536",
                f"a force is not affine in '{title(query)}'",
                query.span,
                caption="forces that depend on forces may add them, and multiply them by what is no force",
                help="'abs', 'min', 'max' and comparisons are possible, too",
            )


def report_circle(system: MechanicalSystem, symbols: Sequence[Node], reporter: Reporter) -> Exception:
    """Report answers that determine each other, so that none of them can be found."""
    queries: dict[str, Query] = {title(system.queries[s]): system.queries[s] for s in symbols}
    names = " and ".join(f"'{name}'" for name in queries)
    first = next(iter(queries.values()))
    return reporter.fail(
        "E0537",
        f"nothing determines {names}",
        first.span,
        caption="the force that contains this is as large as the force that it asks for",
        help="whatever the answer is, it is reproduced: multiply it by another factor, or write the force without it",
    )

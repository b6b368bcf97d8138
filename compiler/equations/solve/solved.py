"""From the Lagrangian record to explicit formulas: accelerations, multipliers, projections, energies, answers."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import replace as replace_fields

from mechc.lang.diagnostics import Label, Reporter
from mechc.runtime.interface import COMPLIANCE

from ...flat.model import Query, Role
from ...graph import Graph, Node
from ...graph.differentiate import jacobian, jvp, vjp
from ...graph.elimination.eliminate import ZeroPivot, solve
from ...graph.evaluate import evaluate
from ...graph.rewrite import substitute
from ...mechanics.defaults import default_values
from ...mechanics.driving_inputs import held_inputs, steady_inputs
from ...mechanics.meaning.delays import Delayed
from ...mechanics.meaning.questions import title
from ...mechanics.system import AssertionRow, MechanicalSystem
from ..rows.constraints import (
    Projection,
    Row,
    projection,
    report_superfluous,
    rows_of,
    weighted,
    without_empty,
)
from ..rows.inertia_checks import check_rigid_bodies
from ..rows.modes import check_count, friction_loss, with_modes
from ..rows.prescribed import check_carriers, check_held, check_momenta, check_prescribed
from ..rows.prescribed_slips import sticking
from ..rows.residual import constraint_rates, residual
from .accelerations import Undetermined, accelerations, massless
from .counted_twice import warn_of_counting_twice
from .energies import Energies, energies
from .energies import still as resting
from .force_laws import solve_laws
from .negative_damping import warn_of_negative_damping
from .queries import Replies, answers, force_answers, joint_reactions, refuse_unanswered
from .shares import Share, follows, shares_of, told
from .unknown_forces import report_circle, unknown_forces

if TYPE_CHECKING:
    from ..rows.rank import RankPlace
    from ..rows.signs import Side


START_TOLERANCE = 1e-9
"""Relative; initial values of driven coordinates may be given twice if they agree."""


class Solved(Struct, frozen=True):
    """Everything after elimination. ``replace`` turns each symbol that is not an array entry into its formula.

    ``found_apart``: multipliers by the symbols that answers have in their place; ``driven``: formulas of prescribed coordinates and
    their rates; ``free``: indices of the unknown velocities;
    ``rows``: independent constraint rows; ``all_rows``: with the dependent ones; ``switched``: rows with modes;
    ``sides``: comparisons of forces in their laws; ``shared``: what may share a load, by multipliers; ``residual``: r - K^T lam; ``pivots`` must not vanish,
    and what may make them vanish is ``asserted``.
    """

    driven: Mapping[Node, Node]
    free: tuple[int, ...]
    rows: tuple[Row, ...]
    all_rows: tuple[Row, ...]
    switched: tuple[Row, ...]
    sides: tuple[Side, ...]
    residual: tuple[Node, ...]
    projection: Projection | None
    energies: Energies
    pivots: tuple[Node, ...]
    asserted: tuple[AssertionRow, ...]
    method: str
    operations: int
    graph: Graph
    replace: Mapping[Node, Node]
    shared: Mapping[Node, Share]
    held_inputs: tuple[int, ...] = ()
    found_apart: Mapping[Node, Node] = {}

    def resolve(self, nodes: Sequence[Node]) -> tuple[Node, ...]:
        """Return formulas of numbers that have a place at run time."""
        return tuple(substitute(self.graph, nodes, self.replace))


def solve_system(
    system: MechanicalSystem,
    reporter: Reporter,
    parts: Collection[str] = (),
    apart: Mapping[str, tuple[Node, ...]] | None = None,
) -> Solved:
    """Solve the equations of motion of a system. Raises Undetermined where they do not decide the motion. ``parts``: see
    needs.py.

    ``apart``: symbols of forces that others find, by the names that questions use; of constraints, what others add to them.
    """
    graph = system.graph
    driven, prescribed = prescribed_motion(system)
    balanced = _balanced(system)
    check_prescribed(system, driven, reporter)
    check_carriers(system, driven, reporter)
    check_momenta(system, driven, reporter)
    _check_starts(system, driven, reporter)
    carried = [m.mass for m in system.masses]
    carried += [x for body in system.inertias for row in body.inertia for x in row]
    refuse_unanswered(system, carried, reporter)
    check_rigid_bodies(system, reporter)
    warn_of_negative_damping(system, reporter)
    free = tuple(i for i in range(len(system.v)) if i not in prescribed)
    multipliers = [
        tuple(graph.symbol(f"#multiplier {n}.{k}") for k in range(len(rows.residuals)))
        for n, rows in enumerate(system.constraints)
    ]
    raw = residual(system, multipliers)
    following = [n for row in system.drives if row.balanced for n in (*row.values, *row.rates)]
    steady = steady_inputs(system, [*raw, *system.xdot.values(), *following])
    driven = (
        dict(zip(driven, substitute(graph, list(driven.values()), steady), strict=True)) if steady else driven
    )
    still = {**resting(system), **sticking(system), **steady}
    xdot = substitute(graph, list(system.xdot.values()), {**driven, **still})
    state_rates = {system.rate(x): f for x, f in zip(system.xdot, xdot, strict=True)}
    before = {**state_rates, **driven, **still}
    refuse_unanswered(system, [*raw, *(n for rows in system.constraints for n in rows.residuals)], reporter)
    check_rates(system, substitute(graph, raw, steady) if steady else raw, reporter)
    every_row = without_empty(
        rows_of(system, multipliers, before), system, reporter, lambda: default_values(system)
    )
    check_count(every_row, reporter)
    check_held(system, every_row, driven, reporter)
    reporter.stop_on_errors()
    all_rows = tuple(row for row in every_row if row.constraint.mode is None)
    replies = _replies(system, raw, multipliers)
    found_apart: dict[Node, Node] = {}
    for name, symbols in (apart or {}).items():
        found_apart |= zip(symbols, replies.multipliers.get(name, ()), strict=False)
    if apart:
        replies = replace_fields(replies, multipliers={**replies.multipliers, **apart})
    sides: dict[Node, Side] = {}
    answered = _force_answers(system, every_row, replies, (*raw, *xdot), before)
    switched = _switched(system, every_row, multipliers, answered, sides)
    independent = _independent(system, all_rows, free, {**driven, **still}, reporter)
    rows, supports, values = independent.rows, independent.supports, independent.start
    kept = {row.multiplier for row in rows}
    kept |= {row.multiplier for row in switched}
    absent = {lam: graph.zero for group in multipliers for lam in group if lam not in kept}
    r = _reduced(system, substitute(graph, raw, before | absent), driven, free)
    if rows:
        from ..rows.singular import soften  # as rank.py, with numpy
        from ..rows.weights import give_weights

        always = COMPLIANCE in parts
        rows = give_weights(system, r, rows, free, independent.places, always=always)
        rows = soften(system, r, rows, free, values, always=always)
    if any(row.position is None for row in rows):
        from ..rows.integrable import note_integrable

        note_integrable(system, rows, values, reporter)
    laws = substitute(graph, [row.equation for row in switched], before | absent)
    unknowns = (*system.a, *(lam for group in multipliers for lam in group))
    formulas, forces = unknown_forces(system, (*r, *laws), xdot, answered, unknowns, sides, reporter)
    forces = replace_fields(forces, equations=tuple(substitute(graph, forces.equations, absent)))
    r, laws = formulas[: len(r)], formulas[len(r) :]
    switched = tuple(replace_fields(row, equation=n) for row, n in zip(switched, laws, strict=True))
    solved_rows = (*rows, *switched)
    whole = "structure" in parts
    found = accelerations(system, r, free, solved_rows, supports, forces, reporter, whole=whole)
    solution = {system.a[i]: a for i, a in zip(free, found.a, strict=True)}
    solution |= {row.multiplier: value for row, value in zip(solved_rows, found.multipliers, strict=True)}
    solution |= zip(forces.symbols, found.forces, strict=True)
    if forces.laws.formulas:
        try:
            known = solve_laws(graph, forces.laws, solution)
        except ZeroPivot:
            raise report_circle(system, forces.symbols, reporter) from None
        solution = dict(zip(solution, substitute(graph, list(solution.values()), known), strict=True))
    replace: dict[Node, Node] = {**driven, **still, **absent, **solution}
    if balanced:  # their rates may hold accelerations
        late = substitute(graph, [driven[n] for n in balanced], {**absent, **solution})
        replace |= zip(balanced, late, strict=True)
    shared = shares_of(system, rows, switched, free, {**driven, **still})
    if follows(system, shared, forces.symbols, answered):
        shared = {}
    with_shares = partial(_with_shares, system, shared, switched, r, free, rows)
    replace |= _asked_by_rates(system, answered, replace, with_shares)
    replace |= zip(state_rates, substitute(graph, list(state_rates.values()), replace), strict=True)
    power = _outer_power(system, solved_rows, raw, driven, {**state_rates, **still})
    alone = frozenset(_balanced(system, combined=False))  # their balances hold whatever else moves
    outside = {n: f for n, f in driven.items() if n not in alone}
    energy = energies(system, {**outside, **still}, free, power, friction_loss(system, switched))
    if balanced:
        energy = _with_balances(system, energy, {**replace, **state_rates})
    warn_of_counting_twice(system, energy.kinetic, {**driven, **still}, reporter)
    lost = {symbol for symbol, lam in found_apart.items() if lam in absent}
    replies = replace_fields(replies, dropped=frozenset({*absent, *lost}))
    reported = {n: f for n, f in answers(system, energy, replies, reporter).items() if n not in replace}
    by_limits = _asked_by_limits(system, switched)  # from limits shares are found: they follow none
    of_limits, of_others = sorted(by_limits & reported.keys()), sorted(reported.keys() - by_limits)
    reported |= zip(of_limits, told(system, shared, switched, [reported[n] for n in of_limits]), strict=True)
    reported |= zip(of_others, with_shares([reported[n] for n in of_others]), strict=True)
    replace |= zip(reported, substitute(graph, list(reported.values()), replace), strict=True)
    try:
        projected = projection(system, r, free, rows, supports) if rows else None
    except ZeroPivot as singular:  # what only friction or a constraint that switches holds
        raise Undetermined(partial(massless, system, r, free, rows, singular, reporter)) from None
    return Solved(
        driven=driven,
        free=free,
        rows=rows,
        all_rows=all_rows,
        switched=switched,
        sides=tuple(sides.values()),
        residual=tuple(r),
        projection=projected,
        energies=energy,
        pivots=found.elimination.pivots,
        asserted=found.determined,
        method=found.elimination.variant,
        operations=found.elimination.operations,
        graph=graph,
        replace=replace,
        shared=shared,
        held_inputs=held_inputs(system, steady),
        found_apart=found_apart,
    )


# ---------------------------------------------------------------- drives


def prescribed_motion(system: MechanicalSystem) -> tuple[dict[Node, Node], frozenset[int]]:
    """Return what replaces each driven coordinate, its rate and acceleration, and their indices in v."""
    graph = system.graph
    replace: dict[Node, Node] = {}
    for row in system.drives:
        replace |= {system.q[k].node: value for k, value in zip(row.q, row.values, strict=True)}
        for i, rate in zip(row.v, row.rates, strict=True):
            replace[system.v[i].node] = rate
            replace[system.a[i]] = system.rate(rate)
    states = {s.node for s in system.symbols.states}
    if any(states.intersection(graph.support(*row.rates)) for row in system.drives if not row.balanced):
        known = {system.rate(state): value for state, value in system.xdot.items()}
        replace = dict(zip(replace, substitute(graph, list(replace.values()), known), strict=True))
    for _ in range(
        3 * len(system.drives)
    ):  # drives may be given by others, rates and accelerations by places and rates
        if not graph.depend(replace.values(), replace.keys()):
            break
        replace = dict(zip(replace, substitute(graph, list(replace.values()), replace), strict=True))
    return replace, frozenset(i for row in system.drives for i in row.v)


def _reduced(
    system: MechanicalSystem, rows: list[Node], driven: Mapping[Node, Node], free: Sequence[int]
) -> list[Node]:
    """Return the equations of motion of the free coordinates with those of others that follow them by balances: virtual work."""
    graph = system.graph
    following = [i for row in system.drives if row.combined for i in row.v]
    if not following:
        return rows
    velocities = [system.v[i].node for i in free]
    entries = jacobian(graph, [driven[system.v[j].node] for j in following], velocities)
    for j, row in zip(following, entries, strict=True):
        for k, share in row.items():
            rows[free[k]] = graph.add(rows[free[k]], graph.mul(share, rows[j]))
    return rows


def _balanced(system: MechanicalSystem, *, combined: bool = True) -> tuple[Node, ...]:
    """Return the symbols of coordinates without mass, of their rates and accelerations that the balance of forces gives."""
    rows = [row for row in system.drives if row.balanced and (combined or not row.combined)]
    places = [system.q[k].node for row in rows for k in row.q]
    return (*places, *(n for row in rows for i in row.v for n in (system.v[i].node, system.a[i])))


def _with_balances(system: MechanicalSystem, energy: Energies, known: Mapping[Node, Node]) -> Energies:
    """Return energies with what the balance of forces decides put in, and without accounts where its rates are unknown."""
    graph = system.graph
    kinetic, potential, total, *powers = substitute(
        graph, [energy.kinetic, energy.potential, energy.total, energy.supplied, energy.dissipated], known
    )
    momenta = tuple(None if p is None else substitute(graph, [p], known)[0] for p in energy.momenta)
    energy = replace_fields(energy, kinetic=kinetic, potential=potential, total=total, momenta=momenta)
    unknown = graph.reached_among(powers, system.unknown_rates)
    if not unknown:
        return energy
    scalar = system.unknown_rates[min(unknown)]
    name = title(scalar) if isinstance(scalar, Query) else scalar.name
    reason = f"coordinates without mass follow '{name}', whose rate is unknown"
    return replace_fields(energy, supplied=graph.zero, dissipated=graph.zero, reason=energy.reason or reason)


def _check_starts(system: MechanicalSystem, driven: Mapping[Node, Node], reporter: Reporter) -> None:
    """Report driven coordinates that are declared to start elsewhere than their drive says."""
    if not any(row.q for row in system.drives):
        return
    values = default_values(system)
    for row in system.drives:
        for k in () if row.balanced else row.q:
            start = system.start_q[k]
            if not start.known or start.start is None:
                continue
            (prescribed,) = evaluate(system.graph, [driven[system.q[k].node]], values)
            (stated,) = evaluate(system.graph, [start.value], values)
            if abs(prescribed - stated) > START_TOLERANCE * max(1.0, abs(stated)):
                name = system.q[k].name
                reporter.error(
                    "E0508",
                    f"'{name}' starts at {stated:.6g} by its declaration and at {prescribed:.6g} by its drive",
                    start.start.origin.span,
                    caption="the initial value of a prescribed motion is not free",
                    labels=(Label(row.origin.span, "driven here"),),
                    help="leave its value out where the component is declared"
                    if "." in name
                    else f"declare it without a value, as in 'coordinate Length {name};'",
                )


def check_rates(system: MechanicalSystem, nodes: Sequence[Node], reporter: Reporter) -> None:
    """Report inputs and accelerations whose rates the formulas need; a rate that cancels is not needed."""
    graph = system.graph
    for n in sorted(graph.reached_among(nodes, system.unknown_rates)):
        scalar = system.unknown_rates[n]
        if all(graph.is_zero(d) for d in jvp(graph, nodes, {n: graph.one})):
            continue
        if isinstance(scalar, Delayed):
            reporter.error(
                "E0583",
                f"the equations need the rate of '{scalar.name}' as it was, which is unknown",
                scalar.span,
                caption="delayed here",
                help="delay the rate itself, as in 'delay(der(x), T)'; a constraint or a drive cannot depend on the past",
            )
            continue
        if isinstance(scalar, Query):
            reporter.error(
                "E0528",
                f"the equations need the rate of '{title(scalar)}', which is unknown",
                scalar.span,
                caption="the answer is a force, whose rate nothing determines",
                help="write the formula itself, in terms of coordinates and their rates",
            )
        elif scalar.variable.role is Role.INPUT:
            reporter.error(
                "E0523",
                f"the equations need the rate of the input '{scalar.name}', which is unknown",
                scalar.variable.origin.shown,
                caption="declared here",
                help=f"give it in the part: '{scalar.name.rpartition('.')[2]} = ...', 0 where it is held, a coordinate of its own where it is free"
                if "." in scalar.name
                else f"let formulas read it through a filter, which has rates: {scalar.name}(filter = 1 ms); a constant default keeps it as it is",
            )
        else:
            reporter.error(
                "E0527",
                f"derivatives of '{scalar.variable.name}' above the second are not available",
                scalar.variable.origin.shown,
                caption="something in the model asks for one",
            )
    reporter.stop_on_errors()


# ---------------------------------------------------------------- constraints


class _Independent(Struct, frozen=True):
    """Independent ``rows``, those of positions first; the free velocities on which each depends; numbers for everything at
    the ``start``; states on the constraints, with the matrix of the rows."""

    rows: tuple[Row, ...] = ()
    supports: tuple[frozenset[int], ...] = ()
    start: Mapping[Node, float] = {}
    places: tuple[RankPlace, ...] = ()


def _independent(
    system: MechanicalSystem,
    rows: tuple[Row, ...],
    free: Sequence[int],
    fixed: Mapping[Node, Node],
    reporter: Reporter,
) -> _Independent:
    """Return the independent rows, and name the others."""
    if not rows:
        return _Independent()
    from ..rows.rank import RankPlace, rank  # numpy is imported for models with constraints only

    values = default_values(system)
    if fixed:
        fixed = {n: f for n, f in fixed.items() if values.keys() >= set(system.graph.support(f))}
        numbers = evaluate(system.graph, list(fixed.values()), values)
        values |= dict(zip(fixed, numbers, strict=True))
    found = rank(system, rows, free, values)
    kept = sorted(found.independent, key=lambda i: rows[i].position is None)
    dropped: dict[str, list[Row]] = {}
    for i in sorted(set(range(len(rows))).difference(kept, found.unfulfilled)):
        dropped.setdefault(rows[i].constraint.name, []).append(rows[i])
    for group in dropped.values():
        report_superfluous(group, reporter)
    return _Independent(
        tuple(rows[i] for i in kept),
        tuple(found.supports[i] for i in kept),
        values,
        tuple(RankPlace(place.values, place.matrix[kept]) for place in found.places),
    )


def _switched(
    system: MechanicalSystem,
    rows: Sequence[Row],
    multipliers: Sequence[Sequence[Node]],
    forces: dict[Node, Node],
    sides: dict[Node, Side],
) -> tuple[Row, ...]:
    """Return those of the rows that have modes with the laws of these; ``sides`` and ``forces`` of laws are added."""
    plain = [row for row in rows if row.constraint.mode is not None]
    if not plain:
        return ()
    return with_modes(system, plain, [lam for group in multipliers for lam in group], forces, sides)


def _force_answers(
    system: MechanicalSystem,
    rows: Sequence[Row],
    replies: Replies,
    formulas: Sequence[Node],
    before: Mapping[Node, Node],
) -> dict[Node, Node]:
    """Return the answers about forces in accelerations, multipliers and each other, where the equations need any."""
    known = force_answers(system, replies)
    asked = system.lowering.questions.forces_in((*formulas, *known.values()))
    if all(row.constraint.mode is None for row in rows) and not asked:
        return {}
    return dict(zip(known, substitute(system.graph, list(known.values()), before), strict=True))


def _asked_by_rates(
    system: MechanicalSystem,
    answered: Mapping[Node, Node],
    known: Mapping[Node, Node],
    shared: Callable[[Sequence[Node]], list[Node]],
) -> dict[Node, Node]:
    """Return the answers that the rates of states ask for and nothing else, once the equations are solved."""
    asked = system.lowering.questions.forces_in(system.xdot.values())
    symbols = [s for s in asked if s in answered and s not in known]
    formulas = substitute(system.graph, shared([answered[s] for s in symbols]), known)
    return dict(zip(symbols, formulas, strict=True))


def _asked_by_limits(system: MechanicalSystem, switched: Sequence[Row]) -> set[Node]:
    """Return the questions about forces that limits of frictions ask."""
    modes = [row.constraint.mode for row in switched if row.constraint.mode is not None]
    limits = [(m.kinetic, m.static, m.backward, m.static_backward) for m in modes]
    return set(system.lowering.questions.forces_in([n for each in limits for n in each if n is not None]))


def _with_shares(
    system: MechanicalSystem,
    shared: Mapping[Node, Share],
    switched: Sequence[Row],
    reduced: Sequence[Node],
    free: Sequence[int],
    rows: Sequence[Row],
    answers: Sequence[Node],
) -> list[Node]:
    """Return answers about forces with what is shared, and with what constraints that always hold answer to that."""
    graph = system.graph
    held = {row.multiplier for row in rows}
    found = told(system, shared, switched, answers)
    if not shared or held.isdisjoint(graph.support(*answers)):
        return found
    beside = [(row.rate, shared[row.multiplier].beside) for row in switched if row.multiplier in shared]
    impulses = vjp(graph, beside, [system.v[i].node for i in free])
    _, added = _answer_impulses(system, reduced, free, rows, impulses)
    more = {row.multiplier: graph.add(row.multiplier, lam) for row, lam in zip(rows, added, strict=True)}
    return substitute(graph, found, more)


def _replies(system: MechanicalSystem, raw: Sequence[Node], multipliers: Sequence[Sequence[Node]]) -> Replies:
    """Return what is known of forces by name, while no row is left out."""
    named: dict[str, tuple[Node, ...]] = {}
    for constraint, symbols in zip(system.constraints, multipliers, strict=True):
        whole = constraint.mode.whole if constraint.mode is not None else ""
        if whole and whole != constraint.name:  # a part of its gap
            known = named.get(whole, (system.graph.zero,))
            named[whole] = (system.graph.add(known[0], *symbols),)
            continue
        named[constraint.name] = named.get(constraint.name, ()) + tuple(symbols)
    drives = {
        name: raw[i]
        for row in system.drives
        if not row.balanced
        for name, i in zip(row.names, row.v, strict=True)
    }
    return Replies(named, frozenset(), drives, joint_reactions(system, multipliers))


def _outer_power(
    system: MechanicalSystem,
    rows: Sequence[Row],
    raw: Sequence[Node],
    driven: Mapping[Node, Node],
    undriven: Mapping[Node, Node],
) -> Node:
    """Return -lam.b + P: the power of moving constraints, with b the part of their rate free of v, and of drives.

    ``undriven`` replaces rates of states and virtual displacements, and nothing that is driven.
    """
    graph = system.graph
    whole = [constraint_rates(system, row.constraint)[row.component] for row in rows]
    whole = substitute(graph, whole, undriven)
    along = jvp(graph, whole, {s.node: s.node for s in system.v})
    power = graph.zero
    for row, rate, part in zip(rows, whole, along, strict=True):
        power = graph.sub(power, graph.mul(row.multiplier, graph.sub(rate, part)))
    for drive in system.drives:
        for i in () if drive.balanced else drive.v:
            power = graph.add(power, graph.mul(raw[i], driven[system.v[i].node]))
    return power


def velocity_jumps(system: MechanicalSystem, solved: Solved, impulses: Sequence[Node]) -> tuple[Node, ...]:
    """Return d with M d - K^T mu = impulses and K d = 0, for the constraints that are never switched."""
    return answer_impulses(system, solved, impulses)[0]


def answer_impulses(
    system: MechanicalSystem, solved: Solved, impulses: Sequence[Node]
) -> tuple[tuple[Node, ...], tuple[Node, ...]]:
    """Return d and mu with M d - K^T mu = impulses and K d = 0, for the constraints that are never switched."""
    return _answer_impulses(system, solved.residual, solved.free, solved.rows, impulses)


def _answer_impulses(
    system: MechanicalSystem,
    reduced: Sequence[Node],
    free: Sequence[int],
    rows: Sequence[Row],
    impulses: Sequence[Node],
) -> tuple[tuple[Node, ...], tuple[Node, ...]]:
    graph = system.graph
    jumps = [graph.symbol(f"#jump {i}") for i in free]
    residual = [reduced[i] for i in free]
    inertia = jvp(graph, residual, dict(zip((system.a[i] for i in free), jumps, strict=True)))
    forces = jvp(graph, residual, {row.multiplier: row.multiplier for row in rows})
    along: Mapping[Node, Node] = {system.v[i].node: d for i, d in zip(free, jumps, strict=True)}
    held = jvp(graph, [row.rate for row in rows], along)
    equations = [graph.sub(graph.add(m, f), p) for m, f, p in zip(inertia, forces, impulses, strict=True)]
    equations = weighted(graph, equations, rows, held, jumps)
    unknowns = [*jumps, *(row.multiplier for row in rows)]
    found = solve(graph, [*equations, *held], unknowns)
    return found.solutions[: len(jumps)], found.solutions[len(jumps) :]

"""From the Lagrangian record to the equations of one model."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from mechc.lang.diagnostics import Reporter
from mechc.runtime.interface import AssertionEntry, ConstraintEntry
from mechc.runtime.methods import CONTACT_STEPS

from ..graph import DivisionByZero, Node
from ..graph.elimination.path_elimination import ZeroPivot
from ..graph.rewrite import substitute
from ..mechanics.defaults import default_formulas, first_values
from ..mechanics.meaning.symbols import Scalar
from ..mechanics.system import AssertionRow, InitialValue, MechanicalSystem
from .features import FEATURES, Draft
from .hybrid.crowd import crowd_of
from .hybrid.delays import with_past
from .model import Equations, Function, origin
from .needs import choices, needs
from .reported.entries import Layout, layout_of, parameter_rules
from .reported.initial_unknowns import initial_unknowns
from .reported.outputs import OutputList, list_outputs
from .rows.constraints import Projection
from .rows.crowd import CrowdMember, check_crowd, forces_by_name, set_apart
from .rows.prescribed_slips import with_prescribed_slips
from .rows.without_mass import with_balances, with_combined_balances
from .solve.accelerations import Undetermined, massless
from .solve.dead_symbols import without_dead_symbols
from .solve.solved import Solved, check_rates, prescribed_motion, solve_system

if TYPE_CHECKING:
    from .hybrid.told_laws import ToldLaws


def assemble(system: MechanicalSystem, reporter: Reporter, parts: Collection[str] = ()) -> Equations:
    """Return the equations of a model; report what makes them undetermined.

    ``parts`` are built whether the equations need them or not (needs.py): ``jacobian`` for implicit methods,
    ``momenta`` for the structure-preserving methods of constrained models, others for comparison.
    """
    if system.curve is not None:
        from .curves.assemble import assemble_curve

        return assemble_curve(system, system.curve, reporter, parts)
    try:
        return without_dead_symbols(_assemble(system, reporter, frozenset(parts)))
    except DivisionByZero:
        raise reporter.fail(
            "E0526",
            "the equations of motion divide by zero in every state",
            system.model.origin.span,
            caption="in this model",
            help="look for a quotient whose divisor vanishes with a prescribed motion or a constraint",
        ) from None


def _assemble(system: MechanicalSystem, reporter: Reporter, parts: frozenset[str]) -> Equations:
    system = with_balances(system, reporter)
    system = with_prescribed_slips(system, prescribed_motion(system)[0], reporter)
    system, members = set_apart(system, reporter)
    if members:
        check_crowd(system, members, parts, reporter)
    laws: ToldLaws | None = None
    if CONTACT_STEPS in parts and not members:
        from .hybrid.told_laws import with_told_laws

        system, laws = with_told_laws(system)
    try:
        solved = solve_system(system, reporter, parts, forces_by_name(system, members))
    except Undetermined as undecided:
        system = with_combined_balances(system, *prescribed_motion(system), undecided.told)
        try:
            solved = solve_system(system, reporter, parts, forces_by_name(system, members))
        except Undetermined:
            raise undecided.told() from None
    solved = with_past(system, solved, reporter)
    reporter.stop_on_errors()
    try:
        draft = _begun(system, solved, members, laws, reporter, parts)
        for feature in FEATURES:
            if feature.always or feature.name in parts:
                feature.build(draft)
    except ZeroPivot as singular:  # what only sticking friction or a closed contact holds
        raise massless(system, solved.residual, solved.free, solved.rows, singular, reporter) from None
    return _equations(draft)


def _begun(
    system: MechanicalSystem,
    solved: Solved,
    members: tuple[CrowdMember, ...],
    laws: ToldLaws | None,
    reporter: Reporter,
    parts: frozenset[str],
) -> Draft:
    """Return what every model has: rates, start, outputs, projections."""
    layout = layout_of(system, solved.driven, solved.energies, {*parts, "accounts"} if members else parts)
    listed = list_outputs(system, solved, layout, parts)
    found = initial_unknowns(system, solved, layout, _starts(system, layout), reporter)
    starts = found.starts
    functions = _functions(system, solved, layout, listed, starts, parts)
    crowd = crowd_of(system, solved, layout, members, listed.nodes, parts, reporter)
    if crowd is not None:
        functions = [Function(f.name, f.doc, crowd.outputs) if f.name == "outputs" else f for f in functions]
    check_rates(system, [n for f in functions for n in f.outputs], reporter)
    return Draft(system, solved, layout, listed, found, members, crowd, laws, reporter, parts, functions)


def _equations(draft: Draft) -> Equations:
    system, solved, layout, listed = draft.system, draft.solved, draft.layout, draft.listed
    everything = (*draft.functions, *draft.behind)
    described: dict[str, Any] = {
        "discretes": layout.discretes,
        "conserved": listed.conserved,
        **draft.described,
    }
    facts = needs(system, layout, everything, described.get("switching"))
    return Equations(
        name=system.model.name,
        doc=system.model.doc,
        graph=system.graph,
        layout={**layout.slots, **draft.slots},
        nq=layout.nq,
        nv=layout.nv,
        nx=layout.nx,
        time=layout.time,
        states=layout.states,
        parameters=layout.parameters,
        parameter_rules=parameter_rules(system),
        inputs=layout.inputs,
        held_inputs=solved.held_inputs,
        outputs=listed.entries,
        known=tuple(b.known for b in draft.found.starts),
        starts=tuple(origin(b.start.origin.shown) if b.start else None for b in draft.found.starts),
        functions=everything,
        needs=facts,
        choices=choices(system, solved, facts, draft.parts),
        rotations=_rotations(system, layout),
        assertions=tuple(
            AssertionEntry(a.message, origin(a.origin.shown)) for a in _asserted(system, solved)
        ),
        energy_balance=listed.energy_balance,
        dependent=tuple(k for k, b in enumerate(draft.found.starts) if b.by_others is not None),
        found_states=draft.found.states,
        constraints=_constraint_entries(solved),
        separable=_separable(system, layout, draft.functions),
        **described,
    )


# ---------------------------------------------------------------- functions


def _functions(
    system: MechanicalSystem,
    solved: Solved,
    layout: Layout,
    listed: OutputList,
    starts: Sequence[InitialValue],
    parts: frozenset[str],
) -> list[Function]:
    resolve, values = solved.resolve, [b.value for b in starts]
    functions = [
        Function("rhs", "time derivative of the state", resolve(_rates(system, solved, layout))),
        Function("initial", "initial state, as far as it is known or guessed", resolve(values)),
        *_initial_of_others(solved, starts),
        Function("outputs", "everything reported beside the state", resolve(listed.nodes)),
    ]
    if layout.inputs:
        formulas = default_formulas(system, system.symbols.inputs)
        inputs = resolve(_of_each(system, system.symbols.inputs, formulas))
        functions.append(Function("inputs", "default of each input at time t", inputs))
    if layout.discretes:
        discretes = resolve(_of_each(system, system.symbols.discretes, first_values(system)))
        functions.append(Function("discretes", "initial discrete variables", discretes))
    projected = _projection(system, solved, parts)
    if projected is not None:
        functions += _projections(system, solved, projected, layout)
    if asserted := [a.condition for a in _asserted(system, solved)]:
        functions.append(Function("assertions", "1 where an assertion holds, else 0", resolve(asserted)))
    return functions


def _rates(system: MechanicalSystem, solved: Solved, layout: Layout) -> list[Node]:
    accounts = {"energy.supplied": solved.energies.supplied, "energy.dissipated": solved.energies.dissipated}
    return [
        *(system.qdot[k] for k in layout.q_indices),
        *(system.a[i] for i in layout.v_indices),
        *(system.rate(s.node) for s in system.symbols.states),
        *(system.qdot[k] for k in layout.first_order),
        *(row.rates[0] for row in layout.guesses),
        *(accounts[name] for name in layout.accounts),
    ]


def _projection(system: MechanicalSystem, solved: Solved, parts: frozenset[str]) -> Projection | None:
    """Return the projection onto the constraints; one that moves nothing where it is only asked for."""
    if solved.projection is not None or "projection" not in parts:
        return solved.projection
    nothing = (system.graph.zero,) * len(solved.free)
    return Projection(nothing, (), nothing, ())


def _asserted(system: MechanicalSystem, solved: Solved) -> tuple[AssertionRow, ...]:
    return (*system.assertions, *solved.asserted)


def _constraint_entries(solved: Solved) -> tuple[ConstraintEntry, ...]:
    return tuple(
        ConstraintEntry(
            row.title,
            "velocity" if row.position is None else "position",
            row.constraint.units[row.component],
            origin(row.constraint.origin.shown),
        )
        for row in solved.rows
    )


def _separable(system: MechanicalSystem, layout: Layout, functions: Sequence[Function]) -> bool:
    """Whether q' = v, there are no first-order states but accounts, and accelerations do not depend on velocities."""
    rhs = next(f for f in functions if f.name == "rhs")
    forces = rhs.outputs[layout.nq : layout.nq + layout.nv]
    return (
        layout.nx == len(layout.guesses) + len(layout.accounts)
        and layout.nq == layout.nv  # of what is driven by its rate only the place is a state
        and not system.rotations
        and not layout.constrained
        and not system.graph.depend(forces, system.symbols.velocities)
    )


def _projections(
    system: MechanicalSystem, solved: Solved, found: Projection, layout: Layout
) -> list[Function]:
    """Return the functions that move a state onto the constraints; what is prescribed stays."""
    from .momenta import dense

    resolve = solved.resolve
    still = {s.node: system.graph.zero for i, s in enumerate(system.v) if i not in solved.free}
    moves = substitute(system.graph, [system.qdot[k] for k in layout.q_indices], still)
    near = "how near a singular position is: the largest share of a compliance in its row of constraints"
    closeness = [] if found.closeness is None else [Function("closeness", near, resolve([found.closeness]))]
    return [
        *closeness,
        Function(
            "project_position",
            "correction of the coordinates in velocity space, then the residuals of position constraints",
            resolve([*found.position, *found.position_residuals]),
        ),
        Function(
            "project_velocity",
            "correction of the velocities, then the residuals of velocity constraints",
            resolve([*found.velocity, *found.velocity_residuals]),
        ),
        Function(
            "constraints",
            "residuals of the position constraints, then K v + b",
            resolve([*found.position_residuals, *found.velocity_residuals]),
        ),
        Function(
            "constraint_jacobian",
            "K, row by row",
            resolve(dense(system, found.velocity_residuals, [system.v[i].node for i in solved.free])),
        ),
        Function(
            "displace",
            "N(q) d: change of the coordinates, with the correction d instead of v",
            resolve(moves),
        ),
    ]


def _initial_of_others(solved: Solved, starts: Sequence[InitialValue]) -> list[Function]:
    """Return the function of the initial values that are stated with those of others, if there are any."""
    nodes = [b.by_others for b in starts if b.by_others is not None]
    if not nodes:
        return []
    return [
        Function(
            "initial_of_others", "initial values that are stated with those of others", solved.resolve(nodes)
        )
    ]


def _starts(system: MechanicalSystem, layout: Layout) -> list[InitialValue]:
    """Return the initial value of each number of the state."""
    zero = InitialValue(system.graph.zero, True, None)
    return [
        *(system.start_q[k] for k in layout.q_indices),
        *(system.start_v[i] for i in layout.v_indices),
        *system.start_x,
        *(system.start_q[k] for k in layout.first_order),
        *(InitialValue(row.guess[1], True, None) for row in layout.guesses if row.guess is not None),
        *(zero for _ in layout.accounts),
    ]


def _of_each(
    system: MechanicalSystem, scalars: Sequence[Scalar], formulas: Mapping[Node, Node]
) -> list[Node]:
    """Return the formula of each number; zero where none is stated."""
    return [formulas.get(s.node, system.graph.zero) for s in scalars]


def _rotations(system: MechanicalSystem, layout: Layout) -> tuple[int, ...]:
    """Return the first index in y of each rotation; prescribed coordinates and those without mass are not among the coordinates there."""
    return tuple(layout.q_indices.index(q) for q, _ in system.rotations if q in layout.q_indices)

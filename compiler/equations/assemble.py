"""From the Lagrangian record to the equations of one model."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from mechc.lang.diagnostics import Reporter

from ..graph import DivisionByZero, Node
from ..graph.differentiate import jacobian, vjp
from ..graph.elimination.path_elimination import ZeroPivot
from ..graph.rewrite import substitute
from ..mechanics.defaults import default_formulas, first_values
from ..mechanics.meaning.symbols import Scalar
from ..mechanics.system import InitialValue, MechanicalSystem
from .curves.assemble import assemble_curve
from .hybrid.crowd import crowd_of
from .hybrid.switching import add_events
from .jacobian import jacobian_of_rates
from .local_derivatives import bias, local_derivatives, second_order
from .model import AssertionText, ConstraintEntry, Entry, Equations, Function, Offer, ParameterRule, Slot
from .needs import choices, needs
from .offered import offered
from .reported.assembly import assembly
from .reported.entries import Layout, layout_of
from .reported.experiments import experiment_plans
from .reported.matter import matter_of
from .reported.outputs import OutputList, list_outputs
from .reported.phase import phase_functions
from .reported.scene import scene_of
from .reported.sought import Systems, systems_of
from .rows.constraints import Projection, Row
from .rows.crowd import check_askers, check_crowd, forces_by_name, set_apart
from .rows.prescribed_slips import with_prescribed_slips
from .sensitivities import passing_on
from .solve.accelerations import massless
from .solve.dead_symbols import without_dead_symbols
from .solve.solved import Solved, check_rates, prescribed_motion, solve_system


def assemble(system: MechanicalSystem, reporter: Reporter, parts: Collection[str] = ()) -> Equations:
    """Return the equations of a model; report what makes them undetermined.

    ``parts`` are built whether the equations need them or not (needs.py): ``jacobian`` for implicit methods,
    ``momenta`` for the structure-preserving methods of constrained models, others for comparison.
    """
    if system.curve is not None:
        return assemble_curve(system, system.curve, reporter, parts)
    try:
        return without_dead_symbols(_assemble(system, reporter, frozenset(parts)))
    except DivisionByZero:
        raise reporter.fail(
            "E0526",
            "the equations of motion divide by zero whatever the state",
            system.model.origin.span,
            caption="in this model",
            help="look for a quotient whose divisor vanishes with a prescribed motion or a constraint",
        ) from None


def _assemble(system: MechanicalSystem, reporter: Reporter, parts: frozenset[str]) -> Equations:
    system = with_prescribed_slips(system, prescribed_motion(system)[0], reporter)
    system, members = set_apart(system, reporter)
    if members:
        check_crowd(system, members, parts, reporter)
    solved = solve_system(system, reporter, parts, forces_by_name(members))
    reporter.stop_on_errors()
    layout = layout_of(system, solved.driven, solved.energies, {*parts, "accounts"} if members else parts)
    try:
        listed = list_outputs(system, solved, layout, parts)
        starts = _starts(system, layout)
        functions = _functions(system, solved, layout, listed, starts, parts)
        crowd = crowd_of(system, solved, layout, members, listed.nodes, reporter)
        if crowd is not None:
            functions = tuple(
                Function(f.name, f.doc, crowd.outputs) if f.name == "outputs" else f for f in functions
            )
        check_rates(system, [n for f in functions for n in f.outputs], reporter)
        assembled, assembly_functions = assembly(system, solved, layout, reporter)
        functions = (*functions, *assembly_functions)
        if "momenta" in parts:
            functions = (*functions, *_momentum_functions(system, solved))
        hybrid = add_events(system, solved, layout, functions, listed.entries, reporter, parts, crowd)
    except ZeroPivot as singular:  # what only sticking friction or a closed contact holds
        raise massless(system, solved.residual, solved.free, solved.rows, singular, reporter) from None
    if hybrid is not None:
        layout, functions = hybrid.layout, hybrid.functions
    plans, plan_functions = experiment_plans(system, layout, reporter)
    reporter.stop_on_errors()
    pattern: tuple[tuple[int, int], ...] = ()
    if "jacobian" in parts:
        derivatives, pattern = jacobian_of_rates(system, layout, functions)
        functions = (*functions, derivatives)
    scene, scene_functions = None, tuple[Function, ...]()
    if "scene" in parts:
        scene, scene_functions = scene_of(system, solved, layout, reporter)
    patterns: dict[str, tuple[tuple[int, int], ...]] = {}
    if "local_derivatives" in parts:
        derivatives, patterns[derivatives.name] = local_derivatives(system, solved, layout, functions)
        functions = (*functions, derivatives)
    if "second_order" in parts:
        derivatives, patterns[derivatives.name] = second_order(system, solved, layout)
        functions = (*functions, derivatives, bias(system, solved))
    phase: tuple[Entry, ...] = ()
    if "phase" in parts:
        rhs = next(f for f in functions if f.name == "rhs")
        found = phase_functions(system, solved, layout, rhs.outputs)
        phase, functions = found.entries, (*functions, *found.functions)
    matter: tuple[Entry, ...] = ()
    if "matter" in parts:
        bodies = matter_of(system, solved, layout)
        matter, functions = bodies.entries, (*functions, *bodies.functions)
    sought = systems_of(system, solved, listed.entries) if crowd is None else Systems()
    everything = (*functions, *plan_functions, *scene_functions, *sought.functions)
    discretes, slots = layout.discretes, {**layout.slots, **sought.slots}
    if crowd is not None:
        slots, everything = {**slots, **crowd.slots}, (*everything, *crowd.functions)
        check_askers(system, members, everything, reporter)
    offers: tuple[Offer, ...] = ()
    if "functions" in parts:
        given = offered(system, solved, layout, functions, listed.entries)
        offers, everything = given.offers, (*everything, *given.functions)
        slots = {**slots, **{n: Slot("z", len(discretes) + k) for k, n in enumerate(given.seeds)}}
        discretes = (*discretes, *given.entries)
        branches = hybrid.plan.branches if hybrid is not None else ()
        first = len(layout.states) + len(layout.discretes)
        everything = _with_zeros(
            "discretes", tuple(passing_on(everything, branches, first, given.seeds)), system, len(given.seeds)
        )
    facts = needs(system, layout, everything, hybrid.plan if hybrid is not None else None)
    return Equations(
        name=system.model.name,
        doc=system.model.doc,
        graph=system.graph,
        layout=slots,
        nq=layout.nq,
        nv=layout.nv,
        nx=layout.nx,
        time=layout.time,
        states=layout.states,
        parameters=layout.parameters,
        parameter_rules=_parameter_rules(system),
        inputs=layout.inputs,
        discretes=discretes,
        outputs=listed.entries,
        known=tuple(b.known for b in starts),
        start_spans=tuple(b.start.origin.shown if b.start else None for b in starts),
        functions=everything,
        experiments=plans,
        needs=facts,
        choices=choices(system, solved, facts, parts),
        rotations=_rotations(system),
        assertions=tuple(
            AssertionText(a.message, a.origin.shown) for a in (*system.assertions, *solved.asserted)
        ),
        conserved=() if hybrid is not None and hybrid.jumps else listed.conserved,
        energy_balance=listed.energy_balance,
        jacobian_pattern=pattern,
        patterns=patterns,
        dependent=tuple(k for k, b in enumerate(starts) if b.by_others is not None),
        constraints=_constraint_entries(solved),
        assembly=assembled,
        separable=_separable(system, layout, functions),
        phase=phase,
        matter=matter,
        offers=offers,
        given=crowd.given if crowd is not None else sought.given,
        sought=sought.plans,
        hybrid=hybrid.plan if hybrid is not None else None,
        scene=scene,
    )


# ---------------------------------------------------------------- functions


def _functions(
    system: MechanicalSystem,
    solved: Solved,
    layout: Layout,
    listed: OutputList,
    starts: Sequence[InitialValue],
    parts: frozenset[str],
) -> tuple[Function, ...]:
    resolve = solved.resolve
    accounts = {"energy.supplied": solved.energies.supplied, "energy.dissipated": solved.energies.dissipated}
    rates = [
        *(system.qdot[k] for k in layout.q_indices),
        *(system.a[i] for i in layout.v_indices),
        *(system.rate(s.node) for s in system.symbols.states),
        *(accounts[name] for name in layout.accounts),
    ]
    functions = [
        Function("rhs", "time derivative of the state", resolve(rates)),
        Function(
            "initial",
            "initial state, as far as it is known or guessed",
            resolve([b.value for b in starts]),
        ),
        *_initial_of_others(solved, starts),
        Function(
            "outputs",
            "everything reported beside the state",
            resolve(listed.nodes),
        ),
    ]
    if layout.inputs:
        functions.append(
            Function(
                "inputs",
                "default of each input at time t",
                resolve(
                    _of_each(system, system.symbols.inputs, default_formulas(system, system.symbols.inputs))
                ),
            )
        )
    if layout.discretes:
        functions.append(
            Function(
                "discretes",
                "initial discrete variables",
                resolve(_of_each(system, system.symbols.discretes, first_values(system))),
            )
        )
    projected = solved.projection
    if projected is None and "projection" in parts:
        nothing = (system.graph.zero,) * len(solved.free)
        projected = Projection(nothing, (), nothing, ())
    if projected is not None:
        functions += _projections(system, solved, projected, layout)
    assertions = (*system.assertions, *solved.asserted)
    if assertions:
        functions.append(
            Function(
                "assertions",
                "1 where an assertion holds, else 0",
                resolve([a.condition for a in assertions]),
            )
        )
    return tuple(functions)


def _with_zeros(
    name: str, functions: Sequence[Function], system: MechanicalSystem, count: int
) -> tuple[Function, ...]:
    """Return functions with so many zeros behind the results of one, which need not be there yet."""
    zeros = (system.graph.zero,) * count
    found = next((f for f in functions if f.name == name), Function(name, "initial discrete variables", ()))
    others = tuple(f for f in functions if f.name != name)
    return (*others, Function(name, found.doc, (*found.outputs, *zeros))) if zeros else tuple(functions)


def _constraint_entries(solved: Solved) -> tuple[ConstraintEntry, ...]:
    return tuple(
        ConstraintEntry(
            row.title,
            "velocity" if row.position is None else "position",
            row.constraint.units[row.component],
            row.constraint.origin.shown,
        )
        for row in solved.rows
    )


def _separable(system: MechanicalSystem, layout: Layout, functions: Sequence[Function]) -> bool:
    """Whether q' = v, there are no first-order states but accounts, and accelerations do not depend on velocities."""
    rhs = next(f for f in functions if f.name == "rhs")
    forces = rhs.outputs[layout.nq : layout.nq + layout.nv]
    return (
        layout.nx == len(layout.accounts)
        and layout.nq == layout.nv  # of what is driven by its rate only the place is a state
        and not system.rotations
        and not layout.constrained
        and not system.graph.depend(forces, system.symbols.velocities)
    )


def _projections(
    system: MechanicalSystem, solved: Solved, found: Projection, layout: Layout
) -> list[Function]:
    """Return the functions that move a state onto the constraints; what is prescribed stays."""
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
            resolve(_dense(system, found.velocity_residuals, [system.v[i].node for i in solved.free])),
        ),
        Function(
            "displace",
            "N(q) d: change of the coordinates, with the correction d in the place of v",
            resolve(moves),
        ),
    ]


def _momentum_functions(system: MechanicalSystem, solved: Solved) -> list[Function]:
    """Return p = dL/dv, dL/dq + Q without the forces of constraints, and dp/dv."""
    graph = system.graph
    values = [p for p in solved.energies.momenta if p is not None]
    velocities = [system.v[i].node for i in solved.free]
    rubbing = vjp(
        graph, [(row.rate, row.multiplier) for row in solved.switched if _is_smooth(row)], velocities
    )
    given = [solved.energies.forces[i] for i in solved.free]
    forces = solved.resolve([graph.add(q, f) for q, f in zip(given, rubbing, strict=True)])
    return [
        Function("momentum", "dL/dv", tuple(values)),
        Function("force", "dL/dq + Q, without the forces of constraints", forces),
        Function("mass", "d(dL/dv)/dv, row by row", tuple(_dense(system, values, velocities))),
    ]


def _is_smooth(row: Row) -> bool:
    """Whether a row is that of a friction whose law is smooth: its force is known, as that of a load is."""
    mode = row.constraint.mode
    return mode is not None and mode.smooth is not None


def _dense(system: MechanicalSystem, rows: Sequence[Node], wrt: Sequence[Node]) -> list[Node]:
    """Return a Jacobian with its zeros, row by row."""
    zero = system.graph.zero
    return [row.get(j, zero) for row in jacobian(system.graph, rows, wrt) for j in range(len(wrt))]


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
        *(zero for _ in layout.accounts),
    ]


def _of_each(
    system: MechanicalSystem, scalars: Sequence[Scalar], formulas: Mapping[Node, Node]
) -> list[Node]:
    """Return the formula of each number; zero where none is stated."""
    return [formulas.get(s.node, system.graph.zero) for s in scalars]


def _parameter_rules(system: MechanicalSystem) -> tuple[ParameterRule, ...]:
    formulas = default_formulas(system, system.symbols.parameters)
    return tuple(
        ParameterRule(k, formulas[s.node])
        for k, s in enumerate(system.symbols.parameters)
        if s.node in formulas
    )


def _rotations(system: MechanicalSystem) -> tuple[int, ...]:
    """Return the first index in y of each rotation; driven coordinates are not in y."""
    gone = {k for row in system.drives for k in row.q}
    kept = [k for k in range(len(system.q)) if k not in gone]
    return tuple(kept.index(q) for q, _ in system.rotations if q not in gone)

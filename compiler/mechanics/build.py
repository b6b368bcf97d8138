"""From a flat model to its Lagrangian record."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from mechc.lang.diagnostics import Label, Reporter

from ..flat.model import (
    Definition,
    DefinitionRole,
    Derivative,
    Element,
    Expression,
    FlatModel,
    Kind,
    Name,
    Query,
)
from ..flat.subscripts import element_name, subscripts
from ..graph import Graph, Node
from ..graph.operations import RATE
from ..graph.rewrite import substitute
from .closures import closure_rows, constraint_rows
from .contacts import contact_rows, switchable
from .drives_by_states import by_states
from .driving_inputs import can_drive, with_rates
from .events import branch_rows
from .families import families
from .forces import damping, efforts
from .initial import initial_values
from .input_ranges import ranges
from .instants import check_instants, check_past
from .kinematics.frames import Frame, displaced, pose_between
from .kinematics.planar import Planar
from .kinematics.pose import Pose, inverse
from .kinematics.rates import TotalDerivative
from .kinematics.reactions import VirtualDisplacement, displace, reactions_formed, whole_reaction
from .kinematics.spatial import Spatial
from .kinematics.topology import Topology, TreeEdge, classify
from .matter import Matter
from .meaning.delays import Delayed
from .meaning.lower import Lowering
from .meaning.questions import Questions
from .meaning.symbols import Scalar, Symbols, declare
from .no_effect import refuse, warn_of_idle
from .parameter_values import check_known_beforehand
from .sliding import warn_of_sliding
from .system import AssertionRow, Curve, ExactRow, MechanicalSystem, OutputRow


def build(model: FlatModel, reporter: Reporter, *, by_value: bool = True) -> MechanicalSystem:
    """Return the Lagrangian record of a flat model; report what it cannot be."""
    refuse(model, reporter)
    topology = classify(model, reporter)
    reporter.stop_on_errors()
    graph = Graph(by_value=by_value)
    symbols = declare(graph, model, topology.dropped)
    rate, unknown_rates = _rates(graph, symbols, () if model.variation is None else model.variation.unknown)
    kinematics = Spatial(graph, rate) if model.space == 3 else Planar(graph, rate)
    frictions = frozenset(f.name for f in model.frictions)
    questions = Questions(graph, rate, frictions, unknown_rates, reporter)
    lowering = Lowering(
        graph,
        symbols,
        {d.name: d for d in model.definitions},
        rate,
        kinematics,
        lambda definition: _unplaced(definition, reporter),
        questions,
        reporter,
        model,
    )
    formed = reactions_formed(model)
    matter = Matter(lowering, model, symbols, reporter)
    virtual = _place_frames(lowering, topology, formed)
    _lower_frames(lowering, model)
    curve = None
    if model.variation is not None:
        from .curves import curve_of

        curve = curve_of(lowering, model, model.variation, symbols, matter)
    xdot = _known_rates(graph, rate, _state_equations(lowering, model, symbols, reporter), symbols, reporter)
    for state, value in xdot.items():
        rate.define(rate(state), rate(value))
    closures = closure_rows(lowering, model, topology, formed, virtual, symbols, reporter)
    _ask_whole(lowering, model, virtual)
    masses, inertias = matter.masses, matter.inertias
    if isinstance(kinematics, Spatial):
        kinematics.field = next((m.field for m in masses if m.field is not None), None)
    kinetic, potential, lagrangian, dissipation = matter.energies()
    stated = () if curve is not None else constraint_rows(lowering, model, symbols, reporter)
    constraints = (
        *switchable(lowering, model, (*closures, *stated)),
        *contact_rows(lowering, model, symbols, matter.driven, reporter),
    )
    q = tuple(s for c in symbols.coordinates for s in c.q)
    v = tuple(s for c in symbols.coordinates for s in c.v)
    drives = by_states(graph, rate, symbols, matter.drives, xdot, model, reporter)
    driven = frozenset(
        n for row in drives for n in (*(q[k].node for k in row.q), *(v[i].node for i in row.v))
    )
    symbols, known = with_rates(graph, rate, symbols, drives)
    for n in known:
        del unknown_rates[n]
    system = MechanicalSystem(
        model=model,
        graph=graph,
        symbols=symbols,
        kinematics=kinematics,
        rate=rate,
        lowering=lowering,
        topology=topology,
        q=q,
        v=v,
        a=tuple(a for c in symbols.coordinates for a in c.a),
        qdot=tuple(n for c in symbols.coordinates for n in c.qdot),
        rotations=_rotations(symbols),
        masses=masses,
        inertias=inertias,
        kinetic=kinetic,
        potential=potential,
        lagrangian=lagrangian,
        dissipation=graph.add(dissipation, damping(lowering, model, symbols)),
        efforts=efforts(lowering, model, symbols, reporter),
        constraints=constraints,
        families=families(lowering, model),
        drives=drives,
        xdot=xdot,
        unknown_rates=unknown_rates,
        **initial_values(lowering, model, symbols, reporter),
        outputs=_outputs(lowering, model),
        exacts=_exacts(lowering, model, reporter),
        assertions=tuple(
            AssertionRow(*row)
            for row in (
                *((lowering.reported(a.condition)[0], a.message, a.origin) for a in model.assertions),
                *((c.holds, c.message, c.origin) for c in lowering.unknowns.conditions),
                *lowering.tables.conditions.values(),
                *lowering.periods.values(),
                *lowering.apart.values(),
            )
        )
        + tuple(ranges(lowering, model, symbols)),
        queries=questions.asked,
        virtual=virtual,
        branches=branch_rows(lowering, model, symbols, constraints, driven, reporter),
        curve=_finished(lowering, curve),
    )
    if curve is None:
        check_known_beforehand(system, reporter)
        check_instants(system, reporter)
        check_past(system, reporter)
        warn_of_idle(system, matter.statements, reporter)
        warn_of_sliding(system, matter.statements, reporter)
    reporter.stop_on_errors()
    return system


def _finished(lowering: Lowering, curve: Curve | None) -> Curve | None:
    """Return a curve with the numbers of the whole that all else asks for."""
    if curve is None:
        return None
    from .curves import finished

    return finished(lowering, curve)


def _rates(
    graph: Graph, symbols: Symbols, constant: Sequence[str]
) -> tuple[TotalDerivative, dict[Node, Scalar | Query | Delayed]]:
    """Return the total derivative: q' = N v, v' = a, t' = 1; rates of states are symbols of their own.

    So are the rates of inputs and of accelerations, which nothing determines: they are returned with what they are
    rates of, so that formulas which need them can be refused. ``constant`` are coordinates that are numbers of a curve.
    """
    rates = {symbols.time: graph.constant(1)}
    unknown: dict[Node, Scalar | Query | Delayed] = {}
    for coordinate in symbols.coordinates:
        for s, qdot in zip(coordinate.q, coordinate.qdot, strict=True):
            rates[s.node] = qdot
        for s, a in zip(coordinate.v, coordinate.a, strict=True):
            rates[s.node] = a
            _unknown_rates(graph, s, a, rates, unknown)
    for s in symbols.states:
        rates[s.node] = graph.symbol(f"der({s.name})")
    for s in symbols.inputs:
        _unknown_rates(graph, s, s.node, rates, unknown)
    return TotalDerivative(graph, rates), unknown


def _unknown_rates(
    graph: Graph,
    scalar: Scalar,
    node: Node,
    rates: dict[Node, Node],
    unknown: dict[Node, Scalar | Query | Delayed],
) -> None:
    for order in (1, 2):
        of = graph.name(node)
        rates[node] = graph.symbol(f"der({of})" if can_drive(scalar) else f"#rate {order} of {of}", RATE)
        node = rates[node]
        unknown[node] = scalar


def _rotations(symbols: Symbols) -> tuple[tuple[int, int], ...]:
    """Return (first index in q, first index in v) of each rotation."""
    result, nq, nv = [], 0, 0
    for coordinate in symbols.coordinates:
        if coordinate.is_rotation:
            result.append((nq, nv))
        nq, nv = nq + len(coordinate.q), nv + len(coordinate.v)
    return tuple(result)


# ---------------------------------------------------------------- frames


def _unplaced(definition: Definition, reporter: Reporter) -> Frame:
    raise reporter.fail(
        "E0514",
        f"the frame '{definition.name}' is used, but nothing places it",
        definition.origin.span,
        caption="free frame",
        help="a joint or a value must place it",
    )


def _place_frames(
    lowering: Lowering, topology: Topology, formed: frozenset[str]
) -> dict[str, VirtualDisplacement]:
    """Give every free frame of the tree its frame, from the root outwards; return the virtual displacements."""
    virtual: dict[str, VirtualDisplacement] = {}
    graph = lowering.graph
    for edge in topology.tree:
        frame, rest = _end_of_joint(lowering, edge)
        name = edge.joint.name
        if name in formed:
            virtual[name] = displace(
                graph, lowering.rate, frame, lowering.kinematics.size, name, opposite=edge.backwards
            )
            frame = virtual[name].frame
        lowering.assign(edge.root, displaced(graph, frame, rest))
    return virtual


def _ask_whole(lowering: Lowering, model: FlatModel, virtual: Collection[str]) -> None:
    """Ask for force and moment of each joint whose reaction is formed, for the laws of the bodies."""
    for joint in model.joints:
        if joint.name in virtual:
            for query in whole_reaction(joint, lowering.kinematics.size):
                lowering.value(query)


def _end_of_joint(lowering: Lowering, edge: TreeEdge) -> tuple[Frame, Pose]:
    """Return where the joint ends, and the pose from there to the free frame that it places.

    That pose is nothing where the free frame is the ``to`` side. Where the joint reaches it through a derived frame
    or from its ``to`` side, the equation to = from * T is evaluated with a provisional root.
    """
    joint = edge.joint
    if not edge.backwards and joint.target == edge.root:
        return lowering.frame(joint.value), ()
    provisional = Frame(None, None, 0)
    with lowering.trial():
        lowering.assign(edge.root, provisional)
        target, value = lowering.named(joint.target), lowering.frame(joint.value)
    assert isinstance(target, Frame)
    loose, fixed = (value, target) if edge.backwards else (target, value)
    pose = pose_between(loose, provisional)
    assert pose is not None
    return fixed, inverse(lowering.graph, pose)


def _lower_frames(lowering: Lowering, model: FlatModel) -> None:
    """Lower frames and points in the order of declaration, so that long chains need no deep recursion."""
    for definition in model.definitions:
        if definition.value is not None and definition.role in (DefinitionRole.FRAME, DefinitionRole.POINT):
            lowering.named(definition.name)


# ---------------------------------------------------------------- equations of states, and what is reported


def _state_equations(
    lowering: Lowering, model: FlatModel, symbols: Symbols, reporter: Reporter
) -> dict[Node, Node]:
    """Return f by the symbol of each state; report states without an equation and with two."""
    nodes = {(s.variable.name, s.indices): s.node for s in symbols.states}
    result: dict[Node, Node] = {}
    for equation in model.equations:
        keys = [
            key
            for key in nodes
            if key[0] == equation.state and key[1][: len(equation.indices)] == equation.indices
        ]
        values = lowering.numbers(equation.value)
        if len(values) == 1:
            values = values * len(keys)
        for key, value in zip(keys, values, strict=True):
            if nodes[key] in result:
                reporter.error(
                    "E0515",
                    f"state '{element_name(*key)}' has two equations",
                    equation.origin.span,
                    caption="second one",
                )
            result[nodes[key]] = value
    for s in symbols.states:
        if s.node not in result:
            reporter.error(
                "E0516",
                f"state '{s.name}' has no equation",
                s.variable.origin.span,
                caption="declared here",
                help=f"add 'equation der({s.name}) = ...;'",
            )
    return result


def _known_rates(
    graph: Graph,
    rate: TotalDerivative,
    xdot: Mapping[Node, Node],
    symbols: Symbols,
    reporter: Reporter,
) -> dict[Node, Node]:
    """Return f without rates of states, which stand in it by their own f; report one that leads back to itself."""
    states = {rate(state): state for state in xdot}
    asked = {x: [states[n] for n in graph.support(f) if n in states] for x, f in xdot.items()}
    if not any(asked.values()):
        return dict(xdot)
    known: dict[Node, Node] = {}

    def settle(state: Node, before: tuple[Node, ...]) -> None:
        if state in known:
            return
        if state in before:
            scalar = next(s for s in symbols.states if s.node == state)
            raise reporter.fail(
                "E0207",
                f"'der({scalar.name})' is defined by itself",
                scalar.variable.origin.span,
                caption="its equation depends on this rate again",
                help="solve the equations for the rates, or let 'output w ~ 0;' and 'equation ..;' find one of them",
            )
        for other in asked[state]:
            settle(other, (*before, state))
        rates = {rate(other): known[other] for other in asked[state]}
        known[state] = substitute(graph, [xdot[state]], rates)[0] if rates else xdot[state]

    for state in xdot:
        settle(state, ())
    return {state: known[state] for state in xdot}


def _exacts(lowering: Lowering, model: FlatModel, reporter: Reporter) -> tuple[ExactRow, ...]:
    """Return the closed solutions, one for each number of what they are of; report a second one of the same."""
    rows: list[ExactRow] = []
    for exact in model.exacts:
        values = lowering.reported(exact.value)
        names = _names(exact.target)
        if stated := next((row for row in rows if row.name in names), None):
            reporter.error(
                "E0538",
                f"the closed solution of '{stated.name}' is given twice",
                exact.origin.span,
                caption="second one",
                labels=(Label(stated.origin.shown, "first one"),),
                help="a run is compared with one solution: leave one of them out",
            )
            continue
        values = values * len(names) if len(values) == 1 else values
        rows += [ExactRow(name, n, exact.origin) for name, n in zip(names, values, strict=True)]
    return tuple(rows)


def _names(target: Expression) -> list[str]:
    """Return the names in results of a variable, an element or a derivative."""
    if isinstance(target, Derivative):
        return [f"der({name})" for name in _names(target.operand)]
    indices: tuple[int, ...] = ()
    base: Expression = target
    while isinstance(base, Element):
        indices, base = base.indices + indices, base.base
    assert isinstance(base, Name)
    return [element_name(base.name, (*indices, *rest)) for rest in subscripts(target.type.shape)]


def _outputs(lowering: Lowering, model: FlatModel) -> tuple[OutputRow, ...]:
    rows = []
    for definition in model.definitions:
        if definition.role is not DefinitionRole.OUTPUT or definition.value is None:
            continue
        if definition.type.kind in (Kind.FRAME, Kind.POSE):
            continue
        numbers = lowering.reported(definition.value)
        names = [element_name(definition.name, i) for i in subscripts(definition.type.shape)]
        rows += [OutputRow(name, n, definition) for name, n in zip(names, numbers, strict=True)]
    return tuple(rows)

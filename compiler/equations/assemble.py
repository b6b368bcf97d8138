"""From the Lagrangian record to the equations of one model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from mechc.lang.diagnostics import Reporter
from mechc.lang.units import Dimension

from ..flat.model import Kind
from ..graph import Node
from ..graph.differentiate import jvp
from ..graph.rewrite import substitute
from ..mechanics.system import Beginning, ConstraintRows, MechanicalSystem
from .accelerations import Accelerations, accelerations
from .answers import answers
from .energies import Energies, energies
from .entries import Layout, layout_of, momentum_unit
from .experiments import experiment_plans
from .model import AssertionText, Entry, Equations, Function, ParameterRule
from .needs import choices, needs
from .residual import constraint_rates, residual


@dataclass(frozen=True, slots=True)
class Solved:
    """What is known after elimination; every node is a function of t, y, u, z, p alone."""

    driven: Mapping[Node, Node]
    free: tuple[int, ...]
    accelerations: Accelerations
    multipliers: Mapping[str, tuple[Node, ...]]
    energies: Energies
    replace: Mapping[Node, Node]


def assemble(system: MechanicalSystem, reporter: Reporter, *, keep_all: bool = False) -> Equations:
    """Return the equations of a model; report what makes them undetermined."""
    solved = _solve(system, reporter)
    reporter.stop_on_errors()
    layout = layout_of(system, solved.driven, solved.energies)
    functions = _functions(system, solved, layout)
    plans, plan_functions = experiment_plans(system, layout, reporter)
    reporter.stop_on_errors()
    everything = (*functions, *plan_functions)
    facts = needs(system, layout, everything)
    return Equations(
        name=system.model.name,
        doc=system.model.doc,
        graph=system.graph,
        layout=layout.slots,
        nq=layout.nq,
        nv=layout.nv,
        nx=layout.nx,
        time=layout.time,
        states=layout.states,
        parameters=layout.parameters,
        parameter_rules=_parameter_rules(system),
        inputs=layout.inputs,
        discretes=layout.discretes,
        outputs=tuple(e for e, _ in _outputs(system, solved, layout)),
        known=tuple(b.known for b in _beginnings(system, solved, layout)),
        functions=everything,
        experiments=plans,
        needs=facts,
        choices=choices(system, solved.accelerations.elimination, layout, facts),
        rotations=_rotations(system),
        assertions=tuple(AssertionText(a.message, a.origin.span) for a in system.assertions),
        conserved=tuple(
            k for k, (e, _) in enumerate(_outputs(system, solved, layout)) if e.kind == "momentum"
        ),
        energy_balance=_balance(system, solved, layout),
    )


def _solve(system: MechanicalSystem, reporter: Reporter) -> Solved:
    graph = system.graph
    driven, prescribed = _driven(system)
    free = tuple(i for i in range(len(system.v)) if i not in prescribed)
    multipliers = [
        tuple(graph.symbol(f"lambda({rows.name}#{n})[{k + 1}]") for k in range(len(rows.residuals)))
        for n, rows in enumerate(system.constraints)
    ]
    raw = residual(system, multipliers)
    state_rates = {system.rate(x): f for x, f in system.xdot.items()}
    before = {**state_rates, **driven}
    r = substitute(graph, raw, before) if before else raw
    _check_inputs(system, r, reporter)
    rows = _constraint_rows(system, multipliers, before)
    found = accelerations(system, r, free, rows, reporter)
    solution = {system.a[i]: a for i, a in zip(free, found.a, strict=True)}
    solution |= {lam: value for (_, _, lam, _), value in zip(rows, found.multipliers, strict=True)}
    replace: dict[Node, Node] = {**driven, **solution}
    if state_rates:
        rates = substitute(graph, list(state_rates.values()), replace)
        replace |= dict(zip(state_rates, rates, strict=True))
    power = _constraint_power(system, multipliers, driven, [system.v[i].node for i in free])
    energy = energies(system, driven, free, power)
    named: dict[str, tuple[Node, ...]] = {}
    for constraint, symbols in zip(system.constraints, multipliers, strict=True):
        named[constraint.name] = named.get(constraint.name, ()) + symbols
    reactions = {system.q[k].name: raw[i] for k, i in _drive_indices(system)}
    replies = answers(system, energy, named, reactions, reporter)
    if replies:
        resolved = substitute(graph, list(replies.values()), replace)
        replace |= dict(zip(replies, resolved, strict=True))
    return Solved(driven, free, found, named, energy, replace)


def _drive_indices(system: MechanicalSystem) -> list[tuple[int, int]]:
    """Return (index in q, index in v) of each driven coordinate."""
    pairs: dict[int, int] = {}
    nq = nv = 0
    for coordinate in system.symbols.coordinates:
        if not coordinate.is_rotation:
            pairs |= {nq + k: nv + k for k in range(len(coordinate.q))}
        nq, nv = nq + len(coordinate.q), nv + len(coordinate.v)
    return [(row.index, pairs[row.index]) for row in system.drives]


def _driven(system: MechanicalSystem) -> tuple[dict[Node, Node], frozenset[int]]:
    """Return what replaces each driven coordinate, its rate and acceleration, and their indices in v."""
    graph = system.graph
    replace: dict[Node, Node] = {}
    indices = _drive_indices(system)
    for row, (q, v) in zip(system.drives, indices, strict=True):
        value = row.value
        rate = system.rate(value)
        replace[system.q[q].node] = value
        replace[system.v[v].node] = rate
        replace[system.a[v]] = system.rate(rate)
    for _ in range(len(system.drives)):  # drives may be given by other drives
        if not any(set(graph.support(n)) & replace.keys() for n in replace.values()):
            break
        replace = dict(zip(replace, substitute(graph, list(replace.values()), replace), strict=True))
    return replace, frozenset(v for _, v in indices)


def _check_inputs(system: MechanicalSystem, r: Sequence[Node], reporter: Reporter) -> None:
    for n in system.graph.support(*r):
        scalar = system.input_rates.get(n)
        if scalar is not None:
            reporter.error(
                "E0523",
                f"the equations need the rate of the input '{scalar.name}', which is unknown",
                scalar.variable.origin.span,
                caption="declared here",
                help="let a 'state' follow the input and use the state instead",
            )
    reporter.stop_on_errors()


def _constraint_rows(
    system: MechanicalSystem, multipliers: Sequence[Sequence[Node]], before: Mapping[Node, Node]
) -> list[tuple[ConstraintRows, int, Node, Node]]:
    """Return each row with its second derivative on acceleration level."""
    rows = []
    for constraint, symbols in zip(system.constraints, multipliers, strict=True):
        seconds = [system.rate(c) for c in constraint_rates(system, constraint)]
        seconds = substitute(system.graph, seconds, before) if before else seconds
        rows += [(constraint, k, lam, c) for k, (lam, c) in enumerate(zip(symbols, seconds, strict=True))]
    return rows


def _constraint_power(
    system: MechanicalSystem,
    multipliers: Sequence[Sequence[Node]],
    driven: Mapping[Node, Node],
    velocities: Sequence[Node],
) -> Node:
    """Return -lam.b: the power of moving constraints, with b the part of their rate that is free of v."""
    graph = system.graph
    power = graph.zero
    for constraint, symbols in zip(system.constraints, multipliers, strict=True):
        rates = list(constraint_rates(system, constraint))
        rates = substitute(graph, rates, driven) if driven else rates
        along = jvp(graph, rates, {v: v for v in velocities})
        for rate, part, lam in zip(rates, along, symbols, strict=True):
            power = graph.sub(power, graph.mul(lam, graph.sub(rate, part)))
    return power


# ---------------------------------------------------------------- functions


def _functions(system: MechanicalSystem, solved: Solved, layout: Layout) -> tuple[Function, ...]:
    graph = system.graph

    def resolve(nodes: Sequence[Node]) -> tuple[Node, ...]:
        return tuple(substitute(graph, list(nodes), solved.replace)) if solved.replace else tuple(nodes)

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
            resolve([b.value for b in _beginnings(system, solved, layout)]),
        ),
        Function(
            "outputs",
            "everything reported beside the state",
            resolve([n for _, n in _outputs(system, solved, layout)]),
        ),
    ]
    if layout.inputs:
        functions.append(
            Function("inputs", "default of each input at time t", resolve(_defaults(system, "inputs")))
        )
    if layout.discretes:
        functions.append(
            Function("discretes", "initial discrete variables", resolve(_defaults(system, "discretes")))
        )
    if system.assertions:
        functions.append(
            Function(
                "assertions",
                "1 where an assertion holds, else 0",
                resolve([a.condition for a in system.assertions]),
            )
        )
    return tuple(functions)


def _beginnings(system: MechanicalSystem, solved: Solved, layout: Layout) -> list[Beginning]:
    zero = Beginning(system.graph.zero, True, None)
    return [
        *(system.start_q[k] for k in layout.q_indices),
        *(system.start_v[i] for i in layout.v_indices),
        *system.start_x,
        *(zero for _ in layout.accounts),
    ]


def _defaults(system: MechanicalSystem, which: str) -> list[Node]:
    scalars = system.symbols.inputs if which == "inputs" else system.symbols.discretes
    result = []
    for s in scalars:
        if s.variable.value is None:
            result.append(system.graph.zero)
            continue
        values = system.lowering.numbers(s.variable.value)
        same = [t for t in scalars if t.variable is s.variable]
        result.append(values[0] if len(values) == 1 else values[same.index(s)])
    return result


def _parameter_rules(system: MechanicalSystem) -> tuple[ParameterRule, ...]:
    rules = []
    scalars = system.symbols.parameters
    for variable in dict.fromkeys(s.variable.name for s in scalars):
        places = [k for k, s in enumerate(scalars) if s.variable.name == variable]
        value = scalars[places[0]].variable.value
        if value is None:
            continue
        numbers = system.lowering.numbers(value)
        numbers = numbers * len(places) if len(numbers) == 1 else numbers
        rules += [ParameterRule(k, n) for k, n in zip(places, numbers, strict=True)]
    return tuple(rules)


def _outputs(system: MechanicalSystem, solved: Solved, layout: Layout) -> list[tuple[Entry, Node]]:
    rows: list[tuple[Entry, Node]] = []
    for k, i in _drive_indices(system):
        q, v = system.q[k], system.v[i]
        rows.append((layout.entry(q, "coordinate"), q.node))
        rows.append((layout.entry(v, "rate", rate=True), v.node))
    for row in system.outputs:
        kind = row.definition.type
        unit = _unit(kind.dimension)
        attributes = row.definition.attributes
        if kind.kind is Kind.POINT:
            unit = layout.length
        rows.append(
            (
                Entry(
                    row.name,
                    "output",
                    unit,
                    attributes.display,
                    attributes.nominal,
                    attributes.minimum,
                    attributes.maximum,
                    row.definition.doc,
                    row.definition.origin.span,
                ),
                row.node,
            )
        )
    energy = solved.energies
    joule = layout.energy
    rows += [
        (Entry("energy.kinetic", "energy", joule), energy.kinetic),
        (Entry("energy.potential", "energy", joule), energy.potential),
        (Entry("energy.total", "energy", joule), energy.total),
    ]
    for name in layout.accounts:
        rows.append((Entry(name, "energy", joule), layout.account_symbols[name]))
    for i in energy.cyclic:
        scalar = system.v[i]
        name = scalar.name.removeprefix("der(").removesuffix(")")
        unit = momentum_unit(scalar, layout)
        rows.append((Entry(f"momentum({name})", "momentum", unit), energy.momenta[i]))
    return rows


def _unit(dimension: Dimension) -> str:
    text = str(dimension)
    return "" if text == "1" else text


def _balance(system: MechanicalSystem, solved: Solved, layout: Layout) -> tuple[int, ...]:
    if solved.energies.reason:
        return ()
    names = [e.name for e, _ in _outputs(system, solved, layout)]
    return tuple(
        names.index(n) if n in names else -1 for n in ("energy.total", "energy.dissipated", "energy.supplied")
    )


def _rotations(system: MechanicalSystem) -> tuple[int, ...]:
    """Return the first index in y of each rotation; driven coordinates are not in y."""
    gone = {row.index for row in system.drives}
    kept = [k for k in range(len(system.q)) if k not in gone]
    return tuple(kept.index(q) for q, _ in system.rotations)

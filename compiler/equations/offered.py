"""The functions of a model for others: mass matrix, bias, accelerations, inverse dynamics, constraints, energies, outputs and
their Jacobians, each a function of its own with names and units of its rows and columns."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from msgspec import Struct

from mechc.lang.units import parse_unit, unit_of
from mechc.runtime.interface import OfferedFunction, Quantity, array_of

from ..graph import Node
from ..graph.differentiate import jacobian, jvp
from ..graph.rewrite import substitute
from ..mechanics.system import MechanicalSystem
from .local_derivatives import bias
from .model import Equations, Function, quantity
from .reported.entries import Layout, momentum_unit
from .sensitivities import SEED
from .solve.solved import Solved

RATES_JACOBIAN = "rates_jacobian"
Labels = tuple[tuple[str, str], ...]
"""Names and SI units."""


class Offered(Struct, frozen=True):
    """``functions`` with what each of ``offers`` says of one; ``seeds``: the symbols of the accelerations that
    ``inverse_dynamics`` reads after the discrete variables, described by ``entries``."""

    functions: tuple[Function, ...]
    offers: tuple[OfferedFunction, ...]
    seeds: tuple[Node, ...]
    entries: tuple[Quantity, ...]


def offered(
    system: MechanicalSystem,
    solved: Solved,
    layout: Layout,
    functions: Sequence[Function],
    outputs: Sequence[Quantity],
) -> Offered:
    """Return what a model offers. ``functions``: those that it has already; ``outputs``: the entries of ``outputs``."""
    graph = system.graph
    seeds = tuple(graph.symbol(f"given acceleration {i}") for i in solved.free)
    made = [
        *_dynamics(system, solved, layout, seeds),
        *_constraints(system, solved, layout, functions),
        *_energies(solved, layout),
        *_state(layout, functions),
        *_outputs(solved, layout, functions, outputs),
    ]
    known = {f.name for f in functions}
    fresh = [f for f, _ in made if f.name not in known]
    rates = layout.states[layout.nq : layout.nq + layout.nv]
    return Offered(
        tuple(dict.fromkeys(fresh)),
        (*(offer for _, offer in made), _offered_later(layout)),
        seeds,
        tuple(
            quantity(f"given der({r.name})", SEED, unit)
            for (r, unit) in zip(rates, _accelerations(layout), strict=True)
        ),
    )


Made = Iterator[tuple[Function, OfferedFunction]]


def _dynamics(system: MechanicalSystem, solved: Solved, layout: Layout, seeds: Sequence[Node]) -> Made:
    graph, zero = system.graph, system.graph.zero
    names = [r.name for r in layout.states[layout.nq : layout.nq + layout.nv]]
    accelerations = tuple((f"der({n})", u) for n, u in zip(names, _accelerations(layout), strict=True))
    forces = tuple(
        (f"force on {_of(n)}", u) for n, u in zip(names, _forces(system, solved, layout), strict=True)
    )
    own = [system.a[i] for i in solved.free]
    equations = [solved.residual[i] for i in solved.free]
    loose = {row.multiplier: zero for row in solved.rows}
    still = {**solved.replace, **dict.fromkeys(own, zero), **loose}
    mass = [row.get(j, zero) for row in jacobian(graph, equations, own) for j in range(len(own))]
    moved = {**solved.replace, **dict(zip(own, seeds, strict=True)), **loose}

    def one(
        name: str,
        doc: str,
        nodes: Sequence[Node],
        rows: Labels,
        columns: Labels | None = None,
        given: bool = False,
    ) -> tuple[Function, OfferedFunction]:
        shape = (len(rows),) if columns is None else (len(rows), len(columns))
        return Function(name, doc, tuple(nodes)), OfferedFunction(
            name, name, doc, shape, rows, columns or (), given
        )

    yield one(
        "accelerations",
        "accelerations of the motion",
        solved.resolve(own),
        accelerations,
    )
    yield one("mass_matrix", "M of M a + h = K^T lam", substitute(graph, mass, still), forces, accelerations)
    yield (
        bias(system, solved),
        OfferedFunction(
            "bias",
            "bias",
            "h of M a + h = K^T lam: inertia at rest of the accelerations, less all forces but those of constraints",
            (len(forces),),
            forces,
            (),
            False,
        ),
    )
    yield one(
        "inverse_dynamics",
        "M a + h: the forces that are missing for given accelerations",
        substitute(graph, equations, moved),
        forces,
        given=True,
    )


def _constraints(
    system: MechanicalSystem, solved: Solved, layout: Layout, functions: Sequence[Function]
) -> Made:
    if not solved.rows:
        return
    named = {f.name: f for f in functions}
    rates = tuple((r.name, r.unit) for r in layout.states[layout.nq : layout.nq + layout.nv])
    rows = [(row.title, row.constraint.units[row.component], row.position is not None) for row in solved.rows]
    second = _per_second
    velocities = tuple((f"rate of {n}" if p else n, second(u) if p else u) for n, u, p in rows)
    positions = tuple((n, u) for n, u, p in rows if p)
    residuals = (*positions, *velocities)
    yield (
        named["constraints"],
        OfferedFunction(
            "constraints",
            "constraints",
            "phi of positions, then K v + b",
            (len(residuals),),
            residuals,
            (),
            False,
        ),
    )
    yield (
        named["constraint_jacobian"],
        OfferedFunction(
            "constraint_jacobian",
            "constraint_jacobian",
            "K of K v + b = 0",
            (len(rows), len(rates)),
            velocities,
            rates,
            False,
        ),
    )
    still = {**solved.replace, **{system.a[i]: system.graph.zero for i in solved.free}}
    gamma = substitute(system.graph, [row.second for row in solved.rows], still)
    units = tuple((f"acceleration of {n}", second(second(u)) if p else second(u)) for n, u, p in rows)
    doc = "gamma of K a + gamma = 0"
    yield (
        Function("constraint_bias", doc, tuple(gamma)),
        OfferedFunction("constraint_bias", "constraint_bias", doc, (len(rows),), units, (), False),
    )


def _energies(solved: Solved, layout: Layout) -> Made:
    energy = solved.energies
    for name, doc, node in (
        ("energy", "energy function, the total energy where nothing depends on time", energy.total),
        ("kinetic_energy", "kinetic energy", energy.kinetic),
        ("potential_energy", "potential energy", energy.potential),
    ):
        yield (
            Function(name, doc, solved.resolve([node])),
            OfferedFunction(name, name, doc, (), ((name, layout.energy),), (), False),
        )


def _state(layout: Layout, functions: Sequence[Function]) -> Made:
    rhs = next(f for f in functions if f.name == "rhs")
    rates = _rates(layout)
    yield (
        rhs,
        OfferedFunction("rates", "rhs", "time derivative of the state", (len(rates),), rates, (), False),
    )


def _offered_later(layout: Layout) -> OfferedFunction:
    """Describe the derivatives of the rates, whose code is longer than that of all others together."""
    states = tuple((s.name, s.unit) for s in layout.states)
    return OfferedFunction(
        RATES_JACOBIAN,
        RATES_JACOBIAN,
        "derivatives of the rates by the state, row by row",
        (len(states), len(states)),
        _rates(layout),
        states,
        False,
        later=True,
    )


def _rates(layout: Layout) -> Labels:
    return tuple(
        (f"der({s.name})", _per_second(s.unit) if not layout.dimensionless else "") for s in layout.states
    )


def rates_jacobian(equations: Equations) -> Function:
    """Return the derivatives of the rates by the state, row by row."""
    graph, ny = equations.graph, len(equations.states)
    rhs = next(f for f in equations.functions if f.name == "rhs")
    by_index = {slot.index: n for n, slot in equations.layout.items() if slot.array == "y"}
    wrt = [by_index[k] for k in range(ny)]
    dense = [row.get(j, graph.zero) for row in jacobian(graph, rhs.outputs, wrt) for j in range(ny)]
    return Function(RATES_JACOBIAN, "derivatives of the rates by the state, row by row", tuple(dense))


def _outputs(
    solved: Solved, layout: Layout, functions: Sequence[Function], entries: Sequence[Quantity]
) -> Made:
    """Yield each declared output with its shape, and its Jacobian: by velocities, of its rate where it depends on places."""
    graph = solved.graph
    named = {f.name: f for f in functions}
    by_index = {slot.index: n for n, slot in layout.slots.items() if slot.array == "y"}
    places = [by_index[k] for k in range(layout.nq)]
    velocities = [by_index[k] for k in range(layout.nq, layout.nq + layout.nv)]
    along = dict(zip(places, named["rhs"].outputs[: layout.nq], strict=True))
    rates = tuple((r.name, r.unit) for r in layout.states[layout.nq : layout.nq + layout.nv])
    groups: dict[str, list[int]] = {}
    for k, entry in enumerate(entries):
        if entry.kind == "output":
            groups.setdefault(array_of(entry.name)[0], []).append(k)
    for number, (name, members) in enumerate(groups.items(), start=1):
        nodes = [named["outputs"].outputs[k] for k in members]
        units = tuple((entries[k].name, entries[k].unit) for k in members)
        shape = _shape([entries[k].name for k in members])
        doc = entries[members[0]].doc or f"output {name}"
        yield (
            Function(f"output_{number}", doc, tuple(nodes)),
            OfferedFunction(name, f"output_{number}", doc, shape, units, (), False, "output"),
        )
        moves = not set(velocities).isdisjoint(graph.support(*nodes))
        moved = nodes if moves else jvp(graph, nodes, along)
        dense = [
            row.get(j, graph.zero)
            for row in jacobian(graph, moved, velocities)
            for j in range(len(velocities))
        ]
        doc = f"derivatives of {name if moves else f'the rate of {name}'} by the velocities"
        units = (
            units
            if moves or layout.dimensionless
            else tuple((f"rate of {n}", _per_second(u)) for n, u in units)
        )
        yield (
            Function(f"jacobian_{number}", doc, tuple(dense)),
            OfferedFunction(
                name, f"jacobian_{number}", doc, (*shape, len(rates)), units, rates, False, "jacobian"
            ),
        )


def _shape(names: Sequence[str]) -> tuple[int, ...]:
    """Return the shape of an array from the name of its last element, ``x[2,3]``."""
    _, shape = array_of(names[-1])
    count = 1
    for n in shape:
        count *= n
    return shape if count == len(names) else (len(names),)


def _of(rate: str) -> str:
    """Return the coordinate of a rate: ``x[1]`` of ``der(x[1])``, ``R[1]`` of ``der(R)[1]``."""
    before, _, behind = rate.removeprefix("der(").rpartition(")")
    return before + behind


def _per_second(unit: str) -> str:
    return (
        unit_of(parse_unit(unit or "1").dimension / parse_unit("s").dimension, unit.startswith("rad"))
        if unit
        else "1/s"
    )


def _accelerations(layout: Layout) -> list[str]:
    rates = layout.states[layout.nq : layout.nq + layout.nv]
    return ["" if layout.dimensionless else _per_second(r.unit) for r in rates]


def _forces(system: MechanicalSystem, solved: Solved, layout: Layout) -> list[str]:
    """Return the units of the generalised forces: those of the momenta per second; of torques N.m."""
    units = [momentum_unit(system.v[i], layout) for i in solved.free]
    found = [
        "" if layout.dimensionless else unit_of(parse_unit(u).dimension / parse_unit("s").dimension)
        for u in units
    ]
    return ["N.m" if u == "J" else u for u in found]

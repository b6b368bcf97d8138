"""Energies, momenta and their balance.

h = sum v dL/dv - L, over all velocities, obeys dh/dt = -dL/dt + Q.v - v.dR/dv - lam.b + P, with P the power of drives.
What explicit time, inputs, drives, moving constraints and forces bring in is *supplied*; what damping, friction and forces
that brake whatever the motion take is *dissipated*.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from msgspec import Struct

from ...flat.model import Impulse, Reinit
from ...graph import Node
from ...graph.differentiate import gradient, jvp, vjp
from ...graph.operations import JUMPING
from ...graph.rewrite import substitute
from ...graph.vector import matvec
from ...mechanics.energies import kinetic_energy, momenta_of, potential_energy, total_energy
from ...mechanics.forces import resistances
from ...mechanics.modes import SetAction
from ...mechanics.system import MechanicalSystem
from ..rows.residual import constraint_rates, projected


class Energies(Struct, frozen=True):
    """``kinetic`` T, ``potential`` V of all bodies and formulas, ``total`` h, ``momenta`` dL/dv (None where driven).

    ``supplied`` and ``dissipated`` are powers [W]; None where the balance cannot be formed (``reason``).
    ``forces``: dL/dq + Q for each v, with what joining matter brings, without constraints. ``cyclic``: indices of velocities whose momentum is
    constant along every motion.
    """

    kinetic: Node
    potential: Node
    total: Node
    momenta: tuple[Node | None, ...]
    supplied: Node
    dissipated: Node
    reason: str
    forces: tuple[Node, ...]
    cyclic: tuple[int, ...]


def energies(
    system: MechanicalSystem,
    driven: Mapping[Node, Node],
    free: Sequence[int],
    outer_power: Node,
    friction_loss: Node,
) -> Energies:
    """Return the energies of a system.

    ``driven`` replaces prescribed coordinates, their rates and accelerations by functions of time; ``free`` are the
    indices of velocities that are unknowns; ``outer_power`` is -lam.b + P, ``friction_loss`` what friction of
    constraints turns into heat.
    """
    graph = system.graph
    kinetic = kinetic_energy(system, system.kinetic)
    potential = potential_energy(system, system.potential)
    lagrangian = graph.add(graph.sub(kinetic, potential), system.lagrangian)
    # before drives put in anything
    whole = substitute(graph, [kinetic, potential, lagrangian], still(system))
    kinetic, potential, lagrangian = substitute(graph, whole, driven)
    velocities = [system.v[i].node for i in free]
    plain_total = graph.add(kinetic, potential)  # built first: where h is equal to it, it becomes this node
    accelerations = [system.a[i] for i in free]
    momenta, _ = momenta_of(graph, system.rate, lagrangian, velocities, accelerations)
    total = _total(system, *whole)
    total = plain_total if total is None else substitute(graph, [total], driven)[0]
    supplied, dissipated, reason = _powers(system, whole[2], driven, outer_power)
    dissipated = graph.add(dissipated, friction_loss)
    forces, cyclic = _forces(system, lagrangian, free)
    all_momenta = dict(zip(free, momenta, strict=True))
    return Energies(
        kinetic,
        potential,
        total,
        tuple(all_momenta.get(i) for i in range(len(system.v))),
        supplied,
        dissipated,
        reason,
        forces,
        cyclic,
    )


def still(system: MechanicalSystem) -> dict[Node, Node]:
    """Return what replaces the virtual displacements and their rates."""
    return {n: system.graph.zero for moved in system.virtual.values() for n in moved.values}


def _total(system: MechanicalSystem, kinetic: Node, potential: Node, lagrangian: Node) -> Node | None:
    """Return h as a formula of all velocities; None where it is T + V."""
    graph = system.graph
    velocities = [s.node for s in system.v]
    plain = graph.add(kinetic, potential)
    momenta, seconds = momenta_of(graph, system.rate, lagrangian, velocities, system.a)
    total = total_energy(graph, lagrangian, velocities, system.a, momenta, seconds)
    return None if graph.equal_up_to_sign(total, plain) else total


def _powers(
    system: MechanicalSystem, lagrangian: Node, driven: Mapping[Node, Node], outer_power: Node
) -> tuple[Node, Node, str]:
    """Return the supplied and the dissipated power, and why there is no balance if there is none.

    What is dissipated is known then, too; what is supplied is not, and counts as nothing.
    """
    graph = system.graph
    reason = _unknown_rate(system, lagrangian, driven)
    explicit = {system.symbols.time: graph.one, **system.xdot}
    (drift,) = substitute(graph, jvp(graph, [lagrangian], explicit), driven)
    along = {s.node: s.node for s in system.v}
    joining = _joining(system)  # along what the coordinates move; what time moves is in the drift
    moved = jvp(graph, [rate for rate, _ in joining], along)
    supplied = graph.add(graph.sub(outer_power, drift), graph.dot(moved, [brought for _, brought in joining]))
    held = still(system)
    dissipated = graph.zero
    if not graph.is_constant(system.dissipation):
        resistance = substitute(graph, [system.dissipation], held)
        (work,) = substitute(graph, jvp(graph, resistance, along), driven)
        dissipated = graph.add(dissipated, work)
        (carried,) = substitute(graph, substitute(graph, [_carried_by_time(system)], held), driven)
        dissipated, supplied = graph.add(dissipated, carried), graph.add(supplied, carried)
    for effort in system.efforts:
        rates = substitute(graph, [rate for rate, _ in effort.pairs], held)
        values = substitute(graph, [value for _, value in effort.pairs], driven)
        power = graph.dot(substitute(graph, jvp(graph, rates, along), driven), values)
        if effort.supplied:
            supplied = graph.add(supplied, power)
            continue
        carried = graph.neg(graph.dot(substitute(graph, _without_velocities(system, rates), driven), values))
        dissipated = graph.sub(graph.add(dissipated, carried), power)
        supplied = graph.add(supplied, carried)
    return graph.zero if reason else supplied, dissipated, reason


def _carried_by_time(system: MechanicalSystem) -> Node:
    """Return the power that dampings take from what moves by itself, as belts that are given by time: all that they take becomes heat,
    and what the motion does not give is supplied."""
    graph, lowering = system.graph, system.lowering
    total = graph.zero
    for item in system.model.dampings:
        pairs = resistances(lowering, item, system.symbols)
        rates = lowering.questions.settle([rate for _, rate in pairs])
        coefficients = lowering.questions.settle([c for c, _ in pairs])
        still_moving = _without_velocities(system, rates)
        if not all(graph.is_zero(n) for n in still_moving):
            total = graph.add(
                total,
                graph.dot(coefficients, [graph.mul(s, e) for s, e in zip(rates, still_moving, strict=True)]),
            )
    return total


def _without_velocities(system: MechanicalSystem, rates: Sequence[Node]) -> list[Node]:
    """Return the parts of rates that are there where no coordinate moves."""
    return substitute(system.graph, rates, {s.node: system.graph.zero for s in system.v})


def _joining(system: MechanicalSystem) -> list[tuple[Node, Node]]:
    """Return, of masses and inertias that change with time, each rate and the momentum that joining matter brings along it in a
    unit of time."""
    graph, kinematics = system.graph, system.kinematics
    found: list[tuple[Node, Node]] = []
    for mass in system.masses:
        flow = system.rate(mass.mass)
        if not graph.is_zero(flow):
            found += [(v, graph.mul(flow, v)) for v in kinematics.velocity(mass.point)]
    for body in system.inertias:
        flows = tuple(tuple(system.rate(x) for x in row) for row in body.inertia)
        if not all(graph.is_zero(x) for row in flows for x in row):
            spin = kinematics.angular_velocity(body.frame)
            found += zip(spin, matvec(graph, flows, spin), strict=True)
    return found


def _unknown_rate(system: MechanicalSystem, energy: Node, known: Mapping[Node, Node]) -> str:
    """Say why an energy has no rate that is known; nothing if it has one, as of inputs whose rates are ``known``."""
    inputs = {s.node: s for s in system.symbols.inputs if system.rate(s.node) not in known}
    found = [inputs[n].name for n in system.graph.support(energy) if n in inputs]
    return f"the energy depends on the input '{found[0]}', whose rate is unknown" if found else ""


def _forces(
    system: MechanicalSystem, lagrangian: Node, free: Sequence[int]
) -> tuple[tuple[Node, ...], tuple[int, ...]]:
    """Return dL/dq + Q and what joining matter brings for each velocity, and the velocities whose momentum is constant.

    Constant: no force, no constraint, no matter that joins, and dL/dq = 0 in the field; a rotation has no momentum of its own
    kind.
    """
    graph = system.graph
    velocities = [s.node for s in system.v]
    conservative = projected(system, gradient(graph, lagrangian, [s.node for s in system.q]))
    loads = vjp(graph, [pair for e in system.efforts for pair in e.pairs], velocities)
    friction = vjp(graph, [(system.dissipation, graph.one)], velocities)
    joining = vjp(graph, _joining(system), velocities)
    rates = [c for rows in system.constraints for c in constraint_rates(system, rows)]
    # a multiplier of its own for each row, so that rows cannot cancel each other
    seeds = [(c, graph.symbol(f"#row {k}")) for k, c in enumerate(rates)]
    constrained = vjp(graph, seeds, velocities)
    turning = {first + k for _, first in system.rotations for k in range(3)}
    parts = list(zip(conservative, loads, friction, constrained, joining, strict=True))
    forces = tuple(graph.add(graph.sub(graph.add(c, load), f), m) for c, load, f, _, m in parts)
    jumping = jumps(system, lagrangian)
    cyclic = (
        i for i in free if i not in turning and i not in jumping and all(graph.is_zero(x) for x in parts[i])
    )
    return forces, tuple(cyclic)


def supplied_at_instants(system: MechanicalSystem, total: Node) -> bool:
    """Tell whether the energy of a state may jump: by its law at a time or a speed, or by a number that events set."""
    graph = system.graph
    actions = [a for branch in system.branches for a in branch.actions]
    assigned = {target for a in actions if isinstance(a, SetAction) for target in a.targets}
    if graph.reached_among([total], assigned):
        return True
    elsewhere = {system.symbols.time, *(s.node for s in (*system.v, *system.symbols.states))}
    jumping = graph.reached_with([total], JUMPING)
    return bool(jumping) and not elsewhere.isdisjoint(graph.support(*jumping))


def carried(system: MechanicalSystem, total: Node, rates: Sequence[Node]) -> bool:
    """Tell whether what moves by itself takes part in impacts: it gives the energy a part that is linear in the velocities, as that of
    a mass on what is driven, or one of the ``rates`` of constraints."""
    graph, velocities = system.graph, [s.node for s in system.v]
    if not all(map(graph.is_zero, _without_velocities(system, rates))):
        return True
    if not graph.depend([total], velocities):
        return False
    slopes = gradient(graph, total, velocities)
    at_rest = substitute(graph, slopes, dict.fromkeys(velocities, graph.zero))
    return not all(map(graph.is_zero, at_rest))


def jumps(system: MechanicalSystem, lagrangian: Node) -> frozenset[int]:
    """Return the velocities whose momenta may change at single instants.

    At a step of the potential its gradient is zero on both sides, and yet there is an impulse; ``reinit`` and
    ``impulse`` change velocities as they please.
    """
    graph = system.graph
    actions = (a for event in system.model.events for branch in event.branches for a in branch.actions)
    if any(isinstance(a, Reinit | Impulse) for a in actions):
        return frozenset(range(len(system.v)))
    steps = graph.reached_with([lagrangian], JUMPING)
    touched = set(graph.support(*steps))
    moved = [rate if s.node in touched else graph.zero for s, rate in zip(system.q, system.qdot, strict=True)]
    support = set(graph.support(*moved))
    return frozenset(i for i, s in enumerate(system.v) if s.node in support)

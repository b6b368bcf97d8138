"""Total linear and angular momentum of all bodies, where the equations of motion keep them constant.

Momenta of cyclic coordinates are found from the Lagrangian (energies.py). Those of the whole system belong to no
coordinate; each component is tried: its rate along the motion must vanish at random states, times and inputs, and so
must its change by an impulse of any contact, friction or constraint that can be switched.
"""

from __future__ import annotations

from math import hypot
from random import Random

from ...graph import Node
from ...graph.differentiate import jvp, vjp
from ...graph.evaluate import evaluate
from ...graph.rewrite import substitute
from ...graph.vector import Vector, add, cross, cross_planar, matvec, scale
from ...mechanics.defaults import default_values
from ...mechanics.system import MechanicalSystem
from ..solve.energies import jumps
from ..solve.solved import Solved, velocity_jumps

MOST_BODIES = 30
"""Larger systems are not tried: world components of all velocities cost more than the whole compilation."""

STATES = 4
MOVED, NOISE = 1e-12, 1e6
"""A rate that changes by more than one in ``NOISE`` of it where all numbers change by the first share is what rounding leaves of zero."""

Momentum = tuple[str, str, Node]
"""Name, unit and node of one component."""


def conserved_momenta(system: MechanicalSystem, solved: Solved, pure: bool) -> list[Momentum]:
    """Return the components of total momentum that are constant; ``pure``: the model has no units."""
    graph = system.graph
    energies = (system.kinetic, system.lagrangian)
    if not system.masses or len(system.masses) > MOST_BODIES or system.drives:
        return []
    if any(mass.field is not None for mass in system.masses) or not all(map(graph.is_constant, energies)):
        return []
    velocities = system.symbols.velocities
    if jumps(system, system.potential) or velocities.intersection(graph.support(system.potential)):
        return []
    linear, angular = totals(system)
    names = "xyz"
    found = [
        (f"momentum.{names[k]}", "" if pure else "kg.m/s", component) for k, component in enumerate(linear)
    ]
    axes = "xyz" if len(angular) == 3 else "z"
    unit = "" if pure else "kg.m^2/s"
    found += [(f"angular_momentum.{axes[k]}", unit, component) for k, component in enumerate(angular)]
    moving = [m for m in found if not graph.is_zero(m[2])]
    rates = [system.rate(component) for *_, component in moving]
    tried = substitute(graph, [*rates, *_kicks(system, solved, moving)], solved.replace)
    vanishing = _vanish(system, tried)
    n = len(moving)
    return [m for k, m in enumerate(moving) if all(vanishing[k::n])]


def _kicks(system: MechanicalSystem, solved: Solved, momenta: list[Momentum]) -> list[Node]:
    """Return the changes of the momenta by unit impulses of all rows with modes; none where there are none."""
    graph = system.graph
    if not momenta or not solved.switched:
        return []
    velocities = [system.v[i].node for i in solved.free]
    impulses = vjp(graph, [(row.rate, graph.one) for row in solved.switched], velocities)
    changes = velocity_jumps(system, solved, impulses)
    return list(jvp(graph, [node for *_, node in momenta], dict(zip(velocities, changes, strict=True))))


def _vanish(system: MechanicalSystem, nodes: list[Node]) -> list[bool]:
    """Tell which nodes vanish at random states; quaternions are of unit length there, which the field cannot know."""
    values = dict.fromkeys(system.graph.support(*nodes), 0.0) | default_values(system)
    random = Random(11)
    vanishing = [True] * len(nodes)
    for k in range(STATES):
        reach = 2**k  # farther and farther, so that laws of regions are met
        moving = (*system.q, *system.v, *system.symbols.inputs)
        values |= {s.node: random.uniform(-reach, reach) for s in moving}
        values[system.symbols.time] = random.uniform(0, 1)
        for first, _ in system.rotations:
            part = [s.node for s in system.q[first : first + 4]]
            length = hypot(*(values[n] for n in part))
            values |= {n: values[n] / length for n in part}
        beside = {n: x * (1 + MOVED * random.uniform(-1, 1)) for n, x in values.items()}
        both = zip(evaluate(system.graph, nodes, values), evaluate(system.graph, nodes, beside), strict=True)
        vanishing = [
            known and abs(x) <= NOISE * abs(x - y) for known, (x, y) in zip(vanishing, both, strict=True)
        ]
    return vanishing


def totals(system: MechanicalSystem) -> tuple[Vector, Vector]:
    """Return the linear momentum and the angular momentum about the origin of the world, in world components."""
    graph, kinematics = system.graph, system.kinematics
    linear: Vector = (graph.zero,) * kinematics.size
    angular: Vector = (graph.zero,) * (1 if kinematics.size == 2 else 3)
    for mass in system.masses:
        frame = mass.point.frame
        velocity = kinematics.from_natural(frame, kinematics.velocity(mass.point))
        momentum = scale(graph, mass.mass, velocity)
        position = kinematics.position(mass.point)
        linear = add(graph, linear, momentum)
        if kinematics.size == 2:
            angular = add(graph, angular, (cross_planar(graph, position, momentum),))
        else:
            angular = add(graph, angular, cross(graph, position, momentum))
    for body in system.inertias:
        spin = matvec(graph, body.inertia, kinematics.angular_velocity(body.frame))
        angular = add(graph, angular, kinematics.spin_from_natural(body.frame, spin))
    return linear, angular

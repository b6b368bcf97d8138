"""Kinetic and potential energy, momenta and the total of a system, as formulas of its state."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from ..graph import Graph, Node
from ..graph.differentiate import vjp
from ..graph.vector import matvec

if TYPE_CHECKING:
    from .bodies import Massive


def kinetic_energy(bodies: Massive, formulas: Node) -> Node:
    """Return T of all bodies, and of what is written as ``kinetic``."""
    graph, kinematics = bodies.graph, bodies.kinematics
    terms = []
    for mass in bodies.masses:
        velocity = kinematics.velocity(mass.point)
        terms.append(graph.mul(mass.mass, graph.dot(velocity, velocity)))
    for body in bodies.inertias:
        spin = kinematics.angular_velocity(body.frame)
        terms.append(graph.dot(spin, matvec(graph, body.inertia, spin)))
    return graph.add(graph.mul(graph.half, graph.sum(terms)), formulas)


def potential_energy(bodies: Massive, formulas: Node) -> Node:
    """Return V of all weights, and of what is written as ``potential``."""
    graph, kinematics = bodies.graph, bodies.kinematics
    terms = [
        graph.mul(mass.mass, kinematics.potential(mass.point, mass.field))
        for mass in bodies.masses
        if mass.field is not None
    ]
    return graph.sub(formulas, graph.sum(terms))


def momenta_of(
    graph: Graph,
    rate: Callable[[Node], Node],
    lagrangian: Node,
    velocities: Sequence[Node],
    accelerations: Sequence[Node],
) -> tuple[list[Node], list[Node]]:
    """Return dL/dv - d/dt dL/da, and dL/da, which is zero but for Lagrangians with second derivatives."""
    seconds = vjp(graph, [(lagrangian, graph.one)], accelerations)
    firsts = vjp(graph, [(lagrangian, graph.one)], velocities)
    momenta = [graph.sub(p, rate(second)) for p, second in zip(firsts, seconds, strict=True)]
    return momenta, seconds


def total_energy(
    graph: Graph,
    lagrangian: Node,
    velocities: Sequence[Node],
    accelerations: Sequence[Node],
    momenta: Sequence[Node],
    seconds: Sequence[Node],
) -> Node:
    """Return h = sum v p - L, with a dL/da."""
    total = graph.sub(graph.dot(momenta, velocities), lagrangian)
    return graph.add(total, graph.dot(seconds, accelerations))

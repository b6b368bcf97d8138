"""The residual r(q, v, a): central form for bodies, Lagrange's operator for energies written as formulas.

Bodies (Lagrange-d'Alembert): r = sum (dv_b/dv)^T m (a_b - g) + (dw_b/dv)^T (J w'_b + w_b x J w_b); one reverse
sweep with the inertia forces as seeds, so the terms that cancel between d/dt dT/dv and dT/dq are never built.
Formulas: r = d/dt dL/dv - N^T dL/dq + w x dL/dw (the last for rotations; Boltzmann-Hamel). Forces enter by
virtual power, constraints by -(dc'/dv)^T lam.

Lagrange's operator on kinetic energies such as m x' y' cos(x - y) makes like terms, of which one cancels: taken together,
c p (x + y) - c p x as c p y, they cost less and round less.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction

from ...graph import Graph, Node
from ...graph import operations as ops
from ...graph.differentiate import gradient, vjp
from ...graph.vector import add, cross, matvec
from ...mechanics.kinematics.reactions import VirtualDisplacement
from ...mechanics.system import ConstraintRows, MechanicalSystem
from .lumps import taken_together

Seeds = list[tuple[Node, Node]]


def inertia_seeds(system: MechanicalSystem) -> Seeds:
    """Return (velocity, inertia force) of every body, weight included."""
    graph, kinematics = system.graph, system.kinematics
    masses, inertias = taken_together(system)
    seeds: Seeds = []
    for mass in masses:
        acceleration = kinematics.acceleration(mass.point, mass.field)
        force = (graph.mul(mass.mass, a) for a in acceleration)
        seeds += zip(kinematics.velocity(mass.point), force, strict=True)
    for body in inertias:
        spin = kinematics.angular_velocity(body.frame)
        moment = matvec(graph, body.inertia, kinematics.angular_acceleration(body.frame))
        if kinematics.size == 3:
            moment = add(graph, moment, cross(graph, spin, matvec(graph, body.inertia, spin)))
        seeds += zip(spin, moment, strict=True)
    return seeds


def effort_seeds(system: MechanicalSystem) -> Seeds:
    """Return (rate, -effort) of every force and torque."""
    return [(rate, system.graph.neg(effort)) for e in system.efforts for rate, effort in e.pairs]


def constraint_rates(system: MechanicalSystem, rows: ConstraintRows) -> tuple[Node, ...]:
    """Return K v + b of each row: the rate of a position constraint, a velocity constraint as it is."""
    if rows.level == "velocity":
        return rows.residuals
    return tuple(system.rate(c) for c in rows.residuals)


def projected(system: MechanicalSystem, gradient: Sequence[Node]) -> list[Node]:
    """Return N^T g for a gradient with respect to q."""
    velocities = [s.node for s in system.v]
    return vjp(system.graph, list(zip(system.qdot, gradient, strict=True)), velocities)


def lagrange(system: MechanicalSystem, lagrangian: Node) -> list[Node]:
    """Return d/dt dL/dv - N^T dL/dq - d2/dt2 dL/da, with w x dL/dw for rotations, for L given as a formula.

    L must be linear in a; the third derivatives then cancel.
    """
    graph = system.graph
    if graph.is_constant(lagrangian):
        return [graph.zero] * len(system.v)
    velocities = [s.node for s in system.v]
    momenta = vjp(graph, [(lagrangian, graph.one)], velocities)
    gradient = vjp(graph, [(lagrangian, graph.one)], [s.node for s in system.q])
    result = [
        combined(graph, graph.sub(system.rate(p), g))
        for p, g in zip(momenta, projected(system, gradient), strict=True)
    ]
    for i, second in enumerate(highest(system, lagrangian)):
        result[i] = graph.sub(result[i], system.rate(system.rate(second)))
    for _, first in system.rotations:
        block = slice(first, first + 3)
        gyroscopic = cross(graph, velocities[block], momenta[block])
        result[block] = add(graph, result[block], gyroscopic)
    return result


def highest(system: MechanicalSystem, lagrangian: Node) -> list[Node]:
    """Return dL/da: zero but for Lagrangians with second derivatives."""
    return vjp(system.graph, [(lagrangian, system.graph.one)], system.a)


def conservative(system: MechanicalSystem) -> list[Node]:
    """Return N^T dV/dq of the potential that the user wrote (weights of bodies are in the inertia seeds).

    One that depends on velocities, as that of a magnetic field does, has Lagrange's operator.
    """
    graph = system.graph
    if graph.is_constant(system.potential):
        return [graph.zero] * len(system.v)
    if graph.depend([system.potential], system.symbols.velocities):
        return lagrange(system, graph.neg(system.potential))
    return projected(system, gradient(graph, system.potential, [s.node for s in system.q]))


def seeds_of(system: MechanicalSystem, multipliers: Sequence[Sequence[Node]]) -> Seeds:
    """Return the seeds of bodies, forces and constraints together."""
    seeds = inertia_seeds(system) + effort_seeds(system)
    for rows, symbols in zip(system.constraints, multipliers, strict=True):
        rates = constraint_rates(system, rows)
        seeds += [(rate, system.graph.neg(lam)) for rate, lam in zip(rates, symbols, strict=True)]
    return seeds


def energy_efforts(system: MechanicalSystem, moved: VirtualDisplacement) -> list[Node]:
    """Return what energies and dissipation written as formulas add to the force along each virtual rate.

    The displacements are coordinates like others, which stay zero: d/dt dL/dw' - dL/dw + dR/dw'.
    """
    graph, rates = system.graph, (*moved.force_rates, *moved.moment_rates)
    places = moved.values[: len(rates)]
    result = [graph.zero] * len(rates)
    lagrangian = graph.sub(graph.add(system.kinetic, system.lagrangian), system.potential)
    if not {*places, *rates}.isdisjoint(graph.support(lagrangian)):
        momenta = vjp(graph, [(lagrangian, graph.one)], rates)
        gradient = vjp(graph, [(lagrangian, graph.one)], places)
        result = [graph.sub(system.rate(p), g) for p, g in zip(momenta, gradient, strict=True)]
    if not set(rates).isdisjoint(graph.support(system.dissipation)):
        losses = vjp(graph, [(system.dissipation, graph.one)], rates)
        result = [graph.add(x, y) for x, y in zip(result, losses, strict=True)]
    return result


def residual(system: MechanicalSystem, multipliers: Sequence[Sequence[Node]]) -> list[Node]:
    """Return r - K^T lam, one node for each velocity, affine in a and lam.

    ``multipliers``: one sequence of symbols for each entry of ``system.constraints``.
    """
    graph: Graph = system.graph
    velocities = [s.node for s in system.v]
    result = vjp(graph, seeds_of(system, multipliers), velocities)
    parts = [
        lagrange(system, graph.add(system.kinetic, system.lagrangian)),
        conservative(system),
    ]
    if not graph.is_constant(system.dissipation):
        parts.append(vjp(graph, [(system.dissipation, graph.one)], velocities))
    for part in parts:
        result = [graph.add(x, y) for x, y in zip(result, part, strict=True)]
    return result


Factors = tuple[Node, ...]
"""Ascending; constants apart."""
Term = tuple[Fraction, Factors]


def combined(graph: Graph, total: Node) -> Node:
    """Return a sum with like terms taken together; the node itself where there are none.

    Only products that hold a sum of two are looked into, each once: the work grows with the number of terms.
    """
    terms: dict[int, Term] = dict(
        enumerate(_product(graph, node, sign) for node, sign in _terms(graph, total))
    )
    where = {factors: i for i, (_, factors) in terms.items()}
    count = len(terms)
    for i in range(count):
        while (found := _cancelling(graph, terms, where, i)) is not None:
            del terms[found[0]]
            terms[i] = found[1]
    if len(terms) == count:
        return total
    return graph.sum(
        graph.mul(graph.constant(coefficient), graph.product(factors))
        for coefficient, factors in terms.values()
    )


def _cancelling(
    graph: Graph, terms: Mapping[int, Term], where: Mapping[Factors, int], i: int
) -> tuple[int, Term] | None:
    """Return a term that cancels one half of term i, with the other half."""
    if i not in terms:
        return None
    coefficient, factors = terms[i]
    for (size, half), rest in _halves(graph, factors, coefficient):
        j = where.get(half, i)
        if j != i and j in terms and terms[j] == (-size, half):
            return j, rest
    return None


def _terms(graph: Graph, total: Node) -> Iterator[tuple[Node, int]]:
    """Yield the terms of a sum in their order, with their signs."""
    stack = [(total, 1)]
    while stack:
        node, sign = stack.pop()
        match graph.op(node):
            case ops.ADD:
                a, b = graph.args(node)
                stack += [(b, sign), (a, sign)]
            case ops.SUB:
                a, b = graph.args(node)
                stack += [(b, -sign), (a, sign)]
            case ops.NEG:
                stack.append((graph.args(node)[0], -sign))
            case _:
                yield node, sign


def _product(graph: Graph, node: Node, sign: int) -> Term:
    """Return the coefficient and the factors of a term."""
    coefficient, factors = Fraction(sign), []
    stack = [node]
    while stack:
        n = stack.pop()
        match graph.op(n):
            case ops.MUL:
                stack += graph.args(n)
            case ops.NEG:
                coefficient = -coefficient
                stack += graph.args(n)
            case ops.CONST:
                coefficient *= graph.value(n)
            case _:
                factors.append(n)
    return coefficient, tuple(sorted(factors))


def _halves(graph: Graph, factors: Factors, coefficient: Fraction) -> Iterator[tuple[Term, Term]]:
    """Yield both halves of a product that holds a sum of two: each half, and what is left without it."""
    for k, factor in enumerate(factors):
        if graph.op(factor) not in (ops.ADD, ops.SUB):
            continue
        others = factors[:k] + factors[k + 1 :]
        first, second = graph.args(factor)
        halves = []
        for part, sign in ((first, 1), (second, -1 if graph.op(factor) == ops.SUB else 1)):
            own, inner = _product(graph, part, sign)
            halves.append((coefficient * own, tuple(sorted((*others, *inner)))))
        yield halves[0], halves[1]
        yield halves[1], halves[0]

"""Switches across which an energy jumps: an impulse along the gradient of the surface keeps the total energy."""

from __future__ import annotations

from collections.abc import Sequence

from msgspec import Struct

from mechc.lang.diagnostics import Reporter
from mechc.lang.source import Span

from ..graph import Node
from ..graph.rewrite import substitute
from ..mechanics.system import MechanicalSystem
from .solve import Solved
from .switches import Switch, Switches


class Step(Struct, frozen=True):
    """A switch across which the potential energy jumps: ``symbol``, and its number among those that are located."""

    switch: int
    symbol: Node
    rate: Node
    impulse: Node
    jump: Node


def energy_steps(
    system: MechanicalSystem, solved: Solved, switches: Switches, reporter: Reporter
) -> list[Step]:
    """Return the switches across which the energies jump; report what has no meaning."""
    graph = system.graph
    (potential, kinetic) = switches.apply(
        system, solved.resolve([solved.energies.potential, solved.energies.kinetic])
    )
    steps: list[Step] = []
    in_kinetic, in_potential = set(graph.support(kinetic)), set(graph.support(potential))
    for k, s in enumerate(switches.located):
        if s.symbol in in_kinetic and not graph.is_zero(_jump(system, kinetic, s)):
            reporter.error(
                "E0715",
                "the kinetic energy must not jump",
                _span(system, "kinetic"),
                caption="this contains an 'if' on a moving quantity",
                help="a mass that changes its value belongs to an event: use a 'discrete' variable and 'reinit'",
            )
        if s.symbol not in in_potential:
            continue
        jump = _jump(system, potential, s)
        if graph.is_zero(jump):
            continue
        support = set(graph.support(s.written))
        if support & system.symbols.velocities or system.symbols.time in support:
            if graph.is_constant(jump):
                reporter.error(
                    "E0716",
                    "the potential energy jumps where velocities or time say so",
                    _span(system, "potential"),
                    caption="only a jump at a place in space has a direction for its impulse",
                )
            continue
        steps.append(Step(k, s.symbol, system.rate(s.written), graph.symbol(f"#impulse step {k}"), jump))
    return steps


def _jump(system: MechanicalSystem, energy: Node, switch: Switch) -> Node:
    """Return the energy where the relation holds minus that where it does not."""
    graph = system.graph
    (holds,) = substitute(graph, [energy], {switch.symbol: graph.one})
    (fails,) = substitute(graph, [energy], {switch.symbol: graph.zero})
    return graph.sub(holds, fails)


def _span(system: MechanicalSystem, kind: str) -> Span | None:
    for energy in system.model.energies:
        if energy.kind == kind:
            return energy.value.span
    return None


def step_values(system: MechanicalSystem, solved: Solved, steps: Sequence[Step]) -> list[Node]:
    graph = system.graph
    zero = graph.zero
    values: list[Node] = []
    for step in steps:
        jump = graph.select(step.symbol, graph.neg(step.jump), step.jump)
        (rate,) = solved.resolve([step.rate])
        values += [zero, rate, zero, zero, jump, zero, zero, zero]
    return values

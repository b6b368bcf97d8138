"""Switches across which an energy jumps: an impulse along the gradient of the surface keeps the total energy."""

from __future__ import annotations

from collections.abc import Sequence

from msgspec import Struct

from mechc.lang.diagnostics import Reporter
from mechc.lang.source import Span

from ...graph import Graph, Node
from ...graph.differentiate import vjp
from ...graph.rewrite import substitute
from ...mechanics.system import MechanicalSystem
from ..solve.solved import Solved, check_rates
from .switches import Switches


class EnergyStep(Struct, frozen=True):
    """A switch across which the potential energy jumps: ``symbol``, and its number among those that are located."""

    switch: int
    symbol: Node
    rate: Node
    impulse: Node
    jump: Node


def energy_steps(
    system: MechanicalSystem, solved: Solved, switches: Switches, reporter: Reporter
) -> list[EnergyStep]:
    """Return the switches across which the energies jump; report what has no meaning."""
    graph = system.graph
    formulas = [solved.energies.potential, system.lagrangian, solved.energies.kinetic]
    potential, lagrangian, kinetic = switches.apply(system, solved.resolve(formulas))
    # As they are written, without what drives put in; a `mass` may change with time: what joins it has its velocity.
    written = switches.apply(system, [system.kinetic, system.potential, system.lagrangian])
    steps: list[EnergyStep] = []
    in_kinetic, in_potential = set(graph.support(kinetic)), set(graph.support(potential, lagrangian))
    symbols = system.symbols
    moving = symbols.positions | symbols.velocities | {x.node for x in (*symbols.states, *symbols.inputs)}
    for timed in switches.timed:
        if timed.symbol in in_kinetic | in_potential:
            then = substitute(graph, written, {symbols.time: timed.crossing})
            _check_inertia(system, timed.symbol, *then, reporter=reporter)
    for k, s in enumerate(switches.located):
        if s.symbol not in in_kinetic | in_potential:
            continue
        of_time = moving.isdisjoint(graph.support(s.indicator))
        energies = written if of_time else (kinetic, potential, lagrangian)
        _check_inertia(system, s.symbol, *energies, reporter=reporter)
        jump = graph.sub(_jump(graph, potential, s.symbol), _jump(graph, lagrangian, s.symbol))
        if not _momenta(system, jump):  # what stands on both sides, with its velocities, cancels
            (jump,) = substitute(graph, [jump], dict.fromkeys(symbols.velocities, graph.zero))
        if graph.is_zero(jump):
            continue
        rate = system.rate(s.written)
        if system.symbols.velocities.intersection(graph.support(s.written)) or not _directed(system, rate):
            if graph.is_constant(jump):
                reporter.error(
                    "E0716",
                    "the potential energy jumps with velocity or time",
                    _span(system, "potential") or _span(system, "lagrangian"),
                    caption="an impulse has a direction only where the energy jumps at a place in space",
                )
            continue
        if not system.unknown_rates.keys().isdisjoint(graph.support(rate)):
            if graph.equal_up_to_sign(jump, s.indicator):
                continue  # nothing jumps, so that no impulse needs the rate
            check_rates(system, [rate], reporter)
        steps.append(EnergyStep(k, s.symbol, rate, graph.symbol(f"#impulse step {k}"), jump))
    return steps


def _directed(system: MechanicalSystem, rate: Node) -> bool:
    """Tell whether an impulse can change the rate of a surface."""
    return not system.symbols.velocities.isdisjoint(system.graph.support(rate))


def _check_inertia(
    system: MechanicalSystem,
    switch: Node,
    kinetic: Node,
    potential: Node,
    lagrangian: Node,
    *,
    reporter: Reporter,
) -> None:
    """Report momenta, as derivatives of the energies, that jump with a switch."""
    graph = system.graph
    for energy, kind in ((kinetic, "kinetic"), (potential, "potential"), (lagrangian, "lagrangian")):
        jump = _jump(graph, energy, switch)
        if kind != "kinetic" and not _momenta(system, jump):
            continue
        if not graph.is_zero(jump):
            reporter.error(
                "E0715",
                "the kinetic energy must not jump",
                _span(system, kind) or _span(system, "potential"),
                caption="this contains an 'if' on a moving quantity",
                help="a mass that changes its value belongs to an event: use a 'discrete' variable and 'reinit'",
            )
            return


def _momenta(system: MechanicalSystem, jump: Node) -> bool:
    """Tell whether momenta jump with an energy."""
    graph, velocities = system.graph, sorted(system.symbols.velocities)
    return not all(map(graph.is_zero, vjp(graph, [(jump, graph.one)], velocities)))


def _jump(graph: Graph, energy: Node, switch: Node) -> Node:
    """Return the energy where the relation holds minus that where it does not."""
    (holds,) = substitute(graph, [energy], {switch: graph.one})
    (fails,) = substitute(graph, [energy], {switch: graph.zero})
    return graph.sub(holds, fails)


def _span(system: MechanicalSystem, kind: str) -> Span | None:
    for energy in system.model.energies:
        if energy.kind == kind:
            return energy.value.span
    return None


def step_values(system: MechanicalSystem, solved: Solved, steps: Sequence[EnergyStep]) -> list[Node]:
    """Return eight values for each step in the order of those of rows: its rate, and as force the jump of the energy."""
    graph = system.graph
    zero = graph.zero
    values: list[Node] = []
    for step in steps:
        jump = graph.select(step.symbol, graph.neg(step.jump), step.jump)
        (rate,) = solved.resolve([step.rate])
        values += [zero, rate, zero, zero, jump, zero, zero, zero]
    return values

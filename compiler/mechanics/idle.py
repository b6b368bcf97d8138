"""Warnings of statements that have no effect, as nothing that they act on moves."""

from __future__ import annotations

from collections.abc import Set

from mechc.lang.diagnostics import Reporter

from ..flat.model import Origin
from ..graph import Node
from .forces import rate_of
from .modes import ImpulseAction
from .system import MechanicalSystem


def warn_of_idle(system: MechanicalSystem, reporter: Reporter) -> None:
    """Warn of forces, frictions, impulses and energies that move nothing and are moved by nothing."""
    graph, model, lowering = system.graph, system.model, system.lowering
    velocities = system.symbols.velocities
    moving = system.symbols.positions | velocities

    def check(
        what: str, nodes: tuple[Node, ...], kept: Set[Node], origin: Origin, why: str, help: str = ""
    ) -> None:
        if kept.isdisjoint(graph.support(*nodes)):
            reporter.warning("W0531", f"this {what} has no effect", origin.shown, caption=why, help=help)

    still = "what it acts on does not move"
    coordinate = "let it act on a coordinate, or on a frame or point that moves"
    for load, effort in zip(model.loads, system.efforts, strict=True):
        check(load.kind, tuple(rate for rate, _ in effort.pairs), velocities, load.origin, still, coordinate)
    for item in model.dampings:
        check(
            "damping", rate_of(lowering, item.on, system.symbols), velocities, item.origin, still, coordinate
        )
    for friction in model.frictions:
        rates = rate_of(lowering, friction.on, system.symbols)
        check("friction", rates, velocities, friction.origin, still, coordinate)
    for branch in system.branches:
        for action in branch.actions:
            if isinstance(action, ImpulseAction):
                rates = tuple(rate for rate, _ in action.pairs)
                check("impulse", rates, velocities, action.origin, still, coordinate)
    for energy in model.energies:
        kept = velocities if energy.kind == "dissipation" else moving
        why = (
            "it depends on no velocity"
            if energy.kind == "dissipation"
            else "it is the same wherever things are"
        )
        noun = "dissipation" if energy.kind == "dissipation" else f"{energy.kind} energy"
        noun = "Lagrangian" if energy.kind == "lagrangian" else noun
        check(noun, (lowering.scalar(energy.value),), kept, energy.origin, why)

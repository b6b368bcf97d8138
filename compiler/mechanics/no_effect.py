"""Statements that change nothing: those whose forces act on nothing that moves are warned of, those without meaning yet are refused."""

from __future__ import annotations

from collections.abc import Sequence, Set

from mechc.lang.diagnostics import Reporter

from ..flat.model import FlatModel, Origin
from ..graph import Graph, Node
from .forces import rate_of
from .modes import ImpulseAction
from .system import MechanicalSystem


def warn_of_idle(system: MechanicalSystem, energies: Sequence[Node], reporter: Reporter) -> None:
    """Warn of forces, frictions, impulses and energies that move nothing and are moved by nothing.

    ``energies``: the formula of each statement of the model.
    """
    graph, model, lowering = system.graph, system.model, system.lowering
    velocities = system.symbols.velocities
    moving = system.symbols.positions | velocities

    def check(
        what: str, nodes: tuple[Node, ...], kept: Set[Node], origin: Origin, why: str, help: str = ""
    ) -> None:
        if not graph.depend(nodes, kept):
            reporter.warning("W0531", f"this {what} has no effect", origin.shown, caption=why, help=help)

    still = "what it acts on does not move"
    coordinate = "let it act on a coordinate, or on a frame or point that moves"

    def check_load(what: str, pairs: Sequence[tuple[Node, Node]], origin: Origin) -> None:
        if _cancels(graph, pairs):
            why, other = "its reaction acts at the same place", "let 'from' name what it pushes away from"
            reporter.warning("W0531", f"this {what} has no effect", origin.shown, caption=why, help=other)
        else:
            check(what, tuple(rate for rate, _ in pairs), velocities, origin, still, coordinate)

    for load, effort in zip(model.loads, system.efforts, strict=True):
        check_load(load.kind, effort.pairs, load.origin)
    for item in model.dampings:
        check(
            "damping",
            rate_of(lowering, item.on, system.symbols, linear=False),
            velocities,
            item.origin,
            still,
            coordinate,
        )
    for friction in model.frictions:
        rates = rate_of(lowering, friction.on, system.symbols)
        check("friction", rates, velocities, friction.origin, still, coordinate)
    for branch in system.branches:
        for action in branch.actions:
            if isinstance(action, ImpulseAction):
                check_load("impulse", action.pairs, action.origin)
    for energy, value in zip(model.energies, energies, strict=True):
        kept = velocities if energy.kind == "dissipation" else moving
        why = (
            "it depends on no velocity"
            if energy.kind == "dissipation"
            else "it does not change with the motion"
        )
        noun = "dissipation" if energy.kind == "dissipation" else f"{energy.kind} energy"
        noun = "Lagrangian" if energy.kind == "lagrangian" else noun
        check(noun, (value,), kept, energy.origin, why)


def _cancels(graph: Graph, pairs: Sequence[tuple[Node, Node]]) -> bool:
    """Tell whether efforts work on the same rates as their reactions, so that nothing is left of them."""
    left: dict[Node, Node] = {}
    for rate, effort in pairs:
        left[rate] = graph.add(left.get(rate, graph.zero), effort)
    return all(map(graph.is_zero, left.values())) and any(not graph.is_zero(effort) for _, effort in pairs)


def refuse(model: FlatModel, reporter: Reporter) -> None:
    """Report each statement that the equations cannot hold yet."""
    for variable in model.variables:
        if "chart" in variable.attributes.options:
            reporter.error(
                "E0590",
                "charts of rotations are not supported yet",
                variable.origin.shown,
                caption="this asks for three angles instead of a quaternion",
                help="leave the chart out, or write the frame as rotz(a)*rotx(b)*rotz(c) with coordinates a, b, c",
            )
    for experiment in model.experiments:
        if (section := experiment.options.get("record")) is not None:
            reporter.error(
                "E0590",
                "recording where an expression crosses zero is not supported yet",
                section.span,
                help="'every' records at equal distances; where the condition of a 'when' becomes true is an event, "
                "which the solution keeps",
            )

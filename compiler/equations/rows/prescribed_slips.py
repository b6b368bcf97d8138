"""Friction along slips that no force changes: between what is driven, its force is known by the sign of the slip.

It acts against the slip with the limit of sliding. At rest it may be anything up to the limit of sticking, and nothing else
decides it: it counts as zero there, which is the middle.
"""

from __future__ import annotations

from collections.abc import Mapping

from msgspec.structs import replace

from mechc.lang.diagnostics import Reporter

from ...graph import Graph, Node
from ...graph.rewrite import substitute
from ...mechanics.modes import Mode, Regularized
from ...mechanics.system import ConstraintRows, MechanicalSystem
from .residual import constraint_rates


def with_prescribed_slips(
    system: MechanicalSystem, driven: Mapping[Node, Node], reporter: Reporter
) -> MechanicalSystem:
    """Return the system with the law of friction where ``driven`` coordinates decide the slip; note its choice at rest."""
    if not system.drives:
        return system
    groups: dict[str, list[ConstraintRows]] = {}
    for rows in system.constraints:
        if rows.mode is not None and rows.mode.kind == "friction" and rows.mode.smooth is None:
            groups.setdefault(rows.mode.contact or rows.name, []).append(rows)
    moving = system.symbols.positions | system.symbols.velocities
    known: dict[str, Mode] = {}
    for name, group in groups.items():
        rates = [constraint_rates(system, rows) for rows in group]
        slips = substitute(system.graph, [rate for (rate,) in rates], driven)
        if not moving.isdisjoint(system.graph.support(*slips)):
            continue
        sticks = _at_rest(system.graph, slips)
        for rows, side in zip(group, _sides(system.graph, slips), strict=True):
            assert rows.mode is not None
            known[rows.name] = replace(rows.mode, smooth=Regularized(side, None, "", sticks))
        reporter.note(
            "N0724",
            f"the slip of friction '{name}' is prescribed, so its force at rest cannot be known",
            group[0].origin.shown,
            caption="zero while nothing slips",
            help="at rest it may be anything up to its limit, and so may the reactions that carry it",
        )
    if not known:
        return system
    return replace(
        system,
        constraints=tuple(
            replace(rows, mode=known[rows.name]) if rows.name in known else rows
            for rows in system.constraints
        ),
    )


def sticking(system: MechanicalSystem) -> dict[Node, Node]:
    """Return what stands for the flags of frictions whose slips are prescribed: 1 where nothing slips."""
    modes = (rows.mode for rows in system.constraints)
    return {m.flag: m.smooth.sticks for m in modes if m and m.smooth and m.smooth.sticks is not None}


def _at_rest(graph: Graph, slips: list[Node]) -> Node:
    square = graph.zero
    for slip in slips:
        square = graph.add(square, graph.mul(slip, slip))
    return graph.select(graph.less(graph.zero, square), graph.zero, graph.one)


def _sides(graph: Graph, slips: list[Node]) -> list[Node]:
    """Return the direction of a slip, of size one, zero where there is none."""
    zero = graph.zero
    if len(slips) == 1:
        (slip,) = slips
        back = graph.select(graph.less(slip, zero), graph.neg(graph.one), zero)
        return [graph.select(graph.less(zero, slip), graph.one, back)]
    square = zero
    for slip in slips:
        square = graph.add(square, graph.mul(slip, slip))
    slides, size = graph.less(zero, square), graph.sqrt(square)
    return [graph.select(slides, graph.div(slip, size), zero) for slip in slips]

"""Drives that follow states: a filter of an input, say. Their rates come from the equations of the states."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from msgspec.structs import replace

from mechc.lang.diagnostics import Reporter

from ..flat.model import FlatModel, Reinit
from ..flat.operands import free_names
from ..graph import Graph, Node
from ..graph import operations as ops
from ..graph.rewrite import substitute
from .driving_inputs import can_drive
from .kinematics.rates import TotalDerivative
from .meaning.symbols import Scalar, Symbols
from .system import DriveRow


def by_states(
    graph: Graph,
    rate: TotalDerivative,
    symbols: Symbols,
    drives: Sequence[DriveRow],
    xdot: Mapping[Node, Node],
    model: FlatModel,
    reporter: Reporter,
) -> tuple[DriveRow, ...]:
    """Return the drives with rates in terms of states; report those whose position or rate may jump, or that follow what moves
    freely."""
    states = {s.node for s in symbols.states}
    if not any(states & set(graph.support(*row.values, *row.rates)) for row in drives):
        return tuple(drives)
    known = {rate(state): value for state, value in xdot.items()}
    rates = [substitute(graph, row.rates, known) for row in drives]
    found = tuple(replace(row, rates=tuple(nodes)) for row, nodes in zip(drives, rates, strict=True))
    for row in found:
        _check(graph, rate, symbols, row, known, model, reporter)
    return found


def _check(
    graph: Graph,
    rate: TotalDerivative,
    symbols: Symbols,
    row: DriveRow,
    known: Mapping[Node, Node],
    model: FlatModel,
    reporter: Reporter,
) -> None:
    """Report a drive whose position or rate depends on more than time, parameters, states and smooth inputs."""
    states = {s.node: s for s in symbols.states}
    accelerations = substitute(graph, [rate(n) for n in row.rates], known)
    support = set(graph.support(*row.values, *row.rates))
    if not support & states.keys():
        return
    moving = [s for c in symbols.coordinates for s in (*c.q, *c.v)]
    rough: list[Scalar] = [s for s in (*symbols.discretes, *moving) if s.node in support]
    rough += [s for s in symbols.inputs if s.node in support and not can_drive(s)]
    rough += [s for s in moving if s.node in set(graph.support(*accelerations))]
    caption = "the rate of what it follows depends on '{}', which may jump or moves freely"
    if not rough:
        rough = [states[n] for n in sorted(_set_anew(symbols, model) & support)]
        caption = "an event sets the state '{}' again, and what follows it would jump"
    if not rough and _switches(graph, row, {symbols.time, *states}):
        rough, caption = [states[n] for n in sorted(support & states.keys())], "the rate of '{}' switches"
    if not rough:
        return
    reporter.error(
        "E0504",
        "a drive may depend on time, parameters, smooth inputs and other drives only",
        row.origin.span,
        caption=caption.format(rough[0].name),
        help="let a second state follow the first one, or use a stiff 'force' that follows it",
    )


def _set_anew(symbols: Symbols, model: FlatModel) -> set[Node]:
    """Return the states that actions of events set."""
    named = {
        name
        for event in model.events
        for branch in event.branches
        for action in branch.actions
        if isinstance(action, Reinit)
        for name in free_names(action.target)
    }
    return {s.node for s in symbols.states if s.variable.name in named}


def _switches(graph: Graph, row: DriveRow, moving: set[Node]) -> bool:
    """Whether the position or the rate of a drive compares what moves, or takes whole parts of it."""
    reached = graph.reach([*row.values, *row.rates])
    return any(graph.op(n) in ops.JUMPING and moving & set(graph.support(n)) for n in reached)

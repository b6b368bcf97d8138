"""What a branch does, as one function: new y, new z, and whether its assertions hold and what it sets fits the constraints."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import assert_never

from msgspec import Struct

from mechc.lang.diagnostics import Reporter

from ...graph import Node
from ...graph.differentiate import jvp, vjp
from ...graph.elimination.eliminate import ZeroPivot, solve
from ...graph.rewrite import substitute
from ...mechanics.modes import BranchRow, CheckAction, EndAction, ImpulseAction, SetAction
from ...mechanics.system import MechanicalSystem
from ..rows.constraints import Row, weighted
from ..solve.solved import Solved


def branch_results(
    system: MechanicalSystem,
    solved: Solved,
    branch: BranchRow,
    y: Sequence[Node],
    z: Sequence[Node],
) -> tuple[Node, ...]:
    """Return new y, new z and the checks of a branch; its actions run from top to bottom.

    A right-hand side sees what the actions above it have done, with what follows from that by the constraints that hold
    there; ``pre(x)`` is the value before the branch. Rates that are set stay while others follow, until a constraint is
    engaged, which is an impact.
    """
    graph = system.graph
    velocities = [system.v[i].node for i in solved.free]
    flags = {row.constraint.mode.flag for row in _holding(solved) if row.constraint.mode}
    now: dict[Node, Node] = {}
    stay: set[Node] = set()
    unsettled = False
    originals = list(system.lowering.previous)
    before = dict(zip(system.lowering.previous.values(), solved.resolve(originals), strict=True))

    def present(nodes: Sequence[Node]) -> list[Node]:
        return substitute(graph, substitute(graph, nodes, now), before)

    def settle() -> None:
        nonlocal unsettled
        if unsettled and _holding(solved):
            others, moved = _others(system, solved, stay)
            now.update(zip(others, present(moved), strict=True))
        unsettled = False

    def seen(nodes: Sequence[Node]) -> list[Node]:
        resolved = solved.resolve(nodes)
        if not (set(velocities) - stay).isdisjoint(graph.support(*resolved)):
            settle()
        return present(resolved)

    checks: list[Node] = []
    for action in branch.actions:
        match action:
            case SetAction(targets=targets, values=values):
                switched = not flags.isdisjoint(targets)
                if switched:
                    settle()
                now |= dict(zip(targets, seen(values), strict=True))
                if switched and values == (graph.one,):
                    stay.clear()
                    unsettled = True
                set_here = set(velocities).intersection(targets)
                stay |= set_here
                unsettled = unsettled or bool(set_here)
            case ImpulseAction(pairs=pairs):
                changes = seen(_jumps(system, solved, pairs))
                moved = [graph.add(now.get(v, v), d) for v, d in zip(velocities, changes, strict=True)]
                now |= dict(zip(velocities, moved, strict=True))
            case CheckAction(condition=condition):
                checks += seen([condition])
            case EndAction():
                pass
            case _:
                assert_never(action)
    if stay:  # else what was engaged acts as the impacts do that follow
        settle()
    checks += [_fits(system, now, tied) for tied in tied_values(system, solved, branch)]
    return (*(now.get(n, n) for n in (*y, *z)), *checks)


class TiedValue(Struct, frozen=True):
    """A row all of whose coordinates or rates a branch sets: ``value``, its position or its rate, must then be zero."""

    row: Row
    value: Node
    rates: bool


def tied_values(system: MechanicalSystem, solved: Solved, branch: BranchRow) -> list[TiedValue]:
    """Return what has to fit because a branch sets it whole."""
    graph = system.graph
    velocities = {system.v[i].node for i in solved.free}
    flags = {row.constraint.mode.flag for row in _holding(solved) if row.constraint.mode}
    places: set[Node] = set()
    stay: set[Node] = set()
    for action in branch.actions:
        if isinstance(action, SetAction):
            if not flags.isdisjoint(action.targets) and action.values == (graph.one,):
                stay.clear()
            stay |= velocities.intersection(action.targets)
            places |= system.symbols.positions.intersection(action.targets)
    found: list[TiedValue] = []
    for row in _holding(solved):
        if row.position is not None and not places.isdisjoint(graph.support(row.position)):
            found.append(TiedValue(row, row.position, rates=False))
        moving = velocities.intersection(graph.support(row.rate))
        if moving and moving <= stay:
            found.append(TiedValue(row, row.rate, rates=True))
    return found


def _fits(system: MechanicalSystem, now: Mapping[Node, Node], tied: TiedValue) -> Node:
    """Return whether a value is zero after a branch, to 1e-6 of the sum of its terms."""
    graph = system.graph
    changing = {v.node for v in system.v} if tied.rates else system.symbols.positions
    symbols = [n for n in graph.support(tied.value) if n in changing]
    terms = [graph.abs(jvp(graph, [tied.value], {n: graph.one})[0]) for n in symbols]
    if tied.rates:  # what remains of it at rest, as where a guide moves
        terms.append(graph.abs(substitute(graph, [tied.value], dict.fromkeys(symbols, graph.zero))[0]))
    off, *terms = substitute(graph, [graph.abs(tied.value), *terms], now)
    size = terms.pop() if tied.rates else graph.zero
    for n, term in zip(symbols, terms, strict=True):
        size = graph.add(size, graph.mul(term, graph.add(graph.abs(n), graph.abs(now.get(n, n)))))
    holds = graph.less_equal(off, graph.mul(graph.constant(1e-6), size))
    mode = tied.row.constraint.mode
    return holds if mode is None else graph.select(now.get(mode.flag, mode.flag), holds, graph.one)


def check_positions(system: MechanicalSystem, solved: Solved, reporter: Reporter) -> None:
    """Report coordinates that events set though constraints tie them to others, which would have to follow."""
    tied = [row for row in _holding(solved) if row.position is not None]
    for branch in system.branches:
        all_set = {target for a in branch.actions if isinstance(a, SetAction) for target in a.targets}
        for action in branch.actions:
            if not isinstance(action, SetAction):
                continue
            places = system.symbols.positions.intersection(action.targets)
            for row in tied:
                assert row.position is not None
                involved = system.symbols.positions.intersection(system.graph.support(row.position))
                if places.isdisjoint(involved) or involved <= all_set:
                    continue
                reporter.error(
                    "E0719",
                    "constraints tie this coordinate to others, so an event cannot set it alone",
                    action.origin.span,
                    caption=f"'{row.title}' would no longer hold",
                    help="set its rate, 'reinit(der(q), ..)': the rates of the others follow; "
                    "or begin another run there, with its initial values",
                )
                break


def check_masses(system: MechanicalSystem, reporter: Reporter) -> None:
    """Report what events set or push though it has no mass: the balance of forces decides it at all times."""
    rows = [row for row in system.drives if row.balanced]
    decided = {system.q[k].node: row for row in rows for k in row.q}
    rates = {system.v[i].node: row for row in rows for i in row.v}
    for branch in system.branches:
        for action in branch.actions:
            if isinstance(action, SetAction):
                found = next((n for n in action.targets if n in decided or n in rates), None)
                word = "set"
            elif isinstance(action, ImpulseAction):
                touched = set(system.graph.support(*(rate for rate, _ in action.pairs)))
                found = next((n for n in rates if n in touched), None)
                word = "pushed"
            else:
                continue
            if found is not None:
                name = (decided.get(found) or rates[found]).names[0]
                reporter.error(
                    "E0713",
                    f"'{name}' has no mass, so it cannot be {word}",
                    action.origin.span,
                    caption="the balance of forces decides it at all times",
                    help="let the event change a force, or give a mass to what moves with it",
                )


def _holding(solved: Solved) -> list[Row]:
    """Return the rows of constraints that hold, or may hold, those that can be released last."""
    released = [
        row for row in solved.switched if row.constraint.mode and row.constraint.mode.kind == "constraint"
    ]
    return [*solved.rows, *released]


def _others(
    system: MechanicalSystem, solved: Solved, stay: Collection[Node]
) -> tuple[list[Node], list[Node]]:
    """Return the velocities that may change, and what they become so that all constraints hold.

    They change as little as kinetic energy allows. Where constraints leave them no room, nothing: those that stay are
    taken to fit.
    """
    graph = system.graph
    others = [i for i in solved.free if system.v[i].node not in stay]
    velocities = [system.v[i].node for i in others]
    rows = [row for row in _holding(solved) if not set(velocities).isdisjoint(graph.support(row.rate))]
    still = [graph.zero] * len(others)
    try:
        changes = _changes(system, solved, others, rows, still, [row.rate for row in rows])
    except ZeroPivot:
        return [], []
    return velocities, [graph.add(v, d) for v, d in zip(velocities, changes, strict=True)]


def _jumps(system: MechanicalSystem, solved: Solved, pairs: Sequence[tuple[Node, Node]]) -> list[Node]:
    """Return the jumps of the velocities by impulses, with all constraints respected."""
    graph = system.graph
    velocities = [system.v[i].node for i in solved.free]
    efforts = vjp(graph, [(rate, effort) for rate, effort in pairs], velocities)
    rows = _holding(solved)
    return _changes(system, solved, solved.free, rows, efforts, [graph.zero] * len(rows))


def _changes(
    system: MechanicalSystem,
    solved: Solved,
    moving: Sequence[int],
    rows: Sequence[Row],
    impulses: Sequence[Node],
    rates: Sequence[Node],
) -> list[Node]:
    """Return d of the velocities ``moving`` with M d - K^T mu = impulses and K d = -rates, for the rows that hold."""
    graph = system.graph
    jumps = [graph.symbol(f"#jump {i}") for i in moving]
    residual = [solved.residual[i] for i in moving]
    inertia = jvp(graph, residual, {system.a[i]: d for i, d in zip(moving, jumps, strict=True)})
    multipliers = [row.multiplier for row in rows]
    forces = jvp(graph, residual, {m: m for m in multipliers})
    step: Mapping[Node, Node] = {system.v[i].node: d for i, d in zip(moving, jumps, strict=True)}
    along = jvp(graph, [row.rate for row in rows], step)
    balance = [graph.sub(graph.add(m, f), p) for m, f, p in zip(inertia, forces, impulses, strict=True)]
    conditions: list[Node] = []
    after: dict[int, range] = {}
    for k, (row, rate, d) in enumerate(zip(rows, rates, along, strict=True), start=len(jumps)):
        condition, mode = graph.add(rate, d), row.constraint.mode
        if mode is not None:  # released: no impulse; its pivot is known when those of all others are
            condition, after[k] = graph.select(mode.flag, condition, row.multiplier), range(k)
        conditions.append(condition)
    equations = [*weighted(graph, balance, rows, conditions, jumps), *conditions]
    found = solve(graph, equations, [*jumps, *multipliers], after=after or None)
    return list(found.solutions[: len(jumps)])

"""``when`` statements as branches: conditions and actions in nodes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import assert_never

from msgspec.structs import replace

from mechc.lang.diagnostics import Label, Reporter

from ..flat import model as flat
from ..flat.model import FlatModel
from ..graph import Graph, Node
from ..graph import operations as ops
from .forces import virtual_power
from .meaning.lower import Lowering
from .meaning.symbols import Symbols
from .modes import BranchRow, CheckAction, EndAction, ImpulseAction, SetAction
from .system import ConstraintRows


def branch_rows(
    lowering: Lowering,
    model: FlatModel,
    symbols: Symbols,
    constraints: tuple[ConstraintRows, ...],
    driven: frozenset[Node],
    reporter: Reporter,
) -> tuple[BranchRow, ...]:
    """Return the branches of all events in the order of declaration."""
    flags = _flags(constraints)
    rows = []
    for number, event in enumerate(model.events):
        for branch in event.branches:
            condition = lowering.scalar(branch.condition)
            _check_condition(lowering, branch, condition, symbols, reporter)
            assigned: dict[Node, flat.Origin] = {}
            actions = tuple(
                made
                for action in branch.actions
                if (made := _action(lowering, action, symbols, flags, driven, assigned, reporter)) is not None
            )
            text = branch.condition.span.text
            if branch.origin.instance:
                text = f"{branch.origin.instance}: {text}"
            rows.append(BranchRow(number, condition, actions, text, branch.origin))
    return (*_told_apart(lowering.graph, rows), *_engaged_at_start(lowering, constraints))


def _told_apart(graph: Graph, rows: Sequence[BranchRow]) -> list[BranchRow]:
    """Return the branches with formulas as texts where a loop repeats one text: ``x[i] < 0 m`` is then that of each i."""
    from ..graph.show import short_formula

    longest = 60
    count = Counter(row.text for row in rows)
    return [
        replace(row, text=text)
        if count[row.text] > 1 and (text := short_formula(graph, row.condition, longest))
        else row
        for row in rows
    ]


def _engaged_at_start(lowering: Lowering, constraints: tuple[ConstraintRows, ...]) -> list[BranchRow]:
    """Return a branch for each constraint that holds, or contact that may press, from the start unless a condition opens it."""
    graph, found = lowering.graph, dict[str, BranchRow]()
    for rows in constraints:
        mode = rows.mode
        if mode is None or mode.unless is None or lowering.initial is None:
            continue
        name = mode.whole or rows.name
        if name in found:
            continue
        condition = graph.logical_and(lowering.initial, graph.logical_not(mode.unless))
        flag, does = (mode.flag, "holds") if mode.enabled is None else (mode.enabled, "may press")
        action = SetAction((flag,), (graph.one,), True, rows.origin)
        number = -1 - len(found)  # it acts before the start is looked at
        found[name] = BranchRow(number, condition, (action,), f"{name} {does} at the start", rows.origin)
    return list(found.values())


def _flags(constraints: tuple[ConstraintRows, ...]) -> dict[str, Node]:
    """Return the symbol that ``release`` and ``engage`` set, by name."""
    found = {}
    for rows in constraints:
        if rows.mode is None:
            continue
        flag = rows.mode.enabled if rows.mode.kind == "contact" else rows.mode.flag
        if flag is not None and rows.mode.kind not in ("friction", "freewheel"):
            found[rows.mode.whole or rows.name] = flag
    return found


def _check_condition(
    lowering: Lowering, branch: flat.EventBranch, condition: Node, symbols: Symbols, reporter: Reporter
) -> None:
    graph = lowering.graph
    parameters = {s.node for s in symbols.parameters}
    span = branch.condition.span
    if set(graph.support(condition)) <= parameters:
        constant = graph.is_constant(condition)
        always = "true" if constant and graph.value(condition) else "false" if constant else "the same"
        reporter.error(
            "E0708",
            f"this condition is always {always}, so it never becomes true",
            span,
            caption="nothing here changes during a run",
            help="an event fires when its condition becomes true; for the start write 'initial()'",
        )
    reached = graph.reach([condition])
    instants = [n for c in lowering.clocks.values() if c.pulse in reached for n in (c.period, c.start)]
    if not set(lowering.previous.values()).isdisjoint(graph.reach([condition, *instants])):
        reporter.error(
            "E0709",
            "'pre' belongs to the actions of an event",
            span,
            caption="a condition is tested with present values",
        )
    discrete = {*parameters, *(s.node for s in symbols.discretes)}
    for n in reached:
        if graph.op(n) == ops.EQUAL and not set(graph.support(n)) <= discrete:
            reporter.error(
                "E0710",
                "a condition cannot ask whether moving quantities are equal",
                span,
                caption="numbers that move meet only for an instant",
                help="write '<' or '>': the instant at which it becomes true is found exactly",
            )


def _action(
    lowering: Lowering,
    action: flat.Action,
    symbols: Symbols,
    flags: Mapping[str, Node],
    driven: frozenset[Node],
    assigned: dict[Node, flat.Origin],
    reporter: Reporter,
) -> SetAction | ImpulseAction | CheckAction | EndAction | None:
    graph: Graph = lowering.graph
    match action:
        case flat.Assign(target=target, value=value) | flat.Reinit(target=target, value=value):
            targets, values = _set(lowering, symbols, target, value)
            _check_once(action, targets, assigned, reporter)
            if isinstance(action, flat.Reinit):
                _check_free(action, targets, driven, reporter)
            return SetAction(targets, values, isinstance(action, flat.Reinit), action.origin)
        case flat.Impulse(load=load, origin=origin):
            return ImpulseAction(tuple(virtual_power(lowering, load, symbols)), origin)
        case flat.Terminate(message=message, origin=origin):
            return EndAction(message, origin)
        case flat.Assertion(condition=condition, message=message, origin=origin):
            return CheckAction(lowering.scalar(condition), message, origin)
        case flat.Switch(target=name, engage=engage, origin=origin):
            if name not in flags:
                word = "engage" if engage else "release"
                reporter.error(
                    "E0711",
                    f"'{name}' cannot be switched",
                    origin.span,
                    caption=f"'{word}' takes a named constraint, a contact, a driven coordinate or a cut joint",
                    help="write 'cut' before a joint of the tree; write the drive of a rotation as a constraint",
                )
                return None
            return SetAction((flags[name],), (graph.one if engage else graph.zero,), True, origin)
        case _:
            assert_never(action)


def _set(
    lowering: Lowering, symbols: Symbols, target: flat.Expression, value: flat.Expression
) -> tuple[tuple[Node, ...], tuple[Node, ...]]:
    """Return what an action sets, and to what: of a rotation its quaternion."""
    if target.type.kind is flat.Kind.ROTATION:
        from .meaning.quaternions import rotation_quaternion

        assert isinstance(target, flat.Name)
        (rotation,) = (c for c in symbols.coordinates if c.variable.name == target.name)
        values = lowering.questions.settle(rotation_quaternion(lowering.graph, lowering, value))
        return tuple(s.node for s in rotation.q), values
    targets, values = lowering.numbers(target), lowering.numbers(value)
    return targets, values * len(targets) if len(values) == 1 else values


def _check_once(
    action: flat.Assign | flat.Reinit,
    targets: tuple[Node, ...],
    assigned: dict[Node, flat.Origin],
    reporter: Reporter,
) -> None:
    for target in targets:
        if target in assigned:
            name = action.target.span.text
            reporter.error(
                "E0712",
                f"'{name}' is set twice at one instant",
                action.origin.span,
                caption="again here",
                labels=(Label(assigned[target].span, "first here"),),
            )
            return
        assigned[target] = action.origin


def _check_free(
    action: flat.Reinit, targets: tuple[Node, ...], driven: frozenset[Node], reporter: Reporter
) -> None:
    if driven.intersection(targets):
        reporter.error(
            "E0713",
            f"'{action.target.span.text}' is driven, so it cannot be set",
            action.origin.span,
            caption="a drive prescribes it at all times",
        )

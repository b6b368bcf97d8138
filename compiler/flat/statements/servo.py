"""Servo constraints: kept by a force elsewhere, a torque, or an input, instead of by a force of their own along them.

The multiplier is that force, or the value of the input. It acts where it is said to, and what it would do along the constraint is taken
back: both are forces that follow from a force.
"""

from __future__ import annotations

from collections.abc import Mapping

from msgspec.structs import replace

from mechc.lang import ast
from mechc.lang.diagnostics import Label, Reporter
from mechc.lang.source import Span

from .. import model, types
from ..expressions.coordinates import has_rates
from ..instances.members import type_of
from ..model import Apply, DefinitionRole, Element, Expression, FlatModel, Kind, Query, Role, Type
from ..names.scope import Scope
from ..subscripts import element_name, subscripts
from .record import StatementRecord
from .variables import attributes


def keep(
    scope: Scope,
    statement: ast.Constraint,
    by: ast.Effort,
    stated: tuple[str, Expression, Expression],
    record: StatementRecord,
) -> None:
    """Record what keeps a constraint of this name and these sides, and take back what its multiplier does along it."""
    name, left, right = stated
    shape = left.type.shape or right.type.shape
    on = scope.elaborate(by.on)
    record.servos[name] = by.span
    origin = scope.origin(by.span)
    if by.kind == "input":
        _bind(scope, by, name, shape, record)
    else:
        from ..expressions.queries import effort_type

        _check_target(scope, by, on, shape)
        force = Query(type=effort_type(scope, by, shape), span=by.span, function="multiplier", target=name)
        record.loads.append(model.Load(by.kind, f"{name}.by", force, on, None, None, None, origin))
    _take_back(scope, stated, by.span, record)


def find_force(
    scope: Scope, stated: tuple[str, Expression, Expression], output: str, span: Span, record: StatementRecord
) -> None:
    """Make an output the multiplier of a constraint of this name and these sides, which acts where the output does."""
    name = stated[0]
    record.servos[name] = span
    for k, definition in enumerate(record.definitions):
        if definition.name == output:
            value = Query(type=definition.type, span=span, function="multiplier", target=name)
            record.definitions[k] = replace(definition, value=value)
    record.unknowns = [u for u in record.unknowns if u.name != output]
    _take_back(scope, stated, span, record)


def _take_back(
    scope: Scope, stated: tuple[str, Expression, Expression], span: Span, record: StatementRecord
) -> None:
    """Take back what the multiplier of a constraint does along it."""
    name, left, right = stated
    shape = left.type.shape or right.type.shape
    difference = Apply(
        type=types.with_shape(
            types.numeric(left.type if left.type.shape or not right.type.shape else right.type), shape
        ),
        span=span,
        function="subtract",
        arguments=(left, right),
    )
    along_type = _own_type(scope, left, right, shape)
    whole = Query(type=along_type, span=span, function="multiplier", target=name)
    for index in subscripts(shape):
        along, value = (_element(e, index, span) for e in (difference, whole))
        back = Apply(type=value.type, span=span, function="negate", arguments=(value,))
        own = element_name(f"{name}.own", index)
        record.loads.append(model.Load("force", own, back, along, None, None, None, scope.origin(span)))


def _own_type(scope: Scope, left: Expression, right: Expression, shape: tuple[int, ...]) -> Type:
    """Return the type of a force along the constraint."""
    if scope.flattening.dimensionless:
        return types.real(types.NUMBER.dimension, shape)
    rates = has_rates(scope.flattening, left) or has_rates(scope.flattening, right)
    side = right if types.is_zero(left) else left
    return types.real((types.POWER if rates else types.ENERGY) / side.type.dimension, shape)


def _element(expression: Expression, index: tuple[int, ...], span: Span) -> Expression:
    if not index:
        return expression
    type = types.element_of(expression.type, len(index))
    return Element(type=type, span=span, base=expression, indices=index)


def _check_target(scope: Scope, by: ast.Effort, on: Expression, shape: tuple[int, ...]) -> None:
    """Report a force or torque that has other numbers than the constraint."""
    placed = on.type.kind in (Kind.FRAME, Kind.POINT)
    if by.kind == "torque" and on.type.kind is Kind.POINT:
        raise scope.fail("E0332", "a torque is on a frame, not on a point", by.on.span)
    if not placed and (on.type.kind not in types.NUMERIC or on.type.shape):
        raise scope.fail(
            "E0322",
            "what keeps a constraint acts on a coordinate, a frame or a point",
            by.on.span,
            caption=f"this is {types.describe(on.type)}",
        )
    size = scope.flattening.space.known(scope, by.span) if placed else 0
    wanted: tuple[int, ...] = (
        () if not placed or (by.kind == "torque" and size == 2) else (3,) if by.kind == "torque" else (size,)
    )
    if wanted != shape:
        numbers = f"{wanted[0]} numbers" if wanted else "one number"
        raise scope.fail(
            "E0726",
            f"this {by.kind} has {numbers}, and the constraint has {shape[0] if shape else 1}",
            by.span,
            caption="each equation takes one number of it",
            help="act on a coordinate, or state as many equations as the force has components",
        )


def _bind(scope: Scope, by: ast.Effort, name: str, shape: tuple[int, ...], record: StatementRecord) -> None:
    on = scope.elaborate(by.on)
    member = scope.flattening.variables.get(on.name) if isinstance(on, model.Name) else None
    if member is None or member.role is not Role.INPUT or member.modifiers:
        raise scope.fail(
            "E0726",
            f"'{by.on.span.text}' is not an input that is free",
            by.on.span,
            caption="'by' finds the value of an input, or says 'force on' or 'torque on'",
            labels=(Label(member.modifiers[0].span, "it is given here"),)
            if member is not None and member.modifiers
            else (),
            help=f"write 'by force on {by.on.span.text}'"
            if member is None or member.role is not Role.INPUT
            else "",
        )
    type = types.numeric(type_of(member))
    if type.shape != shape:
        raise scope.fail(
            "E0726",
            f"the input has {type.shape[0] if type.shape else 1} numbers, and the constraint has {shape[0] if shape else 1}",
            by.span,
        )
    value = Query(type=type, span=by.span, function="multiplier", target=name)
    record.servo_inputs.append((member, value))


def find_inputs(record: StatementRecord) -> None:
    """Define the inputs that servo constraints find."""
    for member, value in record.servo_inputs:
        if member in record.variables:
            record.variables.remove(member)
        member.bound = member.value = value
        declaration, scope = member.declaration, member.scope
        extra = attributes(scope, declaration, value.type)
        origin = scope.origin(declaration.span)
        record.definitions.append(
            model.Definition(
                member.name, DefinitionRole.LET, value.type, value, origin, extra, declaration.doc
            )
        )


def check_impacts(flat: FlatModel, servos: Mapping[str, Span], reporter: Reporter) -> None:
    """Report impacts beside a servo constraint: by which impulse it would be kept is not said."""
    if not servos:
        return
    span = next(iter(servos.values()))
    struck = [c.origin.span for c in flat.contacts] + [f.origin.span for f in flat.frictions if f.one_way]
    for event in flat.events:
        for branch in event.branches:
            for action in branch.actions:
                engaged = isinstance(action, model.Switch) and action.engage
                if isinstance(action, model.Impulse) or engaged:
                    struck.append(action.origin.span)
    if struck:
        reporter.error(
            "E0727",
            "impacts together with a constraint that is held by a force elsewhere are not supported yet",
            struck[0],
            caption="an impulse here",
            labels=(Label(span, "which the servo would have to answer at once"),),
            help="let a controller follow, with a force that is a law of the state",
        )

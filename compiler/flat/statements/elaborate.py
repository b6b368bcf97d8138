"""Statements of an instance, one after another, into the record."""

from __future__ import annotations

from typing import assert_never

from msgspec.structs import replace

from mechc.lang import ast
from mechc.lang.diagnostics import Label

from .. import model
from ..instances.components import instances_of
from ..instances.frames import is_free, place_extents, place_value
from ..instances.instantiate import expand
from ..instances.members import definition_value, parameter_value, type_of
from ..instances.modifications import cannot_modify
from ..model import DefinitionRole, Expression, Role
from ..names.instance import (
    ComponentMember,
    DefinitionMember,
    Expanded,
    Instance,
    PlaceMember,
    VariableMember,
)
from ..names.scope import Poisoned, Scope, skip
from ..subscripts import element_name, subscripts
from ..types import FRAME
from .drawings import audible, is_quiet
from .energies import energy, gravities, inertia, mass
from .initial_values import initial, stationary_start
from .record import JointParts, StatementRecord
from .relations import assertion, closure, constraint, drive, equation, exact, place
from .torques import is_torque
from .variables import attributes, check_input, check_parameter
from .variations import end, inequality, refuse, stationary


def run(instance: Instance, record: StatementRecord) -> None:
    """Record every statement of an instance and of the components inside it, in order."""
    statements = expand(instance)
    gravities(instance, statements)
    parts = JointParts(instance)
    drawn = len(record.draws)
    for item in statements:
        try:
            _statement(item, item.scope, record, parts)
        except Poisoned:
            skip(instance.flattening.reporter)
    _joints(parts, record)
    record.draws[drawn:] = audible(record.draws[drawn:], instance)
    if is_quiet(instance):
        record.quiet.append(instance.path)


def _statement(item: Expanded, scope: Scope, record: StatementRecord, parts: JointParts) -> None:
    statement = item.statement
    if scope.flattening.interval:
        refuse(scope, statement)
    match statement:
        case ast.Declaration():
            _declaration(statement, scope, record)
        case ast.Energy():
            energy(scope, statement, record)
        case ast.Mass():
            mass(scope, statement, record)
        case ast.Inertia():
            inertia(scope, statement, record)
        case ast.Load():
            from .loads import load

            load(scope, statement, record)
        case ast.Damping():
            from .loads import damping

            damping(scope, statement, record)
        case ast.Friction():
            from .loads import friction

            friction(scope, statement, record)
        case ast.Contact():
            from .loads import contact

            contact(scope, statement, record)
            if item.pairs is not None:
                from .contact_families import family_of_loops

                record.families.append(family_of_loops(statement, item.pairs, record.contacts[-1].name))
        case ast.Shape() | ast.ContactOfShapes():
            if item.made is not None:
                _made(item.made, record)
        case ast.Constraint():
            constraint(scope, statement, record)
        case ast.Drive():
            drive(scope, statement, record)
        case ast.Place():
            place(scope, statement, parts, record)
        case ast.Closure():
            closure(scope, statement, parts)
        case ast.Initial() | ast.Final() if isinstance(statement, ast.Final) or scope.flattening.interval:
            end(scope, statement, record)
        case ast.Initial():
            initial(scope, statement, record)
        case ast.StationaryStart():
            stationary_start(scope, statement, record)
        case ast.Equation():
            equation(scope, statement, record)
        case ast.Exact():
            exact(scope, statement, record)
        case ast.When():
            from .events import when

            when(scope, statement, record)
        case ast.Assert():
            record.assertions.append(assertion(scope, statement))
        case ast.Independent() if scope.path:
            raise scope.fail(
                "E0412", "only the model itself names its independent variable, no component", statement.span
            )
        case ast.Draw():
            record.draws.append((statement, scope))
        case ast.Stationary():
            stationary(scope, statement, record)
        case ast.Inequality():
            inequality(scope, statement, record)
        case ast.Gravity() | ast.Dimensionless() | ast.Experiment() | ast.Study() | ast.Independent():
            pass  # gravities(), flatten.py and experiments.py see to them
        case ast.Extends() | ast.Import() | ast.Function() | ast.Type() | ast.Model():
            pass  # classes.py and namespace.py see to them
        case ast.If() | ast.For():
            raise AssertionError("expand() unrolls these")
        case ast.Reinit() | ast.Assign() | ast.Terminate() | ast.Impulse() | ast.Release() | ast.Engage():
            raise AssertionError("actions stand inside 'when'")
        case _:
            raise AssertionError(type(statement))


# ---------------------------------------------------------------- declarations


def _made(member: ComponentMember, record: StatementRecord) -> None:
    """Record what a shape or a contact of shapes makes."""
    from .contact_families import families_of_shapes
    from .contacts_of_shapes import made_by

    for instance, pairs in made_by(member):
        known = len(record.contacts)
        run(instance, record)
        if pairs is not None:
            record.families += families_of_shapes(pairs, instance, record.contacts[known:])


def _declaration(declaration: ast.Declaration, scope: Scope, record: StatementRecord) -> None:
    assert scope.instance is not None
    member = scope.instance.members[declaration.name]
    match member:
        case VariableMember():
            _variable(member, record)
        case DefinitionMember():
            _definition(member, record)
        case PlaceMember():
            for index in subscripts(place_extents(member)):
                _frame_or_point(member, index, record)
        case ComponentMember():
            for instance in instances_of(member).values():
                run(instance, record)
        case _:
            assert_never(member)


def _variable(member: VariableMember, record: StatementRecord) -> None:
    type = type_of(member)
    if member.structural:
        attributes(member.scope, member.declaration, type)  # reports wrong ones
        return
    record.variables.append(member)
    if member.role in (Role.COORDINATE, Role.STATE):
        return
    member.value = parameter_value(member)
    if member.value is None:
        return
    if member.role is Role.PARAMETER:
        check_parameter(member, member.value)
    if member.stands_for_value:
        member.bound = member.value
        record.variables.pop()
        _define(member, DefinitionRole.LET, member.name, member.value, record)
    elif member.role is Role.INPUT:
        check_input(member, member.value)


def _definition(member: DefinitionMember, record: StatementRecord) -> None:
    for modifier in member.modifiers:
        noun = "an abbreviation" if isinstance(member.declaration, ast.Let) else "an output"
        cannot_modify(member, modifier, f"is {noun}")  # reported; the value is used as it is
    within, value = member.scope.instance, definition_value(member)  # which tells the guess
    asked = member.guess is not None or within is None or not within.pair  # a heap has thousands of pairs
    output = isinstance(member.declaration, ast.Output) and asked
    role = DefinitionRole.OUTPUT if output else DefinitionRole.LET
    _define(member, role, member.name, value, record)
    if member.guess is not None:
        origin = member.scope.origin(member.declaration.span)
        record.unknowns.append(model.UnknownOutput(member.name, member.guess, origin))


def _frame_or_point(member: PlaceMember, index: tuple[int, ...], record: StatementRecord) -> None:
    frame = isinstance(member.declaration, ast.Frame)
    role = DefinitionRole.FRAME if frame else DefinitionRole.POINT
    name = element_name(member.name, index)
    value = place_value(member, index)
    _define(member, role, name, value, record)
    if index in member.welds:
        pose, origin = member.welds[index]
        record.placed[name] = origin.span
        record.joints.append(model.Joint(name, "", name, name, pose, (), (), False, origin))


def _define(
    member: VariableMember | DefinitionMember | PlaceMember,
    role: DefinitionRole,
    name: str,
    value: Expression | None,
    record: StatementRecord,
) -> None:
    declaration, scope = member.declaration, member.scope
    if isinstance(member, VariableMember):
        type = type_of(member)
    elif value is None:
        type = FRAME
    else:
        type = value.type
    origin = scope.origin(declaration.span)
    extra = attributes(scope, declaration, type)
    if not extra.display and value is not None and is_torque(scope.flattening, value):
        extra = replace(extra, display="N.m")
    record.definitions.append(model.Definition(name, role, type, value, origin, extra, declaration.doc))


# ---------------------------------------------------------------- joints


def _joints(parts: JointParts, record: StatementRecord) -> None:
    """Make the joints of an instance from its ``place`` and ``closure`` statements."""
    instance = parts.instance
    declaration = instance.declaration
    cut = declaration is not None and declaration.cut
    if not parts.places:
        if cut and declaration is not None and not instance.cls.places:
            instance.flattening.report(
                Scope(instance.flattening, instance.parent, instance.cls.namespace),
                "E0413",
                f"'{declaration.name}' cannot be cut: {instance.cls.name} is not a joint",
                declaration.span,
                labels=(Label(instance.cls.model.name_span, f"{instance.cls.name} places no frame"),),
            )
        return
    coordinates = tuple(
        m.name
        for m in instance.members.values()
        if isinstance(m, VariableMember) and m.role is Role.COORDINATE
    )
    for k, (target, value, span) in enumerate(parts.places):
        name = instance.path if instance.path and k == 0 else target
        source = ""
        if instance.path:
            interface = [n for n in instance.cls.interface if instance.full_name(n) != target]
            source = instance.full_name(interface[0]) if interface else ""
            _check_connected(instance, target, source)
        origin = Scope(instance.flattening, instance, instance.cls.namespace).origin(span)
        record.joints.append(
            model.Joint(
                name,
                source,
                target,
                target,
                value,
                coordinates if k == 0 and instance.path else (),
                tuple(parts.closures) if k == 0 else (),
                cut,
                origin,
            )
        )


def _check_connected(instance: Instance, target: str, source: str) -> None:
    """Report a joint whose sides are not connected to anything."""
    for full in (source, target):
        member = instance.members.get(full.rpartition(".")[2]) if full else None
        if isinstance(member, PlaceMember) and is_free(member) and not member.modifiers:
            scope = Scope(instance.flattening, instance.parent, instance.cls.namespace)
            span = instance.made_at or instance.model.span
            scope.report(
                "E0414",
                f"joint '{instance.path}' does not say what it connects",
                span,
                caption=f"its frame '{member.declaration.name}' is free",
                help=f"write '{instance.cls.name} {instance.path.rpartition('.')[2]}(world -> body.a, ...)'; between two joints without "
                "a body declare a frame: 'frame middle;'",
            )
            return

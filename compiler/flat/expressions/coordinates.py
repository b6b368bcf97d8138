"""Expressions that are coordinates, states or their rates; and whether an expression contains rates at all."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator

from msgspec import Struct

from mechc.lang import ast

from .. import types
from ..instances.members import definition_value, type_of
from ..model import Apply, Array, Derivative, Element, Expression, Kind, Name, Query, Role, Type
from ..names.instance import DefinitionMember, ElaborationProgress, LabelMember, VariableMember
from ..names.scope import Flattening, Poisoned, Scope
from ..operands import children, free_names
from .operators import meet


class Target(Struct, frozen=True):
    """A variable, or an element of it, or its rate (``rate`` the order of the derivative).

    ``type`` is that of the element, without the derivative; ``whole`` that of the variable.
    """

    name: str
    indices: tuple[int, ...]
    role: Role
    rate: int
    type: Type
    whole: Type
    member: VariableMember


def target_of(scope: Scope, expression: Expression) -> Target | None:
    """Return the variable that an expression is, or None where it is something else.

    The four numbers of a rotation are not variables of their own: they move together. Its rate has three elements, der(R)[1..3].
    """
    rate = 0
    indices: tuple[int, ...] = ()
    of_value = False
    while True:
        match expression:
            case Derivative(operand=operand, order=order):
                rate += order
                expression = operand
            case Element(base=base, indices=inner):
                indices = (*inner, *indices)
                of_value = not isinstance(base, Derivative)
                expression = base
            case Name(name=name):
                member = scope.flattening.variables.get(name)
                if member is None or member.structural or member.stands_for_value:
                    return None
                whole = type_of(member)
                if of_value and whole.kind is Kind.ROTATION:
                    return None
                return Target(name, indices, member.role, rate, _element(whole, indices), whole, member)
            case _:
                return None


def whole_rotation(expression: Expression) -> str:
    """Return what to write instead of a number of a rotation or its rate; nothing for other expressions."""
    while isinstance(expression, (Derivative, Element)):
        expression = expression.operand if isinstance(expression, Derivative) else expression.base
    if expression.type.kind is not Kind.ROTATION or not isinstance(expression, Name):
        return ""
    name = re.sub(r"\[[^][]*\]$", "", expression.span.text)
    return f"the four numbers of a rotation move together: '{name}' is one value, and its rate is the angular velocity 'der({name})'"


def slice_elements(expression: Expression) -> tuple[Expression, ...] | None:
    """Return the elements of ``joint.angle`` or ``der(joint.angle)``; None where it is not a slice of components."""
    match expression:
        case Array(elements=elements):
            return elements
        case Derivative(type=type, span=span, operand=Array(elements=elements), order=order):
            inner = types.element_of(type)
            return tuple(Derivative(type=inner, span=span, operand=e, order=order) for e in elements)
        case _:
            return None


def _element(type: Type, indices: tuple[int, ...]) -> Type:
    return types.element_of(type, len(indices)) if indices else type


_RATES = ("vel", "vel_at", "angvel")
_RATES_ASKED = ("energy", "kinetic_energy", "momentum", "power")
"""Questions whose answers contain velocities; a ``potential_energy`` does not: where a potential has some, loads refuse it."""


def has_rates(flattening: Flattening, expression: Expression) -> bool:
    """Tell whether an expression depends on velocities, through definitions too."""
    return any(
        isinstance(at, Derivative)
        or (isinstance(at, Apply) and at.function in _RATES)
        or (isinstance(at, Query) and at.function in _RATES_ASKED)
        for at in _parts(flattening, expression)
    )


def _parts(
    flattening: Flattening, expression: Expression, without: Collection[str] = ()
) -> Iterator[Expression]:
    """Yield all that an expression is made of, through definitions, each once; ``without`` these questions."""
    seen: set[str | int] = set()
    pending = [expression]
    while pending:
        at = pending.pop()
        key = at.name if isinstance(at, Name) else id(at)
        if key in seen or (isinstance(at, Query) and at.function in without):
            continue
        seen.add(key)
        yield at
        pending.extend(definition_of(flattening, at.name) if isinstance(at, Name) else children(at))


def definition_of(flattening: Flattening, name: str) -> list[Expression]:
    """Return the value that a ``let``, ``output`` or connected input stands for, if the name is one."""
    member = flattening.definitions.get(name)
    if isinstance(member, DefinitionMember) and member.progress in (
        ElaborationProgress.DONE,
        ElaborationProgress.NEW,
    ):
        return [definition_value(member)]
    variable = flattening.variables.get(name)
    return [variable.bound] if variable is not None and variable.bound is not None else []


def constraint_dimension(label: LabelMember) -> tuple[Type, bool]:
    """Return the type of left - right of a constraint, of a gap or of what a friction acts on, and whether it is about
    velocities."""
    statement, scope = label.statement, label.scope
    if label.progress is ElaborationProgress.OPEN:
        label.progress = ElaborationProgress.WRONG
        raise scope.fail(
            "E0207",
            f"'{label.name}' depends on its own multiplier",
            statement.span,
            help="the multiplier of a constraint follows from it",
        )
    if label.progress is ElaborationProgress.WRONG:
        raise Poisoned
    label.progress = ElaborationProgress.OPEN
    try:
        if isinstance(statement, ast.Contact) and label.kind == "friction":
            if statement.along is None:  # which is reported with the contact
                raise Poisoned
            along = scope.elaborate(statement.along)
            result = types.with_shape(types.numeric(along.type), along.type.shape), True
        elif isinstance(statement, ast.Contact):
            gap = scope.elaborate(statement.gap)
            result = gap.type, False
        elif isinstance(statement, ast.Friction):
            on = scope.elaborate(statement.on)
            result = types.with_shape(types.numeric(on.type), on.type.shape), has_rates(scope.flattening, on)
        else:
            assert isinstance(statement, ast.Constraint | ast.Inequality)
            parts = statement.condition if isinstance(statement, ast.Inequality) else statement
            assert isinstance(parts, ast.Binary | ast.Constraint)
            left, right = scope.elaborate(parts.left), scope.elaborate(parts.right)
            type = meet(scope, statement, left, right, "the sides of the constraint")
            shape = left.type.shape or right.type.shape
            rates = has_rates(scope.flattening, left) or has_rates(scope.flattening, right)
            result = types.with_shape(types.numeric(type), shape), rates
    except Poisoned:
        label.progress = ElaborationProgress.WRONG
        raise
    label.progress = ElaborationProgress.DONE
    return result


_WHOLE = ("integral", "at", "multiplier")
"""Questions whose answers are numbers of the whole curve."""


def on_the_curve(flattening: Flattening, label: LabelMember) -> bool:
    """Tell whether a constraint holds at every place of a curve, or is one of integrals and ends."""
    statement = label.statement
    parts = statement.condition if isinstance(statement, ast.Inequality) else statement
    assert isinstance(parts, ast.Binary | ast.Constraint)
    sides = (label.scope.elaborate(parts.left), label.scope.elaborate(parts.right))
    return any(varies(flattening, side) for side in sides)


def varies(flattening: Flattening, expression: Expression) -> bool:
    """Tell whether an expression has another value at each place of a curve."""
    interval = flattening.interval
    fixed = () if interval is None else interval.unknown
    for at in _parts(flattening, expression, without=_WHOLE):
        if isinstance(at, Name):
            member = flattening.variables.get(at.name)
            role = None if member is None else member.role
            if at.name == "time" or (role is Role.COORDINATE and at.name not in fixed):
                return True
    return False


def has_unknowns(flattening: Flattening, value: Expression) -> bool:
    """Tell whether outputs that equations determine enter a value, directly or through definitions."""
    seen: set[str] = set()
    pending = [value]
    while pending:
        for name in free_names(pending.pop()):
            member = flattening.definitions.get(name)
            if member is None or name in seen:
                continue
            seen.add(name)
            if isinstance(member.declaration, ast.Output) and member.declaration.guess:
                return True
            pending.extend(definition_of(flattening, name))
    return False

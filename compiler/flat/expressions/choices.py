"""Type rules of ``if`` in expressions and of arrays: values side by side must be alike."""

from __future__ import annotations

from msgspec import Struct

from mechc.lang import ast
from mechc.lang.diagnostics import Label
from mechc.lang.source import Span

from .. import types
from ..model import Array, Expression, Kind, Select, Type
from ..names.scope import Poisoned, Scope
from ..values.evaluate import constant
from .operators import missing_unit, require_truth


class ChoiceBranch(Struct, frozen=True):
    """Where a branch is written, and its value."""

    span: Span
    value: Expression


def conditional(scope: Scope, node: ast.Conditional) -> Expression:
    """Return the chosen branch where the condition is structural, else a choice at run time."""
    conditions: list[tuple[Expression, ast.Expression]] = []
    otherwise = node.otherwise
    for branch in node.branches:
        condition = scope.elaborate(branch.condition)
        require_truth(scope, branch.condition, condition)
        known = constant(condition)
        if known is True:
            otherwise = branch.value
            break
        if known is None:
            conditions.append((condition, branch.value))
    rest = ChoiceBranch(otherwise.span, scope.elaborate(otherwise))
    for condition, value in reversed(conditions):
        then = ChoiceBranch(value.span, scope.elaborate(value))
        rest = ChoiceBranch(value.span, choice(scope, node.span, condition, then, rest))
    return rest.value


def choice(
    scope: Scope, span: Span, condition: Expression, then: ChoiceBranch, other: ChoiceBranch
) -> Expression:
    """Return one of two values by a condition that the run decides. Reports values that differ in kind."""
    for branch in (then, other):
        if branch.value.type.kind in (Kind.FRAME, Kind.POSE, Kind.ROTATION, Kind.STRING):
            raise scope.fail(
                "E0308",
                f"{types.describe(branch.value.type)} cannot depend on a condition that changes during the run",
                branch.span,
                labels=(Label(condition.span, "this is not known when compiling"),),
            )
    first, second = then.value, other.value
    a, b = first.type, second.type
    if (a.kind is Kind.BOOLEAN) is not (b.kind is Kind.BOOLEAN):
        raise _branches_differ(scope, then, other, "E0302")
    if a.dimension != b.dimension and not types.is_zero(first) and not types.is_zero(second):
        raise _branches_differ(scope, then, other, "E0302")
    if a.dimension != b.dimension:
        if types.is_zero(first):
            first = types.retyped_zero(first, b.dimension, b.angle)
        else:
            second = types.retyped_zero(second, a.dimension, a.angle)
    if a.shape != b.shape:
        raise _branches_differ(scope, then, other, "E0305")
    if a.kind is Kind.BOOLEAN:
        type = a
    else:
        kind = Kind.INTEGER if a.kind is b.kind is Kind.INTEGER else Kind.REAL
        type = types.make(kind, a.shape, first.type.dimension, a.angle or b.angle)
    return Select(type=type, span=span, condition=condition, then=first, otherwise=second)


def _branches_differ(scope: Scope, then: ChoiceBranch, other: ChoiceBranch, code: str) -> Poisoned:
    first, second = types.describe(then.value.type), types.describe(other.value.type)
    return scope.fail(
        code,
        f"the branches of 'if' differ: one is {first}, the other is {second}",
        other.span,
        caption=f"this is {second}",
        labels=(Label(then.span, f"this is {first}"),),
    )


def array(scope: Scope, node: ast.Expression, items: list[Expression]) -> Expression:
    """Return an array of elements of one type; zeros fit any."""
    first = next((e for e in items if not types.is_zero(e)), items[0])
    target = types.numeric(first.type) if any(e.type.kind is not Kind.INTEGER for e in items) else first.type
    if first.type.kind is Kind.POINT:
        target = first.type
    elements = [_element(scope, e, target, first) for e in items]
    angle = any(e.type.angle for e in items)
    type = types.make(target.kind, (len(items), *target.shape), target.dimension, target.angle or angle)
    return Array(type=type, span=node.span, elements=tuple(elements))


def _element(scope: Scope, value: Expression, target: Type, first: Expression) -> Expression:
    type = value.type
    same_kind = type.kind is target.kind or (type.kind in types.NUMERIC and target.kind in types.NUMERIC)
    if not same_kind or (type.dimension != target.dimension and not types.is_zero(value)):
        given, wanted = types.describe(type), types.describe(first.type)
        raise scope.fail(
            "E0317",
            f"the elements of an array differ: one is {wanted}, another is {given}",
            value.span,
            caption=f"this is {given}",
            labels=(Label(first.span, f"this is {wanted}"),),
            help=missing_unit(first, value),
        )
    if type.shape != target.shape:
        raise scope.fail(
            "E0305",
            "the elements of an array have different shapes",
            value.span,
            caption=f"this is {types.describe(type)}",
            labels=(Label(first.span, f"this is {types.describe(first.type)}"),),
        )
    if type.dimension != target.dimension:
        return types.retyped_zero(value, target.dimension, target.angle)
    return value

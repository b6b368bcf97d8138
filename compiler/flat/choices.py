"""Type rules of ``if`` in expressions and of arrays: values side by side must be alike."""

from __future__ import annotations

from mechc.lang import ast
from mechc.lang.diagnostics import Label

from . import types
from .evaluate import constant
from .model import Array, Expression, Kind, Select, Type
from .operators import missing_unit, require_truth
from .scope import Poisoned, Scope


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
    result = scope.elaborate(otherwise)
    place = otherwise
    for condition, value in reversed(conditions):
        result = _select(scope, node, condition, value, scope.elaborate(value), place, result)
        place = value
    return result


def _select(
    scope: Scope,
    node: ast.Conditional,
    condition: Expression,
    then_node: ast.Expression,
    then: Expression,
    other_node: ast.Expression,
    other: Expression,
) -> Expression:
    for place, value in ((then_node, then), (other_node, other)):
        if value.type.kind in (Kind.FRAME, Kind.POSE, Kind.ROTATION, Kind.STRING):
            raise scope.fail(
                "E0308",
                f"{types.describe(value.type)} cannot depend on a condition that changes during the run",
                place.span,
                labels=(Label(condition.span, "this is not known when compiling"),),
            )
    a, b = then.type, other.type
    if (a.kind is Kind.BOOLEAN) is not (b.kind is Kind.BOOLEAN):
        raise _branches_differ(scope, then_node, then, other_node, other, "E0302")
    if a.dimension != b.dimension and not types.is_zero(then) and not types.is_zero(other):
        raise _branches_differ(scope, then_node, then, other_node, other, "E0302")
    if a.dimension != b.dimension:
        if types.is_zero(then):
            then = types.retyped_zero(then, b.dimension, b.angle)
        else:
            other = types.retyped_zero(other, a.dimension, a.angle)
    if a.shape != b.shape:
        raise _branches_differ(scope, then_node, then, other_node, other, "E0305")
    if a.kind is Kind.BOOLEAN:
        type = a
    else:
        kind = Kind.INTEGER if a.kind is b.kind is Kind.INTEGER else Kind.REAL
        type = types.make(kind, a.shape, then.type.dimension, a.angle or b.angle)
    return Select(type=type, span=node.span, condition=condition, then=then, otherwise=other)


def _branches_differ(
    scope: Scope,
    then_node: ast.Expression,
    then: Expression,
    other_node: ast.Expression,
    other: Expression,
    code: str,
) -> Poisoned:
    first, second = types.describe(then.type), types.describe(other.type)
    return scope.fail(
        code,
        f"the branches of 'if' differ: one is {first}, the other is {second}",
        other_node.span,
        caption=f"this is {second}",
        labels=(Label(then_node.span, f"this is {first}"),),
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

"""Derivatives of fields by place: ``grad(V, r)``, ``div(F, r)``, ``curl(F, r)``, ``laplacian(V, r)``.

A field is a function of the model whose first argument is the place; further arguments follow the place.
"""

from __future__ import annotations

from mechc.lang import ast
from mechc.lang.builtins import BUILTINS
from mechc.lang.diagnostics import Label

from .. import types
from ..model import Derivative, Expression, FieldDerivative, Kind, Name, Previous, Query, Type, Where
from ..names.scope import Poisoned, Scope
from ..operands import children, free_names

OPERATORS = ("grad", "div", "curl", "laplacian")

_WRITE = "a field is a function of position: 'function V(Length r[3]) = ..;', then '{}(V, r)'"
_MOVING = "give it as a further argument: 'function f(Length r[3], Force N) = ..;', then '{}(f, r, N)'"


def is_field_derivative(scope: Scope, node: ast.Call) -> bool:
    """Tell whether a call differentiates a field; ``div`` of two whole numbers does not."""
    name = node.function.name
    return name in OPERATORS and (name != "div" or _field_name(scope, node) is not None)


def _field_name(scope: Scope, node: ast.Call) -> str | None:
    """Return the name of the function that the first argument is, if it is one."""
    first = node.arguments[0] if node.arguments else None
    if not isinstance(first, ast.Reference) or any(part.indices for part in first.parts):
        return None
    if first.parts[0].name in scope.local or (
        scope.instance is not None and first.parts[0].name in scope.instance.members
    ):
        return None
    found = scope.namespace.look_up(first.name, first.span)
    return first.name if found is not None and isinstance(found.definition, ast.Function) else None


def field_derivative(scope: Scope, node: ast.Call) -> Expression:
    """Return the derivative of a field at a place, its units checked."""
    from .own_functions import own_function

    operator, field = node.function.name, _field_name(scope, node)
    if node.keywords or len(node.arguments) < 2:
        raise scope.fail(
            "E0309",
            f"'{operator}' takes a function, a place, and what else the function takes",
            node.span,
            help=_WRITE.format(operator),
        )
    first = node.arguments[0]
    if field is None:
        known = isinstance(first, ast.Reference) and first.name in BUILTINS
        raise scope.fail(
            "E0336",
            f"'{operator}' takes a function of the model, '{first.span.text}' is none",
            first.span,
            caption="a function of the language" if known else "",
            help=_WRITE.format(operator),
        )
    assert isinstance(first, ast.Reference)
    scope.flattening.quadratures += 1
    variable = f"place#{scope.flattening.quadratures}"
    places: list[Expression] = []

    def bound(value: Expression) -> Expression:
        places.append(value)
        type = types.numeric(value.type)
        if type.kind is not Kind.REAL or len(type.shape) > 1:
            raise scope.fail(
                "E0336",
                f"'{operator}' differentiates by a number or a vector",
                node.arguments[1].span,
                caption=f"this is {types.describe(value.type)}",
                help="write 'pos(F)' for the place of a frame" if type.kind is Kind.FRAME else "",
            )
        return Name(type=type, span=node.arguments[1].span, name=variable)

    call = ast.Call(function=first, arguments=node.arguments[1:], span=node.span)
    body = own_function(scope, call, field, bound)
    (place,) = places
    _check_still(scope, node, body, variable)
    type = _type(scope, node, types.numeric(body.type), types.numeric(place.type))
    return FieldDerivative(
        type=type, span=node.span, operator=operator, variable=variable, place=place, body=body
    )


def _type(scope: Scope, node: ast.Call, field: Type, place: Type) -> Type:
    operator = node.function.name
    if field.kind is not Kind.REAL:
        raise _wrong(scope, node, f"'{operator}' differentiates numbers", field)
    size = place.shape
    slope = field.dimension / place.dimension
    match operator:
        case "grad":
            return types.real(slope, field.shape + size)
        case "div":
            if not size or field.shape[-1:] != size:
                raise _wrong(
                    scope, node, "'div' takes a vector at a place of as many components", field, place
                )
            return types.real(slope, field.shape[:-1])
        case "curl":
            if size not in ((2,), (3,)) or field.shape != size:
                raise _wrong(
                    scope,
                    node,
                    "'curl' takes a vector of 2 or 3 components at a place of as many",
                    field,
                    place,
                )
            return types.real(slope, () if size == (2,) else size)
        case _:
            return types.real(slope / place.dimension, field.shape)


def _wrong(scope: Scope, node: ast.Call, message: str, field: Type, place: Type | None = None) -> Poisoned:
    at = () if place is None else (Label(node.arguments[1].span, f"the place is {types.describe(place)}"),)
    return scope.fail(
        "E0336",
        message,
        node.arguments[0].span,
        caption=f"the field is {types.describe(field)}",
        labels=at,
    )


def _check_still(scope: Scope, node: ast.Call, body: Expression, variable: str) -> None:
    """Refuse fields that ask for the motion of the place, which is any place."""
    moving = {variable}
    pending, seen = [body], set[int]()
    while pending:
        at = pending.pop()
        if id(at) in seen:
            continue
        seen.add(id(at))
        if isinstance(at, Where):
            for name, value in zip(at.names, at.values, strict=True):
                if not moving.isdisjoint(free_names(value)):
                    moving.add(name)
        if isinstance(at, Derivative | Previous | Query) and not moving.isdisjoint(free_names(at)):
            what = "the value before an event" if isinstance(at, Previous) else "a rate"
            raise scope.fail(
                "E0336",
                f"a field has no {what.split(' ', 1)[1]} of its place",
                at.span,
                caption=f"this is {what} of the place, which is any place here",
                help=_MOVING.format(node.function.name),
            )
        pending += children(at)

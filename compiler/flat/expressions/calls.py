"""Calls: built-in functions by their rules, functions of the model inlined."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from fractions import Fraction

from mechc.lang import ast
from mechc.lang.builtins import BUILTINS, Builtin
from mechc.lang.diagnostics import Label

from .. import types
from ..model import Expression, Literal, Name, Quadrature
from ..names.scope import Poisoned, Scope
from ..operands import unbound_names
from ..values.evaluate import iterate
from .fields import field_derivative, is_field_derivative
from .functions import RULES, combined
from .signature import ElaboratedCall

_OF_MOTIONS = {
    "sample": "'sample()' is an instant, and a curve has none",
    "initial": "'initial()' is an instant, and a curve has none",
    "delay": "'delay' looks back in time, and a curve has none",
    "noise": "'noise' runs in time, and a curve has none",
}
"""Functions of a motion in time."""
_OVER_THE_RANGE = "of a curve it goes over the whole range: 'integral(e)'; over a part of it, multiply: 'integral(if x < a then e else 0)'"


def call(scope: Scope, node: ast.Call) -> Expression:
    """Return the value of a call."""
    name = node.function.name
    builtin = BUILTINS.get(name)
    if builtin is None:
        from .own_functions import own_function

        return own_function(scope, node, name)
    own = scope.namespace.exported(name)
    if own is not None and isinstance(own.definition, ast.Function):  # reported where it is defined
        raise Poisoned
    if any(part.indices for part in node.function.parts):
        raise scope.fail("E0209", f"there is no array of functions '{name}'", node.function.span)
    if node.arguments and isinstance(node.arguments[0], ast.Aggregate):
        return _aggregate(scope, node, builtin, node.arguments[0])
    if is_field_derivative(scope, node):
        return field_derivative(scope, node)
    _check_count(scope, node, builtin)
    if name == "integral" and scope.flattening.interval is None:
        return _running_integral(scope, node)
    if name not in RULES and (rule := _rule_before_arguments(name)) is not None:
        return rule(ElaboratedCall(scope, node, name, []))
    interval = scope.flattening.interval
    if interval is not None and name in _OF_MOTIONS:
        raise scope.fail(
            "E0552",
            _OF_MOTIONS[name],
            node.span,
            labels=(Label(interval.span, "this makes it a model of a curve"),),
            help="a choice by place is written 'if x < a then .. else ..'",
        )
    if name == "table" and isinstance(node.arguments[0], ast.Vector):
        raise scope.fail(
            "E0309",
            "a table of two variables takes them one by one",
            node.arguments[0].span,
            help="table(x, y, {x1, x2, ..}, {y1, y2, ..}, {{z11, z12, ..}, ..})",
        )
    arguments = [scope.elaborate(a) for a in node.arguments]
    rule = RULES.get(name) or _further_rules()[name]
    return rule(ElaboratedCall(scope, node, name, arguments))


def _rule_before_arguments(name: str) -> Callable[[ElaboratedCall], Expression] | None:
    """Return the rule of a function that reads its arguments itself; None where another function has the name."""
    if name == "rms":
        from .mean_squares import rms

        return rms
    from .queries import QUERY_RULES

    return QUERY_RULES.get(name)


def _further_rules() -> Mapping[str, Callable[[ElaboratedCall], Expression]]:
    """Return the rules of functions that few models call: no other loads them."""
    from .files import FILE_RULES
    from .kinematics import KINEMATIC_RULES
    from .meshes import MESH_RULES
    from .tables import TABLE_RULES

    return {**KINEMATIC_RULES, **MESH_RULES, **FILE_RULES, **TABLE_RULES}


def _check_count(scope: Scope, node: ast.Call, builtin: Builtin) -> None:
    count = len(node.arguments)
    for keyword in node.keywords:
        if keyword.name not in builtin.keywords:
            known = f"it takes {', '.join(builtin.keywords)}" if builtin.keywords else "it takes none"
            raise scope.fail(
                "E0309", f"'{builtin.name}' has no argument '{keyword.name}'", keyword.span, help=known
            )
    if count < builtin.least or (builtin.most is not None and count > builtin.most):
        raise scope.fail(
            "E0309",
            f"'{builtin.name}' takes {builtin.arity}, not {count}",
            node.span,
            help=_OVER_THE_RANGE if builtin.name == "integral" and scope.flattening.interval else builtin.doc,
        )


# ---------------------------------------------------------------- sums and integrals


def _aggregate(scope: Scope, node: ast.Call, builtin: Builtin, aggregate: ast.Aggregate) -> Expression:
    """Return ``sum(e for i in r)`` written out, or an integral over a real range."""
    if not builtin.generators:
        raise scope.fail("E0309", f"'{builtin.name}' takes no 'for'", aggregate.span)
    if builtin.name == "integral":
        return _quadrature(scope, node, aggregate)
    scopes = [scope]
    for generator in aggregate.generators:
        scopes = [inner for outer in scopes for inner in iterate(outer, generator.name, generator.range)]
    items = [inner.elaborate(aggregate.element) for inner in scopes]
    if not items:
        return _empty(scope, node, builtin.name)
    for item in items:
        if item.type.kind not in types.NUMERIC:
            raise scope.fail(
                "E0308",
                f"'{builtin.name}' works on numbers, not on {types.describe(item.type)}",
                aggregate.element.span,
            )
    if builtin.name in ("sum", "product"):
        _check_alike(scope, builtin.name, items, aggregate)
        return combined(items, "add" if builtin.name == "sum" else "multiply", node.span)
    call = ElaboratedCall(scope, _unrolled(node, aggregate, len(items)), builtin.name, items)
    if len(items) == 1:  # the largest of one number, as where a size of arrays is 1
        call.scalar(0)
        return items[0]
    return RULES[builtin.name](call)


def _unrolled(node: ast.Call, aggregate: ast.Aggregate, count: int) -> ast.Call:
    return ast.Call(function=node.function, arguments=(aggregate.element,) * count, span=node.span)


def _empty(scope: Scope, node: ast.Call, name: str) -> Expression:
    """Return the value of a sum or product of nothing."""
    if name in ("sum", "product"):
        return Literal(type=types.NUMBER, span=node.span, value=Fraction(name == "product"))
    raise scope.fail("E0305", f"'{name}' of no values", node.span)


def _check_alike(scope: Scope, name: str, items: list[Expression], aggregate: ast.Aggregate) -> None:
    first = next((i for i in items if not types.is_zero(i)), items[0])
    for item in items:
        same = name == "product" or item.type.dimension == first.type.dimension or types.is_zero(item)
        if not same or item.type.shape != first.type.shape or (name == "product" and item.type.shape):
            raise scope.fail(
                "E0302",
                f"the terms of '{name}' differ: one is {types.describe(first.type)}, another is {types.describe(item.type)}",
                aggregate.element.span,
            )


def _quadrature(scope: Scope, node: ast.Call, aggregate: ast.Aggregate) -> Expression:
    if len(aggregate.generators) != 1:
        raise scope.fail("E0309", "an integral has one variable", aggregate.span)
    generator = aggregate.generators[0]
    if not isinstance(generator.range, ast.Range) or generator.range.step is not None:
        raise scope.fail(
            "E0309",
            "an integral runs over a range 'a:b'",
            generator.range.span,
            help="write 'integral(e for s in a:b)'",
        )
    bounds = ast.Call(
        function=node.function,
        arguments=(generator.range.start, generator.range.stop),
        span=generator.range.span,
    )
    limits = ElaboratedCall(scope, bounds, "integral", [scope.elaborate(a) for a in bounds.arguments])
    limits.scalar(0), limits.scalar(1)
    type = limits.same(0, 1)
    if types.is_zero(limits.arguments[0]) and types.is_zero(limits.arguments[1]):
        type = types.NUMBER
    type = types.real(type.dimension, angle=type.angle)
    scope.flattening.quadratures += 1
    name = f"{generator.name}#{scope.flattening.quadratures}"
    variable = Name(type=type, span=generator.span, name=name)
    body = scope.with_local({generator.name: variable}).elaborate(aggregate.element)
    if body.type.kind not in types.NUMERIC or body.type.shape:
        raise scope.fail(
            "E0305",
            "the integrand must be one number",
            aggregate.element.span,
            caption=types.describe(body.type),
        )
    result = types.real(body.type.dimension * type.dimension)
    lower, upper = limits.arguments
    return Quadrature(type=result, span=node.span, variable=name, lower=lower, upper=upper, body=body)


def _running_integral(scope: Scope, node: ast.Call) -> Expression:
    """Return the integral from the start: a hidden state."""
    body = scope.elaborate(node.arguments[0])
    if body.type.kind not in types.NUMERIC or body.type.shape:
        raise scope.fail(
            "E0305",
            "the integrand must be one number",
            node.arguments[0].span,
            caption=f"this is {types.describe(body.type)}",
        )
    if unbound_names(body):
        raise scope.fail(
            "E0315",
            "an integral over time cannot stand in the body of a function, or inside of another integral",
            node.span,
            caption="what it integrates has a name only there",
            help="integrate outside, and give the integral to the function as an argument",
        )
    flattening = scope.flattening
    flattening.integrals_named += 1
    name = f"integral[{flattening.integrals_named}]"
    type = types.real(body.type.dimension * flattening.time_type.dimension)
    flattening.integrals.append((name, body, type, scope.origin(node.span)))
    return Name(type=type, span=node.span, name=name)

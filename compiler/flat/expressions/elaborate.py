"""Elaboration of expressions: names resolved, types and units checked, structure evaluated."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import assert_never

from mechc.lang import ast
from mechc.lang.diagnostics import Label
from mechc.lang.units import UnitError, parse_unit, to_si

from .. import types
from ..model import Apply, Array, Derivative, Element, Expression, Kind, Literal, Name, Previous, Role
from ..names.scope import Scope
from ..values.evaluate import iterate
from ..values.indexing import indexed
from .calls import call
from .choices import array, conditional
from .operators import binary, unary
from .references import predefined, reference


def elaborate(node: ast.Expression, scope: Scope) -> Expression:
    """Return the checked expression of a node. Raises Poisoned after reporting what is wrong."""
    match node:
        case ast.Reference():
            return reference(scope, node)
        case ast.Binary():
            return binary(scope, node)
        case ast.Number() | ast.Quantity():
            known = scope.flattening.constants.get(id(node))
            return _number(scope, node) if known is None else known[1]
        case ast.Call(unit=unit):
            return _with_unit(scope, call(scope, node), unit, node)
        case ast.Result():
            from .own_functions import result

            return result(scope, node)
        case ast.Vector(elements=items, unit=unit):
            return _with_unit(scope, array(scope, node, [elaborate(e, scope) for e in items]), unit, node)
        case ast.Derivative():
            return _derivative(scope, node)
        case ast.Unary():
            return unary(scope, node)
        case ast.Parenthesis(inner=inner, unit=unit):
            return _with_unit(scope, elaborate(inner, scope), unit, node)
        case ast.Conditional():
            return conditional(scope, node)
        case ast.Time():
            if scope.flattening.independent != "time":
                raise scope.fail(
                    "E0201",
                    f"the independent variable is '{scope.flattening.independent}' here, not 'time'",
                    node.span,
                )
            return predefined(scope, "time", node.span)
        case ast.Boolean(value=truth):
            return Literal(type=types.BOOLEAN, span=node.span, value=truth)
        case ast.String(value=text):
            return Literal(type=types.STRING, span=node.span, value=text)
        case ast.Comprehension():
            return _comprehension(scope, node)
        case ast.Subscript(base=base, indices=indices):
            return indexed(scope, elaborate(base, scope), indices, node.span)
        case ast.Previous():
            return _previous(scope, node)
        case ast.Range():
            raise scope.fail(
                "E0308",
                "a range has no value of its own",
                node.span,
                help="write '{i for i in 1:n}' for its numbers",
            )
        case ast.Whole():
            raise scope.fail("E0308", "':' alone means all indices, and stands in brackets only", node.span)
        case ast.Aggregate():
            raise scope.fail("E0308", "'for' belongs in sum, product, min, max or integral", node.span)
        case _:
            assert_never(node)


# ---------------------------------------------------------------- numbers and units


def _number(scope: Scope, node: ast.Number | ast.Quantity) -> Literal:
    """Return a number in SI; the same node gives the same object."""
    if isinstance(node, ast.Number):
        whole = node.value.denominator == 1 and node.text.isdigit()
        literal = Literal(type=types.INTEGER if whole else types.NUMBER, span=node.span, value=node.value)
    else:
        literal = _scaled(scope, node.value, node.unit, node)
    scope.flattening.constants[id(node)] = (
        node,
        literal,
    )  # with what has the number, so that nothing else gets it
    return literal


def _scaled(scope: Scope, value: Fraction, text: str, node: ast.Expression) -> Literal:
    try:
        unit = parse_unit(text)
    except UnitError as error:
        raise scope.fail(
            "E0328",
            str(error),
            node.span,
            help=f"did you mean '{error.suggestion}'?" if error.suggestion else "",
        ) from None
    if scope.flattening.dimensionless and not unit.dimension.is_none:
        raise scope.fail(
            "E0319",
            f"a dimensionless model has no units, '{text}' is one",
            node.span,
            help="leave the unit out, or leave out 'dimensionless;'",
        )
    type = types.real(unit.dimension, angle=unit.angle)
    return Literal(type=type, span=node.span, value=to_si(value, unit))


def _with_unit(scope: Scope, value: Expression, unit: str, node: ast.Expression) -> Expression:
    """Apply a unit after a brace or parenthesis to all that is inside, which must be pure numbers."""
    if not unit:
        return value
    factor = _scaled(scope, Fraction(1), unit, node)
    if value.type.kind not in types.NUMERIC or not value.type.dimension.is_none or value.type.angle:
        given = types.describe(value.type)
        raise scope.fail(
            "E0334",
            f"the unit '{unit}' is applied to {given}",
            node.span,
            caption="inside there must be pure numbers",
            help="write the unit once, after or inside",
        )
    return _multiplied(value, factor)


def _multiplied(value: Expression, factor: Literal) -> Expression:
    assert isinstance(factor.value, Fraction)
    type = types.real(factor.type.dimension, value.type.shape, factor.type.angle)
    if isinstance(value, Literal):
        assert isinstance(value.value, Fraction)
        return Literal(type=type, span=value.span, value=value.value * factor.value)
    if isinstance(value, Array):
        elements = tuple(_multiplied(e, factor) for e in value.elements)
        return Array(type=type, span=value.span, elements=elements)
    return Apply(type=type, span=value.span, function="multiply", arguments=(value, factor))


def _comprehension(scope: Scope, node: ast.Comprehension) -> Expression:
    found = _generated(scope, node, node.generators)
    return _with_unit(scope, found, node.unit, node) if found.type.shape != (0,) else found


def _generated(scope: Scope, node: ast.Comprehension, generators: Sequence[ast.Generator]) -> Expression:
    """Return the elements of a comprehension: one list for all of ``for … for …``, a row of them for each of ``for … , …``."""
    count = next((k for k, g in enumerate(generators) if k and g.joined), len(generators))
    scopes = [scope]
    for generator in generators[:count]:
        scopes = [inner for outer in scopes for inner in iterate(outer, generator.name, generator.range)]
    rest = generators[count:]
    items = [_generated(s, node, rest) if rest else elaborate(node.element, s) for s in scopes]
    if not items:
        return Array(type=types.real(shape=(0,)), span=node.span, elements=())
    return array(scope, node, items)


# ---------------------------------------------------------------- der and pre


def _derivative(scope: Scope, node: ast.Derivative) -> Expression:
    operand = elaborate(node.operand, scope)
    type, time = operand.type, scope.flattening.time_type.dimension
    if type.kind is Kind.ROTATION:
        rate = types.real(types.NUMBER.dimension / time**node.order, (3,), angle=True)
        return Derivative(type=rate, span=node.span, operand=operand, order=node.order)
    if type.kind not in types.NUMERIC:
        help = "write 'vel(F)' or 'angvel(F)'" if type.kind is Kind.FRAME else ""
        raise scope.fail(
            "E0329",
            f"{types.describe(type)} has no derivative",
            node.span,
            caption=f"'{node.operand.span.text}' is {types.describe(type)}",
            help=help,
        )
    _check_changing(scope, operand, node)
    order = node.order
    match operand:
        case Derivative(operand=inner, order=lower) if inner.type.kind is not Kind.ROTATION:
            operand, order = inner, lower + order
        case _:
            pass
    rate = types.real(type.dimension / time**node.order, type.shape, type.angle)
    return Derivative(type=rate, span=node.span, operand=operand, order=order)


def _check_changing(scope: Scope, operand: Expression, node: ast.Derivative) -> None:
    """Refuse the derivative of a discrete variable, which jumps."""
    base = operand.base if isinstance(operand, Element) else operand
    if not isinstance(base, Name):
        return
    member = scope.flattening.variables.get(base.name)
    if member is not None and member.role is Role.DISCRETE:
        raise scope.fail(
            "E0329",
            f"'{base.name}' is discrete and has no derivative",
            node.span,
            labels=(Label(member.declaration.name_span, "declared here"),),
            help="it changes only in 'when', by jumps",
        )


def _previous(scope: Scope, node: ast.Previous) -> Expression:
    operand = elaborate(node.operand, scope)
    if not scope.in_event:
        raise scope.fail(
            "E0330",
            "'pre' is the value just before an event, so it needs a 'when'",
            node.span,
            help=f"write '{node.operand.span.text}'",
        )
    if operand.type.kind not in (*types.NUMERIC, Kind.BOOLEAN):
        raise scope.fail("E0308", f"{types.describe(operand.type)} has no earlier value", node.span)
    type = types.numeric(operand.type) if operand.type.kind is Kind.POINT else operand.type
    return Previous(type=type, span=node.span, operand=operand)

"""Type rules of products, quotients and powers, of frames with poses and vectors too."""

from __future__ import annotations

from fractions import Fraction

from mechc.lang import ast
from mechc.lang.diagnostics import Label
from mechc.lang.source import Span
from mechc.lang.units import Dimension

from .. import types
from ..model import Apply, Expression, Kind, Type
from ..names.scope import Poisoned, Scope
from ..operands import free_names
from ..values.evaluate import constant

_RATES = (types.NUMBER.dimension, types.RATE, types.RATE * types.RATE)
"""Dimensions in which a quantity can be an angle, an angular velocity or acceleration."""

_products: dict[tuple[int, int], Type] = {}
_quotients: dict[tuple[int, int], Type] = {}


def _dimensions(a: Type, b: Type) -> tuple[Dimension, bool]:
    dimension = a.dimension * b.dimension
    return dimension, a.angle is not b.angle and dimension in _RATES


def product_type(scope: Scope, node: ast.Binary, left: Expression, right: Expression) -> Type:
    """Return the type of a product of numbers, arrays, matrices, frames, poses and vectors."""
    a, b = left.type, right.type
    known = _products.get((id(a), id(b)))
    if known is not None:
        return known
    if a.kind in (Kind.FRAME, Kind.POSE, Kind.ROTATION):
        return _placed_type(scope, node, left, right)
    if a.kind not in types.NUMERIC or b.kind not in types.NUMERIC:
        help = "a frame stands first, as in 'world * trans({x, y})'" if b.kind is Kind.FRAME else ""
        raise undefined(scope, node, left, right, help)
    shape = _product_shape(scope, node, left, right)
    dimension, angle = _dimensions(a, b)
    kind = Kind.INTEGER if a.kind is b.kind is Kind.INTEGER else Kind.REAL
    type = types.make(kind, shape, dimension, angle)
    _products[id(a), id(b)] = type
    return type


def _product_shape(scope: Scope, node: ast.Binary, left: Expression, right: Expression) -> tuple[int, ...]:
    a, b = left.type.shape, right.type.shape
    if not a or not b:
        return a or b
    if len(a) == 1 and len(b) == 1:
        raise undefined(
            scope,
            node,
            left,
            right,
            "write 'dot(a, b)' for the scalar product, 'cross(a, b)' for the vector product",
        )
    if len(a) == 2 and len(b) in (1, 2):
        if a[1] == b[0]:
            return (a[0], *b[1:])
        raise scope.fail(
            "E0305",
            f"a matrix of {a[1]} columns cannot be multiplied by {b[0]} rows",
            node.span,
            caption=f"{types.shape_text(a)} times {types.shape_text(b)}",
            help=f"write 'transpose({node.left.span.text})*{node.right.span.text}' for the product with the columns"
            if a[0] == b[0]
            else f"the right side has one row for each column of the left one, {a[1]}",
        )
    raise undefined(scope, node, left, right)


def _placed_type(scope: Scope, node: ast.Binary, left: Expression, right: Expression) -> Type:
    """Return the type of a product that begins with a frame, a pose or a rotation."""
    a, b = left.type, right.type
    if a.shape or (b.shape and b.kind not in types.NUMERIC):
        raise undefined(scope, node, left, right)
    if b.kind in (Kind.POSE, Kind.ROTATION):
        return types.FRAME if a.kind is Kind.FRAME else types.POSE
    if b.kind not in types.NUMERIC or len(b.shape) != 1:
        raise undefined(
            scope, node, left, right, "a frame or pose takes a pose or a vector of 2 or 3 components"
        )
    if b.shape[0] not in (2, 3):
        raise scope.fail(
            "E0305",
            f"a frame takes a vector of 2 or 3 components, this one has {b.shape[0]}",
            node.right.span,
        )
    size = b.shape[0]
    scope.flattening.space.require(size, scope, node.right.span, f"a vector of {size} components")
    if a.kind is Kind.FRAME or (a.kind is Kind.POSE and moves(left)):
        length = types.NUMBER.dimension if scope.flattening.dimensionless else types.LENGTH
        if b.dimension != length and not types.is_zero(right):
            given = types.describe(types.numeric(b))
            raise scope.fail(
                "E0304",
                "a frame takes a vector of lengths",
                node.right.span,
                caption=f"this is {given}",
                help=_lengths_help(a, b, node.right.span),
            )
        return types.make(Kind.POINT if a.kind is Kind.FRAME else Kind.REAL, (size,), length)
    return types.numeric(b)


def _lengths_help(a: Type, b: Type, span: Span) -> str:
    """Say how a vector that is none of lengths is meant to be written."""
    if b.dimension.is_none:
        return f"write '{span.text} m'"
    return "for the components of another vector write 'direction(F, v)'" if a.kind is Kind.FRAME else ""


def moves(expression: Expression) -> bool:
    """Tell whether a pose contains a displacement."""
    if isinstance(expression, Apply):
        return expression.function == "trans" or any(
            moves(e) for e in expression.arguments if e.type.kind is Kind.POSE
        )
    return False


def quotient_type(scope: Scope, node: ast.Binary, left: Expression, right: Expression) -> Type:
    """Return the type of a quotient, whose divisor is one value."""
    a, b = left.type, right.type
    known = _quotients.get((id(a), id(b)))
    if known is not None:
        return known
    if a.kind not in types.NUMERIC or b.kind not in types.NUMERIC:
        raise undefined(scope, node, left, right)
    if b.shape:
        raise undefined(scope, node, left, right, "divide by a single value")
    dimension = a.dimension / b.dimension
    angle = a.angle and not b.angle and dimension in _RATES
    type = types.make(Kind.REAL, a.shape, dimension, angle)
    _quotients[id(a), id(b)] = type
    return type


def power_type(scope: Scope, node: ast.Binary, left: Expression, right: Expression) -> Type:
    """Return the type of a power; that of a quantity with a unit has an exponent known while compiling."""
    a, b = left.type, right.type
    if a.kind not in types.NUMERIC or b.kind not in types.NUMERIC or a.shape or b.shape:
        help = "write 'dot(v, v)' for the square of a vector" if a.shape and a.kind in types.NUMERIC else ""
        raise undefined(scope, node, left, right, help)
    if not b.dimension.is_none:
        raise scope.fail(
            "E0313",
            "an exponent must be a number",
            node.right.span,
            caption=f"this is {types.describe(b)}",
        )
    exponent = constant(right)
    if a.dimension.is_none:
        whole = isinstance(exponent, Fraction) and exponent.denominator == 1 and exponent >= 0
        return types.INTEGER if a.kind is b.kind is Kind.INTEGER and whole else types.NUMBER
    if not isinstance(exponent, Fraction):
        name = next(iter(free_names(right)), "")
        raise scope.fail(
            "E0313",
            f"the exponent of {types.with_article(types.dimension_word(a.dimension))} must be known when compiling",
            node.right.span,
            caption=f"'{name}' may change afterwards" if name else "this may change afterwards",
            labels=(Label(node.left.span, f"this is {types.describe(a)}"),),
            help="divide the base by a unit, as in '(x/1 m)^n', or use a structural parameter",
        )
    if exponent.denominator > 12 or abs(exponent) > 100:
        raise scope.fail(
            "E0313",
            "the exponent of a quantity with a unit must be a simple fraction",
            node.right.span,
            caption=f"this is {float(exponent):.10g}",
        )
    return types.real(
        a.dimension**exponent, angle=a.angle and a.dimension**exponent in _RATES and exponent == 1
    )


def undefined(
    scope: Scope, node: ast.Binary, left: Expression, right: Expression, help: str = ""
) -> Poisoned:
    """Report an operator that its operands do not have."""
    first, second = types.describe(left.type), types.describe(right.type)
    return scope.fail(
        "E0308",
        f"'{node.operator}' is not defined for {first} and {second}",
        node.span,
        caption=f"{first} {node.operator} {second}",
        help=help,
    )

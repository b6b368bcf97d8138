"""Type rules of the operators, with folding of constants."""

from __future__ import annotations

from fractions import Fraction

from mechc.lang import ast
from mechc.lang.diagnostics import Label
from mechc.lang.units import Dimension, preferred_unit

from . import types
from .evaluate import constant, free_names
from .model import Apply, Array, Expression, Kind, Literal, Select, Type
from .scope import Poisoned, Scope

FUNCTIONS = {
    "+": "add", "-": "subtract", "*": "multiply", "/": "divide", "^": "power",
    "<": "less", "<=": "less_equal", ">": "greater", ">=": "greater_equal",
    "==": "equal", "<>": "not_equal", "and": "and", "or": "or",
}  # fmt: skip
"""Names of the operators in the flat model."""

_RATES = (types.NUMBER.dimension, types.RATE, types.RATE * types.RATE)
"""Dimensions in which a quantity can be an angle, an angular velocity or acceleration."""

_sums: dict[tuple[int, int], Type] = {}
_products: dict[tuple[int, int], Type] = {}
_quotients: dict[tuple[int, int], Type] = {}

_LONGEST = 2048
"""Most bits of a folded number."""


def unary(scope: Scope, node: ast.Unary) -> Expression:
    operand = scope.elaborate(node.operand)
    if node.operator == "not":
        _require_truth(scope, node.operand, operand)
        if isinstance(operand, Literal):
            return Literal(type=types.BOOLEAN, span=node.span, value=not operand.value)
        return Apply(type=types.BOOLEAN, span=node.span, function="not", arguments=(operand,))
    type = operand.type
    if type.kind not in types.NUMERIC:
        raise scope.fail(
            "E0308",
            f"'{node.operator}' works on numbers, not on {types.describe(type)}",
            node.span,
            caption=f"this is {types.describe(type)}",
        )
    if node.operator == "+":
        return operand
    return negated(operand, node)


def negated(operand: Expression, node: ast.Expression) -> Expression:
    if isinstance(operand, Literal):
        assert isinstance(operand.value, Fraction)
        return Literal(type=operand.type, span=node.span, value=-operand.value)
    if isinstance(operand, Array) and constant(operand) is not None:
        elements = tuple(negated(e, node) for e in operand.elements)
        return Array(type=operand.type, span=node.span, elements=elements)
    type = operand.type if operand.type.kind is not Kind.POINT else types.numeric(operand.type)
    return Apply(type=type, span=node.span, function="negate", arguments=(operand,))


def binary(scope: Scope, node: ast.Binary) -> Expression:
    operator = node.operator
    if operator in ("and", "or"):
        return _logical(scope, node)
    left, right = scope.elaborate(node.left), scope.elaborate(node.right)
    if operator == "+" or operator == "-":
        key = (id(left.type), id(right.type))
        type = _sums.get(key) or _sum_type(scope, node, left, right)
    elif operator == "*":
        key = (id(left.type), id(right.type))
        type = _products.get(key) or _product_type(scope, node, left, right)
    elif operator == "/":
        key = (id(left.type), id(right.type))
        type = _quotients.get(key) or _quotient_type(scope, node, left, right)
    elif operator == "^":
        type = _power_type(scope, node, left, right)
    else:
        type = _comparison_type(scope, node, left, right)
    if isinstance(left, Literal) and isinstance(right, Literal):
        folded = _fold(operator, left.value, right.value)
        if folded is not None:
            return Literal(type=type, span=node.span, value=folded)
    return Apply(type=type, span=node.span, function=FUNCTIONS[operator], arguments=(left, right))


def _fold(operator: str, a: Fraction | bool | str, b: Fraction | bool | str) -> Fraction | bool | None:
    if operator == "==":
        return a == b
    if operator == "<>":
        return a != b
    if not isinstance(a, Fraction) or not isinstance(b, Fraction):
        return None
    match operator:
        case "+":
            result = a + b
        case "-":
            result = a - b
        case "*":
            result = a * b
        case "/":
            if b == 0:
                return None
            result = a / b
        case "^":
            bits = max(a.numerator.bit_length(), a.denominator.bit_length())
            if b.denominator != 1 or bits * abs(b.numerator) > _LONGEST or (a == 0 and b < 0):
                return None
            result = a**b.numerator
        case "<":
            return a < b
        case "<=":
            return a <= b
        case ">":
            return a > b
        case ">=":
            return a >= b
        case _:
            return None
    return result if result.denominator.bit_length() + result.numerator.bit_length() < _LONGEST else None


# ---------------------------------------------------------------- sums and comparisons


def _sum_type(scope: Scope, node: ast.Binary, left: Expression, right: Expression) -> Type:
    a, b = left.type, right.type
    if a.kind not in types.NUMERIC or b.kind not in types.NUMERIC:
        raise _undefined(scope, node, left, right)
    type = meet(scope, node, left, right, f"the two sides of '{node.operator}'")
    if a.shape != b.shape:
        zero = (
            left
            if types.is_zero(left) and not a.shape
            else right
            if types.is_zero(right) and not b.shape
            else None
        )
        if zero is None:
            raise _shapes_differ(scope, node, left, right)
        return types.numeric(b if zero is left else a)
    if not types.is_zero(left) and not types.is_zero(right):
        _sums[id(a), id(b)] = type
    return type


def meet(
    scope: Scope, node: ast.Node, left: Expression, right: Expression, what: str, code: str = "E0302"
) -> Type:
    """Return the type of two quantities that must have one dimension; reports both where they differ."""
    a, b = left.type, right.type
    if a.dimension != b.dimension:
        if types.is_zero(left):
            return types.numeric(b)
        if types.is_zero(right):
            return types.numeric(a)
        first, second = types.unit_words(a.dimension, a.angle), types.unit_words(b.dimension, b.angle)
        raise scope.fail(
            code,
            f"{what} differ: left side is {first}, right side is {second}",
            right.span if not isinstance(node, ast.Binary) else node.right.span,
            caption=f"this is {second}",
            labels=(
                Label(left.span if not isinstance(node, ast.Binary) else node.left.span, f"this is {first}"),
            ),
            help=_missing_unit(left, right),
        )
    if a is b and a.kind is not Kind.POINT:
        return a
    kind = Kind.INTEGER if a.kind is b.kind is Kind.INTEGER else Kind.REAL
    return types.make(kind, a.shape, a.dimension, a.angle or b.angle)


def _missing_unit(left: Expression, right: Expression) -> str:
    for one, other in ((left, right), (right, left)):
        if isinstance(one, Literal) and one.type.dimension.is_none and not one.type.angle:
            return (
                f"a number of the other side's kind carries its unit: '{one.span.text} {_unit(other.type)}'"
            )
    return ""


def _unit(type: Type) -> str:
    return preferred_unit(type.dimension, type.angle)


def _shapes_differ(scope: Scope, node: ast.Binary, left: Expression, right: Expression) -> Poisoned:
    return scope.fail(
        "E0305",
        f"the two sides of '{node.operator}' have different shapes",
        node.right.span,
        caption=f"this is {types.describe(right.type)}",
        labels=(Label(node.left.span, f"this is {types.describe(left.type)}"),),
    )


def _undefined(
    scope: Scope, node: ast.Binary, left: Expression, right: Expression, help: str = ""
) -> Poisoned:
    first, second = types.describe(left.type), types.describe(right.type)
    return scope.fail(
        "E0308",
        f"'{node.operator}' is not defined for {first} and {second}",
        node.span,
        caption=f"{first} {node.operator} {second}",
        help=help,
    )


def _comparison_type(scope: Scope, node: ast.Binary, left: Expression, right: Expression) -> Type:
    a, b = left.type, right.type
    equality = node.operator in ("==", "<>")
    if a.kind in types.NUMERIC and b.kind in types.NUMERIC:
        if a.shape or b.shape:
            raise scope.fail(
                "E0305",
                f"'{node.operator}' compares single values",
                node.span,
                caption=f"{types.describe(a)} and {types.describe(b)}",
            )
        meet(scope, node, left, right, f"the two sides of '{node.operator}'")
        return types.BOOLEAN
    if (
        equality
        and a.kind is b.kind
        and a.kind in (Kind.BOOLEAN, Kind.STRING)
        and not a.shape
        and not b.shape
    ):
        return types.BOOLEAN
    raise _undefined(scope, node, left, right)


def _logical(scope: Scope, node: ast.Binary) -> Expression:
    left = scope.elaborate(node.left)
    _require_truth(scope, node.left, left)
    if isinstance(left, Literal) and left.value is (node.operator == "or"):
        return Literal(type=types.BOOLEAN, span=node.span, value=left.value)
    right = scope.elaborate(node.right)
    _require_truth(scope, node.right, right)
    if isinstance(left, Literal):
        return right
    return Apply(type=types.BOOLEAN, span=node.span, function=node.operator, arguments=(left, right))


def _require_truth(scope: Scope, node: ast.Expression, value: Expression) -> None:
    if value.type.kind is not Kind.BOOLEAN or value.type.shape:
        raise scope.fail(
            "E0318",
            "a condition must be true or false",
            node.span,
            caption=f"this is {types.describe(value.type)}",
            help="compare it, as in 'x > 0 m'" if value.type.kind in types.NUMERIC else "",
        )


# ---------------------------------------------------------------- products and powers


def _dimensions(a: Type, b: Type) -> tuple[Dimension, bool]:
    dimension = a.dimension * b.dimension
    return dimension, a.angle is not b.angle and dimension in _RATES


def _product_type(scope: Scope, node: ast.Binary, left: Expression, right: Expression) -> Type:
    a, b = left.type, right.type
    if a.kind in (Kind.FRAME, Kind.POSE, Kind.ROTATION):
        return _placed_type(scope, node, left, right)
    if a.kind not in types.NUMERIC or b.kind not in types.NUMERIC:
        help = "a frame stands first, as in 'world * trans({x, y})'" if b.kind is Kind.FRAME else ""
        raise _undefined(scope, node, left, right, help)
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
        raise _undefined(
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
        )
    raise _undefined(scope, node, left, right)


def _placed_type(scope: Scope, node: ast.Binary, left: Expression, right: Expression) -> Type:
    """Return the type of a product that begins with a frame, a pose or a rotation."""
    a, b = left.type, right.type
    if a.shape or (b.shape and b.kind not in types.NUMERIC):
        raise _undefined(scope, node, left, right)
    if b.kind in (Kind.POSE, Kind.ROTATION):
        return types.FRAME if a.kind is Kind.FRAME else types.POSE
    if b.kind not in types.NUMERIC or len(b.shape) != 1:
        raise _undefined(
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
                help="for the components of another vector write 'direction(F, v)'"
                if a.kind is Kind.FRAME
                else "",
            )
        return types.make(Kind.POINT if a.kind is Kind.FRAME else Kind.REAL, (size,), length)
    return types.numeric(b)


def moves(expression: Expression) -> bool:
    """Tell whether a pose contains a displacement."""
    if isinstance(expression, Apply):
        return expression.function == "trans" or any(
            moves(e) for e in expression.arguments if e.type.kind is Kind.POSE
        )
    return False


def _quotient_type(scope: Scope, node: ast.Binary, left: Expression, right: Expression) -> Type:
    a, b = left.type, right.type
    if a.kind not in types.NUMERIC or b.kind not in types.NUMERIC:
        raise _undefined(scope, node, left, right)
    if b.shape:
        raise _undefined(scope, node, left, right, "divide by a single value")
    dimension = a.dimension / b.dimension
    angle = a.angle and not b.angle and dimension in _RATES
    type = types.make(Kind.REAL, a.shape, dimension, angle)
    _quotients[id(a), id(b)] = type
    return type


def _power_type(scope: Scope, node: ast.Binary, left: Expression, right: Expression) -> Type:
    a, b = left.type, right.type
    if a.kind not in types.NUMERIC or b.kind not in types.NUMERIC or a.shape or b.shape:
        help = "write 'dot(v, v)' for the square of a vector" if a.shape and a.kind in types.NUMERIC else ""
        raise _undefined(scope, node, left, right, help)
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


# ---------------------------------------------------------------- choices and arrays


def conditional(scope: Scope, node: ast.Conditional) -> Expression:
    """Return the chosen branch where the condition is structural, else a choice at run time."""
    conditions: list[tuple[Expression, ast.Expression]] = []
    otherwise = node.otherwise
    for branch in node.branches:
        condition = scope.elaborate(branch.condition)
        _require_truth(scope, branch.condition, condition)
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
            help=_missing_unit(first, value),
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

"""Type rules of the operators, with folding of constants."""

from __future__ import annotations

from fractions import Fraction

from mechc.lang import ast
from mechc.lang.diagnostics import Label
from mechc.lang.units import Dimension, preferred_unit

from .. import types
from ..model import Apply, Array, Expression, Kind, Literal, Name, Type
from ..names.instance import VariableMember
from ..names.scope import Constant, Poisoned, Scope
from ..operands import free_names
from ..values.angles import warn_of_bare_side
from ..values.evaluate import EXACT, constant
from .missing_factor import missing_factor
from .products import power_type, product_type, quotient_type, undefined

FUNCTIONS = {
    "+": "add", "-": "subtract", "*": "multiply", "/": "divide", "^": "power",
    "<": "less", "<=": "less_equal", ">": "greater", ">=": "greater_equal",
    "==": "equal", "<>": "not_equal", "and": "and", "or": "or",
}  # fmt: skip
"""Names of the operators in the flat model."""

_sums: dict[tuple[int, int], Type] = {}

_LONGEST = 2048
"""Most bits of a folded number."""


def unary(scope: Scope, node: ast.Unary) -> Expression:
    """Return the value of a sign or of ``not``."""
    operand = scope.elaborate(node.operand)
    if node.operator == "not":
        require_truth(scope, node.operand, operand)
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
    """Return minus an operand, folded where it is constant."""
    if isinstance(operand, Literal):
        assert isinstance(operand.value, Fraction)
        return Literal(type=operand.type, span=node.span, value=-operand.value)
    if isinstance(operand, Array) and constant(operand) is not None:
        elements = tuple(negated(e, node) for e in operand.elements)
        return Array(type=operand.type, span=node.span, elements=elements)
    type = operand.type if operand.type.kind is not Kind.POINT else types.numeric(operand.type)
    return Apply(type=type, span=node.span, function="negate", arguments=(operand,))


def binary(scope: Scope, node: ast.Binary) -> Expression:
    """Return the value of an operator, folded where both operands are literals."""
    operator = node.operator
    if operator in ("and", "or"):
        return _logical(scope, node)
    left, right = scope.elaborate(node.left), scope.elaborate(node.right)
    if operator == "+" or operator == "-":
        key = (id(left.type), id(right.type))
        type = _sums.get(key) or _sum_type(scope, node, left, right)
    elif operator == "*":
        type = product_type(scope, node, left, right)
    elif operator == "/":
        type = quotient_type(scope, node, left, right)
    elif operator == "^":
        type = power_type(scope, node, left, right)
    else:
        type = _comparison_type(scope, node, left, right)
    function = FUNCTIONS[operator]
    if isinstance(left, Literal) and isinstance(right, Literal):
        folded = _fold(function, left.value, right.value)
        if folded is not None:
            return Literal(type=type, span=node.span, value=folded)
    return Apply(type=type, span=node.span, function=function, arguments=(left, right))


def _fold(function: str, a: Constant, b: Constant) -> Constant | None:
    """Return the value of an operator of constants; None where it is long or none that is exact."""
    if function not in ("equal", "not_equal") and not (isinstance(a, Fraction) and isinstance(b, Fraction)):
        return None
    try:
        result = _power(a, b) if function == "power" else EXACT[function](a, b)
    except ZeroDivisionError:
        return None
    long = isinstance(result, Fraction) and (
        result.denominator.bit_length() + result.numerator.bit_length() >= _LONGEST
    )
    return None if long else result


def _power(a: Constant, b: Constant) -> Fraction | None:
    assert isinstance(a, Fraction) and isinstance(b, Fraction)
    bits = max(a.numerator.bit_length(), a.denominator.bit_length())
    return a**b.numerator if b.denominator == 1 and bits * abs(b.numerator) <= _LONGEST else None


# ---------------------------------------------------------------- sums and comparisons


def _moved_help(node: ast.Binary, a: Type, b: Type) -> str:
    """Say how a frame is moved where somebody adds to it."""
    vector = b.kind in types.NUMERIC and len(b.shape) == 1
    if node.operator != "+" or a.kind not in (Kind.FRAME, Kind.POSE) or not (vector or b.kind is Kind.POSE):
        return ""
    return f"what moves a frame is multiplied: '{node.left.span.text} * {node.right.span.text}'"


def _sum_type(scope: Scope, node: ast.Binary, left: Expression, right: Expression) -> Type:
    a, b = left.type, right.type
    if a.kind not in types.NUMERIC or b.kind not in types.NUMERIC:
        raise undefined(scope, node, left, right, _moved_help(node, a, b))
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
    if a.angle == b.angle and not types.is_zero(left) and not types.is_zero(right):
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
                *parameters_without_unit(scope, left, right),
            ),
            help=missing_unit(left, right)
            or f"on the right side {missing_factor(scope, b.dimension, a.dimension)}",
        )
    if a is b and a.kind is not Kind.POINT:
        return a
    if a.angle != b.angle and not scope.flattening.dimensionless:
        warn_of_bare_side(left, right, scope.flattening)
    kind = Kind.INTEGER if a.kind is b.kind is Kind.INTEGER else Kind.REAL
    return types.make(kind, a.shape, a.dimension, a.angle or b.angle)


def missing_unit(left: Expression, right: Expression) -> str:
    """Say which of two quantities that differ is a bare number, if one is."""
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
    raise undefined(scope, node, left, right)


def _logical(scope: Scope, node: ast.Binary) -> Expression:
    left = scope.elaborate(node.left)
    require_truth(scope, node.left, left)
    if isinstance(left, Literal) and left.value is (node.operator == "or"):
        return Literal(type=types.BOOLEAN, span=node.span, value=left.value)
    right = scope.elaborate(node.right)
    require_truth(scope, node.right, right)
    if isinstance(left, Literal):
        return right
    return Apply(type=types.BOOLEAN, span=node.span, function=node.operator, arguments=(left, right))


def require_truth(scope: Scope, node: ast.Expression, value: Expression) -> None:
    """Report a condition that is not a single truth value."""
    if value.type.kind is not Kind.BOOLEAN or value.type.shape:
        raise scope.fail(
            "E0318",
            "a condition must be true or false",
            node.span,
            caption=f"this is {types.describe(value.type)}",
            help="compare it, as in 'x > 0 m'" if value.type.kind in types.NUMERIC else "",
        )


MOST = 3
"""Parameters that a message points at."""

_BASE = (types.LENGTH, types.MASS, types.TIME)
"""What a parameter is likelier meant to be than an energy or a momentum."""


def parameters_of_another_kind(scope: Scope, value: Expression, wanted: Dimension) -> tuple[Label, ...]:
    """Return the places of parameters of which each, were it a length, a force .., would give a product the wanted dimension."""
    labels, of_base = [], []
    factor = wanted / value.type.dimension
    for name in free_names(value):
        member = scope.flattening.variables.get(name)
        declaration = member.declaration if isinstance(member, VariableMember) else None
        if member is None or member.type is None or not isinstance(declaration, ast.Parameter):
            continue
        power = _power_of(value, name)
        if not power:
            continue
        meant = member.type.dimension * factor ** (1 / power)
        if types.dimension_word(meant) not in ("quantity", "number"):
            text = f"'{declaration.name}' is {types.unit_words(member.type.dimension)}; it would fit as {types.unit_words(meant)}"
            labels.append(Label(declaration.name_span, text))
            if meant in _BASE:
                of_base.append(labels[-1])
    likely = of_base or labels
    return tuple(likely) if len(likely) == 1 else ()


def _power_of(value: Expression, name: str) -> Fraction | None:
    """Return the power of a name in a product; None where it stands elsewhere than in factors."""
    match value:
        case Name(name=other):
            return Fraction(other == name)
        case Apply(function="multiply" | "divide" as function, arguments=(left, right)):
            a, b = _power_of(left, name), _power_of(right, name)
            return None if a is None or b is None else a + b if function == "multiply" else a - b
        case Apply(function="negate", arguments=(inner,)):
            return _power_of(inner, name)
        case Apply(function="power", arguments=(base, Literal(value=Fraction() as exponent))):
            inside = _power_of(base, name)
            return None if inside is None else inside * exponent
        case _:
            return None if name in free_names(value) else Fraction(0)


def parameters_without_unit(scope: Scope, *expressions: Expression) -> tuple[Label, ...]:
    """Return the places of the parameters in expressions that are numbers without unit."""
    labels = []
    for name in dict.fromkeys(name for expression in expressions for name in free_names(expression)):
        member = scope.flattening.variables.get(name)
        declaration = member.declaration if isinstance(member, VariableMember) else None
        if member is None or member.type is None or not isinstance(declaration, ast.Parameter):
            continue
        plain = member.type.kind is Kind.REAL and member.type.dimension.is_none and not member.type.angle
        if plain and declaration.type == "" and not member.structural:
            labels.append(Label(declaration.name_span, f"'{declaration.name}' is a number without unit"))
    return tuple(labels[:MOST])

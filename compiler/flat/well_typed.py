"""Whether the type that an expression of the flat model states is the one that its operands give."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from fractions import Fraction

from mechc.lang.builtins import BUILTINS
from mechc.lang.units import Dimension

from . import types
from .model import (
    Apply,
    Array,
    Derivative,
    Element,
    Expression,
    FieldDerivative,
    Kind,
    Literal,
    Name,
    Previous,
    Quadrature,
    Query,
    Select,
    Type,
    Unknown,
    Where,
)
from .types import is_zero, numeric

_SUMS = frozenset({"add", "subtract"})
_ORDERS = frozenset({"less", "less_equal", "greater", "greater_equal"})
_EQUALITIES = frozenset({"equal", "not_equal"})
_LOGIC = frozenset({"and", "or", "not"})
_PLACED = (Kind.FRAME, Kind.POSE, Kind.ROTATION)

Shape = tuple[int, ...]


def mistake(expression: Expression, names: Mapping[str, Type], second: Dimension | None) -> str:
    """Return what is wrong with one expression, whose operands are right; empty if nothing is.

    ``names``: the types of all that may be named; ``second``: the dimension of time, None where it is not known.
    """
    type = expression.type
    match expression:
        case Literal(value=value):
            return _literal(value, type)
        case Name(name=name) | Unknown(name=name):
            if name not in names:
                return f"nothing declares '{name}'"
            return _differs(type, names[name])
        case Element(base=base, indices=indices):
            return _element(base.type, indices, type)
        case Derivative(operand=operand, order=order):
            return _derivative(operand.type, order, type, second)
        case Previous(operand=operand):
            return _differs(type, operand.type)
        case Array(elements=items):
            return _array(items, type)
        case Select(condition=condition, then=then, otherwise=otherwise):
            return _truth(condition) or _alike(then, otherwise) or _differs(type, _other(then, otherwise))
        case Quadrature(lower=lower, upper=upper, body=body):
            wanted = body.type.dimension * _other(lower, upper).dimension
            return _alike(lower, upper) or _dimension(type, wanted, is_zero(body) or is_zero(upper))
        case FieldDerivative(operator=operator, place=place, body=body):
            return _field(operator, place, body, type)
        case Where(body=body):
            return _differs(type, body.type)
        case Query(function=function, arguments=arguments):
            return _known(function, len(arguments), type)
        case Apply(function=function, arguments=arguments):
            return _applied(function, arguments, type)


def _literal(value: Fraction | bool | str, type: Type) -> str:
    kinds = {bool: (Kind.BOOLEAN,), str: (Kind.STRING,)}.get(value.__class__, (Kind.REAL, Kind.INTEGER))
    if type.kind not in kinds or type.shape:
        return f"the constant {value!r} is not {types.describe(type)}"
    if type.kind is Kind.INTEGER and isinstance(value, Fraction) and value.denominator != 1:
        return f"the whole number {value} is none"
    return ""


def _differs(stated: Type, given: Type) -> str:
    """Compare what counts: kinds, shapes and dimensions; that of an angle is for display."""
    if _kind(stated) is not _kind(given) or stated.shape != given.shape:
        return f"it is stated to be {types.describe(stated)}, but is {types.describe(given)}"
    return _dimension(stated, given.dimension)


def _kind(type: Type) -> Kind:
    return numeric(type).kind


def _dimension(type: Type, given: Dimension, free: bool = False) -> str:
    if free or type.dimension == given:
        return ""
    return f"its dimension is stated to be {type.dimension}, but is {given}"


def _element(base: Type, indices: Shape, type: Type) -> str:
    shape = (4,) if base.kind is Kind.ROTATION and not base.shape else base.shape
    if len(indices) > len(shape) or not all(0 <= i < n for i, n in zip(indices, shape, strict=False)):
        return f"the indices {indices} are outside of the shape {shape}"
    return _differs(type, types.element_of(base, len(indices)))


def _derivative(operand: Type, order: int, type: Type, second: Dimension | None) -> str:
    if order < 1:
        return f"there is no derivative of order {order}"
    shape = (3,) if operand.kind is Kind.ROTATION else operand.shape
    if type.shape != shape:
        return f"its shape is stated to be {type.shape}, but is {shape}"
    return "" if second is None else _dimension(type, operand.dimension / second**order)


def _array(items: tuple[Expression, ...], type: Type) -> str:
    shapes = {item.type.shape for item in items}
    if len(shapes) > 1 or type.shape != (len(items), *(next(iter(shapes)) if items else type.shape[1:])):
        return f"its shape is stated to be {type.shape}, its {len(items)} elements have {sorted(shapes)}"
    other = [e.type.dimension for e in items if e.type.dimension != type.dimension and not is_zero(e)]
    return _dimension(type, other[0]) if other else ""


def _truth(condition: Expression) -> str:
    if condition.type.kind is Kind.BOOLEAN and not condition.type.shape:
        return ""
    return f"its condition is {types.describe(condition.type)}"


def _alike(a: Expression, b: Expression) -> str:
    """Tell of two values that cannot be compared, added or exchanged. A bare zero fits everything."""
    x, y = numeric(a.type), numeric(b.type)
    if x.kind is not y.kind or (x.shape != y.shape and not is_zero(a) and not is_zero(b)):
        return f"its operands are {types.describe(a.type)} and {types.describe(b.type)}"
    if x.dimension != y.dimension and not is_zero(a) and not is_zero(b):
        return f"its operands have the dimensions {x.dimension} and {y.dimension}"
    return ""


def _other(a: Expression, b: Expression) -> Type:
    """Return the type that two values have, of which one may be a bare zero."""
    return b.type if is_zero(a) else a.type


def _known(function: str, count: int, type: Type) -> str:
    if function not in BUILTINS:
        return f"there is no function '{function}'"
    return ""


def _field(operator: str, place: Expression, body: Expression, type: Type) -> str:
    """Compare with what a field of this shape has; the second derivative is per square of a length."""
    at, field = place.type, body.type
    order = 2 if operator == "laplacian" else 1
    shapes = {
        "grad": field.shape + at.shape,
        "div": field.shape[:-1],
        "curl": () if at.shape == (2,) else at.shape,
        "laplacian": field.shape,
    }
    if operator in ("div", "curl") and field.shape[-1:] != at.shape:
        return f"the field has the shape {field.shape}, its place {at.shape}"
    if type.shape != shapes[operator]:
        return f"its shape is stated to be {type.shape}, but is {shapes[operator]}"
    return _dimension(type, field.dimension / at.dimension**order, is_zero(body))


# ---------------------------------------------------------------- operators and functions


def _applied(function: str, arguments: tuple[Expression, ...], type: Type) -> str:
    kinds = [a.type for a in arguments]
    if function in _LOGIC:
        return next(filter(None, map(_truth, arguments)), "") or _differs(type, types.BOOLEAN)
    if function in _ORDERS or function in _EQUALITIES:
        return _alike(*arguments) or _differs(type, types.BOOLEAN)
    if function in _SUMS:
        return _alike(*arguments) or _differs(type, numeric(_other(*arguments)))
    if function == "negate":
        return _differs(type, numeric(kinds[0]))
    if function in ("multiply", "divide"):
        return _product(function, arguments, type)
    if function == "power":
        return _power(arguments, type)
    found = _known(function, len(arguments), type)
    rule = RESULTS.get(function)
    if found or rule is None:
        return found
    shape, dimension = rule(kinds)
    if type.shape != shape:
        return f"its shape is stated to be {type.shape}, but is {shape}"
    return _dimension(type, dimension, any(is_zero(a) for a in arguments))


def _product(function: str, arguments: tuple[Expression, ...], type: Type) -> str:
    a, b = (argument.type for argument in arguments)
    if a.kind in _PLACED:
        return _placed(a, b, type)
    if function == "divide":
        return _differs(type, types.real(a.dimension / b.dimension, a.shape))
    shape = a.shape or b.shape
    if a.shape and b.shape:
        if len(a.shape) != 2 or a.shape[1] != b.shape[0]:
            return f"the shapes {a.shape} and {b.shape} have no product"
        shape = (a.shape[0], *b.shape[1:])
    return _differs(type, types.real(a.dimension * b.dimension, shape))


def _placed(a: Type, b: Type, type: Type) -> str:
    if b.kind in (Kind.POSE, Kind.ROTATION):
        wanted = Kind.FRAME if a.kind is Kind.FRAME else Kind.POSE
    elif a.kind is Kind.FRAME:
        wanted = Kind.POINT
    else:
        wanted = Kind.REAL
    if type.kind is not wanted or type.shape != (() if b.kind in _PLACED else b.shape):
        return f"it is stated to be {types.describe(type)}, but is a {wanted.value}"
    return ""


def _power(arguments: tuple[Expression, ...], type: Type) -> str:
    base, exponent = arguments
    if base.type.shape or exponent.type.shape or not exponent.type.dimension.is_none:
        return f"its operands are {types.describe(base.type)} and {types.describe(exponent.type)}"
    if isinstance(exponent, Literal) and isinstance(exponent.value, Fraction):
        return _dimension(type, base.type.dimension**exponent.value)
    return ""  # an exponent that was known in another form: what it gave is the type


def _same(kinds: list[Type]) -> tuple[Shape, Dimension]:
    return (), kinds[0].dimension


def _none(kinds: list[Type]) -> tuple[Shape, Dimension]:
    return (), types.NUMBER.dimension


RESULTS: Mapping[str, Callable[[list[Type]], tuple[Shape, Dimension]]] = {
    **{name: _none for name, builtin in BUILTINS.items() if builtin.types},
    **dict.fromkeys(("atan2", "sign", "div", "heading"), _none),
    **dict.fromkeys(("abs", "mod", "clamp", "deadzone", "min", "max"), _same),
    "sqrt": lambda k: ((), k[0].dimension ** Fraction(1, 2)),
    "dot": lambda k: ((), k[0].dimension * k[1].dimension),
    "cross": lambda k: (() if k[0].shape == (2,) else (3,), k[0].dimension * k[1].dimension),
    "norm": lambda k: ((), k[0].dimension),
    "transpose": lambda k: (k[0].shape[::-1], k[0].dimension),
    "outer": lambda k: (k[0].shape + k[1].shape, k[0].dimension * k[1].dimension),
    "diag": lambda k: (k[0].shape * 2, k[0].dimension),
    "det": lambda k: ((), k[0].dimension ** Fraction(k[0].shape[0])),
    "inverse": lambda k: (k[0].shape, k[0].dimension ** Fraction(-1)),
    "solve": lambda k: (k[1].shape, k[1].dimension / k[0].dimension),
    "trace": lambda k: ((), k[0].dimension),
    "eigenvalues": lambda k: (k[0].shape[:1], k[0].dimension),
    "mesh_volume": lambda k: ((), k[0].dimension ** Fraction(3)),
    "mesh_centre": lambda k: ((3,), k[0].dimension),
    "mesh_inertia": lambda k: ((3, 3), k[0].dimension ** Fraction(5)),
    "table": lambda k: ((), k[4 if len(k) == 7 else 2].dimension),
    "noise": _none,
    "delay": lambda k: (k[0].shape, k[0].dimension),
    "components": lambda k: (k[1].shape, k[1].dimension),
    "direction": lambda k: (k[1].shape, k[1].dimension),
}
"""Shape and dimension of what functions give; the others give poses, positions or velocities of frames."""

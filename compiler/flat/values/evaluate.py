"""Values that are known while compiling: structural parameters, sizes, indices, conditions of structure.

Values that must be fixed before a run are refused by the names in them, later by their formulas: each of these functions
returns code, message and details; ``culprit`` is what changes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from fractions import Fraction

from mechc.lang import ast
from mechc.lang.builtins import BUILTINS
from mechc.lang.diagnostics import Details
from mechc.lang.source import Span

from ...graph.operations import OPERATIONS
from .. import types
from ..model import (
    Apply,
    Array,
    Element,
    Expression,
    Kind,
    Literal,
    Name,
    Role,
    Select,
    Type,
    Where,
)
from ..names.scope import Constant, Poisoned, Scope
from ..operands import free_names
from . import matrices

LARGEST = 50_000
"""Most elements of an array, and most turns of a loop."""

_MOST_TURNS = 300_000
"""Most turns of all loops and elements of all arrays of a model."""

Value = Constant | tuple["Value", ...]

NOTHING: Mapping[str, Value] = {}


def _elliptic(name: str) -> Callable[..., float]:
    def value(*x: float) -> float:
        import mpmath

        if x[-1] >= 1:
            return math.nan
        found = mpmath.ellipfun(name, x[0], m=x[1]) if len(name) == 2 else getattr(mpmath, name)(*x)
        return float(found)

    return value


_FLOATS: Mapping[str, Callable[..., float]] = {
    "log10": math.log10,
    **{name: _elliptic(name) for name in ("ellipk", "ellipf", "sn", "cn", "dn")},
    **{row.name: row.value for row in OPERATIONS if row.value is not None and row.name in BUILTINS},
}
"""Functions whose values are rounded: those that are operations of the graph under the same name, and others."""

EXACT: Mapping[str, Callable[..., Constant]] = {
    "add": lambda a, b: a + b,
    "subtract": lambda a, b: a - b,
    "multiply": lambda a, b: a * b,
    "divide": lambda a, b: a / b,
    "negate": lambda a: -a,
    "less": lambda a, b: a < b,
    "less_equal": lambda a, b: a <= b,
    "greater": lambda a, b: a > b,
    "greater_equal": lambda a, b: a >= b,
    "equal": lambda a, b: a == b,
    "not_equal": lambda a, b: a != b,
    "and": lambda a, b: a and b,
    "or": lambda a, b: a or b,
    "not": lambda a: not a,
    "abs": abs,
    "sign": lambda a: Fraction((a > 0) - (a < 0)),
    "floor": lambda a: Fraction(math.floor(a)),
    "ceil": lambda a: Fraction(math.ceil(a)),
    "mod": lambda a, b: a - math.floor(a / b) * b,
    "div": lambda a, b: Fraction(math.trunc(a / b)),
    "min": lambda *a: min(a),
    "max": lambda *a: max(a),
    "clamp": lambda x, low, high: min(max(x, low), high),
    "deadzone": lambda x, width: x - min(max(x, -width), width),
}
"""Functions whose values are exact; those that divide may raise ZeroDivisionError."""


def constant(expression: Expression, known: Mapping[str, Value] = NOTHING) -> Value | None:
    """Return the value of an expression of constants and ``known`` names; None where it is none. Irrational values are rounded."""
    match expression:
        case Literal(value=value):
            return value
        case Name(name=name):
            return known.get(name)
        case Array(elements=items):
            return _complete([constant(e, known) for e in items])
        case Element(base=base, indices=indices):
            value_of_base = constant(base, known)
            for i in indices:
                if not isinstance(value_of_base, tuple):
                    return None
                value_of_base = value_of_base[i]
            return value_of_base
        case Select(condition=condition, then=then, otherwise=otherwise):
            test = constant(condition, known)
            return None if test is None else constant(then if test else otherwise, known)
        case Apply(function=function, arguments=arguments):
            return _apply(function, [constant(a, known) for a in arguments])
        case Where(names=names, values=values, body=body):
            inside = dict(known)
            for local, meaning in zip(names, values, strict=True):
                if (found := constant(meaning, inside)) is not None:
                    inside[local] = found
            return constant(body, inside)
        case _:
            return None


def _complete(values: list[Value | None]) -> tuple[Value, ...] | None:
    """Return the values if all are known."""
    known = tuple(v for v in values if v is not None)
    return known if len(known) == len(values) else None


def _apply(function: str, values: list[Value | None]) -> Value | None:
    known = _complete(values)
    if known is None:
        return None
    try:
        if function == "norm":
            return _root(sum((x**2 for x in _fractions(known[0])), Fraction(0)))
        if function in _OF_MATRICES:
            return _OF_MATRICES[function](*known)
        if any(isinstance(v, tuple) for v in known):
            return _each(function, known)
        if function in EXACT:
            return EXACT[function](*known)
        if function == "power":
            base, exponent = _fractions(known)
            return _power(base, exponent)
        if function == "sqrt":
            return _root(*_fractions(known))
        if function in _FLOATS:
            return Fraction(_FLOATS[function](*map(float, _fractions(known))))
    except (ArithmeticError, ValueError):
        return None
    return None


def _fractions(value: Value) -> list[Fraction]:
    """Return the numbers of a vector."""
    assert isinstance(value, tuple)
    numbers = []
    for x in value:
        assert isinstance(x, Fraction), x
        numbers.append(x)
    return numbers


def _each(function: str, values: tuple[Value, ...]) -> Value | None:
    """Spread an operator over arrays, a scalar standing for all elements; products of arrays are not known."""
    arrays = [v for v in values if isinstance(v, tuple)]
    if function not in ("add", "subtract", "negate", "multiply", "divide"):
        return None
    if function == "multiply" and len(arrays) > 1:
        return _product(*values)
    if function == "divide" and isinstance(values[1], tuple):
        return None
    return _complete(
        [
            _apply(function, [v[i] if isinstance(v, tuple) else v for v in values])
            for i in range(len(arrays[0]))
        ]
    )


def rows_of(value: Value) -> matrices.Rows:
    """Return the rows of a matrix, those of a vector with one number each."""
    assert isinstance(value, tuple)
    return [_fractions(row) if isinstance(row, tuple) else _fractions((row,)) for row in value]


def _product(a: Value, b: Value) -> Value:
    """Return a matrix times a vector or a matrix."""
    columns = list(zip(*rows_of(b), strict=True))
    found = [
        [sum((x * y for x, y in zip(r, c, strict=True)), Fraction(0)) for c in columns] for r in rows_of(a)
    ]
    return _like(b, found)


def _like(value: Value, rows: matrices.Rows) -> Value:
    """Return rows as a matrix, or as a vector where that is what ``value`` is."""
    assert isinstance(value, tuple)
    return tuple(tuple(row) for row in rows) if isinstance(value[0], tuple) else tuple(row[0] for row in rows)


def _inverse(a: Value) -> Value:
    rows = rows_of(a)
    one = [[Fraction(i == j) for j in range(len(rows))] for i in range(len(rows))]
    return _like(a, matrices.solve(rows, one))


_OF_MATRICES: Mapping[str, Callable[..., Value]] = {
    "det": lambda a: matrices.determinant(rows_of(a)),
    "inverse": _inverse,
    "solve": lambda a, b: _like(b, matrices.solve(rows_of(a), rows_of(b))),
    "transpose": lambda a: tuple(zip(*a, strict=True)),
    "identity": lambda n: tuple(tuple(Fraction(i == j) for j in range(int(n))) for i in range(int(n))),
    "diag": lambda a: tuple(
        tuple(x if i == j else Fraction(0) for j in range(len(a))) for i, x in enumerate(a)
    ),
}
"""Functions of whole arrays; those that divide may raise ZeroDivisionError."""


def _power(base: Fraction, exponent: Fraction) -> Fraction | None:
    if exponent.denominator == 1:
        bits = max(base.numerator.bit_length(), base.denominator.bit_length())
        if bits * abs(exponent.numerator) <= 4096:
            return base**exponent.numerator
    return Fraction(math.pow(base, exponent))


def _root(value: Fraction) -> Fraction:
    top, bottom = math.isqrt(value.numerator), math.isqrt(value.denominator)
    if top * top == value.numerator and bottom * bottom == value.denominator:
        return Fraction(top, bottom)
    return Fraction(math.sqrt(value))


def to_expression(value: Value, type: Type, span: Span) -> Expression:
    """Return a value as literals of ``type``."""
    if isinstance(value, tuple):
        inner = types.element_of(type)
        return Array(type=type, span=span, elements=tuple(to_expression(v, inner, span) for v in value))
    return Literal(type=type, span=span, value=value)


# ---------------------------------------------------------------- what statements ask for


def whole_number(scope: Scope, node: ast.Expression, purpose: str) -> int:
    """Return the whole number that an expression gives; reports anything else."""
    expression = scope.elaborate(node)
    value = expression.value if type(expression) is Literal else constant(expression)
    if value is None:
        raise not_structural(scope, node, expression, purpose)
    kind = expression.type
    counts = kind is types.INTEGER or (kind.dimension.is_none and not kind.shape)
    if counts and isinstance(value, Fraction) and value.denominator == 1:
        return value.numerator
    raise scope.fail(
        "E0326",
        f"{purpose} must be a whole number",
        node.span,
        caption=f"this is {_shown(value, expression.type)}",
    )


def _shown(value: Value, type: Type) -> str:
    if isinstance(value, Fraction) and type.dimension.is_none and not type.shape:
        return f"{float(value):.10g}"
    return types.describe(type)


def truth(scope: Scope, node: ast.Expression, purpose: str) -> bool:
    """Return the truth value that a structural condition gives; reports anything else."""
    expression = scope.elaborate(node)
    if expression.type.kind is not Kind.BOOLEAN or expression.type.shape:
        raise scope.fail(
            "E0318",
            f"{purpose} must be true or false",
            node.span,
            caption=f"this is {types.describe(expression.type)}",
        )
    value = constant(expression)
    if value is None:
        raise not_structural(scope, node, expression, purpose)
    return bool(value)


def not_structural(scope: Scope, node: ast.Expression, expression: Expression, purpose: str) -> Poisoned:
    """Report that a value is needed while compiling, but may change afterwards."""
    names = free_names(expression)
    name = next((n for n in names if "#" not in n), None)  # the others are bound by integrals and fields
    member = scope.flattening.variables.get(name) if name else None
    if member is not None and member.role is Role.PARAMETER:
        help = f"declare '{name}' as 'structural parameter'"
    else:
        help = "only structural parameters, numbers and indices of loops are known"
    late = "this is found later, as integrals and derivatives are" if names else "this may change afterwards"
    return scope.fail(
        "E0315",
        f"{purpose} must be known when compiling",
        node.span,
        caption=f"'{name}' may change afterwards" if name else late,
        help=help,
    )


def range_values(scope: Scope, node: ast.Range) -> range:
    """Return the whole numbers of ``a:b`` or ``a:step:b``."""
    first = whole_number(scope, node.start, "the start of a range")
    last = whole_number(scope, node.stop, "the end of a range")
    step = 1 if node.step is None else whole_number(scope, node.step, "the step of a range")
    if step == 0:
        raise scope.fail("E0326", "the step of a range must not be zero", (node.step or node).span)
    count = max(0, (last - first) // step + 1)  # ``len`` of a range has a limit of its own
    check_size(scope, count, node.span)
    return range(first, last + (1 if step > 0 else -1), step)


def check_size(scope: Scope, size: int, span: Span) -> None:
    """Count elements of an array or turns of a loop; report too many of them, here or in the whole model."""
    if size > LARGEST:
        raise scope.fail(
            "E0419",
            f"{size} elements are too many",
            span,
            help=f"at most {LARGEST} are possible",
        )
    scope.flattening.turns += size
    if scope.flattening.turns > _MOST_TURNS:
        raise scope.flattening.reporter.fail(
            "E0419", f"the arrays and loops of the model have more than {_MOST_TURNS} elements", span
        )


def iterate(scope: Scope, name: str, node: ast.Expression) -> list[Scope]:
    """Return one scope for each value of ``for name in node``."""
    return [scope.with_local({name: item}) for item in values_of(scope, node)]


def values_of(scope: Scope, node: ast.Expression) -> list[Expression]:
    """Return the elements of a range, or of any expression with several values."""
    if isinstance(node, ast.Range):
        return [
            Literal(type=types.INTEGER, span=node.span, value=Fraction(i)) for i in range_values(scope, node)
        ]
    expression = scope.elaborate(node)
    if not expression.type.shape:
        raise scope.fail(
            "E0305",
            "a loop runs over a range or an array",
            node.span,
            caption=f"this is {types.describe(expression.type)}",
            help="write a range such as '1:n'",
        )
    return elements(expression)


def elements(expression: Expression) -> list[Expression]:
    """Return the elements of an array along its first dimension."""
    return [pick(expression, (i,)) for i in range(expression.type.shape[0])]


def flat(expression: Expression) -> list[Expression]:
    """Return the single numbers of an array in row-major order; a number is its own."""
    items = [expression]
    while items and items[0].type.shape:
        items = [e for item in items for e in elements(item)]
    return items


def pick(expression: Expression, indices: tuple[int, ...]) -> Expression:
    """Return ``expression[indices]``, without a node where the elements are written out."""
    while indices and isinstance(expression, Array):
        expression, indices = expression.elements[indices[0]], indices[1:]
    if not indices:
        return expression
    type = types.element_of(expression.type, len(indices))
    if isinstance(expression, Element):
        return Element(
            type=type, span=expression.span, base=expression.base, indices=(*expression.indices, *indices)
        )
    return Element(type=type, span=expression.span, base=expression, indices=indices)


Refusal = tuple[str, str, Details]


def parameter_changes(name: str, culprit: str) -> Refusal:
    """Refuse the value of a parameter."""
    help = "a parameter is fixed during a run; write 'let' for what changes, or 'input' in a component"
    message = f"parameter '{name}' must not depend on '{culprit}', which changes"
    return "E0810", message, {"caption": f"this depends on '{culprit}'", "help": help}


def input_changes(name: str, culprit: str) -> Refusal:
    """Refuse the default of an input, which may use time too."""
    help = "a default may use parameters and time; write 'let' for what follows from the motion"
    message = f"the default of the input '{name}' must not depend on '{culprit}'"
    return "E0811", message, {"caption": f"this depends on '{culprit}'", "help": help}


def first_value_changes(name: str, culprit: str) -> Refusal:
    """Refuse the first value of a discrete variable, which is known before the state is."""
    help = f"give it a number, and its value at the start by 'when initial() then {name} := ...; end when;'"
    message = f"the first value of the discrete variable '{name}' must not depend on '{culprit}'"
    return "E0811", message, {"caption": f"this depends on '{culprit}'", "help": help}


def setting_changes(culprit: str) -> Refusal:
    """Refuse what an experiment sets."""
    help = (
        "an experiment sets fixed values, which may use parameters; for a function of time, change the default of the "
        "'input' in the model, or give a table (--input NAME=FILE.csv)"
    )
    message = f"what an experiment sets must not depend on '{culprit}', which changes"
    return "E0812", message, {"caption": f"this depends on '{culprit}'", "help": help}

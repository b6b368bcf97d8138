"""Parameters without unit, where dimensions do not fit: one of them may lack it."""

from __future__ import annotations

from fractions import Fraction

from mechc.lang import ast
from mechc.lang.diagnostics import Label
from mechc.lang.units import Dimension

from .. import types
from ..model import Apply, Expression, Kind, Literal, Name
from ..names.instance import VariableMember
from ..names.scope import Scope
from ..operands import free_names

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
        power = _power(value, name)
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


def _power(value: Expression, name: str) -> Fraction | None:
    """Return the power of a name in a product; None where it stands elsewhere than in factors."""
    match value:
        case Name(name=other):
            return Fraction(other == name)
        case Apply(function="multiply" | "divide" as function, arguments=(left, right)):
            a, b = _power(left, name), _power(right, name)
            return None if a is None or b is None else a + b if function == "multiply" else a - b
        case Apply(function="negate", arguments=(inner,)):
            return _power(inner, name)
        case Apply(function="power", arguments=(base, Literal(value=Fraction() as exponent))):
            inside = _power(base, name)
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

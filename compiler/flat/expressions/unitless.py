"""Parameters without unit, where dimensions do not fit: one of them may lack it."""

from __future__ import annotations

from mechc.lang import ast
from mechc.lang.diagnostics import Label

from ..model import Expression, Kind
from ..names.instance import VariableMember
from ..names.scope import Scope
from ..operands import free_names

MOST = 3
"""Parameters that a message points at."""


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

"""What a quantity lacks that is one of another kind."""

from __future__ import annotations

from mechc.lang.units import Dimension

from .. import types
from ..model import Kind
from ..names.instance import DefinitionMember, VariableMember
from ..names.scope import Scope


def missing_factor(scope: Scope, given: Dimension, wanted: Dimension) -> str:
    """Say which factor is missing or too many, and what in scope has its dimension."""
    factor, problem = wanted / given, "missing"
    if all(e <= 0 for e in factor.exponents):
        factor, problem = given / wanted, "too many"
    text = f"one factor of [{factor}] is {problem}"
    found = _candidates(scope, factor)
    if not found:
        return text
    return f"{text}; {types.with_article(types.dimension_word(factor))} in scope: {', '.join(found)}"


def _candidates(scope: Scope, dimension: Dimension) -> list[str]:
    if scope.instance is None:
        return []
    found = []
    for name, member in scope.instance.members.items():
        if isinstance(member, VariableMember | DefinitionMember):
            type = member.type
            if type is not None and type.dimension == dimension and not type.shape and type.kind is Kind.REAL:
                line = member.declaration.name_span.file.position(member.declaration.name_span.start)[0]
                found.append(f"'{name}' (line {line})")
    return found[:3]

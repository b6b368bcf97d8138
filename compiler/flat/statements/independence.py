"""What a picture cannot ask: that a model is the same with what is drawn as without it."""

from __future__ import annotations

from collections.abc import Iterator

from mechc.lang import ast
from mechc.lang.source import Span

from ..expressions.coordinates import definition_of
from ..model import Apply, Expression, Literal, Name, Previous, Query
from ..names.scope import Flattening, Poisoned, Scope
from ..operands import children


def check_alone(scope: Scope, value: Expression, span: Span) -> None:
    """Report what a picture cannot ask without changing the model: answers of the equations, memory, clocks."""
    for part in _parts(scope.flattening, value):
        match part:
            case Query(function=function):
                raise not_in_a_picture(scope, span, f"'{function}'")
            case Previous():
                raise not_in_a_picture(scope, span, "'pre'")
            case Apply(function="sample" | "initial" | "delay" as function):
                raise not_in_a_picture(scope, span, f"'{function}'")
            case _:
                pass


def not_in_a_picture(scope: Scope, span: Span, what: str) -> Poisoned:
    return scope.fail(
        "E1007",
        f"{what} is nothing that can be asked for a picture: it would change the model",
        span,
        help="declare an output, as in 'output R = reaction(pin);', and draw that",
    )


def _parts(flattening: Flattening, value: Expression) -> Iterator[Expression]:
    """Yield all that an expression is made of, through abbreviations, but not through outputs."""
    seen: set[int | str] = set()
    pending = [value]
    while pending:
        at = pending.pop()
        key = at.name if isinstance(at, Name) else id(at)
        if key in seen or isinstance(at, Literal):
            continue
        seen.add(key)
        yield at
        if not isinstance(at, Name):
            pending.extend(children(at))
            continue
        member = flattening.definitions.get(at.name)
        if member is not None and not isinstance(member.declaration, ast.Output):
            pending.extend(definition_of(flattening, at.name))

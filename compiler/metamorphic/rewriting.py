"""Flat models with every expression exchanged, and the expressions that twins are made of."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import Any, TypeVar

from msgspec import Struct
from msgspec.structs import replace

from mechc.lang.source import Placed, Span

from ..flat import types
from ..flat.model import (
    Apply,
    Attributes,
    Expression,
    FlatModel,
    Literal,
    Name,
    Origin,
    Select,
    Type,
)
from ..flat.operands import children, with_operands

KEPT = (Origin, Type, Attributes, Span)
"""Parts of a model that hold no expressions of its motion."""
Change = Callable[[Expression], Expression]
T = TypeVar("T")


class Rewriting:
    """Exchanges every part of expressions, operands first; what expressions share stays shared."""

    def __init__(self, change: Change) -> None:
        self._change = change
        self._done: dict[int, tuple[Expression, Expression]] = {}

    def __call__(self, expression: Expression) -> Expression:
        found = self._done.get(id(expression))
        if found is None:
            inner = tuple(self(e) for e in children(expression))
            found = self._done[id(expression)] = expression, self._change(with_operands(expression, inner))
        return found[1]


def everywhere(part: T, change: Change) -> T:
    """Return a part of a flat model with each of its whole expressions exchanged."""
    return _exchanged(part, change)  # type: ignore[no-any-return]


def _exchanged(part: Any, change: Change) -> Any:
    match part:
        case Placed():
            return change(part)  # type: ignore[arg-type]
        case Struct() if not isinstance(part, KEPT):
            fields = {name: getattr(part, name) for name in part.__struct_fields__}
            changed = {name: _exchanged(value, change) for name, value in fields.items()}
            same = all(changed[name] is fields[name] for name in fields)
            return part if same else replace(part, **changed)
        case tuple():
            made = tuple(_exchanged(value, change) for value in part)
            return part if all(a is b for a, b in zip(made, part, strict=True)) else made
        case Mapping():
            return {name: _exchanged(value, change) for name, value in part.items()}
        case _:
            return part


def rewritten(model: FlatModel, change: Change) -> FlatModel:
    """Return a model with every part of every expression exchanged, operands first."""
    return everywhere(model, Rewriting(change))


def undrawn(model: FlatModel) -> FlatModel:
    """Return a model without pictures, studies and closed solutions, which say nothing of its motion."""
    return replace(model, draws=(), quiet=("",), studies=(), exacts=())


MEASURES = {
    "time": types.TIME,
    "length": types.LENGTH,
    "velocity": types.VELOCITY,
    "rate": types.RATE,
}


def measured(model: FlatModel, what: str, shape: tuple[int, ...] = ()) -> Type:
    """Return the type of a kind of quantity in a model, whose quantities may all be pure numbers."""
    return types.real(types.NUMBER.dimension if model.dimensionless else MEASURES[what], shape)


# ---------------------------------------------------------------- expressions


def number(value: float | Fraction, like: Type, span: Span) -> Literal:
    """Return a constant of the dimension of a type."""
    return Literal(type=types.real(like.dimension, angle=like.angle), span=span, value=Fraction(value))


def apply(function: str, type: Type, *arguments: Expression) -> Apply:
    return Apply(type=type, span=arguments[0].span, function=function, arguments=arguments)


def negative(e: Expression) -> Expression:
    return apply("negate", types.numeric(e.type), e)


def product(a: Expression, b: Expression) -> Expression:
    """Return a scalar times anything."""
    dimension = a.type.dimension * b.type.dimension
    return apply("multiply", types.real(dimension, a.type.shape or b.type.shape), a, b)


def quotient(a: Expression, b: Expression) -> Expression:
    return apply("divide", types.real(a.type.dimension / b.type.dimension, a.type.shape), a, b)


def total(a: Expression, b: Expression, function: str = "add") -> Expression:
    """Return a sum, or with ``function="subtract"`` a difference."""
    whole = b.type if types.is_zero(a) else a.type
    return apply(function, types.numeric(whole), a, b)


def squared(e: Expression) -> Expression:
    two = Literal(type=types.NUMBER, span=e.span, value=Fraction(2))
    return apply("power", types.real(e.type.dimension**2), e, two)


def dotted(a: Expression, b: Expression) -> Expression:
    return apply("dot", types.real(a.type.dimension * b.type.dimension), a, b)


def half(e: Expression) -> Expression:
    return product(number(Fraction(1, 2), types.NUMBER, e.span), e)


def named(name: str, type: Type, span: Span) -> Name:
    return Name(type=type, span=span, name=name)


def choice(condition: Expression, then: Expression, otherwise: Expression) -> Expression:
    whole = otherwise.type if types.is_zero(then) else then.type
    return Select(
        type=types.numeric(whole), span=condition.span, condition=condition, then=then, otherwise=otherwise
    )


def compared(function: str, a: Expression, b: Expression) -> Expression:
    return apply(function, types.BOOLEAN, a, b)

"""What an expression is made of: its operands, the names in it, its size."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from msgspec import Struct
from msgspec.structs import replace

from mechc.lang.source import Placed

from .model import (
    Apply,
    Array,
    Derivative,
    Element,
    Expression,
    FieldDerivative,
    FlatModel,
    Literal,
    Name,
    Origin,
    Previous,
    Quadrature,
    Query,
    Role,
    Select,
    Type,
    Where,
)

_LEAVES = (Literal, Name)
_OPERANDS: Mapping[type[Expression], tuple[str, ...]] = {
    Apply: ("arguments",),
    Array: ("elements",),
    Element: ("base",),
    Select: ("condition", "then", "otherwise"),
    Derivative: ("operand",),
    Previous: ("operand",),
    Query: ("arguments",),
    Quadrature: ("lower", "upper", "body"),
    FieldDerivative: ("place", "body"),
    Where: ("values", "body"),
}
"""The fields that hold operands; what is not here has none."""


def children(expression: Expression) -> tuple[Expression, ...]:
    """Return the operands of an expression."""
    match expression:
        case Apply(arguments=arguments):
            return arguments
        case Array(elements=items):
            return items
        case Literal() | Name():
            return ()
        case _:
            found: list[Expression] = []
            for name in _OPERANDS.get(expression.__class__, ()):
                part = getattr(expression, name)
                found += part if isinstance(part, tuple) else (part,)
            return tuple(found)


def with_operands(expression: Expression, operands: tuple[Expression, ...]) -> Expression:
    """Return the same expression of other operands, in the order of ``children``."""
    if all(a is b for a, b in zip(operands, children(expression), strict=True)):
        return expression
    changed: dict[str, object] = {}
    rest = list(operands)
    for name in _OPERANDS[expression.__class__]:
        old = getattr(expression, name)
        changed[name] = tuple([rest.pop(0) for _ in old]) if isinstance(old, tuple) else rest.pop(0)
    return replace(expression, **changed)


def stated(part: object) -> Iterator[Expression]:
    """Yield the whole expressions in a part of a flat model."""
    pending = [part]
    while pending:
        at = pending.pop()
        if isinstance(at, Placed):
            yield at  # type: ignore[misc]
        elif isinstance(at, tuple):
            pending.extend(reversed(at))
        elif isinstance(at, Mapping):
            pending.extend(reversed(list(at.values())))
        elif isinstance(at, Struct) and not isinstance(at, (Origin, Type)):
            pending.extend(getattr(at, name) for name in reversed(at.__struct_fields__))


def parts(roots: Iterable[Expression]) -> Iterator[Expression]:
    """Yield expressions and all in them, each once."""
    seen: set[int] = set()
    pending = list(roots)
    while pending:
        at = pending.pop()
        if id(at) not in seen:
            seen.add(id(at))
            yield at
            pending.extend(children(at))


def idle_parameters(model: FlatModel) -> frozenset[str]:
    """Return the parameters that nothing uses but what is drawn and closed solutions: their values change nothing."""
    given = {v.name: v.value for v in model.variables if v.role is Role.PARAMETER}
    rest = tuple(v for v in model.variables if v.role is not Role.PARAMETER)
    used: set[str] = set()
    for expression in stated(replace(model, variables=rest, draws=(), exacts=())):
        if len(used) == len(given):
            break
        pending = [expression]
        while pending:
            for name in free_names(pending.pop()):
                if name in given and name not in used:
                    used.add(name)
                    value = given[name]
                    pending += [value] if value is not None else []
    return frozenset(given) - used


def free_names(expression: Expression) -> dict[str, None]:
    """Return the names that an expression mentions, in order."""
    found: dict[str, None] = {}
    seen: set[int] = set()
    pending: list[Expression] = [expression]
    while pending:
        at = pending.pop()
        kind = at.__class__
        if kind is Name:
            found[at.name] = None  # type: ignore[union-attr]
        elif kind is not Literal and id(at) not in seen:  # arguments of functions are shared
            seen.add(id(at))
            pending += children(at)[::-1]
    return found


def unbound_names(expression: Expression) -> list[str]:
    """Return the names that something around an expression binds: an integral, a field, the body of a function."""
    bound: set[str] = set()
    for at in parts([expression]):
        match at:
            case Quadrature(variable=variable) | FieldDerivative(variable=variable):
                bound.add(variable)
            case Where(names=names):
                bound.update(names)
            case _:
                pass
    return [name for name in free_names(expression) if "#" in name and name not in bound]


def written_size(expression: Expression) -> int:
    """Return the number of nodes of an expression with everything shared written out."""
    sizes: dict[int, int] = {}
    pending: list[Expression] = [expression]
    while pending:
        at = pending[-1]
        inner = children(at)
        missing = [e for e in inner if e.__class__ not in _LEAVES and id(e) not in sizes]
        if missing:
            pending.extend(missing)
            continue
        sizes[id(at)] = 1 + sum([sizes.get(id(e), 1) for e in inner])
        pending.pop()
    return sizes[id(expression)]

"""Circles of signals between parts that are linear: one of their outputs becomes an unknown that an equation determines.

A circle has one solution wherever it is not singular, so no guess is asked for; others are reported (cycles.py).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from fractions import Fraction

from msgspec.structs import replace

from ..model import (
    Apply,
    Definition,
    DefinitionRole,
    Expression,
    ImplicitEquation,
    Kind,
    Literal,
    Name,
    Select,
    Unknown,
    UnknownOutput,
)
from ..operands import free_names
from ..statements.record import StatementRecord
from .cycles import chains_to_themselves

_NOT_LINEAR = 2


def solve_linear_loops(record: StatementRecord) -> None:
    """Give each linear circle of signals an unknown, the first output of a component in it."""
    while True:
        values = {d.name: d for d in record.definitions}
        opened = False
        for chain in chains_to_themselves((), tuple(record.definitions)):
            name = next((n for n in chain if _is_signal(values[n])), None)
            if name is not None and _is_linear(name, values):
                _open(record, values[name])
                opened = True
        if not opened:
            return


def _is_linear(name: str, values: Mapping[str, Definition]) -> bool:
    """Tell whether all that depends on a definition and on which it depends is linear in these signals together."""
    reads = {
        n: free_names(d.value) & values.keys() if d.value is not None else set() for n, d in values.items()
    }
    readers: dict[str, set[str]] = {n: set() for n in values}
    for n, others in reads.items():
        for other in others:
            readers[other].add(n)
    circle = _reached(name, reads) & _reached(name, readers)
    return all(_degree(values[n].value, circle) <= 1 for n in circle)


def _reached(name: str, following: Mapping[str, Collection[str]]) -> set[str]:
    found, pending = {name}, [name]
    while pending:
        new = set(following[pending.pop()]) - found
        found |= new
        pending += new
    return found


def _is_signal(definition: Definition) -> bool:
    """Tell whether this is an output of a component, and one real number."""
    return (
        definition.role is DefinitionRole.OUTPUT
        and "." in definition.name
        and definition.type.kind is Kind.REAL
        and not definition.type.shape
    )


def _open(record: StatementRecord, definition: Definition) -> None:
    """Let an equation hold between an output and its formula."""
    name, type, origin, value = definition.name, definition.type, definition.origin, definition.value
    assert value is not None
    opened = replace(definition, value=Unknown(type=type, span=origin.span, name=name))
    record.definitions = [opened if d.name == name else d for d in record.definitions]
    guess = Literal(type=type, span=origin.span, value=Fraction(0))
    record.unknowns.append(UnknownOutput(name, guess, origin))
    record.implicit.append(ImplicitEquation(Name(type=type, span=origin.span, name=name), value, origin))


def _degree(value: Expression | None, circle: set[str]) -> int:
    """Return the degree of an expression in the signals of a circle: 0, 1, or more."""
    if value is None or circle.isdisjoint(free_names(value)):
        return 0
    match value:
        case Name():
            return 1
        case Apply(function="add" | "subtract" | "negate"):
            return max(_degree(x, circle) for x in value.arguments)
        case Apply(function="multiply"):
            return sum(_degree(x, circle) for x in value.arguments)
        case Apply(function="divide", arguments=(dividend, divisor)) if circle.isdisjoint(
            free_names(divisor)
        ):
            return _degree(dividend, circle)
        case Select() if circle.isdisjoint(free_names(value.condition)):
            return max(_degree(value.then, circle), _degree(value.otherwise, circle))
    return _NOT_LINEAR

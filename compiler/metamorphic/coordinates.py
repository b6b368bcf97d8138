"""Coordinates replaced by others: each one a hyperbolic sine of another, whose equations hold further terms."""

from __future__ import annotations

import math
from collections.abc import Mapping
from fractions import Fraction
from random import Random

from msgspec.structs import replace

from mechc.lang.diagnostics import Reporter

from ..flat import types
from ..flat.model import (
    Array,
    Definition,
    DefinitionRole,
    Derivative,
    Element,
    Expression,
    FlatModel,
    Kind,
    Name,
    Query,
    Reinit,
    Role,
    Type,
    Variable,
)
from ..flat.operands import parts, stated
from ..flat.subscripts import element_name, subscripts
from ..mechanics.kinematics.topology import classify
from .rewriting import apply, number, product, quotient, rewritten, undrawn
from .starts import begun, rate_name
from .twin import NotApplicable, Seen, States, Twin


def other_coordinates(model: FlatModel, seen: Seen | None, random: Random) -> Twin:
    """Write each coordinate q as c*sinh(r), with c the size that it has in the motion."""
    if seen is None:
        raise NotApplicable("the sizes of its coordinates are not known")
    held = held_coordinates(model)
    chosen = [v for v in model.variables if v.role is Role.COORDINATE and v.type.kind is Kind.REAL]
    chosen = [v for v in chosen if v.name not in held and _known(v, seen.first)]
    if not chosen:
        raise NotApplicable(
            "it has no coordinate of its own that nothing asks for, sets or prescribes"
            if any(v.role is Role.COORDINATE for v in model.variables)
            else "it has no coordinates"
        )
    names = {v.name: f"other {v.name}" for v in chosen}
    start = dict(seen.first)
    variables, definitions = [], list(model.definitions)
    slopes: dict[str, tuple[Name, Expression]] = {}
    for v in model.variables:
        if v.name not in names:
            variables.append(v)
            continue
        sizes = {index: _size(v, index, seen.largest) for index in subscripts(v.type.shape)}
        start |= _start(v, names[v.name], sizes, seen.first)
        plain = types.real(shape=v.type.shape)
        variables.append(
            Variable(names[v.name], Role.COORDINATE, plain, v.origin, doc=f"{v.name} as a hyperbolic sine")
        )
        other = Name(type=plain, span=v.origin.span, name=names[v.name])
        value = _bent(other, v.type, sizes)
        if not v.type.shape:
            slopes[v.name] = _slope(other, v.type, sizes[()])
        definitions.append(Definition(v.name, DefinitionRole.OUTPUT, v.type, value, v.origin))
    joints = tuple(
        replace(j, coordinates=tuple(names.get(c, c) for c in j.coordinates)) for j in model.joints
    )
    made = replace(undrawn(model), variables=tuple(variables), definitions=tuple(definitions), joints=joints)
    made = rewritten(made, lambda e: _momentum(e, slopes))
    says = f"{len(chosen)} of {_count(model)} coordinates as c*sinh of others"
    return Twin("other coordinates", says, begun(made, start), frozenset({"momentum"}), start=start)


def _slope(other: Name, type: Type, size: float) -> tuple[Name, Expression]:
    """Return dq/dr = c*cosh(r), beside r."""
    c = number(Fraction(size), type, other.span)
    return other, product(c, apply("cosh", types.NUMBER, other))


def _momentum(e: Expression, slopes: Mapping[str, tuple[Name, Expression]]) -> Expression:
    """Return a momentum by that of the other coordinate: p = dL/dr' / (dq/dr)."""
    if not isinstance(e, Query) or e.function != "momentum" or e.target not in slopes:
        return e
    other, slope = slopes[e.target]
    whole = types.real(e.type.dimension * slope.type.dimension)
    return quotient(replace(e, type=whole, target=other.name), slope)


def _count(model: FlatModel) -> int:
    return sum(v.role is Role.COORDINATE for v in model.variables)


def held_coordinates(model: FlatModel) -> set[str]:
    """Return the coordinates that statements name as such: what is asked of them, what sets or prescribes them."""
    single = {v.name for v in model.variables if not v.type.shape}
    asked = [p for p in parts(stated(model)) if isinstance(p, Query)]
    held = {p.target for p in asked if p.function != "momentum" or p.target not in single}
    for e in model.events:
        actions = [a for branch in e.branches for a in branch.actions]
        held |= {_head(a.target) for a in actions if isinstance(a, Reinit)}
    held |= {_head(d.target) for d in model.drives}
    return held | {n for j in classify(model, Reporter()).closures for n in j.coordinates}


def _head(target: Expression) -> str:
    while isinstance(target, (Element, Derivative)):
        target = target.base if isinstance(target, Element) else target.operand
    return target.name if isinstance(target, Name) else ""


def _known(v: Variable, first: States) -> bool:
    return all(element_name(v.name, index) in first for index in subscripts(v.type.shape))


def _size(v: Variable, index: tuple[int, ...], largest: States) -> float:
    return largest.get(element_name(v.name, index), 0.0) or 1.0


def _start(v: Variable, other: str, sizes: dict[tuple[int, ...], float], first: States) -> dict[str, float]:
    """Return where the others begin: r = asinh(q/c), r' = q'/sqrt(c^2 + q^2)."""
    start = {}
    for index, c in sizes.items():
        name, new = element_name(v.name, index), element_name(other, index)
        q = first[name]
        start[new] = math.asinh(q / c)
        if rate_name(name) in first:  # none without inertia
            start[rate_name(new)] = first[rate_name(name)] / math.hypot(c, q)
    return start


def _bent(
    other: Expression, type: Type, sizes: dict[tuple[int, ...], float], at: tuple[int, ...] = ()
) -> Expression:
    """Return c*sinh(r), element by element."""
    shape = type.shape
    if len(at) == len(shape):
        r = other if not at else Element(type=types.NUMBER, span=other.span, base=other, indices=at)
        c = number(Fraction(sizes[at]), type, other.span)
        return product(c, apply("sinh", types.NUMBER, r))
    elements = tuple(_bent(other, type, sizes, (*at, k)) for k in range(shape[len(at)]))
    inner = types.real(type.dimension, shape[len(at) :])
    return Array(type=inner, span=other.span, elements=elements)

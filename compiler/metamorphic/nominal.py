"""Coordinates of another size, with nominal values of that size: what is guessed is weighed alike."""

from __future__ import annotations

from fractions import Fraction
from random import Random

from msgspec.structs import replace

from ..flat import types
from ..flat.model import (
    Definition,
    DefinitionRole,
    Expression,
    FlatModel,
    Kind,
    Query,
    Role,
    StartValue,
    Variable,
)
from ..flat.operands import parts, stated
from .coordinates import held_coordinates
from .rewriting import named as whole
from .rewriting import number, product, quotient, undrawn
from .twin import NotApplicable, Seen, Twin

POWERS = (-3, -2, 2, 3)


def nominal_sizes(model: FlatModel, seen: Seen | None, random: Random) -> Twin:
    """Write each coordinate that states a nominal value as a power of two times another one, each by its own."""
    held = held_coordinates(model)
    held |= {p.target for p in parts(stated(model)) if isinstance(p, Query)}
    chosen = [
        v
        for v in model.variables
        if v.role is Role.COORDINATE
        and v.type.kind is Kind.REAL
        and not v.type.shape
        and v.attributes.nominal is not None
        and v.name not in held
    ]
    if not chosen:
        raise NotApplicable(
            "no coordinate of its own that nothing asks for, sets or prescribes has a nominal value"
        )
    names = {v.name: f"other {v.name}" for v in chosen}
    powers = [POWERS[k % len(POWERS)] for k in random.sample(range(len(chosen)), len(chosen))]
    factors = {v.name: Fraction(2) ** p for v, p in zip(chosen, powers, strict=True)}
    variables = tuple(_sized(v, names, factors) for v in model.variables)
    definitions = list(model.definitions)
    for v in chosen:
        by = number(factors[v.name], types.NUMBER, v.origin.span)
        value = product(by, whole(names[v.name], v.type, v.origin.span))
        definitions.append(Definition(v.name, DefinitionRole.OUTPUT, v.type, value, v.origin))
    experiments = tuple(
        replace(
            e,
            settings=tuple(
                replace(s, target=names[s.target], value=_by(s.value, factors[s.target]))
                if s.target in names
                else s
                for s in e.settings
            ),
        )
        for e in model.experiments
        if not any(s.target in names for s in e.sweeps)
    )
    if len(experiments) < len(model.experiments):
        raise NotApplicable("its experiments sweep over a coordinate")
    joints = tuple(
        replace(j, coordinates=tuple(names.get(c, c) for c in j.coordinates)) for j in model.joints
    )
    made = replace(
        undrawn(model),
        variables=variables,
        definitions=tuple(definitions),
        experiments=experiments,
        joints=joints,
    )
    says = f"{len(chosen)} coordinates and their nominal values of another size"
    return Twin("nominal sizes", says, made, frozenset({"momentum"}))


def _by(e: Expression, factor: Fraction) -> Expression:
    return quotient(e, number(factor, types.NUMBER, e.span))


def _sized(v: Variable, names: dict[str, str], factors: dict[str, Fraction]) -> Variable:
    if v.name not in names:
        return v
    factor = factors[v.name]

    def start(given: StartValue | None) -> StartValue | None:
        return None if given is None else replace(given, value=_by(given.value, factor))

    sizes = {
        n: getattr(v.attributes, n) / float(factor)
        for n in ("nominal", "minimum", "maximum")
        if getattr(v.attributes, n) is not None
    }
    attributes = replace(v.attributes, **sizes)
    return replace(v, name=names[v.name], attributes=attributes, start=start(v.start), rate=start(v.rate))

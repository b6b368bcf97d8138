"""Inputs after a filter: two states follow each of them, and formulas read the first.

``input Length road(filter = 0.5 ms);`` is, with ``s`` instead of ``road`` wherever it is read:

    state s = road; state r = 0;
    equation der(s) = r; equation der(r) = (road - s)/tau^2 - 2*r/tau;
"""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import Any

from msgspec import Struct
from msgspec.structs import replace

from mechc.lang.diagnostics import Reporter
from mechc.lang.units import Dimension

from . import types
from .model import (
    Apply,
    Attributes,
    FlatModel,
    Literal,
    Name,
    Origin,
    Role,
    StartValue,
    StateEquation,
    Type,
    Variable,
)

FILTER = "filter"
"""The option that holds the time constant, as a fraction of SI."""


def filtered(flat: FlatModel, time: Dimension, reporter: Reporter) -> FlatModel:
    """Return a model with the states of the filters of its inputs; ``time``: the dimension of the time."""
    for definition in flat.definitions:
        if FILTER in definition.attributes.options:
            reporter.error(
                "E0333",
                f"'{definition.name}' has a filter, and it is given in the model",
                definition.origin.shown,
                caption="this is not an input from outside",
                help="leave the filter out, or write what follows it: state s = u; equation der(s) = (u - s)/tau;",
            )
    filters = [v for v in flat.variables if FILTER in v.attributes.options]
    if not filters:
        return flat
    names = {v.name: f"{v.name}.filtered" for v in filters}
    parts: dict[str, Any] = {
        field: _renamed(getattr(flat, field), names)
        for field in flat.__struct_fields__
        if field not in ("variables", "structural", "data", "files", "origin")
    }
    made = [_states(v, names[v.name], time) for v in filters]
    parts["variables"] = (*_renamed(flat.variables, names), *(v for variables, _ in made for v in variables))
    parts["equations"] = (*parts["equations"], *(e for _, equations in made for e in equations))
    return replace(flat, **parts)


def _states(
    u: Variable, name: str, time: Dimension
) -> tuple[tuple[Variable, Variable], tuple[StateEquation, StateEquation]]:
    """Return value and rate of a filter, and their equations."""
    tau, origin, span = Fraction(u.attributes.options[FILTER]), u.origin, u.origin.span

    def of_order(order: int) -> Type:
        dimension = u.type.dimension
        for _ in range(order):
            dimension = dimension / time
        return types.real(dimension, u.type.shape, u.type.angle)

    value, rate = of_order(0), of_order(1)
    acceleration = of_order(2)
    read = Name(type=value, span=span, name=u.name)
    s = Name(type=value, span=span, name=name)
    r = Name(type=rate, span=span, name=f"{name}_rate")

    def applied(function: str, type: Type, *arguments: Any) -> Apply:
        return Apply(type=type, span=span, function=function, arguments=arguments)

    def number(value: Fraction, order: int) -> Literal:
        dimension = types.NUMBER.dimension
        for _ in range(order):
            dimension = dimension / time
        return Literal(type=types.real(dimension), span=span, value=value)

    pull = applied("multiply", acceleration, number(1 / tau**2, 2), applied("subtract", value, read, s))
    brake = applied("multiply", acceleration, number(2 / tau, 1), r)
    zero = Literal(type=types.NUMBER, span=span, value=Fraction(0))
    lag = f"{u.name} after a filter of two times {float(tau):g} s, which lets it lag by {2 * float(tau):g} s"
    shown = Attributes(nominal=u.attributes.nominal, display=u.attributes.display)
    variables = (
        Variable(
            name, Role.STATE, value, origin, start=StartValue(read, False, origin), attributes=shown, doc=lag
        ),
        Variable(
            r.name, Role.STATE, rate, origin, start=StartValue(zero, False, origin), doc=f"rate of {name}"
        ),
    )
    equations = (
        StateEquation(name, (), r, origin),
        StateEquation(r.name, (), applied("subtract", acceleration, pull, brake), origin),
    )
    return variables, equations


def _renamed(at: Any, names: Mapping[str, str]) -> Any:
    """Return a part of a model that reads other names instead of some."""
    if isinstance(at, tuple):
        found = tuple(_renamed(part, names) for part in at)
        return at if all(a is b for a, b in zip(at, found, strict=True)) else found
    if isinstance(at, Mapping):
        return {key: _renamed(part, names) for key, part in at.items()}
    if isinstance(at, Name):
        return replace(at, name=names[at.name]) if at.name in names else at
    if not isinstance(at, Struct) or isinstance(at, Type | Origin):
        return at
    changed = {}
    for field in at.__struct_fields__:
        part = getattr(at, field)
        if field != "span" and (new := _renamed(part, names)) is not part and new != part:
            changed[field] = new
    return replace(at, **changed) if changed else at

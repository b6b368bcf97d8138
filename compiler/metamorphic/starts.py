"""Models that begin at given states, whatever they state themselves."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

from msgspec.structs import replace

from mechc.lang.units import Dimension

from ..flat import types
from ..flat.model import Apply, Array, Expression, FlatModel, Kind, Role, StartValue, Type, Variable
from ..flat.subscripts import element_name, subscripts
from .rewriting import measured, number
from .twin import States

MOVING = (Role.COORDINATE, Role.STATE)


def rate_name(name: str) -> str:
    return f"der({name})"


Moved = Callable[[str, Expression], Expression]
"""Gives what a state, by its name, begins with instead of a number."""


def begun(model: FlatModel, states: States, moved: Moved = lambda name, value: value) -> FlatModel:
    """Return the model with initial values of all that has one in ``states``, as guesses that assembly need not move, but by
    what ``moved`` makes of them."""
    given = {v.name for v in model.variables if v.role not in MOVING}
    experiments = tuple(
        replace(e, settings=tuple(s for s in e.settings if s.target in given), sweeps=())
        for e in model.experiments
    )
    second, spin = measured(model, "time").dimension, measured(model, "rate", (3,))
    variables = tuple(
        _begun(v, states, second, spin, moved) if v.role in MOVING else v for v in model.variables
    )
    return replace(model, variables=variables, experiments=experiments, initials=())


def _begun(v: Variable, states: States, second: Dimension, spin: Type, moved: Moved) -> Variable:
    if v.type.kind is Kind.ROTATION:
        return _turned(v, states, spin, moved)

    def given(rate: bool) -> dict[tuple[int, ...], StartValue]:
        found = {}
        for index in subscripts(v.type.shape):
            name = element_name(v.name, index)
            name = rate_name(name) if rate else name
            if name in states:
                kind = types.real(v.type.dimension / second) if rate else v.type
                found[index] = _guess(moved(name, number(states[name], kind, v.origin.span)), v)
        return found

    if not v.type.shape:
        place, speed = given(False), given(True)
        return replace(v, start=place.get((), v.start), rate=speed.get((), v.rate))
    return replace(v, starts={**v.starts, **given(False)}, rates={**v.rates, **given(True)})


def _turned(v: Variable, states: States, turning: Type, moved: Moved) -> Variable:
    span = v.origin.span
    entries = [element_name(v.name, (i,)) for i in range(4)]
    spin = [f"{rate_name(v.name)}[{i + 1}]" for i in range(3)]
    if any(n not in states for n in (*entries, *spin)):
        return v

    def value(name: str, type: Type) -> Expression:
        return moved(name, number(Fraction(states[name]), type, span))

    pose = Apply(
        type=types.POSE,
        span=span,
        function="quat",
        arguments=tuple(value(n, types.NUMBER) for n in entries),
    )
    rates = tuple(value(n, turning) for n in spin)
    return replace(v, start=_guess(pose, v), rate=_guess(Array(type=turning, span=span, elements=rates), v))


def _guess(value: Expression, v: Variable) -> StartValue:
    return StartValue(value, True, v.origin)

"""What forces and rates of states are, written out as the text says it: a question in a force means what it means in an output."""

from __future__ import annotations

from random import Random

from msgspec.structs import replace

from ..flat import types
from ..flat.model import (
    Definition,
    DefinitionRole,
    Derivative,
    Element,
    Expression,
    FlatModel,
    Kind,
    Load,
    Name,
    Query,
    Variable,
)
from .asked import ModelFacts
from .rewriting import apply, dotted, measured, product, undrawn
from .twin import NotApplicable, Seen, Twin


def powers_written_out(model: FlatModel, seen: Seen | None, random: Random) -> Twin:
    """Let outputs tell the power of each force that asks about the motion, and the rate of each such state, as mechc answers it;
    in the twin as the formula that it stands for."""
    facts = ModelFacts(model)
    pairs = [(x, load_power(model, facts, x)) for x in model.loads if _asks(facts, x.value)]
    power = types.real(types.NUMBER.dimension if model.dimensionless else types.POWER)
    told: list[tuple[str, Expression, Expression]] = [
        (f"power of {x.name}", Query(type=power, span=formula.span, function="power", target=x.name), formula)
        for x, formula in pairs
        if formula is not None
    ]
    variables = {v.name: v for v in model.variables}
    for equation in model.equations:
        if _asks(facts, equation.value):
            place = f"[{', '.join(str(i + 1) for i in equation.indices)}]" if equation.indices else ""
            rate = _rate(equation.value, variables[equation.state], equation.indices)
            told.append((f"rate of {equation.state}{place}", rate, equation.value))
    if not told:
        raise NotApplicable(
            "no force on what has a rate of its own, and no rate of a state, asks about the motion"
        )
    asked = tuple(_output(model, name, answer) for name, answer, _ in told)
    written = tuple(_output(model, name, formula) for name, _, formula in told)
    plain = undrawn(model)
    return Twin(
        "powers written out",
        f"{', '.join(name for name, _, _ in told)} as formulas",
        replace(plain, definitions=(*plain.definitions, *written)),
        beside=replace(plain, definitions=(*plain.definitions, *asked)),
    )


def _output(model: FlatModel, name: str, value: Expression) -> Definition:
    return Definition(name, DefinitionRole.OUTPUT, types.numeric(value.type), value, model.origin)


def _asks(facts: ModelFacts, value: Expression) -> bool:
    return any(name.endswith("?") for name in facts.within(value))


def load_power(model: FlatModel, facts: ModelFacts, load: Load) -> Expression | None:
    """Return the power of a load that acts in world components and on one thing; None of any other."""
    if load.source is not None or load.at is not None or load.frame is not None:
        return None
    if load.on.type.kind in (Kind.FRAME, Kind.POINT):
        space = (model.space,)
        if load.kind == "torque":
            spin = () if model.space == 2 else space
            rate: Expression = apply("angvel", measured(model, "rate", spin), load.on)
        else:
            rate = apply("vel", measured(model, "velocity", space), load.on)
    elif facts.moves(load.on):
        rate = load.on
    else:
        dimension = load.on.type.dimension / measured(model, "time").dimension
        rate = Derivative(type=types.real(dimension, load.on.type.shape), span=load.on.span, operand=load.on)
    if load.value.type.shape != rate.type.shape:
        return None
    return dotted(load.value, rate) if rate.type.shape else product(load.value, rate)


def _rate(value: Expression, variable: Variable, indices: tuple[int, ...]) -> Expression:
    """Return the rate of a state, or of an element of one."""
    state: Expression = Name(type=variable.type, span=value.span, name=variable.name)
    if indices:
        state = Element(type=types.element_of(variable.type), span=value.span, base=state, indices=indices)
    return Derivative(type=types.numeric(value.type), span=value.span, operand=state)

"""Time reversed: from where a motion ends, with all velocities turned round, back to where it began."""

from __future__ import annotations

from collections.abc import Callable
from random import Random

from msgspec.structs import replace

from ..flat.model import Apply, Derivative, Drive, Expression, FlatModel, Kind, Load, Name, Query, Role
from ..flat.operands import parts, stated
from .asked import RATES, ModelFacts, defined_by, felt
from .rewriting import Rewriting, everywhere, measured, negative, number, total, undrawn
from .starts import begun
from .twin import NotApplicable, Seen, Twin

ACCOUNTS = frozenset({"energy.supplied", "energy.dissipated", "momentum", "angular_momentum"})
FLIPPED = frozenset({"momentum", "power"})
"""Questions whose answers change their sign with time."""
LOSING = ("dampings", "frictions", "contacts", "events")


def time_reversed(model: FlatModel, seen: Seen | None, random: Random) -> Twin:
    """Let time run from the stop to the start: what depends on it, and the sign of all rates, turn round."""
    _refuse(model)
    if seen is None:
        raise NotApplicable("its end is not known")
    end = number(seen.begin + seen.stop, measured(model, "time"), model.origin.span)
    back = Rewriting(lambda e: _reversed(e, end))
    facts = ModelFacts(model)
    old = undrawn(model)
    made = everywhere(replace(old, loads=(), drives=(), equations=()), back)
    made = replace(
        made,
        loads=tuple(_load(x, facts, back) for x in old.loads),
        drives=tuple(_drive(d, back) for d in old.drives),
        equations=tuple(replace(e, value=negative(back(e.value))) for e in old.equations),
    )
    states = {v.name for v in model.variables if v.role is Role.STATE}
    start = {n: -x if is_rate(n, states) else x for n, x in seen.last.items()}
    apart = ACCOUNTS | defined_by(model, {"multiplier"})
    return Twin(
        "time reversed",
        "from its end back to its start",
        begun(made, start),
        apart,
        start=start,
        backwards=True,
    )


def is_rate(name: str, states: set[str]) -> bool:
    """Whether a state changes its sign with time: rates of coordinates do."""
    return name.startswith("der(") and name not in states


def _refuse(model: FlatModel) -> None:
    for what in LOSING:
        if getattr(model, what):
            raise NotApplicable(f"{what} have no way back")
    if any(isinstance(p, Apply) and p.function == "delay" for p in parts(stated(model))):
        raise NotApplicable("what looks back would look ahead")
    if any(e.kind == "dissipation" for e in model.energies):
        raise NotApplicable("what it dissipates has no way back")
    if felt(model, {"multiplier", "closed"}):
        raise NotApplicable("its motion feels a multiplier, whose sign may depend on that of time")
    if any(isinstance(p, Query) for x in model.loads for p in parts([x.on])):
        raise NotApplicable("a force acts along the answer to a question")
    inputs = {v.name for v in model.variables if v.role is Role.INPUT}
    facts = ModelFacts(model)
    if any(facts.bends(c.left, c.right) for c in model.constraints):
        raise NotApplicable("what a bend of a constraint takes has no way back")
    if any(facts.jumps(e.value) for e in model.equations):
        raise NotApplicable("a state may slide where its law jumps, which has no way back")
    if any(facts.within(d.value) & inputs for d in model.drives):
        raise NotApplicable("an input drives it")


def _reversed(e: Expression, end: Expression) -> Expression:
    match e:
        case Name(name="time"):
            return total(end, e, "subtract")
        case Derivative(order=order) if order % 2:
            return negative(e)
        case Apply(function=function) if function in RATES:
            return negative(e)
        case Query(function=function) if function in FLIPPED:
            return negative(e)
        case _:
            return e


def _load(load: Load, facts: ModelFacts, back: Callable[[Expression], Expression]) -> Load:
    """Return a load whose power counts by the rates themselves, not by those turned round."""
    made = everywhere(load, back)
    along = load.on.type.kind in (Kind.REAL, Kind.INTEGER)
    return replace(made, on=negative(made.on)) if along and facts.moves(load.on) else made


def _drive(drive: Drive, back: Callable[[Expression], Expression]) -> Drive:
    value = back(drive.value)
    return replace(drive, value=negative(value) if isinstance(drive.target, Derivative) else value)

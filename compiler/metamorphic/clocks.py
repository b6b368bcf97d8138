"""Events said otherwise: clocks as counts of one base clock, actions that do not see each other in another order."""

from __future__ import annotations

import math
from fractions import Fraction
from random import Random

from msgspec.structs import replace

from ..flat import types
from ..flat.model import (
    Action,
    Apply,
    Assign,
    Event,
    EventBranch,
    Expression,
    FlatModel,
    Literal,
    Name,
    Previous,
    Reinit,
    Role,
    StartValue,
    StateEquation,
    Variable,
)
from ..flat.operands import children, parts, stated
from ..flat.values.evaluate import constant
from .rewriting import Rewriting, apply, choice, compared, measured, number, total, undrawn
from .twin import NotApplicable, Seen, Twin

COUNT = "base count"
RUNNING, TICKED = "running time", "ticks that end steps"
TICKS = 9973
"""Of the clock that ends steps: a prime, so that hardly any output time is one of them."""
MOST = 1000
"""Ticks of the base clock between those of the slowest."""


def clocks_counted(model: FlatModel, seen: Seen | None, random: Random) -> Twin:
    """Let one clock of the common base period count, and each task act at its own counts, in the order of the text."""
    tasks = [(e, _clock(e)) for e in model.events]
    clocks = [clock for _, clock in tasks if clock is not None]
    if len(clocks) < 2:
        raise NotApplicable("it has no two clocks whose periods are numbers and whose tasks set values")
    first = min(start for _, start in clocks)
    base = _divisor([x for period, start in clocks for x in (period, start - first) if x])
    if max(period for period, _ in clocks) / base > MOST:
        raise NotApplicable("its clocks have no common base period")
    origin = next(e.origin for e, clock in tasks if clock is not None)
    span = origin.span
    second = _condition(next(e for e, clock in tasks if clock is not None)).arguments[0].type
    count = Name(type=types.NUMBER, span=span, name=COUNT)
    tick = apply("sample", types.BOOLEAN, number(base, second, span), number(first, second, span))
    events = []
    for event, clock in tasks:
        if clock is None:
            events.append(event)
            continue
        due = _due(count, int(clock[0] / base), int((clock[1] - first) / base))
        events.append(_when(tick, [_chosen(due, action) for action in event.branches[0].actions], event))
    one = number(1, types.NUMBER, span)
    events.append(_when(tick, [Assign(count, total(count, one), origin)], events[0]))
    zero = Literal(type=types.NUMBER, span=span, value=Fraction(0))
    counter = Variable(COUNT, Role.DISCRETE, types.NUMBER, origin, value=zero)
    made = replace(undrawn(model), events=tuple(events), variables=(*model.variables, counter))
    says = f"{len(clocks)} clocks as counts of one of {float(base):g} s"
    return Twin("clocks counted", says, made)


def _when(condition: Expression, actions: list[Action], like: Event) -> Event:
    return Event((EventBranch(condition, tuple(actions), like.origin),), like.origin)


def _chosen(due: Expression, action: Action) -> Action:
    """Return an action that leaves what it sets where it is not due."""
    assert isinstance(action, (Assign, Reinit))
    return replace(action, value=choice(due, action.value, action.target))


def _condition(event: Event) -> Apply:
    condition = event.branches[0].condition
    assert isinstance(condition, Apply)
    return condition


def _clock(event: Event) -> tuple[Fraction, Fraction] | None:
    """Return period and first instant of a task that only sets values, by numbers and what is there now."""
    if len(event.branches) != 1:
        return None
    condition, actions = event.branches[0].condition, event.branches[0].actions
    if not isinstance(condition, Apply) or condition.function != "sample":
        return None
    if not all(isinstance(a, (Assign, Reinit)) for a in actions):
        return None
    if any(isinstance(p, Previous) for p in parts(stated(actions))):
        return None
    period, *start = (constant(a) for a in condition.arguments)
    found = period, start[0] if start else Fraction(0)
    return found if all(isinstance(x, Fraction) for x in found) and period else None  # type: ignore[return-value]


def _divisor(numbers: list[Fraction]) -> Fraction:
    """Return the greatest common divisor."""
    bottom = math.lcm(*(x.denominator for x in numbers))
    return Fraction(math.gcd(*(int(x * bottom) for x in numbers)), bottom)


def _due(count: Expression, period: int, start: int) -> Expression:
    """Return whether a count is start, start + period, ..."""
    of, first, zero = (number(n, types.NUMBER, count.span) for n in (period, start, 0))
    left = apply("mod", types.NUMBER, total(count, first, "subtract"), of)
    begun = compared("greater_equal", count, first)
    return apply("and", types.BOOLEAN, begun, compared("less_equal", left, zero))


def times_as_a_state(model: FlatModel, seen: Seen | None, random: Random) -> Twin:
    """Let a state run as time does, and conditions of `when` ask for it: what happens at known times is then located."""
    second = measured(model, "time")
    span = model.origin.span
    running = Name(type=second, span=span, name=RUNNING)
    changed = 0

    def counted(e: Expression) -> Expression:
        nonlocal changed
        if not isinstance(e, Name) or e.name != "time":
            return e
        changed += 1
        return running

    back = Rewriting(counted)

    def other(branch: EventBranch) -> EventBranch:
        return replace(branch, condition=back(branch.condition))

    conditions = [b.condition for e in model.events for b in e.branches]
    if any(isinstance(p, Apply) and p.function == "sample" for p in parts(conditions)):
        raise NotApplicable("clocks tick at instants that a state reaches within rounding only")
    events = tuple(replace(e, branches=tuple(map(other, e.branches))) for e in model.events)
    if changed != 1:
        raise NotApplicable("not one condition of a 'when' holds the time; two may belong to one instant")
    begin = StartValue(number(0.0 if seen is None else seen.begin, second, span), False, model.origin)
    state = Variable(RUNNING, Role.STATE, second, model.origin, start=begin)
    rate = StateEquation(RUNNING, (), number(1, types.NUMBER, span), model.origin)
    made = replace(
        undrawn(model),
        events=events,
        variables=(*model.variables, state),
        equations=(*model.equations, rate),
    )
    return Twin("times as a state", "conditions ask for a state that runs as time does", made)


def actions_reordered(model: FlatModel, seen: Seen | None, random: Random) -> Twin:
    """Exchange neighbouring actions of which neither sees what the other sets."""
    changed = 0

    def other(branch: EventBranch) -> EventBranch:
        nonlocal changed
        actions, k = list(branch.actions), 0
        while k + 1 < len(actions):
            one, two = actions[k : k + 2]
            if isinstance(one, Assign) and isinstance(two, Assign) and _are_independent(one, two):
                actions[k : k + 2] = two, one
                changed += 1
                k += 1
            k += 1
        return replace(branch, actions=tuple(actions))

    events = tuple(replace(e, branches=tuple(map(other, e.branches))) for e in model.events)
    if not changed:
        raise NotApplicable("no two of its actions could stand the other way round")
    made = replace(undrawn(model), events=events)
    return Twin("actions reordered", "actions that do not see each other in another order", made)


def _are_independent(one: Assign, two: Assign) -> bool:
    a, b = (_heads(x.target) for x in (one, two))
    return not a & b and not a & _now(two.value) and not b & _now(one.value)


def _heads(e: Expression) -> set[str]:
    return {p.name for p in parts([e]) if isinstance(p, Name)}


def _now(e: Expression) -> set[str]:
    """Return the names whose present value an expression contains: not what stands in `pre`."""
    if isinstance(e, Previous):
        return set()
    own = {e.name} if isinstance(e, Name) else set()
    return own.union(*(_now(c) for c in children(e)))


def steps_ended(model: FlatModel, seen: Seen | None, random: Random) -> Twin:
    """Let a clock count that nothing asks: each tick ends a step, so that nothing much longer is stepped over."""
    if seen is None:
        raise NotApplicable("its length is not known")
    span, second = model.origin.span, measured(model, "time")
    begin, stop = Fraction(seen.begin), Fraction(seen.stop)
    tick = apply(
        "sample",
        types.BOOLEAN,
        number((stop - begin) / TICKS, second, span),
        number(begin, second, span),
    )
    count = Name(type=types.NUMBER, span=span, name=TICKED)
    more = Assign(count, total(count, number(1, types.NUMBER, span)), model.origin)
    zero = Literal(type=types.NUMBER, span=span, value=Fraction(0))
    counter = Variable(TICKED, Role.DISCRETE, types.NUMBER, model.origin, value=zero)
    event = Event((EventBranch(tick, (more,), model.origin),), model.origin)
    made = replace(undrawn(model), events=(*model.events, event), variables=(*model.variables, counter))
    return Twin("steps ended", f"a clock that nothing asks ends steps {TICKS} times", made)

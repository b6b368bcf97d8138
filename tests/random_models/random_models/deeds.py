"""Events with several actions, one below the other, each of which sees what those above have done."""

from __future__ import annotations

from fractions import Fraction

from random_models.expressions import Writer
from random_models.operators import add, der, multiply, relation
from random_models.scope import Scope
from random_models.tree import ENERGY, NUMBER, TIME, E, S, Seq, Slot, node, over, reference, statement, times

SHARE = 0.1
"""Of the models."""


def deeds(s: Scope, seed: int) -> None:
    """Write an event or two. Their random numbers are their own: models keep all else."""
    with s.apart(f"deeds of {seed}"):
        if s.chance(SHARE):
            for _ in range(s.pick((1, 1, 2))):
                _event(s)


def _event(s: Scope) -> None:
    free = [q for q in s.coordinates if q not in s.driven and "held:" + q.ref not in s.notes]
    numbers = [s.discrete_number() for _ in range(s.pick((1, 1, 2)))]
    todo: list[S] = [_assign(s, n, numbers) for n in numbers]
    if free and not s.locked:
        q = s.pick(free)
        todo += [_reinit(s, q, numbers[0]), _impulse(s, q if s.chance(0.7) else s.pick(free))]
        if s.chance(0.3):
            other = s.pick(free)
            todo += [_impulse(s, other)]
    s.random.shuffle(todo)
    t = reference("time", "time", TIME, level="t")
    if s.chance(0.7):
        late = s.number(0.05, 0.35) if s.chance(0.8) else Fraction(0)  # with the start, or later
        edge = s.literal(TIME, late)
        condition: list[str | Slot] = [
            Slot("when.condition", relation(">" if not late else s.pick((">", ">=")), t, edge))
        ]
    else:
        condition = [
            "sample(",
            Slot("sample.period", s.literal(TIME, s.pick((Fraction(1, 5), Fraction(1, 4))))),
            ")",
        ]
    s.add("when", "when ", *condition, " then", Seq(tuple(todo)), "end when;")


def _assign(s: Scope, n: E, numbers: list[E]) -> S:
    """Set a number by the others, some of which are set above it, or by what moves."""
    seen = s.pick(numbers)
    if s.chance(0.4):
        seen = node("pre", "pre(", seen, ")", level="z")
    value = add(multiply(s.literal(NUMBER, s.number(0.3, 0.9)), seen), _seen(s, NUMBER))
    return statement("assign", f"{n.ref} := ", Slot("assign.value", value), ";", name=n.ref)


def _seen(s: Scope, d: tuple[Fraction, Fraction, Fraction, Fraction]) -> E:
    return Writer(s, "tzqv", kinks=False).scalar(d, 1)


def _reinit(s: Scope, q: E, n: E) -> S:
    """Set a rate by itself, now or before, and by a number that may be set above."""
    rate: E = der(q) if s.chance(0.6) else node("pre", "pre(", der(q), ")", dim=over(q.dim, TIME))
    value = multiply(s.literal(NUMBER, s.number(-0.6, 0.9)), rate)
    share = s.literal(over(q.dim, TIME), s.number(0.1, 0.6))
    value = add(value, multiply(share, n) if s.chance(0.6) else share)
    return statement(
        "reinit", "reinit(", Slot("reinit.target", der(q)), ", ", Slot("reinit.value", value), ");"
    )


def _impulse(s: Scope, q: E) -> S:
    """Push a coordinate, by a share of its rate or by itself."""
    size = times(over(ENERGY, q.dim), TIME)
    value: E = s.literal(size, s.number(-0.4, 0.4))
    if s.chance(0.5):
        share = s.literal(over(size, over(q.dim, TIME)), s.number(-0.3, 0.3))
        value = add(value, multiply(share, der(q)))
    return statement("impulse", "impulse ", Slot("impulse.value", value), " on ", Slot("impulse.on", q), ";")

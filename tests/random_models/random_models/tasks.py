"""Tasks of a program: clocks whose ticks belong together, each of which reads what the others set."""

from __future__ import annotations

from fractions import Fraction

from random_models.operators import add, multiply
from random_models.quantities import quantity
from random_models.scope import Scope, rare
from random_models.tree import NUMBER, TIME, Seq, Slot, statement

SHARE = 0.1
"""Of the models."""
_BASES = (Fraction(1, 10), Fraction(1, 20), Fraction(7, 100), Fraction(3, 50), Fraction(11, 100))
"""Seconds; rounded multiples of most are not the multiples' own rounding."""


@rare(SHARE)
def tasks(s: Scope) -> None:
    """Write two or three clocks."""
    base = s.pick(_BASES)
    several = s.pick(((1, 3), (1, 3), (1, 2), (2, 3), (1, 2, 3), (1, 3, 1)))
    shares = s.random.sample(several, len(several))
    late = quantity(base * s.pick((1, 2)), TIME) if s.chance(0.15) else None
    numbers = [s.discrete_number() for _ in shares]
    for k, share in enumerate(shares):
        own, others = numbers[k], numbers[:k] + numbers[k + 1 :]
        value = add(
            multiply(s.literal(NUMBER, s.number(0.3, 0.9)), own),
            multiply(s.literal(NUMBER, s.number(0.3, 0.9)), s.pick(others)),
        )
        parts: list[str | Slot] = ["when sample(", Slot("sample.period", quantity(base * share, TIME))]
        parts += [", ", Slot("sample.start", late)] if late is not None else []
        action = statement("assign", f"{own.ref} := ", Slot("assign.value", value), ";", name=own.ref)
        s.add("when", *parts, ") then", Seq((action,)), "end when;")

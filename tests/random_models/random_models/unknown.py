"""Outputs that equations determine: equations with one solution, of whatever a model offers."""

from __future__ import annotations

import math
from fractions import Fraction

from random_models.expressions import Writer
from random_models.operators import add, call, der, divide, multiply, negate
from random_models.scope import Scope, rare
from random_models.tree import (
    ENERGY,
    FORCE,
    LENGTH,
    NUMBER,
    SPEED,
    E,
    Slot,
    node,
    reference,
)

SHARE = 0.2
"""Of the models that have some."""
LEVELS = "tuzxqv"


@rare(SHARE)
def unknowns(s: Scope) -> None:
    """Let equations determine one or two outputs."""
    s.weighted(((2, _one), (1, _two)))(s)


def _declared(s: Scope, guess: E | None = None) -> tuple[E, E]:
    """Declare an unknown; return it, and its size."""
    d = s.pick((LENGTH, FORCE, ENERGY, NUMBER, SPEED))
    name, size = s.fresh("y"), s.literal(d)
    first = multiply(size, guess) if guess is not None and s.chance(0.5) else s.literal(d, s.number(-1, 1))
    s.add("unknown", f"output {name} ~ ", Slot("unknown.guess", first), ";", name=name)
    return reference(name, "unknown", d, level=LEVELS), size


def _bent(s: Scope, x: E) -> E:
    """Return what changes by less than x, and bends."""
    f, value = s.pick((("sin", math.sin), ("tanh", math.tanh), ("atan", math.atan), ("cos", math.cos)))
    small = s.literal(NUMBER, s.number(0.1, 0.7))
    e = multiply(small, call(f, x, value=value))
    return negate(e) if s.chance(0.4) else e


def _given(s: Scope) -> E:
    w = Writer(s, LEVELS + ("a" if s.chance(0.4) else ""), questions=True)
    return w.scalar(NUMBER, 2)


def _equation(s: Scope, left: E, right: E) -> None:
    sides = (left, right) if s.chance(0.7) else (right, left)
    s.add(
        "implicit",
        "equation ",
        Slot("implicit.left", sides[0]),
        " = ",
        Slot("implicit.right", sides[1]),
        ";",
    )


def _asked(s: Scope, y: E) -> None:
    """Ask for what follows from an unknown."""
    if s.chance(0.6):
        name = s.fresh("o")
        e = (
            multiply(y, _given(s))
            if s.chance(0.5)
            else multiply(y, node("number", "2", value=lambda: Fraction(2)))
        )
        s.add("output", f"output {name} = ", Slot("output.value", e), ";", name=name)


def _one(s: Scope) -> None:
    given = _given(s)
    y, size = _declared(s, given)
    x = divide(y, size)
    _equation(s, add(x, _bent(s, x)), given)
    _asked(s, y)
    if s.chance(0.3) and "a" not in given.level and "u" not in given.level and "z" not in given.level:
        name = s.fresh("o")
        s.add("output", f"output {name} = ", Slot("output.value", der(y)), ";", name=name)


def _two(s: Scope) -> None:
    """Two unknowns that enter both equations; by Banach there is one solution."""
    given = _given(s), _given(s)
    pairs = [_declared(s, g) for g in given]
    x = [divide(y, size) for y, size in pairs]
    for k, g in enumerate(given):
        _equation(s, add(x[k], _bent(s, x[1 - k])), g)
    _asked(s, pairs[0][0])

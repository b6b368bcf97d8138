"""Forms that random expressions have seldom or never: powers whose exponents move, angles whose sines are known exactly."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction

from random_models.expressions import Writer
from random_models.operators import add, call, multiply
from random_models.scope import Scope
from random_models.tree import ATOM, ENERGY, FORCE, NUMBER, POWER_OF, SIGNED, E, Slot, node, over

SHARE = 0.12
"""Of the models."""
F = Fraction


def forms(s: Scope, seed: int) -> None:
    """Write some. Their random numbers are their own: models keep all else."""
    with s.apart(f"forms of {seed}"):
        if s.chance(SHARE):
            for _ in range(s.pick((1, 2, 2, 3))):
                s.weighted(((2, _force), (2, _potential), (1, _output)))(s)


def _power(s: Scope, w: Writer) -> E:
    """Return a power of a positive base, which may move, with an exponent that moves."""
    base: E = s.literal(NUMBER, s.number(0.4, 2.5))
    if s.chance(0.4):
        base = add(s.literal(NUMBER, F("1.6")), call("sin", w.number(0), value=math.sin))
    exponent = call("sin", w.number(0), value=math.sin) if s.chance(0.5) else w.number(0)
    return node("^", (base, ATOM), "^", (exponent, ATOM), binding=POWER_OF, value=lambda x, y: x**y)


def _exact(s: Scope, w: Writer) -> E:
    """Return something times a sine that is known exactly."""
    k = s.pick((-7, -5, -4, -2, -1, 1, 2, 4, 5, 7, 8, 10, 11, 13, 16, 19))
    if s.chance(0.5):
        angle = node("quantity", f"{30 * k} deg", binding=SIGNED if k < 0 else ATOM, value=lambda: k * math.pi / 6,
                     data=F(math.pi) * k / 6)  # fmt: skip
    else:
        angle = node("exact angle", f"({k}*pi/6)", value=lambda: k * math.pi / 6)
    name, value = s.pick((("sin", math.sin), ("cos", math.cos)))
    return multiply(call(name, angle, value=value), call("cos", w.number(0), value=math.cos))


_FORMS: tuple[Callable[[Scope, Writer], E], ...] = (_power, _power, _exact)


def _form(s: Scope, allowed: str) -> E:
    return s.pick(_FORMS)(s, Writer(s, allowed, kinks=False))


def _force(s: Scope) -> None:
    free = [q for q in s.coordinates if q not in s.driven]
    if not free:
        return
    q = s.pick(free)
    value = multiply(s.value(over(ENERGY, q.dim), s.number(0.1, 1)), _form(s, "tzxqv"))
    s.add(
        "force", "force ", Slot("force.value", value), " on ", Slot("force.on", q), ";", data={"on": "scalar"}
    )


def _potential(s: Scope) -> None:
    e = multiply(s.value(ENERGY, s.number(0.1, 1)), _form(s, "tq"))
    s.add("energy", "potential ", Slot("potential", e), ";", data={"what": "potential"})


def _output(s: Scope) -> None:
    name = s.fresh("o")
    e = multiply(s.value(FORCE, s.number(0.1, 1)), _form(s, "tzxqvu"))
    s.add("output", f"output {name} = ", Slot("output.value", e), ";", name=name)

"""What hits at one instant: bars, boxes and plates that fall flat, rows of equal balls, twins side by side."""

from __future__ import annotations

import itertools
import math
from fractions import Fraction

from random_models.bends import coordinate
from random_models.coordinates import half, square
from random_models.operators import add, call, der, multiply, negate, subtract
from random_models.scope import Scope
from random_models.tree import ACCELERATION, INERTIA, LENGTH, MASS, NUMBER, E, Slot

SHARE = 0.5
"""Of the models without bodies that are small: a motion by definition is slow."""
FEW = 3
"""Coordinates that they may have."""
F = Fraction


def together(s: Scope, seed: int) -> None:
    """Write a part with several contacts that hit at once. Its random numbers are its own: models keep all else."""
    if (
        s.space
        or len(s.coordinates) > FEW
        or any(st.kind in ("contact", "when", "friction") for st in s.statements)
    ):
        return
    with s.apart(f"together of {seed}"):
        if s.chance(SHARE):
            s.weighted(((2, _bar), (2, _box), (1, _plate), (2, _row), (1, _apart)))(s)


def _moving(s: Scope, mass: E, *rates: E) -> None:
    for q in rates:
        s.add(
            "energy",
            "kinetic ",
            Slot("kinetic", half(s, mass, square(der(q)))),
            ";",
            data={"what": "kinetic"},
        )


def _falling(s: Scope, mass: E, y: E) -> None:
    weight = multiply(multiply(mass, s.literal(ACCELERATION, F("9.81"))), y)
    s.add("energy", "potential ", Slot("potential", weight), ";", data={"what": "potential"})


class _Law:
    """What all contacts of a part have in common."""

    def __init__(self, s: Scope, rough: bool = True) -> None:
        self.rebound = s.value(NUMBER, s.number(0.3, 0.9)) if s.chance(0.75) else None
        self.grip = s.value(NUMBER, s.number(0.05, 0.5)) if rough and s.chance(0.5) else None
        self.static = s.value(NUMBER, s.number(0.5, 0.8)) if s.chance(0.4) else None
        self.solved = s.chance(0.2)

    def contact(self, s: Scope, gap: E, slip: E | None = None) -> None:
        parts: list[str | Slot] = [f"contact {s.fresh('C')}: ", Slot("contact.gap", gap)]
        if self.rebound is not None:
            parts += [" restitution ", Slot("contact.restitution", self.rebound)]
        if self.grip is not None and slip is not None:
            parts += [" friction ", Slot("contact.friction", self.grip)]
            if self.static is not None:
                parts += [" static ", Slot("contact.static", self.static)]
            parts += [" along ", Slot("contact.along", slip)]
        s.add("contact", *parts, ', impacts = "simultaneous";' if self.solved else ";")


def _bar(s: Scope) -> None:
    """A bar without a thickness, whose mass centre is in its middle or not."""
    y, turned = coordinate(s, s.number(0.1, 0.3, 3), F(0), LENGTH), coordinate(s, F(0), F(0), NUMBER)
    mass = s.value(MASS, s.number(0.5, 2))
    _moving(s, mass, y)
    _moving(s, s.value(INERTIA, s.number(0.05, 0.4)), turned)
    _falling(s, mass, y)
    law, left = _Law(s, rough=False), s.value(LENGTH, s.number(0.2, 0.6))
    right = left if s.chance(0.6) else s.value(LENGTH, s.number(0.2, 0.6))
    sine = call("sin", turned, value=math.sin)
    law.contact(s, subtract(y, multiply(left, sine)))
    law.contact(s, add(y, multiply(right, sine)))


def _box(s: Scope) -> None:
    """A box in the plane that falls onto its lower side while it slides."""
    x, turned = (
        coordinate(s, F(0), s.pick((F(0), s.number(0.5, 3))), LENGTH),
        coordinate(s, F(0), F(0), NUMBER),
    )
    high, wide = s.number(0.1, 0.3), s.number(0.1, 0.4)
    y = coordinate(s, high + s.number(0.1, 0.3, 3), F(0), LENGTH)
    mass = s.value(MASS, s.number(0.5, 2))
    _moving(s, mass, x, y)
    _moving(s, s.value(INERTIA, s.number(0.02, 0.2)), turned)
    _falling(s, mass, y)
    law, b, h = _Law(s), s.value(LENGTH, wide), s.value(LENGTH, high)
    sine, cosine = call("sin", turned, value=math.sin), call("cos", turned, value=math.cos)
    for side in (b, negate(b)):
        corner = add(multiply(side, sine), negate(multiply(h, cosine)))
        across = add(x, add(multiply(side, cosine), multiply(h, sine)))
        law.contact(s, add(y, corner), der(across))


def _plate(s: Scope) -> None:
    """A plate on three or four legs, with small turns about both of its axes."""
    z = coordinate(s, s.number(0.1, 0.3, 3), F(0), LENGTH)
    a, b = coordinate(s, F(0), F(0), NUMBER), coordinate(s, F(0), F(0), NUMBER)
    mass = s.value(MASS, s.number(0.5, 2))
    _moving(s, mass, z)
    _moving(s, s.value(INERTIA, s.number(0.05, 0.3)), a)
    _moving(s, s.value(INERTIA, s.number(0.05, 0.3)), b)
    _falling(s, mass, z)
    law, p, q = _Law(s, rough=False), s.value(LENGTH, s.number(0.2, 0.5)), s.value(LENGTH, s.number(0.2, 0.5))
    legs = ((p, q), (p, negate(q)), (negate(p), q), (negate(p), negate(q)))
    for u, v in legs[: s.pick((3, 4))]:
        law.contact(s, add(z, add(multiply(u, a), multiply(v, b))))


def _row(s: Scope) -> None:
    """Equal balls in a row that is hit from one end or from both; they touch, or not quite."""
    n, wide = s.pick((3, 4)), s.number(0.1, 0.3)
    speed, both = s.number(1, 3), s.chance(0.5)
    apart = s.pick((F(0), F(0), F("0.01")))
    mass, d = s.value(MASS, s.number(0.5, 2)), s.literal(LENGTH, wide)
    start = s.number(0.05, 0.2)
    places = [-start, *(wide + k * (wide + apart) for k in range(n - 1))]
    rates = [speed] + [F(0)] * (n - 1)
    if both:
        places.append(places[-1] + wide + start)
        rates.append(-speed)
    balls = [coordinate(s, at, rate, LENGTH) for at, rate in zip(places, rates, strict=True)]
    _moving(s, mass, *balls)
    law = _Law(s, rough=False)
    for left, right in itertools.pairwise(balls):
        law.contact(s, subtract(subtract(right, left), d))


def _apart(s: Scope) -> None:
    """Two bodies that have nothing to do with each other, and fall alike."""
    mass, height, law = s.value(MASS, s.number(0.5, 2)), s.number(0.1, 0.3, 3), _Law(s)
    for _ in range(2):
        y, x = coordinate(s, height, F(0), LENGTH), coordinate(s, F(0), s.number(0.5, 2), LENGTH)
        _moving(s, mass, x, y)
        _falling(s, mass, y)
        law.contact(s, y, der(x))

"""Something that falls onto a floor with bends and slides over them: contacts that are closed where their gap bends."""

from __future__ import annotations

from fractions import Fraction

from random_models.coordinates import half, square
from random_models.expressions import Writer
from random_models.operators import add, call, der, multiply, negate, subtract
from random_models.scope import Scope, rare
from random_models.tree import (
    ACCELERATION,
    FORCE,
    LENGTH,
    MASS,
    NUMBER,
    SPEED,
    TIME,
    E,
    Slot,
    node,
    reference,
)

SHARE = 0.08
"""Of the models."""
F = Fraction


@rare(SHARE)
def slider(s: Scope) -> None:
    """Write a slider and its floor."""
    right = F(1) if s.chance(0.5) else F(-1)
    speed, way, drop = s.number(0.8, 1.5), s.number(0.1, 0.25), s.number(0.005, 0.02, 3)
    x = _coordinate(s, -right * way, right * speed)
    floor, height = _floor(s, x, right, way)
    y = _coordinate(s, height + drop, F(0))
    mass = s.value(MASS, s.number(0.5, 2))
    s.add("energy", "kinetic ", Slot("kinetic", half(s, mass, add(square(der(x)), square(der(y))))), ";")
    weight = multiply(multiply(mass, s.literal(ACCELERATION, F("9.81"))), y)
    s.add("energy", "potential ", Slot("potential", weight), ";", data={"what": "potential"})
    if s.chance(0.6):
        push = Writer(s, "tuzxqv", kinks=False).scalar(FORCE, 1)
        s.add(
            "force",
            "force ",
            Slot("force.value", push),
            " on ",
            Slot("force.on", x),
            ";",
            data={"on": "scalar"},
        )
    name = s.fresh("C")
    parts: list[str | Slot] = [f"contact {name}: ", Slot("contact.gap", subtract(y, floor))]
    if s.chance(0.15):
        parts += [" restitution ", Slot("contact.restitution", s.literal(NUMBER, s.number(0.05, 0.2)))]
    if s.chance(0.4):
        parts += [" friction ", Slot("contact.friction", s.literal(NUMBER, s.number(0.05, 0.3)))]
        parts += [" along ", Slot("contact.along", der(x))]
    s.add("contact", *parts, ";", name=name)


def _coordinate(s: Scope, place: Fraction, rate: Fraction) -> E:
    name = s.fresh("q")
    s.add(
        "coordinate",
        f"coordinate Length {name} = ",
        Slot("coordinate.value", s.literal(LENGTH, place)),
        ";",
        name=name,
        data={"guess": False},
    )
    value = Slot("initial.rate", s.literal(SPEED, rate))
    s.add("initial", f"initial der({name}) = ", value, ";", name=f"der({name})", data={"guess": False})
    return reference(name, "coordinate", LENGTH, level="q")


def _floor(s: Scope, x: E, right: Fraction, way: Fraction) -> tuple[E, Fraction]:
    """Return the height of the floor, which bends at 0 or in time, and the height where x begins, left or right of it."""
    slope, zero = s.number(0.1, 0.5), node("number", "0", value=lambda: 0)
    ahead = x if right > 0 else negate(x)
    kind = s.pick(("abs", "max", "min", "clamp", "time"))
    sign = F(1) if s.chance(0.5) else F(-1)
    factor = s.literal(NUMBER, sign * slope)
    match kind:
        case "abs":
            return multiply(factor, call("abs", x, dim=LENGTH)), sign * slope * way
        case "max":
            return multiply(factor, call("max", zero, ahead, dim=LENGTH)), F(0)
        case "min":
            return multiply(factor, call("min", ahead, zero, dim=LENGTH)), -sign * slope * way
        case "clamp":
            low, high = s.literal(LENGTH, F("-0.04")), s.literal(LENGTH, F("0.06"))
            return multiply(factor, call("clamp", ahead, low, high, dim=LENGTH)), -sign * slope * F("0.04")
    late = subtract(reference("time", "time", TIME, level="t"), s.literal(TIME, s.number(0.12, 0.3)))
    lift = multiply(s.literal(SPEED, sign * slope), call("max", late, zero, dim=TIME))
    return lift, F(0)
